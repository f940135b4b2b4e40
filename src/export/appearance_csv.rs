//! The table of the skin's states: one CSV row a frame, which `appearance::read_appearance_csv` reads back.
//!
//! `frame, timestamp, state`, a column for each region named after its curve; a cell is empty where the region is absent.

use std::path::Path;

use super::decimal::{push_fixed, push_integer, push_nanoseconds};
use super::{Draft, ExportError};
use crate::appearance::{AppearanceFrame, Skin, columns};

const DECIMALS: usize = 4;

/// Writes the states of a take.
pub fn write_appearance_csv(path: &Path, frames: &[AppearanceFrame]) -> Result<(), ExportError> {
    let mut draft = Draft::create(path)?;
    draft.append(b"frame,timestamp,state")?;
    for region in columns() {
        draft.append(format!(",{}", region.curve()).as_bytes())?;
    }
    draft.append(b"\n")?;
    let mut line = Vec::new();
    for (number, frame) in (1..).zip(frames) {
        line.clear();
        push_integer(&mut line, number);
        line.push(b',');
        push_nanoseconds(&mut line, frame.time.0);
        line.push(b',');
        line.extend_from_slice(frame.state.name().as_bytes());
        for region in columns() {
            line.push(b',');
            if let Some(state) = frame.states.get(region) {
                push_fixed(&mut line, f64::from(state), DECIMALS);
            }
        }
        line.push(b'\n');
        draft.append(&line)?;
    }
    draft.commit()
}

/// Writes a performer's skin.
pub fn write_skin(path: &Path, skin: &Skin) -> Result<(), ExportError> {
    let mut draft = Draft::create(path)?;
    let bytes =
        skin.to_bytes().map_err(|reason| ExportError::refused(path, reason, "Learn fewer takes at once"))?;
    draft.append(&bytes)?;
    draft.commit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        appearance::{AppearanceStates, Region, read_appearance_csv},
        capture::Timestamp,
        lift::FaceState,
    };
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_written_is_read_as_it_was(
            rows in prop::collection::vec((1..80_000_000_i64, prop::array::uniform11(prop::option::of(0..=10_000_u32))), 1..9),
        ) {
            let mut time = 0;
            let frames: Vec<AppearanceFrame> = rows.iter().map(|(step, values)| {
                time += step;
                let mut states = AppearanceStates::default();
                for (region, value) in Region::ALL.into_iter().zip(values) {
                    states.set(region, value.map(|value| value as f32 / 1e4));
                }
                AppearanceFrame { time: Timestamp(time), state: FaceState::Tracking, states }
            }).collect();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("take.appearance.csv");
            write_appearance_csv(&path, &frames).unwrap();
            prop_assert_eq!(read_appearance_csv(&path).unwrap(), frames);
        }
    }
}
