//! Radial-basis splines: kernels, fitting, and the precomputed matrix that warps a mesh in one product.
//!
//! f(x) = A·\[1 x\] + Σ wᵢ U(|x − Pᵢ|) with Σ wᵢ = 0 and Σ wᵢ Pᵢᵀ = 0: chapter 4.4 of the thesis (000, eq.
//! 4.4–4.19) for thin plates, section IV of Fidaleo et al. (002, eq. 1–5) for Hardy's multiquadric and the Gaussian.
//!
//! Pure mathematics: no files, no clock, no threads, no random numbers. Points may be in any unit; the answers come
//! back in it. `docs/splines.md` holds the equations, the accuracy against VTK, SciPy and Kornia, and the timings.
//!
//! | to | use |
//! |---|---|
//! | map points once | [`Spline::fit`], [`Spline::evaluate`], [`Spline::jacobian`] |
//! | solve for many sets of values on the same centres | [`Factored::new`], [`Factored::solve`] |
//! | displace the same vertices in every frame | [`Warp::new`], [`Warp::apply`] |
//!
//! # Deliberately different from the papers
//! - 000 uses U = r² ln r² in space too. It is offered ([`Kernel::ThinPlate`]) beside U = r, the biharmonic kernel of
//!   three dimensions ([`Kernel::Linear`]), which stays calm where controls nearly touch.
//! - 002 solves Σ cᵢ h alone; here Hardy's kernel carries the affine part too, so that an affine motion comes out
//!   exactly. [`Polynomial::None`] is 002 as printed.
//! - 002 adds +λ to the diagonal. Hardy's projected kernel matrix is *negative* definite, so +λ drives it towards
//!   singularity; the sign here follows the kernel ([`Kernel::definiteness`]).
//! - Everything is solved in a centred unit box, for conditioning and so that λ can be free of scale.
//!
//! # Not covered
//! Compactly supported kernels, fast multipole sums, fitting more than a few
//! thousand centres (the system is dense), and the blending of regions, for which [`Warp::from_columns`] is the door.

mod basis;
mod error;
mod fit;
mod kernel;
mod options;
mod product;
mod unit_box;
mod warp;

pub use error::{Flatness, Input, SplineError};
pub use fit::{Factored, Spline};
pub use kernel::Kernel;
pub use options::{Options, Polynomial, Regularisation};
pub use warp::Warp;
