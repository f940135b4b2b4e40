//! Where the head is: camera model and head pose from the points that expressions hardly move (002 §III).

mod camera;
mod error;
mod pose;
mod procrustes;
mod response;

pub use camera::Camera;
pub use error::HeadError;
pub use pose::{HeadPose, PoseSolver};
pub use procrustes::{rigid_between, rotation_between};
pub use response::true_turn;
