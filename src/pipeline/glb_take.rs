//! A take as few morph targets: the motion of hundreds of controls compressed to what the vertices can show.

use std::path::Path;

use nalgebra::{Isometry3, MatrixXx3, Vector3};

use super::{HeadMode, Motion, PipelineError, Target};
use crate::{
    capture::Timestamp,
    export::{GlbAvatar, GlbPart, MorphTarget, NodeKey, compress, write_glb},
    rig::Rig,
    scan::{Mesh, NormalSolver},
};

/// Root mean square over frames and vertices of what the morph targets leave out, millimetres.
const TOLERANCE: f64 = 0.1;
const METRES_PER_MILLIMETRE: f64 = 1e-3;

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

/// Writes the target with the take's motion. Axes are the scan's own, the unit is the metre, as glTF wants.
pub fn write_take_glb(
    path: &Path,
    target: &Target,
    rig: &Rig,
    motion: &Motion,
    controls: &[MatrixXx3<f64>],
    heads: &[Isometry3<f64>],
    mode: HeadMode,
) -> Result<GlbReport, PipelineError> {
    let basis = compress(&rig.warp().gram(), controls, TOLERANCE)?;
    let placement = &target.scan.placement;
    // From the scan frame in millimetres to the file's own axes in metres.
    let metres_per_own = placement.scale() * METRES_PER_MILLIMETRE;
    let vector = |v: Vector3<f64>| placement.vector_to_own(v) * metres_per_own;

    let mut deltas = vec![[0.0_f32; 3]; rig.warp().vertices()];
    let mut morphs = Vec::with_capacity(basis.shapes.len());
    for (i, shape) in basis.shapes.iter().enumerate() {
        let moved: Vec<[f32; 3]> =
            shape.row_iter().map(|row| [row[0] as f32, row[1] as f32, row[2] as f32]).collect();
        rig.warp().apply(&moved, &mut deltas)?;
        let deltas = deltas.iter().map(|d| vector(Vector3::from(d.map(f64::from))).map(|v| v as f32).into());
        morphs.push(MorphTarget { name: format!("motion{:02}", i + 1), deltas: deltas.collect() });
    }
    let weights: Vec<Vec<f32>> =
        basis.weights.row_iter().map(|row| row.iter().map(|&weight| weight as f32).collect()).collect();
    let times: Vec<Timestamp> = motion.frames.iter().map(|frame| frame.timestamp).collect();
    let keys: Vec<NodeKey> = heads.iter().map(|head| head_key(head, target, metres_per_own)).collect();

    let mesh = own_mesh_in_metres(target, metres_per_own);
    let positions = mesh.positions_f32();
    let normals = NormalSolver::once(&mesh.triangles, &positions);
    let face = GlbPart {
        name: "face",
        mesh: &mesh,
        normals: &normals,
        morphs: &morphs,
        pivot: [0.0; 3],
        keys: None,
    };
    write_glb(
        path,
        &GlbAvatar {
            name: &target.scan.name,
            parts: &[face],
            weights: &weights,
            times: &times,
            head: (mode == HeadMode::Follow).then_some(keys.as_slice()),
        },
    )?;
    Ok(GlbReport { morphs: morphs.len(), rms: basis.rms, worst_frame_rms: basis.worst_frame_rms })
}

fn own_mesh_in_metres(target: &Target, metres_per_own: f64) -> Mesh {
    let mut mesh = target.mesh().clone();
    for position in &mut mesh.positions {
        *position = target.scan.placement.to_own(*position) * metres_per_own;
    }
    mesh
}

/// The head's motion, carried from the scan frame to the file's own axes: P⁻¹ · M · P.
fn head_key(head: &Isometry3<f64>, target: &Target, metres_per_own: f64) -> NodeKey {
    let placement = &target.scan.placement;
    let origin = placement.to_scan(nalgebra::Point3::origin());
    let translation = placement.to_own(head * origin).coords * metres_per_own;
    let turn = nalgebra::UnitQuaternion::from_rotation_matrix(&placement.rotation());
    let rotation = turn.inverse() * head.rotation * turn;
    NodeKey {
        translation: translation.map(|v| v as f32).into(),
        rotation: rotation.coords.map(|v| v as f32).into(),
    }
}
