//! A take as few morph targets: the motion of hundreds of controls compressed to what the vertices can show.

use std::path::Path;

use nalgebra::Point3;

use super::{
    ControlMotion, HeadMode, PipelineError, Target,
    glb_parts::{AvatarParts, OwnMetres},
};
use crate::{
    capture::Timestamp,
    export::{GlbAvatar, NodeKey, compress, write_glb},
    spline::Warp,
};

/// Root mean square over frames and vertices of what the morph targets leave out, millimetres.
const TOLERANCE: f64 = 0.1;

/// What the compression achieved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlbReport {
    /// Morph targets written.
    pub morphs: usize,
    /// Root mean square error over frames and vertices, millimetres.
    pub rms: f64,
    /// The same in the worst frame.
    pub worst_frame_rms: f64,
}

/// Writes the target with its motion at `times`, spread by `warp`. Axes are the scan's own, the unit is the metre, as glTF
/// wants.
pub fn write_take_glb(
    path: &Path,
    target: &Target,
    warp: &Warp,
    times: &[Timestamp],
    moves: &ControlMotion,
    mode: HeadMode,
) -> Result<GlbReport, PipelineError> {
    let basis = compress(&warp.gram(), &moves.controls, TOLERANCE)?;
    let export = OwnMetres::of(target);
    let mut deltas = vec![[0.0_f32; 3]; warp.vertices()];
    let mut shapes = Vec::with_capacity(basis.shapes.len());
    for shape in &basis.shapes {
        let moved: Vec<[f32; 3]> =
            shape.row_iter().map(|row| [row[0] as f32, row[1] as f32, row[2] as f32]).collect();
        warp.apply(&moved, &mut deltas)?;
        shapes.push(deltas.iter().map(|delta| export.vector(*delta)).collect());
    }
    let names: Vec<String> = (1..=shapes.len()).map(|i| format!("motion{i:02}")).collect();
    let weights: Vec<Vec<f32>> =
        basis.weights.row_iter().map(|row| row.iter().map(|&weight| weight as f32).collect()).collect();
    let heads: Vec<NodeKey> = moves.heads.iter().map(|head| export.key(head, &Point3::origin())).collect();
    let parts = AvatarParts::new(target, &export, &names, &shapes, Some(&moves.bones));
    write_glb(
        path,
        &GlbAvatar {
            name: &target.scan.name,
            parts: &parts.glb_parts(),
            weights: &weights,
            times,
            head: (mode == HeadMode::Follow).then_some(heads.as_slice()),
        },
    )?;
    Ok(GlbReport { morphs: basis.shapes.len(), rms: basis.rms, worst_frame_rms: basis.worst_frame_rms })
}
