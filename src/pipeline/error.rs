//! Every error of the stages, for those who join them.

use crate::{
    appearance::AppearanceError,
    assets::AssetError,
    capture::CaptureError,
    export::{ExportError, MorphBasisError},
    grid::GridError,
    lift::LiftError,
    muscle::MuscleError,
    rig::RigError,
    scan::ScanError,
    spline::SplineError,
    tracking::TrackingError,
    view::ViewError,
};

/// A stage's error, or one of joining them.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The assets that `make setup` brings.
    #[error(transparent)]
    Asset(#[from] AssetError),
    /// Frames in.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// Landmarks.
    #[error(transparent)]
    Tracking(#[from] TrackingError),
    /// Pose and lifting.
    #[error(transparent)]
    Lift(#[from] LiftError),
    /// Scans.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// Splines.
    #[error(transparent)]
    Spline(#[from] SplineError),
    /// Transfer and warp.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// Muscles.
    #[error(transparent)]
    Muscle(#[from] MuscleError),
    /// Skins.
    #[error(transparent)]
    Appearance(#[from] AppearanceError),
    /// Files out.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A folder that cannot be made.
    #[error("{}: {source}. Name a folder that can be written to", path.display())]
    Folder {
        /// Which.
        path: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The canonical face does not carry the regions of the skin, or the performer's face has no extent.
    #[error(
        "the face has no place for the regions of the skin. Remove the canonical face and run `make setup`"
    )]
    NoSampler,
    /// A scan that cannot be gridded.
    #[error("{scan}: {source}")]
    Grid {
        /// The scan.
        scan: std::path::PathBuf,
        /// Why.
        source: GridError,
    },
    /// Scans that have no average.
    #[error("the scans have no average: {source}")]
    Average {
        /// Why.
        source: GridError,
    },
    /// Compression to morph targets.
    #[error(transparent)]
    MorphBasis(#[from] MorphBasisError),
    /// Pictures.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The canonical face is not what this program was built for.
    #[error("the canonical face {path} cannot be used: {reason}. Remove it and run `make setup`")]
    CanonicalFace {
        /// The file.
        path: std::path::PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// No face on a scan.
    #[error(
        "no face was found on {scan}, whichever way it was turned. Check with `understudy render {scan} -o look.png` \
         what it shows, or give its landmarks with --landmarks FILE (.json, .pts or .ljson with 68 or 478 points)"
    )]
    NoFaceOnScan {
        /// The scan.
        scan: std::path::PathBuf,
    },
    /// A landmark file with another number of points.
    #[error(
        "{path} holds {found} landmarks; a target needs 478 (this program's), 468 (MediaPipe's) or 68 (iBUG's)"
    )]
    LandmarkCount {
        /// The file.
        path: std::path::PathBuf,
        /// Points found.
        found: usize,
    },
    /// Nothing to bake skin into.
    #[error(
        "{scan} has no texture of its own, and wrinkle maps are textures. Leave --bake out: films and pictures show the \
         wrinkles on vertex colours too, and a .glb holds their curves"
    )]
    NoSkinTexture {
        /// The scan's name.
        scan: String,
    },
    /// A stage's thread ended without saying why.
    #[error("the {stage} stage stopped unexpectedly; please report this with the command that was run")]
    StageLost {
        /// Which.
        stage: &'static str,
    },
}
