//! A source face tied to a target: displacements of the source's handles in, the warp's columns out.

use nalgebra::{Point3, Vector3};

use super::{Bones, Driver, LipDrive, Method, Puppet, RigError, SourceFace, TargetFace, Transfer, WarpKind};
use crate::{actions::Catalogue, anatomy::Anatomy, lift::Eyes, scan::Surface, tracking::SKIN_LANDMARK_COUNT};

/// What performer, action library and muscles have in common.
#[derive(Debug, Clone)]
pub struct Drive {
    /// The target, as something that moves.
    pub puppet: Puppet,
    /// From the source's handles to the target's.
    pub transfer: Transfer,
    /// The lips' drive, where the target's lips part.
    pub lips: Option<LipDrive>,
}

impl Drive {
    /// `anatomy` is the target's mesh, opened or as scanned, `surface` the scan's own, both in the scan frame and
    /// millimetres.
    pub fn new(
        source: &SourceFace,
        target: &TargetFace,
        anatomy: &Anatomy,
        surface: &Surface,
        method: Method,
    ) -> Result<Self, RigError> {
        let transfer = Transfer::new(source, target, method.rule)?;
        let carried = |landmark: usize| Some(transfer.place(landmark));
        let placed = Catalogue::get().place(&target.landmarks, surface);
        // A point whose landmarks were not found comes over from the source and onto the surface (000 §5.6.1).
        let points: Vec<Option<Point3<f64>>> = (SKIN_LANDMARK_COUNT..source.points.len())
            .map(|handle| placed[handle].or_else(|| Some(surface.nearest(transfer.place(handle))?.position)))
            .collect();
        let puppet = Puppet::new(target, anatomy, surface, &carried, &points, method.warp)?;
        let opens = method.warp != WarpKind::Regions;
        let lips = anatomy.mouth.as_ref().filter(|_| opens).map(|mouth| LipDrive::new(source, target, mouth));
        Ok(Self { puppet, transfer, lips })
    }

    /// Moves controls and bones. `vectors` has a displacement for each of the source's handles, in its scan frame and
    /// millimetres; `camera` is where they were seen from, on the target, unless they were measured in space.
    pub fn controls(
        &self,
        vectors: &[Vector3<f64>],
        eyes: &Eyes,
        camera: Option<&Point3<f64>>,
        out: &mut [[f32; 3]],
    ) -> Bones {
        let lips = self.lips.as_ref().map(|lips| (lips, lips.wishes(&self.transfer, vectors)));
        let moved = |driver: Driver| match driver {
            Driver::Landmark(landmark) => self.transfer.vector(landmark, &vectors[landmark]),
            Driver::Point(point) => {
                let handle = SKIN_LANDMARK_COUNT + point;
                self.transfer.vector(handle, &vectors[handle])
            }
            Driver::Rim { node, lower } => lips
                .as_ref()
                .map_or_else(Vector3::zeros, |(lips, wishes)| lips.rims(node, wishes)[usize::from(lower)]),
            Driver::Skull => Vector3::zeros(),
        };
        let freedom = |driver: Driver| match driver {
            Driver::Rim { node, .. } => {
                lips.as_ref().map_or(1.0, |(lips, wishes)| lips.freedom(node, wishes))
            }
            Driver::Landmark(_) | Driver::Point(_) | Driver::Skull => 1.0,
        };
        self.puppet.fill(moved, freedom, eyes, camera, out)
    }
}
