//! Curves as Live Link Face records them, for any character that takes ARKit's 52 shapes.
//!
//! Columns, their order, the count of 61 and the ten decimals are those of a recording of the app; what the angles mean
//! is with [`FaceAngles`], what the timecode means with [`TimecodeBase`].

use std::{fmt::Write as _, path::Path};

use super::{Draft, ExportError};
use crate::muscle::{ARKIT_SHAPES, Channel, FaceAngles, LIVE_LINK_ANGLES, MuscleCurves, TimecodeBase};

/// Writes curves whose muscles have ARKit's names, `jawOpen`, `eyeBlinkLeft`, …, with the turn of head and eyes in
/// each frame.
///
/// A shape that the curves do not have, or whose channel is absent, is 0 throughout: the format knows no other way to
/// say so. Muscles that ARKit does not name are left out; curves with none of its names are refused.
pub fn write_live_link(
    path: &Path,
    curves: &MuscleCurves,
    angles: &[FaceAngles],
    base: TimecodeBase,
) -> Result<(), ExportError> {
    let refuse = |reason: String, remedy| Err(ExportError::refused(path, reason, remedy));
    if angles.len() != curves.frames().len() {
        return refuse(
            format!("{} angles of the head for {} frames", angles.len(), curves.frames().len()),
            "Give the angles of every frame",
        );
    }
    if !angles.iter().all(|angles| angles.row().iter().all(|angle| angle.is_finite())) {
        return refuse("an angle of head or eyes is no number".into(), "Give 0 where nothing is known");
    }
    let place = |shape: &str| {
        let place = curves.muscles().iter().position(|muscle| muscle == shape)?;
        (curves.channels()[place] != Channel::Absent).then_some(place)
    };
    let places = ARKIT_SHAPES.map(place);
    if places.iter().all(Option::is_none) {
        return refuse(
            "none of its muscles has the name of one of ARKit's 52 shapes".into(),
            "Write these curves as .muscles.csv",
        );
    }
    let mut draft = Draft::create(path)?;
    draft.append(header().as_bytes())?;
    for (frame, angles) in curves.frames().iter().zip(angles) {
        let mut line =
            format!("{},{}", base.timecode(frame.time), ARKIT_SHAPES.len() + LIVE_LINK_ANGLES.len());
        let shapes = places.iter().map(|place| place.map_or(0.0, |place| frame.contractions[place]));
        for value in shapes.chain(angles.row()) {
            // Zero has no sign, and writing to a String cannot fail.
            let _ = write!(line, ",{:.10}", value + 0.0);
        }
        line.push('\n');
        draft.append(line.as_bytes())?;
    }
    draft.commit()
}

