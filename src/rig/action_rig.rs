//! A target that action units move (000 §5.6): magnitudes in, vertices out.

use nalgebra::{Rotation3, Vector3};

use super::{
    AvatarFrame, Bones, Controls, LipDrive, Method, Puppet, RigError, SourceFace, TargetFace, drive::Drive,
};
use crate::{
    actions::{ActionKey, ActionLibrary, ActionWeights, MOST_PULLS, Merge, merge},
    anatomy::Anatomy,
    head::rotation_between,
    lift::{EyeState, Eyes, Side},
    scan::Surface,
    tracking::{LANDMARK_COUNT, is_still},
};

/// A library of action units tied to a target.
#[derive(Debug, Clone)]
pub struct ActionRig {
    drive: Drive,
    merge: Merge,
    actions: Vec<Dense>,
}

/// An action with a vector for every handle, library's scan frame, millimetres.
#[derive(Debug, Clone)]
struct Dense {
    key: ActionKey,
    closure: [f64; 2],
    vectors: Vec<Vector3<f64>>,
}

impl ActionRig {
    /// `anatomy` is the target's mesh, opened or as scanned, `surface` the scan's own, both in the scan frame and
    /// millimetres.
    pub fn new(
        library: &ActionLibrary,
        target: &TargetFace,
        anatomy: &Anatomy,
        surface: &Surface,
        method: Method,
        merge: Merge,
    ) -> Result<Self, RigError> {
        let drive = Drive::new(&SourceFace::library(library), target, anatomy, surface, method)?;
        let dense = library.actions.iter().map(|action| {
            let mut vectors = action.dense(library.face.len());
            // Lids that can close do it by themselves: what a blink does to the skin is not done twice.
            for (side, closure) in Side::BOTH.into_iter().zip(action.closure) {
                let blink = library.actions.iter().find(|other| other.key == blink(side));
                for moved in blink.iter().filter(|_| anatomy.eye(side).is_some()).flat_map(|b| &b.vectors) {
                    vectors[moved.handle] -= moved.vector * closure.clamp(0.0, 1.0);
                }
            }
            Dense { key: action.key, closure: action.closure, vectors }
        });
        Ok(Self { drive, merge, actions: dense.collect() })
    }

    /// The target, as something that moves.
    pub fn puppet(&self) -> &Puppet {
        &self.drive.puppet
    }

    /// The lips' drive, where the target's lips part.
    pub fn lips(&self) -> Option<&LipDrive> {
        self.drive.lips.as_ref()
    }

    /// The control points.
    pub fn controls(&self) -> &Controls {
        self.drive.puppet.controls()
    }

    /// A frame to hand to [`ActionRig::pose`] again and again.
    pub fn new_frame(&self) -> AvatarFrame {
        self.drive.puppet.new_frame()
    }

    /// The avatar for these magnitudes; actions that the library has not got do nothing.
    pub fn pose(&self, weights: &ActionWeights, frame: &mut AvatarFrame) -> Result<(), RigError> {
        let eyes = self.eyes(weights);
        self.pose_controls(weights, &eyes, frame);
        self.drive.puppet.place(frame)
    }

    /// Moves controls and bones only; lids and gaze are given.
    pub fn pose_controls(&self, weights: &ActionWeights, eyes: &Eyes, frame: &mut AvatarFrame) -> Bones {
        let mut vectors = std::mem::take(&mut frame.scratch);
        self.vectors(weights, &mut vectors);
        frame.bones = self.drive.controls(&vectors, eyes, None, &mut frame.controls);
        frame.scratch = vectors;
        frame.bones
    }

    /// What the lids do at these magnitudes.
    pub fn eyes(&self, weights: &ActionWeights) -> Eyes {
        let eye = |which: usize| {
            let own = |(key, magnitude): (ActionKey, f64)| Some(self.action(key)?.closure[which] * magnitude);
            EyeState::closed_by(weights.iter().filter_map(own))
        };
        Eyes { right: eye(0), left: eye(1) }
    }

    /// The displacement of every handle of the library's face: the two sides of one action add up, different actions
    /// are merged.
    fn vectors(&self, weights: &ActionWeights, out: &mut Vec<Vector3<f64>>) {
        let handles = self.actions.first().map_or(0, |action| action.vectors.len());
        out.clear();
        out.resize(handles, Vector3::zeros());
        for (handle, out) in out.iter_mut().enumerate() {
            let mut pulls = [Vector3::zeros(); MOST_PULLS];
            let (mut count, mut last) = (0, None);
            for (key, magnitude) in weights.iter().filter(|(_, magnitude)| *magnitude > 0.0) {
                let Some(action) = self.action(key) else { continue };
                let pull = action.vectors[handle] * magnitude;
                if pull == Vector3::zeros() {
                    continue;
                }
                if last == Some(key.au) {
                    pulls[count - 1] += pull;
                } else if count < MOST_PULLS {
                    pulls[count] = pull;
                    count += 1;
                    last = Some(key.au);
                }
            }
            *out = merge(self.merge, &pulls[..count]);
        }
    }

    fn action(&self, key: ActionKey) -> Option<&Dense> {
        self.actions.binary_search_by_key(&key, |action| action.key).ok().map(|at| &self.actions[at])
    }
}

/// AU45 on one side.
fn blink(side: Side) -> ActionKey {
    ActionKey { au: 45, side: Some(side) }
}

/// A target seen as an average face is: turned by the rotation between the landmarks of both that hardly move. `average`
/// has the 468 landmarks first.
pub fn facing(average: &[nalgebra::Point3<f64>], target: &[Option<nalgebra::Point3<f64>>]) -> Rotation3<f64> {
    let (from, to): (Vec<_>, Vec<_>) = (0..LANDMARK_COUNT)
        .filter(|&i| is_still(i))
        .filter_map(|i| Some((target.get(i).copied().flatten()?.coords, average.get(i)?.coords)))
        .unzip();
    if from.len() < 3 { Rotation3::identity() } else { rotation_between(&from, &to) }
}
