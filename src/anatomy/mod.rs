//! A raw scan made able to perform: lips that part, a mouth behind them, a jaw, lids, eyes that look.
//!
//! A scan is one closed skin. It is cut open along the lips and around the eyes, and what a scanner does not see is
//! added: cavity, teeth, tongue, eyeballs. The scan's own vertices keep their order; those of the cuts follow, then
//! those of the added parts. Built once for a target, whatever the performer; `docs/anatomy.md` shows it.
//!
//! What the published methods leave out: 000 §7.2 names the missing tongue and jaw as what keeps expressions with an
//! open mouth out of its results, 001 turns the jaw but leaves lips and lids to the model's author.

mod atlas;
mod disjoint;
mod distances;
mod edit;
mod eye_hole;
mod eyeball;
mod face_spline;
mod frame;
mod front_view;
mod interior;
mod jaw;
mod join;
mod lids;
mod lip_line;
mod lip_sides;
mod lips;
mod model;
mod mouth;
mod outline;
mod part;
mod prepare;
mod regions;
mod sides;
mod slit;

pub use eye_hole::EyeFault;
pub use face_spline::{alike_pairs, face_spline};
pub use frame::FaceFrame;
pub use front_view::FrontView;
pub use interior::{Hanging, RingPoint};
pub use jaw::{Jaw, JawPose};
pub use lids::{CLOSURES, LidShapes, shares as lid_shares};
pub use lip_sides::{Lip, SidedSkin, SkinPlace};
pub use lips::LipFault;
pub use model::{Anatomy, Eye, Mouth, Omission, Part, PartKind, RimNode, RimVertex};
pub use regions::{
    BETWEEN_JAW_AND_SKULL, CHIN, CORNERS, EyeLandmarks, INNER_CORNERS, LOWER_INNER, LOWER_LIP, ON_JAW,
    OUTER_CORNERS, UPPER_INNER, UPPER_LIP, eye_landmarks,
};
pub use slit::SlitFault;
