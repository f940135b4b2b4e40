//! What is played on a target by itself, without a performer's clip, into every output.

use std::path::Path;

use image::RgbaImage;
use nalgebra::{MatrixXx3, Vector3};

use super::{
    ControlMotion, GlbReport, HeadMode, PipelineError, SkinRelief, Stage, Target,
    glb_take::{SkinCurves, write_take_glb},
};
use crate::{
    appearance::AppearanceStates,
    capture::{FrameRate, Timestamp},
    export::{Mp4Settings, Mp4Writer, Pc2Writer, write_obj},
    rig::{AvatarFrame, Puppet},
    scan::Mesh,
    view::contact_sheet,
};

/// Digits that a file's coordinates keep: more than scanners write, fewer than arithmetic blurs.
const DIGITS: i32 = 14;

/// Something that moves a target over time: action units, contraction curves.
pub trait Play {
    /// The target, as something that moves.
    fn puppet(&self) -> &Puppet;

    /// Moves controls, bones and head to a moment from 0 to [`Play::end`]; the positions stay.
    fn pose_controls(&self, time: Timestamp, frame: &mut AvatarFrame);

    /// When the last frame is shown; the first is at 0.
    fn end(&self) -> Timestamp;

    /// The moment that a mesh shows.
    fn still(&self) -> Timestamp;

    /// The moments that a picture shows, in order.
    fn moments(&self) -> Vec<Timestamp> {
        vec![self.still()]
    }

    /// The states of living skin at a moment; none where skin plays no part.
    fn states(&self, _time: Timestamp) -> Option<AppearanceStates> {
        None
    }

    /// Whether the head moves.
    fn head(&self) -> HeadMode {
        HeadMode::Still
    }
}

/// A target, what is played on it, and at which rate.
pub struct PlayedTake<'a> {
    /// The scan.
    pub target: &'a Target,
    /// What is played.
    pub play: &'a dyn Play,
    /// Frames of films and motions.
    pub rate: FrameRate,
    /// What of living skin moves vertices in a .glb.
    pub relief: &'a SkinRelief,
}

