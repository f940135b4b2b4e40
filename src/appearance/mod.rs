//! The look of the skin, which landmarks do not tell: wrinkles and lids, after 002 §V.
//!
//! `docs/appearance.md` shows it, `docs/benchmarks/appearance.md` says how well it is told.

mod region;
mod states;

pub use region::{Detail, REGION_COUNT, Region};
pub use states::AppearanceStates;
