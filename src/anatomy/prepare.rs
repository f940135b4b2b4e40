//! The whole of it: a scan and its landmarks in, an [`Anatomy`] out.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::{
    Anatomy, Eye, FaceFrame, FrontView, Jaw, Omission, Part, PartKind,
    edit::EditMesh,
    eye_hole::{self, EyeFault},
    eyeball::Eyeball,
    join::{encoded, join, paint_bag},
    lids::{self, LidShapes},
    lip_line::LipLine,
    lips::{self, LipFault, Lips},
    outline::Outline,
    part::PartMesh,
    regions::eye_landmarks,
    sides::lower_side,
};
use crate::{
    lift::Side,
    scan::{Material, Mesh, Surface},
    tracking::LANDMARK_COUNT,
};

/// Gloss of the eyes.
const WET_EYE: f32 = 1.0;

impl Anatomy {
    /// Opens a scan: `mesh` with its `surface`, and 468 or 478 landmarks on it, all in the scan frame. `view` shows its
    /// colours; `None` for a scan without any. What cannot be done is left out and listed.
    pub fn prepare(
        mesh: &Mesh,
        surface: &Surface,
        landmarks: &[Option<Point3<f64>>],
        view: Option<&FrontView>,
    ) -> Self {
        let Some(frame) = FaceFrame::of(landmarks) else {
            return Self { omissions: vec![Omission::NoFace], ..Self::as_scanned(mesh) };
        };
        // Skin alone, without irises, is enough.
        let mut landmarks = landmarks.to_vec();
        landmarks.resize(LANDMARK_COUNT, None);
        Preparation::new(mesh, surface, &landmarks, view, frame).finish()
    }
}

/// A scan while it is being opened.
pub(super) struct Preparation<'a> {
    scan: &'a Mesh,
    pub(super) surface: &'a Surface,
    view: Option<&'a FrontView>,
    pub(super) frame: FaceFrame,
    /// In the face's axes.
    pub(super) landmarks: Vec<Option<Point3<f64>>>,
    /// In the face's axes.
    pub(super) edit: EditMesh,
    omissions: Vec<Omission>,
    pub(super) parts: Vec<(PartKind, PartMesh, Material)>,
    /// Triangles of the scan's own cavity.
    pub(super) bag: Vec<u32>,
    /// What it is painted with.
    pub(super) flesh: Option<Material>,
}

impl<'a> Preparation<'a> {
    fn new(
        scan: &'a Mesh,
        surface: &'a Surface,
        landmarks: &[Option<Point3<f64>>],
        view: Option<&'a FrontView>,
        frame: FaceFrame,
    ) -> Self {
        let mut mesh = scan.clone();
        for position in &mut mesh.positions {
            *position = frame.enter(position);
        }
        let landmarks = landmarks.iter().map(|p| p.map(|p| frame.enter(&p))).collect();
        let (omissions, parts) = (Vec::new(), Vec::new());
        Self {
            scan,
            surface,
            view,
            frame,
            landmarks,
            edit: EditMesh::new(mesh),
            omissions,
            parts,
            bag: Vec::new(),
            flesh: None,
        }
    }

    fn finish(mut self) -> Anatomy {
        let lips = self.open_lips();
        let mut moved_back = Vec::new();
        let eyes = Side::BOTH.map(|side| self.open_eye(side, &mut moved_back));
        let (lower_side, mouth) = match &lips {
            Some((line, lips)) => {
                let sides = lower_side(&self.edit, line, lips, &self.landmarks, self.frame.mouth);
                let mouth = self.mouth(line, lips, &sides);
                (sides, Some(mouth))
            }
            None => (vec![0.0; self.edit.mesh().positions.len()], None),
        };
        // The interior needs the rims, and the eyes' parts come after it: the cavity must follow the skin.
        self.parts.sort_by_key(|part| matches!(part.0, PartKind::Eye(_)));
        let frame = self.frame;
        let (scan_vertices, scan_positions) = (self.scan.positions.len(), &self.scan.positions);
        let mut mesh = self.edit.into_mesh();
        for (vertex, position) in mesh.positions.iter_mut().enumerate() {
            // Not there and back: what stays where it was keeps its bits.
            *position = scan_positions.get(vertex).copied().unwrap_or_else(|| frame.leave(position));
        }
        for (vertex, place) in moved_back {
            mesh.positions[vertex as usize] = frame.leave(&place);
        }
        if let Some(flesh) = &self.flesh {
            paint_bag(&mut mesh, &self.bag, flesh);
        }
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        let mut parts = vec![Part { kind: PartKind::Skin, vertices: 0..vertices, triangles: 0..triangles }];
        for (kind, part, material) in self.parts {
            parts.push(join(&mut mesh, &frame, kind, &part, material));
        }
        Anatomy {
            mesh,
            scan_vertices,
            parts,
            lower_side,
            frame: Some(frame),
            jaw: Some(Jaw::of(&frame)),
            mouth,
            eyes,
            omissions: self.omissions,
        }
    }

