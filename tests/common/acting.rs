//! A performer on an opened scan: the demonstration clip, tracked once, and a scan tied to it.

use std::{path::Path, sync::LazyLock};

use nalgebra::{Point3, Vector3};
use understudy::{
    assets::Assets,
    capture::VideoFile,
    lift::{Displacements, Expression},
    pipeline::{
        Motion, Networks, Performance, SolveOptions, Stopwatch, Target, TargetOptions, read_canonical_face,
    },
    rig::{AvatarFrame, LipDrive, Method, Rig, TargetFace},
    tracking::TrackerOptions,
    view::Gpu,
};

use super::{asset, opened::Opened};

/// cap13, solved.
pub static CLIP: LazyLock<Motion> = LazyLock::new(|| {
    let mut networks = networks();
    let clip = Box::new(VideoFile::open(&asset("cap13")).unwrap());
    let mut watch = Stopwatch::default();
    let performance = Performance::track(clip, &mut networks.tracker, 2, &mut watch, |_| {}).unwrap();
    let average = read_canonical_face(&asset("canonical_face")).unwrap();
    Motion::solve(&performance, &average, &mut networks.blendshapes, &SolveOptions::default()).unwrap()
});

fn networks() -> Networks {
    Networks::load(&Assets::locate().unwrap(), TrackerOptions::default()).unwrap()
}

/// A scan and the clip's performer, tied together.
pub struct Acting {
    pub opened: Opened,
    pub face: TargetFace,
    pub rig: Rig,
}

impl Acting {
    pub fn new(scan: &Path) -> Self {
        let gpu = Gpu::headless().unwrap();
        let mut tracker = networks().tracker;
        let mut target = Target::load(scan, &TargetOptions::default(), &gpu, &mut tracker).unwrap();
        target.prepare(&gpu).unwrap();
        let (face, _) = target.level_with(CLIP.performer.rest_landmarks(), &mut tracker).unwrap();
        let (anatomy, surface) = (&target.anatomy, &target.surface);
        let rig = Rig::new(&CLIP.performer, &face, anatomy, surface, Method::default()).unwrap();
        Self { opened: Opened::of(&target), face, rig }
    }

    pub fn lips(&self) -> &LipDrive {
        self.rig.lips().unwrap()
    }

    pub fn posed(&self, expression: &Expression) -> AvatarFrame {
        let mut frame = self.rig.new_frame();
        self.rig.pose(expression, &mut frame).unwrap();
        frame
    }

    /// The gaps that a performer's inner lips ask for, millimetres.
    pub fn wanted_gaps(&self, displacements: &Displacements) -> [f64; 9] {
        std::array::from_fn(|pair| self.lips().wanted_gap(pair, &displacements.vectors))
    }
}

/// The clip's performer with every landmark moved by a rule of its index and its place at rest, scan frame, millimetres.
pub fn performing(moved: impl Fn(usize, &Point3<f64>) -> Vector3<f64>) -> Expression {
    let mut displacements = Displacements::neutral();
    let points = displacements.vectors.iter_mut().zip(CLIP.performer.neutral());
    for (i, (vector, point)) in points.enumerate() {
        *vector = moved(i, point);
    }
    Expression { displacements, ..Expression::neutral(*CLIP.performer.rest()) }
}
