//! The whole of it: a scan and its landmarks in, an [`Anatomy`] out.

use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, fmt, ops::Range, sync::Arc};

use image::RgbImage;
use nalgebra::{Point3, Vector3};

use super::{
    FaceFrame, FrontView, Hanging, Jaw, LidShapes,
    edit::EditMesh,
    eye_hole::{self, EyeFault},
    eyeball::Eyeball,
    interior::{Interior, RingPoint},
    lids,
    lip_line::LipLine,
    lips::{self, LipFault, Lips},
    part::PartMesh,
    regions::{INNER_CORNERS, LOWER_INNER, UPPER_INNER, eye_landmarks},
    sides::lower_side,
};
use crate::{
    lift::Side,
    scan::{Material, Mesh, Surface, Texture, TextureFormat},
};

/// Gloss of the added parts.
const WET_EYE: f32 = 1.0;
const WET_MOUTH: f32 = 0.35;
const DULL_CAVITY: f32 = 0.05;
/// What lies behind skin stays at least this far behind it, mouth widths.
const TUCKED: f64 = 0.03;
/// Nodes of the lips' rims nearer to each other than this are one, millimetres.
const CLOSEST_NODES: f64 = 0.15;
/// Where a scan's own cavity is looked for: around the mouth's middle and behind the lips, mouth widths.
const BAG_REACH: f64 = 0.9;
const BAG_START: f64 = 0.08;
const BAG_DEPTH: f64 = 2.6;
/// The cavity of an open mouth starts this far behind its lips, mouth widths.
const BEHIND_OPEN: f64 = 0.05;
/// Fewer hidden triangles than this are a fold.
const FEWEST_BAG: usize = 60;
/// A cavity has at most this many edges with nothing beyond.
const MOST_ENDS: usize = 6;

/// What a part is, and so how it moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PartKind {
    /// The scan, cut open.
    Skin,
    /// The bag behind the lips.
    Cavity,
    /// Fixed to the skull.
    UpperTeeth,
    /// Fixed to the jaw.
    LowerTeeth,
    /// On the jaw.
    Tongue,
    /// Turns about its own centre.
    Eye(Side),
}

impl PartKind {
    /// What exports call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skin => "face",
            Self::Cavity => "mouth",
            Self::UpperTeeth => "upper teeth",
            Self::LowerTeeth => "lower teeth",
            Self::Tongue => "tongue",
            Self::Eye(Side::Right) => "right eye",
            Self::Eye(Side::Left) => "left eye",
        }
    }
}

/// A stretch of the mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// What it is.
    pub kind: PartKind,
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its triangles.
    pub triangles: Range<usize>,
}

/// A place on the line between the lips that drives both rims.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RimNode {
    /// Stations of the network's inner lips: 0 is the right inner corner, 1..=9 the pairs, 10 the left corner. The node
    /// lies at `share` of the way from this one to the next.
    pub station: usize,
    /// 0..1.
    pub share: f64,
    /// Where it rests on the upper and the lower rim, scan frame, millimetres; one place where the lips were cut.
    pub rest: [Point3<f64>; 2],
}

/// A vertex on a rim, which lies between two nodes and goes where they go.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RimVertex {
    /// Which vertex.
    pub vertex: u32,
    /// Whether on the lower lip.
    pub lower: bool,
    /// The nodes on either side.
    pub nodes: [usize; 2],
    /// 0..=1 of the way from the first to the second.
    pub share: f64,
}

/// The lips and what they need to move.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Mouth {
    /// Whether the program cut them; otherwise the scan's mouth was open.
    pub is_cut: bool,
    /// Vertices of the rims from the subject's right to the left, upper and lower, of equal number; empty where the
    /// mouth was open.
    pub rims: [Vec<u32>; 2],
    /// From corner to corner.
    pub nodes: Vec<RimNode>,
    /// The vertices of both rims between the nodes: two rims whose nodes touch touch everywhere. Empty where the mouth was
    /// open.
    pub held: Vec<RimVertex>,
    /// Where the inner corners rest, right and left; `None` where the landmark's own place serves.
    pub corners: [Option<Point3<f64>>; 2],
    /// Upwards across the lips, scan frame.
    pub up: Vector3<f64>,
    /// The ring from which the cavity hangs, scan frame; empty where there is none.
    pub ring: Vec<RingPoint>,
    /// How the cavity's vertices hang on it and on the jaw.
    pub hanging: Vec<Hanging>,
}

