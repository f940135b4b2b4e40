//! A solved clip as a take of markers on a basis' face.

use super::{Motion, PipelineError};
use crate::{
    lift::FaceState,
    muscle::{MarkerSeat, MuscleBasis, MuscleError, SeatedTake, Training},
    rig::{SourceFace, TargetFace, Transfer, TransferRule},
    tracking::{LandmarkState, SKIN_LANDMARK_COUNT},
};

/// All 468 landmarks of a clip as markers, their displacements carried from the performer's face to that of `basis` by the
/// landmark spline. Landmarks that a frame does not observe are not seen in it.
pub fn motion_markers(motion: &Motion, basis: &MuscleBasis) -> Result<SeatedTake, PipelineError> {
    let performer = SourceFace::performer(&motion.performer);
    let transfer = TargetFace::of_source(&SourceFace::average(&basis.face))
        .and_then(|target| Transfer::new(&performer, &target, TransferRule::Spline))
        .map_err(MuscleError::from)?;
    let frames = motion.frames.iter().map(|frame| {
        let moved = &frame.expression.displacements;
        let seen = frame.state == FaceState::Tracking;
        let one = |landmark: usize| {
            let observed = seen && moved.states.get(landmark) == Some(&LandmarkState::Observed);
            observed.then(|| transfer.vector(landmark, &moved.vectors[landmark]))
        };
        (0..SKIN_LANDMARK_COUNT).map(one).collect()
    });
    Ok(SeatedTake {
        names: (0..SKIN_LANDMARK_COUNT).map(|landmark| format!("landmark {landmark}")).collect(),
        seats: MarkerSeat::landmarks(),
        training: Training { frames: frames.collect(), rate: motion.info.rate.per_second() },
        alignment: None,
        stilled: true,
    })
}
