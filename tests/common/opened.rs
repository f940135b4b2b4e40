//! Scans with their landmarks, opened as the program opens them.

use std::path::Path;

use nalgebra::{Point3, Rotation3, Vector3};
use understudy::{
    actions::Catalogue,
    anatomy::{Anatomy, Omission, Part, PartKind},
    assets::Assets,
    lift::{EyeState, Eyes, Side},
    pipeline::{Networks, Target, TargetOptions},
    rig::{Puppet, TargetFace, WarpKind},
    scan::{Mesh, Surface},
    tracking::{SKIN_LANDMARK_COUNT, TrackerOptions},
    view::Gpu,
};

/// A scan in the scan frame, what the networks found on it, and what was made of it.
pub struct Opened {
    pub scan: Mesh,
    pub surface: Surface,
    pub landmarks: Vec<Option<Point3<f64>>>,
    pub anatomy: Anatomy,
}

impl Opened {
    /// With its colours, as the program does it.
    pub fn load(scan: &Path) -> Self {
        let assets = Assets::locate().unwrap();
        let gpu = Gpu::headless().unwrap();
        let mut networks = Networks::load(&assets, TrackerOptions::default()).unwrap();
        let mut target = Target::load(scan, &TargetOptions::default(), &gpu, &mut networks.tracker).unwrap();
        target.prepare(&gpu).unwrap();
        Self::of(&target)
    }

    /// What a target holds.
    pub fn of(target: &Target) -> Self {
        Self {
            scan: target.mesh().clone(),
            surface: target.surface.clone(),
            landmarks: target.landmarks.clone(),
            anatomy: target.anatomy.clone(),
        }
    }

    /// Another mesh or other landmarks, without colours.
    pub fn new(scan: Mesh, landmarks: Vec<Option<Point3<f64>>>) -> Self {
        let surface = Surface::new(&scan).unwrap();
        let anatomy = Anatomy::prepare(&scan, &surface, &landmarks, None);
        Self { scan, surface, landmarks, anatomy }
    }

    pub fn face(&self) -> TargetFace {
        TargetFace::new(self.landmarks.clone(), Rotation3::identity()).unwrap()
    }

    pub fn puppet(&self) -> Puppet {
        self.puppet_with(WarpKind::default())
    }

    /// The same with another warp.
    pub fn puppet_with(&self, warp: WarpKind) -> Puppet {
        let points = Catalogue::get().place(&self.landmarks, &self.surface).split_off(SKIN_LANDMARK_COUNT);
        Puppet::new(&self.face(), &self.anatomy, &self.surface, &|_| None, &points, warp).unwrap()
    }

    pub fn part(&self, kind: PartKind) -> Option<&Part> {
        self.anatomy.parts.iter().find(|part| part.kind == kind)
    }

    /// What a triangle of the opened mesh belongs to.
    pub fn kind_of(&self, triangle: u32) -> PartKind {
        let holds = |part: &&Part| part.triangles.contains(&(triangle as usize));
        self.anatomy.parts.iter().find(holds).unwrap().kind
    }

    pub fn landmark(&self, index: usize) -> Point3<f64> {
        self.landmarks[index].unwrap()
    }

    /// A direction given in the face's axes.
    pub fn direction(&self, x: f64, y: f64, z: f64) -> Vector3<f64> {
        self.anatomy.frame.unwrap().leave_vector(&Vector3::new(x, y, z))
    }

    pub fn omits_lips(&self) -> bool {
        self.anatomy.omissions.iter().any(|omission| matches!(omission, Omission::Lips(_)))
    }
}

/// Eyes that close by so much, right and left, and look straight ahead.
pub fn closing(right: f64, left: f64) -> Eyes {
    let eye = |closure| EyeState { closure, ..EyeState::default() };
    Eyes { right: eye(right), left: eye(left) }
}

/// Open eyes that turn to the subject's left and up, radians.
pub fn looking(yaw: f64, pitch: f64) -> Eyes {
    let eye = EyeState { closure: 0.0, yaw, pitch };
    Eyes { right: eye, left: eye }
}

pub fn number(side: Side) -> usize {
    usize::from(side == Side::Left)
}

pub fn points(positions: &[[f32; 3]]) -> Vec<Point3<f64>> {
    positions.iter().map(|p| Point3::from(p.map(f64::from))).collect()
}
