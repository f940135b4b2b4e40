//! A take as few morph targets: the motion of hundreds of controls compressed to what the vertices can show.

use std::path::Path;

use nalgebra::Point3;

use super::{
    ControlMotion, HeadMode, PipelineError, SkinRelief, Target,
    glb_parts::{AvatarParts, OwnMetres},
};
use crate::{
    appearance::{AppearanceStates, Region},
    capture::Timestamp,
    export::{GlbAvatar, NodeKey, compress, write_glb},
    scan::NormalSolver,
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

/// How living skin plays over a take.
#[derive(Debug, Clone, Copy)]
pub struct SkinCurves<'a> {
    /// One for each of the take's times.
    pub states: &'a [AppearanceStates],
    /// What of it moves vertices.
    pub relief: &'a SkinRelief,
}

impl SkinCurves<'_> {
    /// The regions that ever have a state, each with its curve; what cannot be told is neutral.
    fn curves(&self) -> impl Iterator<Item = (Region, Vec<f32>)> {
        let told = |region: &Region| self.states.iter().any(|states| states.get(*region).is_some());
        Region::ALL.into_iter().filter(told).map(|region| {
            (region, self.states.iter().map(|states| states.get(region).unwrap_or(0.0)).collect())
        })
    }
}

/// Writes the target with its motion at `times`, spread by `warp`. Axes are the scan's own, the unit is the metre, as glTF
/// wants. The states of living skin become morph targets by the names of their curves, by which engines blend wrinkle maps;
/// they move what the relief moves, often nothing.
pub fn write_take_glb(
    path: &Path,
    target: &Target,
    warp: &Warp,
    times: &[Timestamp],
    moves: &ControlMotion,
    mode: HeadMode,
    skin: Option<SkinCurves>,
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
    let mut names: Vec<String> = (1..=shapes.len()).map(|i| format!("motion{i:02}")).collect();
    let mut weights: Vec<Vec<f32>> =
        basis.weights.row_iter().map(|row| row.iter().map(|&weight| weight as f32).collect()).collect();
    let normals = skin.map(|_| {
        let mesh = &target.anatomy.mesh;
        NormalSolver::once(&mesh.triangles, &mesh.positions_f32())
    });
    for (skin, normals) in skin.iter().zip(&normals) {
        for (region, curve) in skin.curves() {
            names.push(region.curve());
            let raised = skin.relief.deltas(region, normals, warp.vertices());
            shapes.push(raised.into_iter().map(|delta| export.vector(delta)).collect());
            for (row, state) in weights.iter_mut().zip(curve) {
                row.push(state);
            }
        }
    }
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
