//! What a prepared scan consists of.

use std::{fmt, ops::Range};

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::{FaceFrame, Hanging, Jaw, LidShapes, eye_hole::EyeFault, interior::RingPoint, lips::LipFault};
use crate::{lift::Side, scan::Mesh};

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
                match fault {
                    EyeFault::Hollow => write!(formatter, "the {side} eye cannot close: {fault}"),
                    _ => write!(formatter, "the {side} eye stays as it was scanned: {fault}"),
                }
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