/// An eye that can look and close.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Eye {
    /// Scan frame, millimetres.
    pub centre: Point3<f64>,
    /// Millimetres.
    pub radius: f64,
    /// Displacements in the scan frame.
    pub lids: LidShapes,
}

/// What could not be made, and why.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Omission {
    /// Eyes or mouth are not known at all.
    NoFace,
    /// The lips stay fused.
    Lips(LipFault),
    /// An eye stays painted.
    Eye(Side, EyeFault),
}

impl fmt::Display for Omission {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoFace => {
                formatter.write_str("no mouth and no eyes: their corners are not among the landmarks")
            }
            Self::Lips(fault) => {
                write!(formatter, "the lips stay closed, without a mouth behind them: {fault}")
            }
            Self::Eye(side, fault) => {
                let side = if *side == Side::Right { "right" } else { "left" };
                write!(formatter, "the {side} eye stays as it was scanned: {fault}")
            }
        }
    }
}

/// A scan that can perform. Scan frame, millimetres.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Anatomy {
    /// The scan's vertices in their order, then those of the cuts, then those of the parts.
    pub mesh: Mesh,
    /// How many vertices the scan had.
    pub scan_vertices: usize,
    /// Skin first, then the cavity, if any, then the rigid parts.
    pub parts: Vec<Part>,
    /// For each vertex of the skin 0 on the upper lip's side, 1 on the lower one's.
    pub lower_side: Vec<f32>,
    /// The face's own axes; `None` where its proportions are unknown.
    pub frame: Option<FaceFrame>,
    /// Where the jaw turns; `None` where the face's proportions are unknown.
    pub jaw: Option<Jaw>,
    /// The lips.
    pub mouth: Option<Mouth>,
    /// Right and left.
    pub eyes: [Option<Eye>; 2],
    /// What was left out.
    pub omissions: Vec<Omission>,
}

impl Anatomy {
    /// The scan as it is: one skin.
    pub fn as_scanned(mesh: &Mesh) -> Self {
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        Self {
            mesh: mesh.clone(),
            scan_vertices: vertices,
            parts: vec![Part { kind: PartKind::Skin, vertices: 0..vertices, triangles: 0..triangles }],
            lower_side: vec![0.0; vertices],
            frame: None,
            jaw: None,
            mouth: None,
            eyes: [None, None],
            omissions: Vec::new(),
        }
    }

    /// Opens a scan: `mesh` with its `surface`, and 478 landmarks on it, all in the scan frame. `view` shows its
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
        Preparation::new(mesh, surface, landmarks, view, frame).finish()
    }

    /// The skin's vertices.
    pub fn skin_vertices(&self) -> usize {
        self.parts[0].vertices.len()
    }

    /// The vertices that bend: the skin's and the cavity's. The others belong to rigid parts.
    pub fn soft_vertices(&self) -> usize {
        let soft = |part: &&Part| matches!(part.kind, PartKind::Skin | PartKind::Cavity);
        self.parts.iter().filter(soft).map(|part| part.vertices.end).max().unwrap_or(0)
    }

    /// The eye on one side.
    pub fn eye(&self, side: Side) -> Option<&Eye> {
        self.eyes[usize::from(side == Side::Left)].as_ref()
    }
}

