//! A basis as shapes on a target (001 figure 1): pictures, OBJ files, a GLB with morph targets.

use std::path::Path;

use image::RgbaImage;
use nalgebra::Vector3;

use super::{PipelineError, Stage, Target, avatar_glb::write_shapes, glb_parts::OwnMetres};
use crate::{
    export::write_obj,
    muscle::MuscleMotor,
    rig::{AvatarFrame, Motor},
    scan::Mesh,
    view::contact_sheet,
};

/// Pictures in a row of the sheet.
const COLUMNS: u32 = 6;
/// What moves less in its file's unit is the target's own place, bit for bit.
const STILL: f32 = 1e-6;

/// A basis tied to a target, one muscle at a time.
pub struct MuscleShapes<'a> {
    /// The scan.
    pub target: &'a Target,
    /// The muscles that move it.
    pub motor: &'a MuscleMotor,
}

impl MuscleShapes<'_> {
    /// The target with one muscle fully contracted.
    fn pose(&self, muscle: usize, frame: &mut AvatarFrame) -> Result<(), PipelineError> {
        let mut contractions = vec![0.0; self.motor.basis().count()];
        contractions[muscle] = 1.0;
        let eyes = self.motor.eyes(&contractions);
        self.motor.pose_contractions(&contractions, &eyes, frame);
        Ok(self.motor.puppet().place(frame)?)
    }

    /// A picture of each muscle, after one of the neutral.
    pub fn sheet(&self, stage: &mut Stage) -> Result<RgbaImage, PipelineError> {
        let mut frame = self.motor.puppet().new_frame();
        let mut pictures = vec![(stage.picture(&frame)?, "neutral".to_owned())];
        for (k, muscle) in self.motor.basis().muscles.iter().enumerate() {
            self.pose(k, &mut frame)?;
            pictures.push((stage.picture(&frame)?, muscle.name.replace('_', " ")));
        }
        let cells: Vec<_> = pictures.iter().map(|(picture, name)| (picture, name.as_str())).collect();
        Ok(contact_sheet(&cells, COLUMNS))
    }

    /// `neutral.obj` and one file a muscle, on one mesh, in the file's own frame and unit: what `--basis FOLDER` reads.
    pub fn write_folder(&self, folder: &Path, mut progress: impl FnMut(u64)) -> Result<(), PipelineError> {
        std::fs::create_dir_all(folder)
            .map_err(|source| PipelineError::Folder { path: folder.into(), source })?;
        let placement = &self.target.scan.placement;
        let rest = &self.target.anatomy.mesh;
        let own: Vec<_> = rest.positions.iter().map(|p| placement.to_own(*p)).collect();
        write_obj(&folder.join("neutral.obj"), &Mesh { positions: own.clone(), ..rest.clone() })?;
        let mut frame = self.motor.puppet().new_frame();
        for (k, muscle) in self.motor.basis().muscles.iter().enumerate() {
            self.pose(k, &mut frame)?;
            let moved = own.iter().zip(&frame.positions).zip(self.motor.puppet().rest());
            let positions = moved.map(|((own, now), rest)| {
                let step = Vector3::from(std::array::from_fn(|k| f64::from(now[k] - rest[k])));
                own + placement.vector_to_own(step)
            });
            let mesh = Mesh { positions: positions.collect(), ..rest.clone() };
            write_obj(&folder.join(format!("{}.obj", muscle.name)), &mesh)?;
            progress(k as u64 + 1);
        }
        Ok(())
    }

    /// One file with a morph target a muscle.
    pub fn write_glb(&self, path: &Path) -> Result<(), PipelineError> {
        let export = OwnMetres::of(self.target);
        let puppet = self.motor.puppet();
        let mut frame = puppet.new_frame();
        let (mut names, mut shapes) = (Vec::new(), Vec::new());
        for (k, muscle) in self.motor.basis().muscles.iter().enumerate() {
            self.pose(k, &mut frame)?;
            let moved = frame.positions.iter().zip(puppet.rest()).take(puppet.warp().vertices());
            let shape = moved.map(|(p, rest)| {
                let step: [f32; 3] = std::array::from_fn(|k| p[k] - rest[k]);
                export.vector(step.map(|value| if value.abs() < STILL { 0.0 } else { value }))
            });
            names.push(muscle.name.clone());
            shapes.push(shape.collect::<Vec<_>>());
        }
        write_shapes(path, self.target, &export, &names, &shapes)
    }
}
