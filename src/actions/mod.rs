//! Action units: which there are, where their control points lie, and what each does to an average face.
//!
//! 000 §5.5, the modelling phase. Muscle and wrinkle control points are placed relative to landmarks (§5.5.1–5.5.2,
//! `catalogue.toml`), carried from a neutral scan to an expressive one, and the difference is the action (§5.5.3,
//! eq. 5.6). Different here: the vectors of many pairs are averaged on an average face, as §7.1 proposes; the network's
//! 468 landmarks are handles beside the control points; on scans of one topology, points are carried by the mesh itself.

mod author;
mod catalogue;
mod error;
mod library;
mod merge;
mod score;
mod score_read;
mod stray;
mod unit;
mod weights;

pub use author::{Expressive, Measured, measure, measure_moved};
pub use catalogue::{ActionFacts, Catalogue, ControlPoint, Emotion, FaceRegion};
pub use error::ActionError;
pub use library::{Action, ActionLibrary, ActionVector};
pub use merge::{MOST_PULLS, Merge, merge};
pub use score::Score;
pub use stray::stray_landmarks;
pub use unit::ActionKey;
pub use weights::ActionWeights;