impl PlayedTake<'_> {
    /// The frames of the constant rate.
    pub fn times(&self) -> Vec<Timestamp> {
        let count = (self.play.end().seconds() * self.rate.per_second() + 1e-6).floor() as u64;
        (0..=count).map(|index| self.rate.tick(index)).collect()
    }

    fn pose(&self, time: Timestamp, frame: &mut AvatarFrame) -> Result<(), PipelineError> {
        self.play.pose_controls(time, frame);
        Ok(self.play.puppet().place(frame)?)
    }

    fn show(&self, time: Timestamp, stage: &mut Stage) {
        if let Some(states) = self.play.states(time) {
            stage.show(&states);
        }
    }

    /// The avatar at one moment, every part of it, in the file's own frame and unit. The scan's vertices come first, in
    /// their order; those that do not move keep the file's numbers.
    pub fn write_obj(&self, path: &Path) -> Result<(), PipelineError> {
        let mut frame = self.play.puppet().new_frame();
        self.pose(self.play.still(), &mut frame)?;
        let mut placed = frame.positions.clone();
        self.play.head().place(&frame, &mut placed);
        let mesh = &self.target.anatomy.mesh;
        let placement = &self.target.scan.placement;
        let moved = mesh.positions.iter().zip(&placed).zip(self.play.puppet().rest());
        let extent = mesh.positions.iter().map(|p| placement.to_own(*p).coords.amax()).fold(0.0, f64::max);
        let places = decimals(extent);
        let positions = moved.map(|((rest, now), before)| {
            let step = Vector3::from(std::array::from_fn(|k| f64::from(now[k]) - f64::from(before[k])));
            (placement.to_own(*rest) + placement.vector_to_own(step)).map(|value| rounded(value, places))
        });
        Ok(write_obj(path, &Mesh { positions: positions.collect(), ..mesh.clone() })?)
    }

    /// Every vertex of every frame. `progress` is told the number of frames done.
    pub fn write_pc2(&self, path: &Path, mut progress: impl FnMut(u64)) -> Result<(), PipelineError> {
        let mut writer = Pc2Writer::create(path, self.play.puppet().rest().len())?;
        let mut frame = self.play.puppet().new_frame();
        let mut placed = frame.positions.clone();
        let mut own = frame.positions.clone();
        for (done, time) in (1..).zip(self.times()) {
            self.pose(time, &mut frame)?;
            self.play.head().place(&frame, &mut placed);
            self.target.scan.to_own(&placed, &mut own);
            writer.write_sample(&own)?;
            progress(done);
        }
        Ok(writer.commit()?)
    }

    /// The target with its motion as morph targets.
    pub fn write_glb(&self, path: &Path) -> Result<GlbReport, PipelineError> {
        let times = self.times();
        let mut moves = ControlMotion { controls: Vec::new(), bones: Vec::new(), heads: Vec::new() };
        let mut posed = self.play.puppet().new_frame();
        for time in &times {
            self.play.pose_controls(*time, &mut posed);
            let moved = &posed.controls;
            moves.controls.push(MatrixXx3::from_fn(moved.len(), |i, axis| f64::from(moved[i][axis])));
            moves.bones.push(posed.bones);
            moves.heads.push(posed.head);
        }
        let states: Option<Vec<_>> = times.iter().map(|time| self.play.states(*time)).collect();
        let skin = states.as_deref().map(|states| SkinCurves { states, relief: self.relief });
        write_take_glb(path, self.target, self.play.puppet().warp(), &times, &moves, self.play.head(), skin)
    }

    /// A film. `progress` is told the number of pictures done.
    pub fn write_mp4(
        &self,
        path: &Path,
        stage: &mut Stage,
        mut progress: impl FnMut(u64),
    ) -> Result<(), PipelineError> {
        let [width, height] = stage.size();
        let mut writer = Mp4Writer::create(path, Mp4Settings::new(width, height, self.rate))?;
        let times = self.times();
        let mut frame = self.play.puppet().new_frame();
        let mut picture = Vec::new();
        // One picture is drawn while the one before it is read back and encoded.
        for step in 0..=times.len() {
            if let Some(time) = times.get(step) {
                self.pose(*time, &mut frame)?;
                self.show(*time, stage);
                stage.submit(&frame)?;
            }
            if step > 0 {
                stage.fetch(&mut picture)?;
                writer.write_picture(&picture)?;
                progress(step as u64);
            }
        }
        Ok(writer.commit()?)
    }

    /// A picture of the one moment there is to show, or a sheet of several.
    pub fn picture(&self, stage: &mut Stage) -> Result<RgbaImage, PipelineError> {
        let mut frame = self.play.puppet().new_frame();
        let moments = self.play.moments();
        let mut cells = Vec::new();
        for time in &moments {
            self.pose(*time, &mut frame)?;
            self.show(*time, stage);
            let picture = stage.picture(&frame)?;
            if moments.len() == 1 {
                return Ok(picture);
            }
            cells.push((picture, format!("{:.2} s", time.seconds())));
        }
        let columns = moments.len().div_ceil(2).max(1) as u32;
        let cells: Vec<_> = cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
        Ok(contact_sheet(&cells, columns))
    }
}

/// Decimals that numbers up to `extent` keep: there and back between two frames blurs the last ones.
fn decimals(extent: f64) -> i32 {
    let before_the_point = extent.max(1e-3).log10().floor() as i32 + 1;
    (DIGITS - before_the_point).clamp(0, 16)
}

fn rounded(value: f64, places: i32) -> f64 {
    let scale = 10.0_f64.powi(places);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_file_come_back_as_they_were() {
        for text in ["51.109501", "-0.281312", "1234.5678", "0.000123456", "-90.773521"] {
            let value: f64 = text.parse().unwrap();
            let blurred = (value + 17.3) * 1.0 - 17.3;
            assert_eq!(rounded(blurred, decimals(1500.0)).to_string(), value.to_string());
        }
    }
}
