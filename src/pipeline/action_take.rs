//! Action units played on a target (000 §5.6): one expression, or a score of keys, into every output.

use std::path::Path;

use image::RgbaImage;
use nalgebra::{MatrixXx3, Vector3};

use super::{ControlMotion, GlbReport, HeadMode, PipelineError, Stage, Target, glb_take::write_take_glb};
use crate::{
    actions::{ActionKey, ActionWeights, Score},
    capture::{FrameRate, Timestamp},
    export::{Mp4Settings, Mp4Writer, Pc2Writer, write_obj},
    rig::ActionRig,
    scan::Mesh,
    view::contact_sheet,
};

/// A single expression is shown as it comes, stays and goes, seconds.
const COMING: f64 = 0.6;
const STAYING: f64 = 1.2;
/// Moments on a score's sheet.
const MOMENTS: usize = 8;
/// Digits that a file's coordinates keep: more than scanners write, fewer than arithmetic blurs.
const DIGITS: i32 = 14;

/// What is played.
#[derive(Debug, Clone, PartialEq)]
pub enum Playing {
    /// One expression.
    Expression(ActionWeights),
    /// Keys over time.
    Score(Score),
}

impl Playing {
    /// The magnitudes at a moment.
    pub fn at(&self, time: Timestamp) -> ActionWeights {
        match self {
            Self::Score(score) => score.at(time),
            Self::Expression(weights) => {
                let seconds = time.seconds();
                let from_end = 2.0 * COMING + STAYING - seconds;
                let ramp = (seconds.min(from_end) / COMING).clamp(0.0, 1.0);
                ActionWeights::default().towards(weights, ramp * ramp * (3.0 - 2.0 * ramp))
            }
        }
    }

    /// The actions that are on at some time.
    pub fn actions(&self) -> Vec<ActionKey> {
        match self {
            Self::Expression(weights) => weights.iter().map(|(key, _)| key).collect(),
            Self::Score(score) => score.actions().collect(),
        }
    }

    /// Seconds from the first to the last frame.
    pub fn seconds(&self) -> f64 {
        match self {
            Self::Expression(_) => 2.0 * COMING + STAYING,
            Self::Score(score) => score.end().seconds(),
        }
    }

    /// The frames of a constant rate.
    pub fn times(&self, rate: FrameRate) -> Vec<Timestamp> {
        let count = (self.seconds() * rate.per_second() + 1e-6).floor() as u64;
        (0..=count).map(|index| rate.tick(index)).collect()
    }
}

/// A target, its rig, and what is played on it.
pub struct ActionTake<'a> {
    /// The scan.
    pub target: &'a Target,
    /// The library tied to it.
    pub rig: &'a ActionRig,
    /// What is played.
    pub playing: &'a Playing,
    /// At which rate.
    pub rate: FrameRate,
}

impl ActionTake<'_> {
    /// The avatar at one moment, every part of it, in the file's own frame and unit. The scan's vertices come first, in
    /// their order; those that do not move keep the file's numbers.
    pub fn write_obj(&self, path: &Path, weights: &ActionWeights) -> Result<(), PipelineError> {
        let mut frame = self.rig.new_frame();
        self.rig.pose(weights, &mut frame)?;
        let mesh = &self.target.anatomy.mesh;
        let placement = &self.target.scan.placement;
        let moved = mesh.positions.iter().zip(&frame.positions).zip(self.rig.puppet().rest());
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
        let mut writer = Pc2Writer::create(path, self.rig.puppet().rest().len())?;
        let mut frame = self.rig.new_frame();
        let mut own = frame.positions.clone();
        for (done, time) in (1..).zip(self.playing.times(self.rate)) {
            self.rig.pose(&self.playing.at(time), &mut frame)?;
            self.target.scan.to_own(&frame.positions, &mut own);
            writer.write_sample(&own)?;
            progress(done);
        }
        Ok(writer.commit()?)
    }

    /// The target with its motion as morph targets.
    pub fn write_glb(&self, path: &Path) -> Result<GlbReport, PipelineError> {
        let times = self.playing.times(self.rate);
        let mut moves = ControlMotion { controls: Vec::new(), bones: Vec::new(), heads: Vec::new() };
        let mut posed = self.rig.new_frame();
        for time in &times {
            let weights = self.playing.at(*time);
            moves.bones.push(self.rig.pose_controls(&weights, &self.rig.eyes(&weights), &mut posed));
            let moved = &posed.controls;
            moves.controls.push(MatrixXx3::from_fn(moved.len(), |i, axis| f64::from(moved[i][axis])));
            moves.heads.push(posed.head);
        }
        write_take_glb(path, self.target, self.rig.puppet().warp(), &times, &moves, HeadMode::Still)
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
        let times = self.playing.times(self.rate);
        let mut frame = self.rig.new_frame();
        let mut picture = Vec::new();
        // One picture is drawn while the one before it is read back and encoded.
        for step in 0..=times.len() {
            if let Some(time) = times.get(step) {
                self.rig.pose(&self.playing.at(*time), &mut frame)?;
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

    /// One picture of an expression; of a score, a sheet of moments.
    pub fn picture(&self, stage: &mut Stage) -> Result<RgbaImage, PipelineError> {
        let mut frame = self.rig.new_frame();
        match self.playing {
            Playing::Expression(weights) => {
                self.rig.pose(weights, &mut frame)?;
                stage.picture(&frame)
            }
            Playing::Score(score) => {
                let end = score.end().0;
                let mut cells = Vec::new();
                for k in 0..MOMENTS as i64 {
                    let time = Timestamp(end * k / (MOMENTS as i64 - 1));
                    self.rig.pose(&score.at(time), &mut frame)?;
                    cells.push((stage.picture(&frame)?, format!("{:.2} s", time.seconds())));
                }
                let cells: Vec<_> =
                    cells.iter().map(|(picture, caption)| (picture, caption.as_str())).collect();
                Ok(contact_sheet(&cells, MOMENTS as u32 / 2))
            }
        }
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

    #[test]
    fn an_expression_comes_stays_and_goes() {
        let mut weights = ActionWeights::default();
        weights.set_text("17=0.8").unwrap();
        let playing = Playing::Expression(weights);
        let at =
            |seconds: f64| playing.at(Timestamp((seconds * 1e9) as i64)).iter().map(|e| e.1).sum::<f64>();
        assert!(at(0.0).abs() < 1e-12 && at(playing.seconds()).abs() < 1e-9);
        assert!((at(0.3) - 0.4).abs() < 1e-9 && (at(1.0) - 0.8).abs() < 1e-12);
    }
}
