//! Recordings of Live Link Face: ARKit's 52 shapes and nine angles as CSV.
//!
//! Axes and signs of the angles are those of a recording at hand (4030 frames): of `LeftEyeYaw` against
//! `EyeLookInLeft − EyeLookOutLeft` the slope is +0.607, of `RightEyeYaw` against In − Out of the right eye −0.603, so
//! that both grow as the eyes turn to the subject's right; of both pitches against Down − Up it is +0.556, so that they
//! grow downwards. The head's angles are 0 throughout that recording; they follow from the same change of axes, which
//! turns ARKit's into Unreal's: yaw to the subject's right, pitch downwards, roll towards the subject's left shoulder.

use std::f64::consts::PI;

use nalgebra::{Rotation3, Vector3};

use super::{
    Channel, CurveFrame, MuscleCurves, MuscleError, TimecodeBase, curves::mean_rate, curves_csv::number,
    timecode::Timecode,
};
use crate::{
    capture::Timestamp,
    head::HeadPose,
    lift::{EyeState, Eyes, FaceState},
    rows::{Lines, quoted},
};

/// ARKit's shapes in the order of the file; there they begin with a capital letter.
#[rustfmt::skip]
pub const ARKIT_SHAPES: [&str; 52] = [
    "eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeSquintLeft", "eyeWideLeft",
    "eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight", "eyeSquintRight",
    "eyeWideRight", "jawForward", "jawRight", "jawLeft", "jawOpen", "mouthClose", "mouthFunnel", "mouthPucker",
    "mouthRight", "mouthLeft", "mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight",
    "mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight", "mouthRollLower", "mouthRollUpper",
    "mouthShrugLower", "mouthShrugUpper", "mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft",
    "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight", "browDownLeft", "browDownRight", "browInnerUp",
    "browOuterUpLeft", "browOuterUpRight", "cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft",
    "noseSneerRight", "tongueOut",
];

/// The angles that stand after the shapes.
#[rustfmt::skip]
pub const LIVE_LINK_ANGLES: [&str; 9] = [
    "HeadYaw", "HeadPitch", "HeadRoll", "LeftEyeYaw", "LeftEyePitch", "LeftEyeRoll", "RightEyeYaw", "RightEyePitch",
    "RightEyeRoll",
];

const REMEDY: &str = "Record it again, or copy it again from the device";

/// How head and eyes are turned: yaw, pitch and roll of each, radians. Yaw grows to the subject's right, pitch
/// downwards, roll towards the subject's left shoulder.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FaceAngles {
    /// Since the camera was looked at straight.
    pub head: [f64; 3],
    /// Within the head.
    pub left_eye: [f64; 3],
    /// Within the head.
    pub right_eye: [f64; 3],
}

impl FaceAngles {
    /// Of a tracked face: the head towards the camera, the eyes since the neutral, without roll.
    pub fn of(pose: &HeadPose, eyes: &Eyes) -> Self {
        // The camera's y and z point against those of a face that looks into it.
        let facing = Rotation3::from_axis_angle(&Vector3::x_axis(), PI);
        let eye = |eye: &EyeState| [-eye.yaw, -eye.pitch, 0.0];
        Self {
            head: Self::of_turn(&(facing * pose.rotation)),
            left_eye: eye(&eyes.left),
            right_eye: eye(&eyes.right),
        }
    }

    /// Yaw, pitch and roll of a turn in the scan frame (+X to the subject's left, +Y up, +Z out of the face), rolled
    /// first and yawed last.
    pub fn of_turn(turn: &Rotation3<f64>) -> [f64; 3] {
        let m = turn.matrix();
        let left = m[(0, 2)].atan2(m[(2, 2)]);
        let down = (-m[(1, 2)]).clamp(-1.0, 1.0).asin();
        let to_right_shoulder = m[(1, 0)].atan2(m[(1, 1)]);
        [-left, down, -to_right_shoulder]
    }

    /// The head's turn in the scan frame, of which [`FaceAngles::of_turn`] tells the angles.
    pub fn head_turn(&self) -> Rotation3<f64> {
        let [right, down, to_left_shoulder] = self.head;
        let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
        turn(Vector3::y_axis(), -right)
            * turn(Vector3::x_axis(), down)
            * turn(Vector3::z_axis(), -to_left_shoulder)
    }

    /// Where the eyes look; of the lids nothing is told.
    pub fn eyes(&self) -> Eyes {
        let eye = |[yaw, pitch, _]: [f64; 3]| EyeState { closure: 0.0, yaw: -yaw, pitch: -pitch };
        Eyes { right: eye(self.right_eye), left: eye(self.left_eye) }
    }