struct Preparation<'a> {
    scan: &'a Mesh,
    surface: &'a Surface,
    view: Option<&'a FrontView>,
    frame: FaceFrame,
    /// In the face's axes.
    landmarks: Vec<Option<Point3<f64>>>,
    /// In the face's axes.
    edit: EditMesh,
    omissions: Vec<Omission>,
    parts: Vec<(PartKind, PartMesh, Material)>,
    /// Triangles of the scan's own cavity.
    bag: Vec<u32>,
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
        }
    }

    fn finish(mut self) -> Anatomy {
        let lips = self.open_lips();
        let mut moved_back = Vec::new();
        let eyes = Side::BOTH.map(|side| match self.open_eye(side, &mut moved_back) {
            Ok(eye) => Some(eye),
            Err(fault) => {
                self.omissions.push(Omission::Eye(side, fault));
                None
            }
        });
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
        if let Some(flesh) = self.parts.iter().find(|part| part.0 == PartKind::Tongue) {
            let flesh = Material { gloss: DULL_CAVITY, ..flesh.2.clone() };
            paint_bag(&mut mesh, &self.bag, &flesh);
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
    fn depth(&self, x: f64, y: f64) -> Option<f64> {
        let before = self.frame.leave(&Point3::new(x, y, 4.0 * self.frame.eyes));
        let hit = self.surface.cast(before, self.frame.leave_vector(&-Vector3::z()))?;
        Some(self.frame.enter(&hit.position).z)
    }

    fn mouth(&mut self, line: &LipLine, lips: &Lips, lower_side: &[f32]) -> Mouth {
        let up = line.up();
        let up = self.frame.leave_vector(&Vector3::new(up.x, up.y, 0.0));
        let rims = match lips {
            Lips::Cut(slit) => [slit.upper.clone(), slit.lower.clone()],
            Lips::Open => self.open_rims(line, lower_side),
        };
        let [upper, lower] =
            [&rims[0], &rims[1]].map(|rim| rim.iter().map(|&place| *self.edit.at(place)).collect::<Vec<_>>());
        let interior = match lips {
            Lips::Cut(_) => Interior::new(line, &upper, &lower, self.frame.mouth),
            Lips::Open => {
                let [above, below] = [&upper, &lower].map(|rim| self.behind(line, rim));
                Interior::new(line, &above, &below, self.frame.mouth)
            }
        };
        let picture = Arc::new(encoded("mouth", &super::atlas::paint()));
        let material = |kind: PartKind| Material {
            name: kind.name().to_owned(),
            base_colour: [1.0; 4],
            texture: Some(Arc::clone(&picture)),
            gloss: if kind == PartKind::Cavity { DULL_CAVITY } else { WET_MOUTH },
        };
        let bag = if matches!(lips, Lips::Open) { self.own_bag(line, &upper) } else { Vec::new() };
        let (mut ring, mut hanging) = (Vec::new(), Vec::new());
        if bag.is_empty() {
            (ring, hanging) = (interior.ring, interior.hanging);
            for point in &mut ring {
                point.place = self.frame.leave(&point.place);
            }
            let cavity = self.tucked(interior.cavity);
            self.parts.push((PartKind::Cavity, cavity, material(PartKind::Cavity)));
        }
        for (kind, part) in [
            (PartKind::UpperTeeth, interior.upper_teeth),
            (PartKind::LowerTeeth, interior.lower_teeth),
            (PartKind::Tongue, interior.tongue),
        ] {
            let part = self.tucked(part);
            self.parts.push((kind, part, material(kind)));
        }
        self.bag = bag;
        let on_rim = |along: f64| self.frame.leave(&rim_place(line, &upper, along));
        let (nodes, corners) = match lips {
            Lips::Cut(_) => (self.cut_nodes(line, &upper), line.corners.map(|along| Some(on_rim(along)))),
            Lips::Open => (open_nodes(&self.frame, &upper, &lower), [None, None]),
        };
        let held = if matches!(lips, Lips::Cut(_)) { self.held(line, &rims, &nodes) } else { Vec::new() };
        Mouth { is_cut: matches!(lips, Lips::Cut(_)), rims, nodes, held, corners, up, ring, hanging }
    }

    /// The rims of an open mouth at the network's stations: on each lip the vertex nearest to where the landmark should
    /// be, since the network takes one lip's rim for the other's where they touch.
    fn open_rims(&self, line: &LipLine, lower_side: &[f32]) -> [Vec<u32>; 2] {
        let stations = self.stations(line);
        let positions = &self.edit.mesh().positions;
        let nearest = |target: Point3<f64>, allowed: &dyn Fn(usize) -> bool| -> u32 {
            let far = |v: usize| (positions[v] - target).norm_squared();
            let best =
                (0..positions.len()).filter(|&v| allowed(v)).min_by(|&a, &b| far(a).total_cmp(&far(b)));
            best.map_or(0, |v| self.edit.place(v as u32))
        };
        let place = |k: usize| {
            let on_line = line.place(stations[k]);
            let z = match k {
                0 => self.landmarks[INNER_CORNERS[0]].map(|p| p.z),
                k if k < stations.len() - 1 => {
                    let (u, l) = (self.landmarks[UPPER_INNER[k - 1]], self.landmarks[LOWER_INNER[k - 1]]);
                    u.iter().chain(&l).map(|p| p.z).reduce(f64::max)
                }
                _ => self.landmarks[INNER_CORNERS[1]].map(|p| p.z),
            };
            Point3::new(on_line.x, on_line.y, z.unwrap_or(0.0))
        };
        let last = stations.len() - 1;
        let ends = [0, last].map(|k| nearest(place(k), &|_| true));
        let rim = |lower: bool| -> Vec<u32> {
            let of_lip = |v: usize| (lower_side[v] > 0.5) == lower;
            let own = |k: usize| {
                let landmark = if lower { LOWER_INNER[k - 1] } else { UPPER_INNER[k - 1] };
                let mut target = place(k);
                if let Some(p) = self.landmarks[landmark] {
                    target.y = p.y;
                }
                nearest(target, &of_lip)
            };
            std::iter::once(ends[0]).chain((1..last).map(own)).chain([ends[1]]).collect()
        };
        [rim(false), rim(true)]
    }

    /// A part of the mouth, drawn back where it would stand out of a thin lip or chin.
    fn tucked(&self, mut part: PartMesh) -> PartMesh {
        for p in &mut part.positions {
            if let Some(skin) = self.depth(p.x, p.y) {
                p.z = p.z.min((skin - TUCKED * self.frame.mouth).max(p.z - 0.3 * self.frame.mouth));
            }
        }
        part
    }

    /// A smooth curve along the line, as deep as a rim, a little behind the lips.
    fn behind(&self, line: &LipLine, rim: &[Point3<f64>]) -> Vec<Point3<f64>> {
        const COLUMNS: usize = 25;
        (0..COLUMNS)
            .map(|i| {
                let t = i as f64 / (COLUMNS - 1) as f64;
                let along = line.corners[0] + (line.corners[1] - line.corners[0]) * t;
                let place = line.place(along);
                Point3::new(place.x, place.y, rim_place(line, rim, along).z - BEHIND_OPEN * self.frame.mouth)
            })
            .collect()
    }

    /// Triangles of the scan's own cavity, if it has one: behind the lips and hidden by them.
    fn own_bag(&self, line: &LipLine, rim: &[Point3<f64>]) -> Vec<u32> {
        let mouth = self.frame.mouth;
        let front = rim.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        let middle = line.place(0.0);
        let reach = BAG_REACH * mouth;
        let patch = self.edit.patch(
            &Point3::new(middle.x - reach, middle.y - reach, front - BAG_DEPTH * mouth),
            &Point3::new(middle.x + reach, middle.y + reach, front - BAG_START * mouth),
        );
        let hidden = |triangle: &u32| {
            let corners = self.edit.mesh().triangles[*triangle as usize];
            let middle = corners.map(|v| self.edit.at(v).coords).iter().sum::<Vector3<f64>>() / 3.0;
            let is_behind = middle.z < front - BAG_START * mouth;
            is_behind && self.depth(middle.x, middle.y).is_some_and(|z| z - middle.z > BAG_START * mouth)
        };
        let bag: Vec<u32> = patch.iter().copied().filter(hidden).collect();
        // Nostrils are hidden too, but hang together with nothing behind the lips.
        let near_lips = |piece: &Vec<u32>| {
            let behind = |t: &u32| {
                let corners = self.edit.corners(*t).map(|c| self.edit.at(c));
                let off = |p: &Point3<f64>| line.above(p).abs().max(line.along(p).abs() - line.corners[1]);
                corners.iter().any(|p| off(p) < BAG_START * mouth && p.z > front - 0.5 * mouth)
            };
            piece.iter().any(behind)
        };
        tracing::info!(
            "{} of {} triangles behind the lips are hidden",
            bag.len(),
            self.edit.mesh().triangles.len()
        );
        let pieces = self.edit.pieces(&bag).into_iter().filter(near_lips);
        let largest = pieces.max_by_key(Vec::len).unwrap_or_default();
        // A few hidden triangles are a fold, not a mouth; one that ends in an edge is the lips' lining.
        let around = self.edit.edges(&patch);
        let ends = self.edit.edges(&largest).keys().filter(|edge| around[edge].len() == 1).count();
        if largest.len() < FEWEST_BAG || ends > MOST_ENDS { Vec::new() } else { largest }
    }

    /// Along-coordinates of the network's stations, ascending.
    fn stations(&self, line: &LipLine) -> Vec<f64> {
        let pairs = UPPER_INNER.iter().zip(&LOWER_INNER);
        let mut stations = vec![line.corners[0]];
        for (&u, &l) in pairs {
            let both: Vec<f64> =
                [u, l].iter().filter_map(|&i| Some(line.along(&self.landmarks[i]?))).collect();
            let last = stations[stations.len() - 1];
            let mean = both.iter().sum::<f64>() / both.len().max(1) as f64;
            stations.push(if both.is_empty() { last } else { mean.max(last) });
        }
        stations.push(line.corners[1].max(stations[stations.len() - 1]));
        stations
    }

    /// Two nodes to a stretch between stations, four to those at the corners; and beyond the inner corners two that keep
    /// the rims together to the ends of the cut.
    fn cut_nodes(&self, line: &LipLine, rim: &[Point3<f64>]) -> Vec<RimNode> {
        let stations = self.stations(line);
        let last = stations.len() - 1;
        let between = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let beyond =
            |station: usize, end: f64| [0.0, 0.5].map(|t| (station, 0.0, between(end, stations[station], t)));
        let mut wanted = beyond(0, line.ends[0]).to_vec();
        for station in 0..last {
            let is_end = station == 0 || station + 1 == last;
            let shares: &[f64] = if is_end { &[0.0, 0.25, 0.5, 0.75] } else { &[0.0, 0.5] };
            let stretch = shares
                .iter()
                .map(|&share| (station, share, between(stations[station], stations[station + 1], share)));
            // The corner itself is a landmark's control.
            wanted.extend(stretch.skip(usize::from(station == 0)));
        }
        wanted.extend(beyond(last, line.ends[1]).into_iter().rev());
        let mut nodes: Vec<RimNode> = Vec::new();
        for (station, share, along) in wanted {
            let rest = self.frame.leave(&rim_place(line, rim, along));
            if nodes.last().is_none_or(|last| (last.rest[0] - rest).norm() >= CLOSEST_NODES) {
                nodes.push(RimNode { station, share, rest: [rest; 2] });
            }
        }
        nodes
    }

    /// Between which nodes every vertex of the rims lies.
    fn held(&self, line: &LipLine, rims: &[Vec<u32>; 2], nodes: &[RimNode]) -> Vec<RimVertex> {
        let places: Vec<f64> =
            nodes.iter().map(|node| line.along(&self.frame.enter(&node.rest[0]))).collect();
        let lips: [BTreeSet<u32>; 2] = [0, 1].map(|lip| rims[lip].iter().copied().collect());
        let vertices = 0..self.edit.mesh().positions.len() as u32;
        let held = vertices.filter_map(|vertex| {
            let place = self.edit.place(vertex);
            let lower = !lips[0].contains(&place);
            if lower && !lips[1].contains(&place) {
                return None;
            }
            let along = line.along(self.edit.at(vertex));
            let right = places.partition_point(|p| *p < along).clamp(1, places.len() - 1);
            let (a, b) = (places[right - 1], places[right]);
            let share = if b > a { ((along - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
            Some(RimVertex { vertex, lower, nodes: [right - 1, right], share })
        });
        if places.len() < 2 { Vec::new() } else { held.collect() }
    }

    fn open_eye(&mut self, side: Side, moved_back: &mut Vec<(u32, Point3<f64>)>) -> Result<Eye, EyeFault> {
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
        let kind = PartKind::Eye(side);
        let picture = ball.texture(&hole, &self.landmarks, eye, self.view);
        let texture = Some(Arc::new(encoded(kind.name(), &picture)));
        let material =
            Material { name: kind.name().to_owned(), base_colour: [1.0; 4], texture, gloss: WET_EYE };
        self.parts.push((kind, ball.mesh(), material));
        Ok(Eye { centre: self.frame.leave(&ball.centre), radius: ball.radius, lids })
    }
}

/// The network's pairs where the mouth was open: each on its own lip.
fn open_nodes(frame: &FaceFrame, upper: &[Point3<f64>], lower: &[Point3<f64>]) -> Vec<RimNode> {
    let pairs = upper.iter().zip(lower).enumerate().skip(1).take(UPPER_INNER.len());
    pairs
        .map(|(station, (u, l))| RimNode { station, share: 0.0, rest: [frame.leave(u), frame.leave(l)] })
        .collect()
}

/// The place on a rim at an along-coordinate.
fn rim_place(line: &LipLine, rim: &[Point3<f64>], along: f64) -> Point3<f64> {
    let at = |i: usize| line.along(&rim[i]);
    let crossing = (1..rim.len()).find(|&i| at(i) >= along);
    let right = crossing.unwrap_or(rim.len() - 1);
    let (a, b) = (at(right - 1), at(right));
    let t = if b > a { ((along - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
    rim[right - 1] + (rim[right] - rim[right - 1]) * t
}

fn encoded(name: &str, picture: &RgbImage) -> Texture {
    let mut bytes = std::io::Cursor::new(Vec::new());
    // Writing into memory does not fail; without bytes the material is plain.
    let _ = picture.write_to(&mut bytes, image::ImageFormat::Png);
    Texture { name: format!("{name}.png"), format: TextureFormat::Png, bytes: bytes.into_inner() }
}

/// Gives the scan's own cavity the flesh of the mouth's picture: a scanner has painted it, if at all, like skin.
fn paint_bag(mesh: &mut Mesh, bag: &[u32], flesh: &Material) {
    if bag.is_empty() {
        return;
    }
    complete(mesh);
    let number = mesh.materials.len() as u32;
    mesh.materials.push(Material { name: "mouth".into(), ..flesh.clone() });
    let uv = mesh.uvs.len() as u32;
    mesh.uvs.push(super::interior::DEEP);
    for &triangle in bag {
        mesh.triangle_materials[triangle as usize] = number;
        mesh.uv_triangles[triangle as usize] = [uv; 3];
    }
}

/// Gives every triangle a material and texture coordinates.
fn complete(mesh: &mut Mesh) {
    if mesh.materials.is_empty() {
        mesh.materials.push(Material {
            name: "skin".into(),
            base_colour: [1.0; 4],
            texture: None,
            gloss: 0.0,
        });
    }
    if mesh.triangle_materials.is_empty() {
        mesh.triangle_materials = vec![0; mesh.triangles.len()];
    }
    if mesh.uv_triangles.is_empty() {
        mesh.uvs = vec![[0.0; 2]];
        mesh.uv_triangles = vec![[0; 3]; mesh.triangles.len()];
    }
}

/// Appends a part to the mesh, which gains what it lacks to hold it.
fn join(mesh: &mut Mesh, frame: &FaceFrame, kind: PartKind, part: &PartMesh, material: Material) -> Part {
    complete(mesh);
    let (vertex, uv, triangle) = (mesh.positions.len(), mesh.uvs.len(), mesh.triangles.len());
    let number = mesh.materials.len() as u32;
    mesh.materials.push(material);
    mesh.positions.extend(part.positions.iter().map(|p| frame.leave(p)));
    if !mesh.colours.is_empty() {
        mesh.colours.resize(mesh.positions.len(), [1.0; 3]);
    }
    mesh.uvs.extend(&part.uvs);
    let from = |offset: usize| move |t: &[u32; 3]| t.map(|i| i + offset as u32);
    mesh.uv_triangles.extend(part.triangles.iter().map(from(uv)));
    mesh.triangle_materials.resize(triangle + part.triangles.len(), number);
    mesh.triangles.extend(part.triangles.iter().map(from(vertex)));
    Part { kind, vertices: vertex..mesh.positions.len(), triangles: triangle..mesh.triangles.len() }
}
