//! An avatar's parts as glTF wants them: each a mesh of its own in the scan's axes and metres, rigid ones about a pivot.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::Target;
use crate::{
    anatomy::{Part, PartKind},
    export::{GlbPart, MorphTarget, NodeKey},
    rig::Bones,
    scan::{Mesh, NormalSolver, Placement},
};

const METRES_PER_MILLIMETRE: f64 = 1e-3;

/// From the scan frame in millimetres to the file's own axes in metres.
pub struct OwnMetres {
    placement: Placement,
    metres_per_own: f64,
}

impl OwnMetres {
    /// For one target.
    pub fn of(target: &Target) -> Self {
        let placement = target.scan.placement;
        Self { metres_per_own: placement.scale() * METRES_PER_MILLIMETRE, placement }
    }

    /// A displacement.
    pub fn vector(&self, vector: [f32; 3]) -> [f32; 3] {
        let own = self.placement.vector_to_own(Vector3::from(vector.map(f64::from)));
        (own * self.metres_per_own).map(|v| v as f32).into()
    }

    fn point(&self, point: &Point3<f64>) -> Point3<f64> {
        self.placement.to_own(*point) * self.metres_per_own
    }

    /// A motion of the scan frame, carried to the file's own axes (P⁻¹ · M · P): the turn, and where the own place
    /// `pivot` goes, as a shift from itself.
    pub fn key(&self, motion: &Isometry3<f64>, pivot: &Point3<f64>) -> NodeKey {
        let moved = self.point(&(motion * self.placement.to_scan(pivot / self.metres_per_own)));
        let turn = UnitQuaternion::from_rotation_matrix(&self.placement.rotation());
        let rotation = turn.inverse() * motion.rotation * turn;
        NodeKey {
            translation: (moved - pivot).map(|v| v as f32).into(),
            rotation: rotation.coords.map(|v| v as f32).into(),
        }
    }
}

/// Everything that the parts of a GLB borrow from.
pub struct AvatarParts {
    parts: Vec<OwnedPart>,
}

struct OwnedPart {
    kind: PartKind,
    mesh: Mesh,
    normals: Vec<[f32; 3]>,
    morphs: Vec<MorphTarget>,
    pivot: [f32; 3],
    keys: Option<Vec<NodeKey>>,
}

impl AvatarParts {
    /// The target's parts. `shapes` are displacements of the soft vertices, own axes and metres, named by `names`, or
    /// empty where a name moves nothing;
    /// `bones` move the rigid parts, a motion for each frame, or nothing moves them.
    pub fn new(
        target: &Target,
        export: &OwnMetres,
        names: &[String],
        shapes: &[Vec<[f32; 3]>],
        bones: Option<&[Bones]>,
    ) -> Self {
        let parts = target.anatomy.parts.iter().map(|part| {
            let mut mesh = target.anatomy.mesh.stretch(&part.vertices, &part.triangles);
            for position in &mut mesh.positions {
                *position = export.point(position);
            }
            let normals = NormalSolver::once(&mesh.triangles, &mesh.positions_f32());
            let is_soft = matches!(part.kind, PartKind::Skin | PartKind::Cavity);
            let morphs = if is_soft { morphs(part, names, shapes) } else { Vec::new() };
            let pivot = pivot(target, part.kind).map_or_else(Point3::origin, |pivot| export.point(&pivot));
            let moves = !matches!(part.kind, PartKind::Skin | PartKind::Cavity | PartKind::UpperTeeth);
            let keys = bones
                .filter(|_| moves)
                .map(|bones| bones.iter().map(|bones| export.key(&bones.of(part.kind), &pivot)).collect());
            OwnedPart { kind: part.kind, mesh, normals, morphs, pivot: pivot.map(|v| v as f32).into(), keys }
        });
        Self { parts: parts.collect() }
    }

    /// As the writer takes them, the skin first.
    pub fn glb_parts(&self) -> Vec<GlbPart<'_>> {
        self.parts
            .iter()
            .map(|part| GlbPart {
                name: part.kind.name(),
                mesh: &part.mesh,
                normals: &part.normals,
                morphs: &part.morphs,
                pivot: part.pivot,
                keys: part.keys.as_deref(),
            })
            .collect()
    }
}

fn morphs(part: &Part, names: &[String], shapes: &[Vec<[f32; 3]>]) -> Vec<MorphTarget> {
    let named = names.iter().zip(shapes);
    named
        .map(|(name, shape)| MorphTarget {
            name: name.clone(),
            deltas: shape.get(part.vertices.clone()).unwrap_or_default().to_vec(),
        })
        .collect()
}

/// What a rigid part turns about, scan frame.
fn pivot(target: &Target, kind: PartKind) -> Option<Point3<f64>> {
    match kind {
        PartKind::Skin | PartKind::Cavity | PartKind::UpperTeeth => None,
        PartKind::LowerTeeth | PartKind::Tongue => target.anatomy.jaw.map(|jaw| jaw.pivot),
        PartKind::Eye(side) => target.anatomy.eye(side).map(|eye| eye.centre),
    }
}
