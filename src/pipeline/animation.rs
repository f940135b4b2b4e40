//! A take played on a target, into every output at once.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, MatrixXx3};

use super::{
    GlbReport, HeadMode, Motion, PipelineError, Stage, Stopwatch, Target, constant_rate,
    glb_take::{SkinCurves, write_take_glb},
    performer_view::PerformerView,
};
use crate::{
    capture::FrameSource,
    export::{Mp4Settings, Mp4Writer, Pc2Writer, Sound},
    rig::{Bones, Rig},
    scan::NormalSolver,
};

/// A solved take, a rigged target, and how the head is shown.
pub struct Animation<'a> {
    /// The take.
    pub motion: &'a Motion,
    /// The scan.
    pub target: &'a Target,
    /// The two, tied together.
    pub rig: &'a Rig,
    /// Whether outputs move the head.
    pub head: HeadMode,
    /// Living skin, one state for each frame of the take, if it is shown.
    pub skin: Option<SkinCurves<'a>>,
}

/// A video to be written.
pub struct VideoPlan {
    /// Where.
    pub path: PathBuf,
    /// Draws the avatar; its size is the video's, or the avatar's half of it.
    pub stage: Stage,
    /// The clip again, to be shown beside the avatar.
    pub beside: Option<Box<dyn FrameSource>>,
    /// The file whose sound is kept.
    pub sound_from: Option<PathBuf>,
}

impl Animation<'_> {
    /// Every vertex of every frame, in the file's own order, frame and unit, at the clip's nominal rate. `progress` is
    /// told the number of frames done.
    pub fn write_pc2(
        &self,
        path: &Path,
        watch: &mut Stopwatch,
        mut progress: impl FnMut(u64),
    ) -> Result<(), PipelineError> {
        let mut writer = Pc2Writer::create(path, self.rig.rest().len())?;
        let mut frame = self.rig.new_frame();
        let mut placed = frame.positions.clone();
        let mut own = frame.positions.clone();
        let mesh = &self.target.anatomy.mesh;
        let solver = NormalSolver::new(&mesh.triangles, mesh.positions.len());
        let mut normals = frame.positions.clone();
        for (done, index) in (1..).zip(self.ticks()) {
            watch.time("warp", || self.rig.pose(&self.motion.frames[index].expression, &mut frame))?;
            watch.time("write pc2", || {
                let raised = self.skin.filter(|skin| !skin.relief.is_flat());
                if let Some((skin, states)) = raised.and_then(|skin| Some((skin, skin.states.get(index)?))) {
                    solver.update(&frame.positions, &mut normals);
                    skin.relief.apply(states, &normals, &mut frame.positions);
                }
                self.head.place(&frame, &mut placed);
                self.target.scan.to_own(&placed, &mut own);
                writer.write_sample(&own)
            })?;
            progress(done);
        }
        Ok(writer.commit()?)
    }

    /// The target with its motion as morph targets.
    pub fn write_glb(&self, path: &Path, watch: &mut Stopwatch) -> Result<GlbReport, PipelineError> {
        watch.time("write glb", || {
            let moves = self.control_motion();
            let times: Vec<_> = self.motion.frames.iter().map(|frame| frame.timestamp).collect();
            write_take_glb(path, self.target, self.rig.warp(), &times, &moves, self.head, self.skin)
        })
    }

    /// The avatar as a film, at the clip's nominal rate. `progress` is told the number of pictures done.
    pub fn write_mp4(
        &self,
        plan: VideoPlan,
        watch: &mut Stopwatch,
        mut progress: impl FnMut(u64),
    ) -> Result<(), PipelineError> {
        let VideoPlan { path, mut stage, beside, sound_from } = plan;
        let [avatar_width, height] = stage.size();
        let mut beside = beside.map(PerformerView::new);
        let beside_width = beside.as_ref().map_or(0, |view| view.width_at(height));
        let mut settings = Mp4Settings::new(beside_width + avatar_width, height, self.motion.info.rate);
        settings.sound = sound_from.map(|clip| Sound { clip, start: crate::capture::Timestamp(0) });
        let mut writer = Mp4Writer::create(&path, settings)?;

        let ticks = self.ticks();
        let mut frame = self.rig.new_frame();
        let (mut avatar, mut picture) = (Vec::new(), Vec::new());
        // One picture is drawn while the one before it is read back and encoded.
        for step in 0..=ticks.len() {
            if let Some(&index) = ticks.get(step) {
                watch.time("warp", || self.rig.pose(&self.motion.frames[index].expression, &mut frame))?;
                self.show(index, &mut stage);
                watch.time("draw", || stage.submit(&frame))?;
            }
            let Some(done) = step.checked_sub(1) else { continue };
            watch.time("read back", || stage.fetch(&mut avatar))?;
            if let Some(view) = &mut beside {
                let index = self.motion.frames[ticks[done]].index;
                let performer = watch.time("performer", || view.picture(index, [beside_width, height]))?;
                join_rows(&performer, &avatar, height, &mut picture);
                watch.time("encode", || writer.write_picture(&picture))?;
            } else {
                watch.time("encode", || writer.write_picture(&avatar))?;
            }
            progress(step as u64);
        }
        Ok(watch.time("encode", || writer.commit())?)
    }

    /// Lets the stage show the skin of a frame.
    pub(super) fn show(&self, index: usize, stage: &mut Stage) {
        if let Some(states) = self.skin.and_then(|skin| skin.states.get(index)) {
            stage.show(states);
        }
    }

    /// The indices of the frames shown at each tick of the clip's nominal rate.
    pub fn ticks(&self) -> Vec<usize> {
        let times: Vec<_> = self.motion.frames.iter().map(|frame| frame.timestamp).collect();
        constant_rate(&times, self.motion.info.rate)
    }

    /// How everything moves that the rest follows from.
    pub fn control_motion(&self) -> ControlMotion {
        let mut posed = self.rig.new_frame();
        let mut motion = ControlMotion { controls: Vec::new(), bones: Vec::new(), heads: Vec::new() };
        for frame in &self.motion.frames {
            motion.bones.push(self.rig.pose_controls(&frame.expression, &mut posed));
            let moved = &posed.controls;
            let controls = MatrixXx3::from_fn(moved.len(), |i, axis| f64::from(moved[i][axis]));
            motion.controls.push(controls);
            motion.heads.push(posed.head);
        }
        motion
    }
}

/// A take in the rig's own terms, an entry for each frame. Target's scan frame, millimetres.
pub struct ControlMotion {
    /// What multiplies the warp's columns, C × 3.
    pub controls: Vec<MatrixXx3<f64>>,
    /// The rigid parts.
    pub bones: Vec<Bones>,
    /// The head.
    pub heads: Vec<Isometry3<f64>>,
}

/// Two pictures of one height as one, row by row.
fn join_rows(left: &[u8], right: &[u8], height: u32, out: &mut Vec<u8>) {
    let rows = height.max(1) as usize;
    out.clear();
    for (left, right) in left.chunks_exact(left.len() / rows).zip(right.chunks_exact(right.len() / rows)) {
        out.extend_from_slice(left);
        out.extend_from_slice(right);
    }
}
