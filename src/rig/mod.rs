//! From a source's displacements, a performer's or a library's of action units, to the target's vertices.
//!
//! Follows 000 §5.6: control points are placed on the target, their displacements are transferred, and a warp through them
//! moves the mesh. Different here: the vectors' rule is the landmark spline's own (`transfer`) and the warp spreads over
//! the surface (`spread`), with the thesis's beside both (`method`); all is multiplied out before the first frame.

mod action_rig;
mod action_solver;
mod avatar;
mod controls;
mod drive;
mod error;
mod lips;
mod method;
mod motor;
mod points;
mod puppet;
mod regions;
mod skin;
mod source;
mod spread;
mod target;
mod teeth_guard;
mod transfer;
mod volume;

pub use action_rig::{ActionRig, facing};
pub use action_solver::ActionSolver;
pub use avatar::{DriveMode, Rig};
pub use controls::{Controls, Driver};
pub use drive::Drive;
pub use error::RigError;
pub use lips::LipDrive;
pub use method::{Method, TransferRule, WarpKind};
pub use motor::Motor;
pub use puppet::{AvatarFrame, Bones, Puppet};
pub use source::SourceFace;
pub(crate) use target::PIVOT_DEPTH;
pub use target::TargetFace;
pub use transfer::Transfer;
pub use volume::{TRACKED_18, VolumeMorph, VolumePoints};
