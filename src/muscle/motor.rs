//! A target that muscles move: contractions in, controls and bones out (001 §5: "applying the muscle contractions to
//! different 3D models").

use nalgebra::Point3;

use super::{FaceBasis, MuscleBasis, MuscleError};
use crate::{
    anatomy::Anatomy,
    lift::{Expression, EyeState, Eyes, Side},
    rig::{AvatarFrame, Bones, Drive, LipDrive, Method, Motor, Puppet, SourceFace, TargetFace},
    scan::Surface,
};

/// A basis tied to a target.
#[derive(Debug, Clone)]
pub struct MuscleMotor {
    drive: Drive,
    basis: FaceBasis,
}

impl MuscleMotor {
    /// `anatomy` is the target's mesh, opened or as scanned, `surface` the scan's own, both in the scan frame and
    /// millimetres.
    pub fn new(
        basis: &MuscleBasis,
        target: &TargetFace,
        anatomy: &Anatomy,
        surface: &Surface,
        method: Method,
    ) -> Result<Self, MuscleError> {
        let drive = Drive::new(&SourceFace::average(&basis.face), target, anatomy, surface, method)?;
        let mut own = basis.clone();
        for (eye, side) in Side::BOTH.into_iter().enumerate() {
            // Lids that can close do it by themselves: what a blink does to the skin is not done twice.
            let [blink, _] = basis.lids(side).map(|found| found.map(|k| &basis.elements[k]));
            let Some(blink) = blink.filter(|_| anatomy.eye(side).is_some()) else { continue };
            for element in &mut own.elements {
                let closure = (element.closure[eye] / blink.closure[eye]).clamp(0.0, 1.0);
                for (vector, blink) in element.vectors.iter_mut().zip(&blink.vectors) {
                    *vector -= blink * closure;
                }
            }
        }
        Ok(Self { drive, basis: FaceBasis::own(&own) })
    }

    /// The muscles, on the basis' own face.
    pub fn basis(&self) -> &FaceBasis {
        &self.basis
    }

    /// What the lids do at these contractions, where nothing else is known of them.
    pub fn eyes(&self, contractions: &[f64]) -> Eyes {
        let eye = |which: usize| {
            let muscles = self.basis.muscles.iter().zip(contractions);
            EyeState::closed_by(muscles.map(|(muscle, contraction)| muscle.closure[which] * contraction))
        };
        Eyes { right: eye(0), left: eye(1) }
    }

    /// Moves controls and bones.
    pub fn pose_contractions(&self, contractions: &[f64], eyes: &Eyes, frame: &mut AvatarFrame) -> Bones {
        let mut vectors = std::mem::take(&mut frame.scratch);
        self.basis.synthesize(contractions, &mut vectors);
        frame.bones = self.drive.controls(&vectors, eyes, None, &mut frame.controls);
        frame.scratch = vectors;
        frame.bones
    }
}

impl Motor for MuscleMotor {
    fn puppet(&self) -> &Puppet {
        &self.drive.puppet
    }

    fn lips(&self) -> Option<&LipDrive> {
        self.drive.lips.as_ref()
    }

    fn pose_controls(&self, expression: &Expression, _: &Point3<f64>, frame: &mut AvatarFrame) -> Bones {
        self.pose_contractions(&expression.contractions, &expression.eyes, frame)
    }
}