    /// `share` of the way from `self` to `other`.
    #[must_use]
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let (from, to) = (self.row(), other.row());
        Self::from_row(std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share))
    }

    /// As a mirror shows them: left and right exchanged.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let mirror = |[yaw, pitch, roll]: [f64; 3]| [-yaw, pitch, -roll];
        Self { head: mirror(self.head), left_eye: mirror(self.right_eye), right_eye: mirror(self.left_eye) }
    }

    /// In the order of [`LIVE_LINK_ANGLES`].
    pub fn row(&self) -> [f64; 9] {
        let [a, b, c] = [self.head, self.left_eye, self.right_eye];
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    fn from_row([a, b, c, d, e, f, g, h, i]: [f64; 9]) -> Self {
        Self { head: [a, b, c], left_eye: [d, e, f], right_eye: [g, h, i] }
    }
}

/// What a recording of Live Link Face holds beside its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveLinkExtras {
    /// One a frame.
    pub angles: Vec<FaceAngles>,
    /// What its timecodes count from.
    pub base: TimecodeBase,
}

/// Whether a header is that of Live Link Face; newer versions write its second column otherwise.
pub(super) fn is_header(header: &[String]) -> bool {
    ["Timecode", "BlendShapeCount"].iter().all(|name| find(header, name).is_some())
}

fn find(header: &[String], name: &str) -> Option<usize> {
    header.iter().position(|cell| cell.eq_ignore_ascii_case(name))
}

/// Reads the rows below `header`; columns are found by name in any order, shapes that are not there are absent.
///
/// A row whose count is 0 shows no face: it keeps what the one before it had.
pub(super) fn read(
    mut lines: Lines<'_>,
    header: &[String],
) -> Result<(MuscleCurves, LiveLinkExtras), MuscleError> {
    let number_of_header = lines.number();
    let missing = |lines: &Lines<'_>, name: &str| {
        lines.whole_fault(format!("line {number_of_header} does not name {name}"), REMEDY)
    };
    let mut columns = header.iter().map(|name| name.to_ascii_lowercase()).collect::<Vec<_>>();
    columns.sort();
    if let Some([twice, _]) = columns.array_windows().find(|[name, next]| name == next) {
        let reason = format!("line {number_of_header} names {} twice", quoted(twice));
        return Err(lines.whole_fault(reason, REMEDY).into());
    }
    let time = find(header, "Timecode").ok_or_else(|| missing(&lines, "Timecode"))?;
    let count = find(header, "BlendShapeCount").ok_or_else(|| missing(&lines, "BlendShapeCount"))?;
    let shapes = ARKIT_SHAPES.map(|name| find(header, name));
    if shapes.iter().all(Option::is_none) {
        return Err(missing(&lines, "any of the 52 shapes").into());
    }
    let angles = LIVE_LINK_ANGLES.map(|name| find(header, name));
    let (mut codes, mut rows) = (Vec::new(), Vec::new());
    let mut held = (FaceState::Waiting, [0.0; 52], [0.0; 9]);
    let mut passed_midnight = false;
    while let Some(cells) = lines.next()? {
        let row = || -> Result<_, String> {
            if cells.len() < header.len().min(time.max(count) + 1) || cells.len() > header.len() {
                return Err(format!("it has {} cells, and the header names {}", cells.len(), header.len()));
            }
            let code = Timecode::read(cells[time])
                .ok_or_else(|| format!("{} is no timecode HH:MM:SS:FF.mmm", quoted(cells[time])))?;
            if cells[count] == "0" {
                return Ok((code, None));
            }
            if cells.len() != header.len() {
                return Err(format!("it has {} cells, and the header names {}", cells.len(), header.len()));
            }
            let value = |place: &Option<usize>| match place {
                None => Ok(0.0),
                Some(place) => number(cells[*place])
                    .ok_or_else(|| format!("{} is no value of {}", quoted(cells[*place]), header[*place])),
            };
            let (mut shape, mut angle) = ([0.0; 52], [0.0; 9]);
            for (slot, place) in shape.iter_mut().zip(&shapes).chain(angle.iter_mut().zip(&angles)) {
                *slot = value(place)?;
            }
            Ok((code, Some((FaceState::Tracking, shape, angle))))
        };
        let (code, seen) = row().map_err(|reason| lines.fault(&reason))?;
        let is_new_day = codes.last().is_some_and(|last: &Timecode| last.is_day_before(code));
        if is_new_day && passed_midnight {
            return Err(lines.fault("its timecode passes midnight once more").into());
        }
        passed_midnight |= is_new_day;
        if !is_new_day && codes.last().is_some_and(|last| code <= *last) {
            return Err(lines.fault("its timecode is not after that of the row before").into());
        }
        match seen {
            Some(seen) => held = seen,
            None if held.0 == FaceState::Tracking => held.0 = FaceState::Holding,
            None => {}
        }
        codes.push(code);
        rows.push(held);
    }
    if codes.is_empty() {
        return Err(lines.whole_fault("it has a header and no rows".into(), REMEDY).into());
    }
    let nominal = Timecode::nominal(&codes);
    let times = since_first(&codes, nominal);
    let frames = times.iter().zip(&rows).map(|(&time, (state, shape, _))| CurveFrame {
        time,
        state: *state,
        contractions: shape.to_vec(),
        error: None,
    });
    let channels = shapes.map(|place| if place.is_some() { Channel::Measured } else { Channel::Absent });
    let muscles = ARKIT_SHAPES.map(String::from).to_vec();
    let curves = MuscleCurves::new(muscles, channels.to_vec(), mean_rate(&times), frames.collect())
        .map_err(|error| lines.whole_fault(error.to_string(), REMEDY))?;
    let angles = rows.iter().map(|row| FaceAngles::from_row(row.2)).collect();
    Ok((curves, LiveLinkExtras { angles, base: TimecodeBase { nominal, start: codes[0].time(nominal) } }))
}

