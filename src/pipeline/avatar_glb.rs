//! A prepared scan without a performer: as a GLB whose morph targets open it, and as a sheet of pictures.

use std::path::Path;

use image::RgbaImage;

use super::{
    HeadMode, PipelineError, Stage, Target,
    glb_parts::{AvatarParts, OwnMetres},
};
use crate::{
    anatomy::JawPose,
    export::{GlbAvatar, write_glb},
    lift::{EyeState, Eyes},
    rig::{Puppet, TargetFace, WarpKind},
    view::{Gpu, Look, Smoothing, contact_sheet},
};

/// Radians of the jaw at weight 1: a mouth wide open.
const WIDE: f64 = 0.35;
/// Pixels of the sheet's pictures.
const SIDE: u32 = 480;
/// A look to the side and up, radians.
const ASIDE: f64 = 0.4;

/// A named thing that a prepared scan can do.
struct Act {
    name: &'static str,
    jaw: JawPose,
    eyes: Eyes,
}

fn jaw(opening: f64, swing: f64, protrusion: f64) -> JawPose {
    JawPose { opening, swing, protrusion }
}

fn eyes(right: f64, left: f64, yaw: f64) -> Eyes {
    let eye = |closure| EyeState { closure, yaw, pitch: 0.0 };
    Eyes { right: eye(right), left: eye(left) }
}

/// Morph targets, by ARKit's names.
fn morphs() -> [Act; 8] {
    let still = Eyes::default();
    let shut = JawPose::default();
    [
        Act { name: "jawOpen", jaw: jaw(WIDE, 0.0, 0.0), eyes: still },
        Act { name: "jawForward", jaw: jaw(0.0, 0.0, 6.0), eyes: still },
        Act { name: "jawLeft", jaw: jaw(0.0, 0.1, 0.0), eyes: still },
        Act { name: "jawRight", jaw: jaw(0.0, -0.1, 0.0), eyes: still },
        Act { name: "eyeBlinkLeft", jaw: shut, eyes: eyes(0.0, 1.0, 0.0) },
        Act { name: "eyeBlinkRight", jaw: shut, eyes: eyes(1.0, 0.0, 0.0) },
        Act { name: "eyeWideLeft", jaw: shut, eyes: eyes(0.0, -0.35, 0.0) },
        Act { name: "eyeWideRight", jaw: shut, eyes: eyes(-0.35, 0.0, 0.0) },
    ]
}

/// The target as a puppet that no performer moves.
fn puppet(target: &Target) -> Result<Puppet, PipelineError> {
    let face = TargetFace::new(target.landmarks.clone(), nalgebra::Rotation3::identity())?;
    Ok(Puppet::new(&face, &target.anatomy, &target.surface, &|_| None, &[], WarpKind::Spline)?)
}

/// Writes the prepared target with its parts as nodes and what it can do as morph targets.
///
/// Teeth and tongue are nodes of their own with the jaw's pivot, the eyes with their centres: who animates by hand turns
/// them beside the morph targets.
pub fn write_avatar_glb(path: &Path, target: &Target) -> Result<(), PipelineError> {
    let puppet = puppet(target)?;
    let export = OwnMetres::of(target);
    let mut frame = puppet.new_frame();
    let (mut names, mut shapes) = (Vec::new(), Vec::new());
    for act in morphs() {
        puppet.act(&act.jaw, &act.eyes, &mut frame)?;
        let moved = frame.positions.iter().zip(puppet.rest()).take(puppet.warp().vertices());
        let shape: Vec<[f32; 3]> =
            moved.map(|(p, rest)| export.vector(std::array::from_fn(|k| p[k] - rest[k]))).collect();
        if shape.iter().flatten().any(|value| value.abs() > 1e-6) {
            names.push(act.name.to_owned());
            shapes.push(shape);
        }
    }
    write_shapes(path, target, &export, &names, &shapes)
}

/// Writes a target with its parts as nodes and named shapes of its skin, in metres, as morph targets.
pub(super) fn write_shapes(
    path: &Path,
    target: &Target,
    export: &OwnMetres,
    names: &[String],
    shapes: &[Vec<[f32; 3]>],
) -> Result<(), PipelineError> {
    let parts = AvatarParts::new(target, export, names, shapes, None);
    let name = &target.scan.name;
    let avatar = GlbAvatar { name, parts: &parts.glb_parts(), weights: &[], times: &[], head: None };
    Ok(write_glb(path, &avatar)?)
}

/// Pictures of the prepared target: at rest, jaw open, shut eyes, a wink, a look to either side.
pub fn expression_sheet(gpu: &Gpu, target: &Target) -> Result<RgbaImage, PipelineError> {
    let puppet = puppet(target)?;
    let level = nalgebra::Rotation3::identity();
    let mut stage =
        Stage::new(gpu, target, &level, [SIDE; 2], Look::default(), HeadMode::Still, Smoothing::Samples4)?;
    let still = JawPose::default();
    let open = Eyes::default();
    let acts = [
        Act { name: "as scanned", jaw: still, eyes: open },
        Act { name: "mouth half open", jaw: jaw(0.4 * WIDE, 0.0, 0.0), eyes: open },
        Act { name: "mouth open", jaw: jaw(WIDE, 0.0, 0.0), eyes: open },
        Act { name: "eyes shut", jaw: still, eyes: eyes(1.0, 1.0, 0.0) },
        Act { name: "left wink", jaw: still, eyes: eyes(0.0, 1.0, 0.0) },
        Act { name: "half shut", jaw: still, eyes: eyes(0.5, 0.5, 0.0) },
        Act { name: "looks left", jaw: still, eyes: eyes(0.0, 0.0, ASIDE) },
        Act { name: "looks right", jaw: still, eyes: eyes(0.0, 0.0, -ASIDE) },
    ];
    let mut frame = puppet.new_frame();
    let mut pictures = Vec::new();
    for act in &acts {
        puppet.act(&act.jaw, &act.eyes, &mut frame)?;
        pictures.push((stage.picture(&frame)?, act.name));
    }
    let cells: Vec<_> = pictures.iter().map(|(picture, name)| (picture, *name)).collect();
    Ok(contact_sheet(&cells, 4))
}
