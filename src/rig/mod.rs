//! From the performer's displacements to the target's vertices.
//!
//! Follows 000 §5.6: control points are carried from source to target by the landmark spline and snapped to the
//! surface, their displacements are transferred, and a spline through them warps the mesh. Different here: the source's
//! motion is measured, not modelled; the vectors' rule is the spline's own (`transfer`), with the thesis's beside it;
//! the warp's kernel is r, the biharmonic one of space, which stays local where lips nearly touch; both are multiplied
//! out before the first frame.

mod avatar;
mod controls;
mod error;
mod lips;
mod puppet;
mod regions;
mod skin;
mod target;
mod transfer;

pub use avatar::Rig;
pub use controls::{Controls, Driver, Lip};
pub use error::RigError;
pub use lips::LipDrive;
pub use puppet::{AvatarFrame, Bones, Puppet};
pub use target::TargetFace;
pub use transfer::{Transfer, TransferRule};