fn header() -> String {
    let mut line = String::from("Timecode,BlendShapeCount");
    for shape in ARKIT_SHAPES {
        let (first, rest) = shape.split_at(1);
        line.push(',');
        line.push_str(&first.to_ascii_uppercase());
        line.push_str(rest);
    }
    for angle in LIVE_LINK_ANGLES {
        line.push(',');
        line.push_str(angle);
    }
    line.push('\n');
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        capture::{FrameRate, Timestamp},
        lift::FaceState,
        muscle::{CurveFrame, CurveTake},
    };

    /// As a recording of the app has it.
    const HEADER: &str = "Timecode,BlendShapeCount,EyeBlinkLeft,EyeLookDownLeft,EyeLookInLeft,EyeLookOutLeft,\
        EyeLookUpLeft,EyeSquintLeft,EyeWideLeft,EyeBlinkRight,EyeLookDownRight,EyeLookInRight,EyeLookOutRight,\
        EyeLookUpRight,EyeSquintRight,EyeWideRight,JawForward,JawRight,JawLeft,JawOpen,MouthClose,MouthFunnel,\
        MouthPucker,MouthRight,MouthLeft,MouthSmileLeft,MouthSmileRight,MouthFrownLeft,MouthFrownRight,\
        MouthDimpleLeft,MouthDimpleRight,MouthStretchLeft,MouthStretchRight,MouthRollLower,MouthRollUpper,\
        MouthShrugLower,MouthShrugUpper,MouthPressLeft,MouthPressRight,MouthLowerDownLeft,MouthLowerDownRight,\
        MouthUpperUpLeft,MouthUpperUpRight,BrowDownLeft,BrowDownRight,BrowInnerUp,BrowOuterUpLeft,BrowOuterUpRight,\
        CheekPuff,CheekSquintLeft,CheekSquintRight,NoseSneerLeft,NoseSneerRight,TongueOut,HeadYaw,HeadPitch,HeadRoll,\
        LeftEyeYaw,LeftEyePitch,LeftEyeRoll,RightEyeYaw,RightEyePitch,RightEyeRoll\n";

    const RATE: FrameRate = FrameRate { numerator: 30000, denominator: 1001 };

    fn curves(muscles: &[&str], channels: &[Channel], frames: u64) -> MuscleCurves {
        let frame = |k| CurveFrame {
            time: RATE.tick(k),
            state: FaceState::Tracking,
            contractions: (0..muscles.len()).map(|m| 0.125 * m as f64 + 0.01 * k as f64).collect(),
            error: None,
        };
        let names = muscles.iter().map(|name| (*name).to_owned()).collect();
        MuscleCurves::new(names, channels.to_vec(), RATE, (0..frames).map(frame).collect()).unwrap()
    }

    #[test]
    fn the_header_is_the_apps() {
        assert_eq!(header(), HEADER);
        assert_eq!(header().split(',').count(), 63);
    }

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.livelink.csv");
        let made = curves(
            &["tongueOut", "jawOpen", "cheekPuff"],
            &[Channel::Weak, Channel::Measured, Channel::Absent],
            40,
        );
        let angle = |k: usize| FaceAngles { head: [0.01 * k as f64, -0.2, 0.3], ..FaceAngles::default() };
        let angles: Vec<_> = (0..40).map(angle).collect();
        let base = TimecodeBase { nominal: 30, start: Timestamp(47_584_000_000_000) };
        write_live_link(&path, &made, &angles, base).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.lines().nth(1).unwrap().starts_with("13:13:04:00.000,61,0.0000000000,"), "{text}");
        let take = CurveTake::read(&path).unwrap();
        let extras = take.live_link.unwrap();
        for (read, wrote) in extras.angles.iter().zip(&angles) {
            assert!(read.row().iter().zip(wrote.row()).all(|(a, b)| (a - b).abs() < 1e-10), "{read:?}");
        }
        assert_eq!(extras.base, base);
        assert_eq!(take.curves.rate(), RATE);
        let place = |name: &str| take.curves.muscles().iter().position(|muscle| muscle == name).unwrap();
        for (read, wrote) in take.curves.frames().iter().zip(made.frames()) {
            assert!((read.time.0 - wrote.time.0).abs() < 17_000, "{read:?}");
            let [tongue, jaw, puff] =
                ["tongueOut", "jawOpen", "cheekPuff"].map(|name| read.contractions[place(name)]);
            assert!((tongue - wrote.contractions[0]).abs() < 1e-10);
            assert!((jaw - wrote.contractions[1]).abs() < 1e-10);
            assert!(puff.abs() < 1e-15, "an absent channel is written as 0");
        }
    }

    #[test]
    fn what_the_format_cannot_hold_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.livelink.csv");
        let base = TimecodeBase::from_midnight(RATE);
        let said = |curves: &MuscleCurves, angles: &[FaceAngles]| {
            write_live_link(&path, curves, angles, base).unwrap_err().to_string()
        };
        let jaw = curves(&["jawOpen"], &[Channel::Measured], 2);
        assert!(said(&jaw, &[FaceAngles::default()]).contains("1 angles of the head for 2 frames"));
        let nan = FaceAngles { head: [f64::NAN; 3], ..FaceAngles::default() };
        assert!(said(&jaw, &[nan, nan]).contains("no number"));
        let other = curves(&["jaw_rotation"], &[Channel::Measured], 1);
        assert!(said(&other, &[FaceAngles::default()]).contains("ARKit"));
        assert!(!path.exists());
    }
}