    fn open_lips(&mut self) -> Option<(LipLine, Lips)> {
        let view = self.view;
        let luma = |x: f64, y: f64| view.map_or(0.0, |view| view.luma(x, y));
        let luma: Option<&dyn Fn(f64, f64) -> f64> = view.is_some().then_some(&luma);
        let depth = |x: f64, y: f64| self.depth(x, y);
        let line = LipLine::find(&self.landmarks, self.frame.mouth, luma, &depth);
        let opened = line.ok_or(LipFault::OffSurface).and_then(|mut line| {
            let lips = lips::open(&mut self.edit, &mut line, &self.landmarks, self.frame.mouth)?;
            Ok((line, lips))
        });
        match opened {
            Ok(opened) => Some(opened),
            Err(fault) => {
                self.omissions.push(Omission::Lips(fault));
                None
            }
        }
    }

    /// The surface's z at a place in the plane of the face, seen from the front.
    pub(super) fn depth(&self, x: f64, y: f64) -> Option<f64> {
        let before = self.frame.leave(&Point3::new(x, y, 4.0 * self.frame.eyes));
        let hit = self.surface.cast(before, self.frame.leave_vector(&-Vector3::z()))?;
        Some(self.frame.enter(&hit.position).z)
    }

    /// Opens an eye as far as it can be, and notes what could not be done.
    fn open_eye(&mut self, side: Side, moved_back: &mut Vec<(u32, Point3<f64>)>) -> Option<Eye> {
        let fault = match self.cut_eye(side, moved_back) {
            Ok(eye) => return Some(eye),
            Err(fault) => fault,
        };
        self.omissions.push(Omission::Eye(side, fault));
        if fault == EyeFault::Hollow { self.fill_socket(side) } else { None }
    }

    fn cut_eye(&mut self, side: Side, moved_back: &mut Vec<(u32, Point3<f64>)>) -> Result<Eye, EyeFault> {
        let eye = eye_landmarks(side);
        let before = self.edit.clone();
        let hole = eye_hole::open(&mut self.edit, &self.landmarks, eye)?;
        let ball = Eyeball::fit(&self.edit, &hole);
        let Some(mut lids) = lids::shape(&self.edit, &hole, &ball, &self.landmarks, eye) else {
            self.edit = before;
            return Err(EyeFault::OffSurface);
        };
        for shape in lids.shapes.iter_mut().flatten() {
            *shape = self.frame.leave_vector(shape);
        }
        moved_back.extend(hole.painted.iter().map(|&v| (v, ball.behind(&hole, self.edit.at(v)))));
        moved_back.extend(hole.deep.iter().map(|&v| (v, ball.sunk(self.edit.at(v)))));
        Ok(self.add_ball(side, &ball, Some(&hole.outline), lids))
    }

    /// An eyeball for lids that are modelled around nothing; they stay as they are.
    fn fill_socket(&mut self, side: Side) -> Option<Eye> {
        let eye = eye_landmarks(side);
        let corners = [self.landmarks[eye.outer]?, self.landmarks[eye.inner]?];
        let width = (corners[0].xy() - corners[1].xy()).norm();
        let front = eye_hole::hollow_front(&self.landmarks, eye, width)?;
        let ball = Eyeball::in_socket(corners, front);
        Some(self.add_ball(side, &ball, None, LidShapes::none()))
    }

    fn add_ball(&mut self, side: Side, ball: &Eyeball, outline: Option<&Outline>, lids: LidShapes) -> Eye {
        let kind = PartKind::Eye(side);
        let picture = ball.texture(outline, &self.landmarks, eye_landmarks(side), self.view);
        let texture = Some(Arc::new(encoded(kind.name(), &picture)));
        let material =
            Material { name: kind.name().to_owned(), base_colour: [1.0; 4], texture, gloss: WET_EYE };
        self.parts.push((kind, ball.mesh(), material));
        Eye { centre: self.frame.leave(&ball.centre), radius: ball.radius, lids }
    }
}