/// Times since the first; past midnight the clock begins anew.
fn since_first(codes: &[Timecode], nominal: u32) -> Vec<Timestamp> {
    let mut days = 0;
    let mut times = Vec::with_capacity(codes.len());
    for (k, code) in codes.iter().enumerate() {
        if k > 0 && codes[k - 1].is_day_before(*code) {
            days += 1;
        }
        times.push(Timestamp(code.time(nominal).0 + days * Timecode::day() - codes[0].time(nominal).0));
    }
    times
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{lift::frontal_pose, muscle::MuscleBasis};

    #[test]
    fn turns_have_the_signs_of_the_recording() {
        let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
        let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
        // Looking to the subject's left turns +Z towards +X, about +Y; the recording counts to the right.
        let close = |got: [f64; 3], wanted: [f64; 3]| {
            assert!(got.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{got:?} {wanted:?}");
        };
        close(FaceAngles::of_turn(&turn(y, 0.3)), [-0.3, 0.0, 0.0]);
        close(FaceAngles::of_turn(&turn(x, 0.2)), [0.0, 0.2, 0.0]);
        close(FaceAngles::of_turn(&turn(z, 0.1)), [0.0, 0.0, -0.1]);
        close(FaceAngles::of_turn(&(turn(y, -0.3) * turn(x, 0.2) * turn(z, 0.1))), [0.3, 0.2, -0.1]);
        let angles = FaceAngles { head: [0.3, -0.2, 0.4], ..FaceAngles::default() };
        close(FaceAngles::of_turn(&angles.head_turn()), angles.head);
    }

    #[test]
    fn a_tracked_face_has_the_signs_of_the_recording() {
        let up_and_left = EyeState { yaw: 0.2, pitch: 0.1, closure: 0.0 };
        let eyes = Eyes { left: up_and_left, right: EyeState::default() };
        let straight = FaceAngles::of(&frontal_pose(), &eyes);
        assert!(straight.head.iter().all(|angle| angle.abs() < 1e-12));
        let wanted = [-0.2, -0.1, 0.0, 0.0, 0.0, 0.0];
        assert!(straight.row()[3..].iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{straight:?}");
        assert_eq!(straight.eyes(), eyes);
        // The nose, 100 mm out, goes to the picture's left when the subject turns to the right, and down with the chin.
        let turned = |axis, angle| {
            let frontal = frontal_pose();
            let rotation = Rotation3::from_axis_angle(&axis, angle) * frontal.rotation;
            let pose = HeadPose { rotation, ..frontal };
            let nose = rotation * Vector3::new(0.0, 0.0, 100.0);
            (FaceAngles::of(&pose, &eyes).head, nose)
        };
        let (head, nose) = turned(Vector3::y_axis(), 0.3);
        assert!(
            (head[0].abs() - 0.3).abs() < 1e-12 && head[0].signum() == -nose.x.signum(),
            "{head:?} {nose}"
        );
        let (head, nose) = turned(Vector3::x_axis(), 0.3);
        assert!(
            (head[1].abs() - 0.3).abs() < 1e-12 && head[1].signum() == nose.y.signum(),
            "{head:?} {nose}"
        );
    }

    #[test]
    fn shapes_of_the_basis_are_shapes_of_the_file() {
        for name in MuscleBasis::arkit().names() {
            assert!(ARKIT_SHAPES.contains(&name), "{name}");
        }
    }

    #[test]
    fn a_mirror_shown_twice_changes_nothing() {
        let angles =
            FaceAngles { head: [0.1, 0.2, 0.3], left_eye: [0.4, 0.5, 0.6], right_eye: [-0.4, 0.5, 0.0] };
        assert_eq!(angles.mirrored().mirrored(), angles);
        let [yaw, pitch, roll] = angles.mirrored().left_eye;
        assert!((yaw - 0.4).abs() + (pitch - 0.5).abs() + roll.abs() < 1e-12);
        assert_eq!(FaceAngles::from_row(angles.row()), angles);
    }
}
