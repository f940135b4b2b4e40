//! From the performer's displacements to the target's vertices.
//!
//! Follows 000 §5.6: control points are carried from source to target by the landmark spline and snapped to the
//! surface, their displacements are transferred, and a spline through them warps the mesh. Different here: the source's
//! motion is measured, not modelled; the vectors' rule is the spline's own (`transfer`), with the thesis's beside it;
//! the warp's kernel is r, the biharmonic one of space, which stays local where lips nearly touch; both are multiplied
//! out before the first frame.

mod action_rig;
mod action_solver;
mod avatar;
mod controls;
mod drive;
mod error;
mod lips;
mod method;
mod points;
mod puppet;
mod regions;
mod skin;
mod source;
mod spread;
mod target;
mod teeth_guard;
mod transfer;

pub use action_rig::{ActionRig, facing};
pub use action_solver::ActionSolver;
pub use avatar::{DriveMode, Rig};
pub use controls::{Controls, Driver};
pub use error::RigError;
pub use lips::LipDrive;
pub use method::{Method, TransferRule, WarpKind};
pub use puppet::{AvatarFrame, Bones, Puppet};
pub use source::SourceFace;
pub use target::TargetFace;
pub use transfer::Transfer;
