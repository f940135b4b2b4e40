//! Motion spread over a surface: the warp that knows which skin is joined to which.
//!
//! 000 §5.6.2 spreads the motion of control points through space, so that one lip drags the other along. Here it is
//! spread over the mesh: the smoothest displacement of the surface that moves its handles as asked. Lips that have been
//! cut, lids and nostrils are far apart on the surface however near they lie in space. No paper of the three has this;
//! `docs/transfer.md` gives the equations and what it gains.

mod error;
mod laplacian;
mod surface_warp;

pub use error::DeformError;
pub use laplacian::SurfaceLaplacian;
pub use surface_warp::{Handle, Stiffness, SurfaceWarp};
