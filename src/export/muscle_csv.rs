//! The table of contractions: one CSV row a frame, which `muscle::CurveTake` reads back.
//!
//! `frame, timestamp, state`, the muscles, `error_upper_mm, error_lower_mm`, and each muscle's channel under its name
//! with `_s` after it; separated, numbered and timed as the motion table is.

use std::path::Path;

use super::decimal::{push_fixed, push_integer, push_nanoseconds};
use super::{Draft, ExportError};
use crate::muscle::{CHANNEL_SUFFIX, MuscleCurves, RESERVED_COLUMNS};

/// Decimals of contractions.
const CONTRACTION_DECIMALS: usize = 6;
/// Decimals of errors in millimetres.
const LENGTH_DECIMALS: usize = 3;

/// Writes a take's contractions.
pub fn write_muscle_csv(path: &Path, curves: &MuscleCurves) -> Result<(), ExportError> {
    let mut draft = Draft::create(path)?;
    let [frame, timestamp, state, upper, lower] = RESERVED_COLUMNS;
    let muscles = || curves.muscles().iter();
    let channels = muscles().map(|name| format!("{name}{CHANNEL_SUFFIX}"));
    let names = [frame, timestamp, state].map(String::from).into_iter().chain(muscles().cloned());
    let header: Vec<String> = names.chain([upper, lower].map(String::from)).chain(channels).collect();
    draft.append(header.join(",").as_bytes())?;
    draft.append(b"\n")?;
    let mut line = Vec::new();
    for (number, frame) in (1..).zip(curves.frames()) {
        line.clear();
        push_integer(&mut line, number);
        line.push(b',');
        push_nanoseconds(&mut line, frame.time.0);
        line.push(b',');
        line.extend_from_slice(frame.state.name().as_bytes());
        for &contraction in &frame.contractions {
            line.push(b',');
            push_fixed(&mut line, contraction, CONTRACTION_DECIMALS);
        }
        for region in 0..2 {
            line.push(b',');
            if let Some(error) = frame.error {
                push_fixed(&mut line, error[region], LENGTH_DECIMALS);
            }
        }
        for channel in curves.channels() {
            line.push(b',');
            line.extend_from_slice(channel.name().as_bytes());
        }
        line.push(b'\n');
        draft.append(&line)?;
    }
    draft.commit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        capture::{FrameRate, Timestamp},
        lift::FaceState,
        muscle::{Channel, CurveFrame, CurveTake},
    };
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_written_is_read_as_it_was(
            rows in prop::collection::vec((1..80_000_000_i64, 0..5_usize, prop::array::uniform2(-2_000_000..2_000_000_i64), 0..9000_u32), 1..9),
        ) {
            let states =
                [FaceState::Waiting, FaceState::Tracking, FaceState::Holding, FaceState::Easing, FaceState::Blending];
            let mut time = 0;
            let frames = rows.iter().map(|&(step, state, values, error)| {
                time += step;
                CurveFrame {
                    time: Timestamp(time),
                    state: states[state],
                    contractions: values.map(|value| value as f64 / 1e6).to_vec(),
                    error: (error % 3 > 0).then_some([f64::from(error) / 1e3, 0.0]),
                }
            });
            let muscles = vec!["frontalis_left".to_owned(), "jaw_rotation".to_owned()];
            let rate = FrameRate { numerator: 30, denominator: 1 };
            let made = MuscleCurves::new(muscles, vec![Channel::Weak, Channel::Inferred], rate, frames.collect()).unwrap();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("take.muscles.csv");
            write_muscle_csv(&path, &made).unwrap();
            let read = CurveTake::read(&path).unwrap().curves;
            prop_assert_eq!(read.muscles(), made.muscles());
            prop_assert_eq!(read.channels(), made.channels());
            prop_assert_eq!(read.frames(), made.frames());
            let first = std::fs::read(&path).unwrap();
            write_muscle_csv(&path, &read).unwrap();
            prop_assert_eq!(first, std::fs::read(&path).unwrap());
        }
    }
}
