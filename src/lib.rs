//! understudy: a performer drives a scanned 3D face.
//!
//! One direction: a frame enters at the top of this list and leaves at the bottom; no module imports one that
//! stands below it. `docs/architecture.md` is the map.

pub mod anatomy;
pub mod assets;
pub mod capture;
mod rows;
pub mod tracking;

pub mod head;
pub mod lift;

pub mod scan;
pub mod spline;

pub mod actions;

pub mod deform;

pub mod grid;
pub mod rig;

pub mod muscle;

pub mod appearance;

pub mod export;
pub mod view;

pub mod wire;

pub mod compare;

pub mod pipeline;
