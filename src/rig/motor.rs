//! What moves a target: the performer's landmarks, action units, muscles.

use std::{fmt::Debug, sync::Arc};

use nalgebra::Point3;

use super::{
    ActionRig, ActionSolver, AvatarFrame, Bones, Drive, LipDrive, Puppet, RigError, SourceFace,
    points::PointFill,
};
use crate::{actions::ActionLibrary, lift::Expression};

/// Actions that a solver measures at most.
const MOST_ACTIONS: usize = 64;

/// Turns a performer's expression into the motion of a target's controls and bones.
pub trait Motor: Debug + Send + Sync {
    /// The target, as something that moves.
    fn puppet(&self) -> &Puppet;

    /// The lips' drive, where the target's lips part.
    fn lips(&self) -> Option<&LipDrive>;

    /// Moves controls and bones. `camera` is where the expression was seen from, about the target: scan frame, millimetres.
    fn pose_controls(&self, expression: &Expression, camera: &Point3<f64>, frame: &mut AvatarFrame) -> Bones;
}

/// The landmarks' own displacements, and the folds of the actions that they show.
#[derive(Debug, Clone)]
pub(super) struct LandmarkMotor {
    drive: Drive,
    fill: PointFill,
    solver: Arc<ActionSolver>,
}

impl LandmarkMotor {
    pub fn new(
        drive: Drive,
        source: &SourceFace,
        library: &ActionLibrary,
        solver: Arc<ActionSolver>,
    ) -> Result<Self, RigError> {
        let fill = PointFill::new(&source.points)?.with_relief(library, &solver)?;
        Ok(Self { drive, fill, solver })
    }
}

impl Motor for LandmarkMotor {
    fn puppet(&self) -> &Puppet {
        &self.drive.puppet
    }

    fn lips(&self) -> Option<&LipDrive> {
        self.drive.lips.as_ref()
    }

    fn pose_controls(&self, expression: &Expression, camera: &Point3<f64>, frame: &mut AvatarFrame) -> Bones {
        let mut vectors = std::mem::take(&mut frame.scratch);
        let mut magnitudes = [0.0; MOST_ACTIONS];
        let count = self.solver.keys().count().min(MOST_ACTIONS);
        self.solver.solve(&expression.displacements.vectors, &mut magnitudes[..count]);
        vectors.clear();
        vectors.extend_from_slice(&expression.displacements.vectors);
        self.fill.fill(&mut vectors);
        self.fill.fold(&magnitudes[..count], &mut vectors);
        frame.bones = self.drive.controls(&vectors, &expression.eyes, Some(camera), &mut frame.controls);
        frame.scratch = vectors;
        frame.bones
    }
}

/// The landmarks' own displacements, and nothing besides: volume morphing (002 §IV).
#[derive(Debug, Clone)]
pub(super) struct VolumeMotor {
    pub drive: Drive,
}

impl Motor for VolumeMotor {
    fn puppet(&self) -> &Puppet {
        &self.drive.puppet
    }

    fn lips(&self) -> Option<&LipDrive> {
        self.drive.lips.as_ref()
    }

    fn pose_controls(&self, expression: &Expression, camera: &Point3<f64>, frame: &mut AvatarFrame) -> Bones {
        let vectors = &expression.displacements.vectors;
        frame.bones = self.drive.controls(vectors, &expression.eyes, Some(camera), &mut frame.controls);
        frame.bones
    }
}

/// Action units that are measured on the performer, and a library that moves the target by them.
#[derive(Debug, Clone)]
pub(super) struct ActionMotor {
    pub rig: ActionRig,
    pub solver: Arc<ActionSolver>,
}

impl Motor for ActionMotor {
    fn puppet(&self) -> &Puppet {
        self.rig.puppet()
    }

    fn lips(&self) -> Option<&LipDrive> {
        self.rig.lips()
    }

    fn pose_controls(&self, expression: &Expression, _: &Point3<f64>, frame: &mut AvatarFrame) -> Bones {
        self.rig.pose_controls(&self.solver.measure(expression), &expression.eyes, frame)
    }
}
