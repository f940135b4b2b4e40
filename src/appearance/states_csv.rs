//! States over time, and reading them from a table.

use std::{collections::BTreeMap, path::Path};

use super::{AppearanceError, AppearanceStates, Region};
use crate::{
    capture::Timestamp,
    lift::FaceState,
    rows::{Lines, quoted, seconds},
};

const REMEDY: &str =
    "Give a table of states, as `understudy track --skin performer.skin -o take.appearance.csv` writes";

/// The states of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppearanceFrame {
    /// When.
    pub time: Timestamp,
    /// Where the face of the frame comes from.
    pub state: FaceState,
    /// The states of its regions.
    pub states: AppearanceStates,
}

/// The columns of states, in the order of the table: wrinkles, then lids.
pub fn columns() -> impl Iterator<Item = Region> {
    let of = |eyes: bool| Region::ALL.into_iter().filter(move |region| region.is_eye() == eyes);
    of(false).chain(of(true))
}

/// Reads a table of states. Columns are found by their names, others are passed over; a region without a column is absent, and
/// without `state` every frame counts as tracked.
pub fn read_appearance_csv(path: &Path) -> Result<Vec<AppearanceFrame>, AppearanceError> {
    let mut lines = Lines::open(path)?;
    let header: Vec<String> = match lines.next()? {
        Some(cells) => cells.into_iter().map(str::to_owned).collect(),
        None => return Err(lines.whole_fault("it is empty".into(), REMEDY).into()),
    };
    let mut places = BTreeMap::new();
    for (place, name) in header.iter().enumerate() {
        if places.insert(name.as_str(), place).is_some() {
            return Err(lines.fault(&format!("the header names the column {} twice", quoted(name))).into());
        }
    }
    let Some(&time) = places.get("timestamp") else {
        return Err(lines.whole_fault("the header does not name the column timestamp".into(), REMEDY).into());
    };
    let state = places.get("state").copied();
    let regions: Vec<(Region, usize)> =
        columns().filter_map(|region| Some((region, *places.get(region.curve().as_str())?))).collect();
    if regions.is_empty() {
        return Err(lines.whole_fault("the header names no region of the skin".into(), REMEDY).into());
    }
    let mut frames: Vec<AppearanceFrame> = Vec::new();
    while let Some(cells) = lines.next()? {
        let frame =
            row(&cells, header.len(), time, state, &regions).map_err(|reason| lines.fault(&reason))?;
        if frames.last().is_some_and(|last| frame.time <= last.time) {
            return Err(lines.fault("its time is not after that of the row before").into());
        }
        frames.push(frame);
    }
    if frames.is_empty() {
        return Err(lines.whole_fault("it has a header and no rows".into(), REMEDY).into());
    }
    Ok(frames)
}

fn row(
    cells: &[&str],
    count: usize,
    time: usize,
    state: Option<usize>,
    regions: &[(Region, usize)],
) -> Result<AppearanceFrame, String> {
    if cells.len() != count {
        return Err(format!("it has {} cells, and the header names {count}", cells.len()));
    }
    let state = match state.map(|place| cells[place]) {
        None => FaceState::Tracking,
        Some(word) => word.parse().map_err(|()| format!("{} is no state of a face", quoted(word)))?,
    };
    let mut states = AppearanceStates::default();
    for &(region, place) in regions.iter().filter(|(_, place)| !cells[*place].is_empty()) {
        let value = cells[place].parse().ok().filter(|value| (0.0..=1.0).contains(value));
        let wrong =
            || format!("{} is no state of {}: 0 to 1, or nothing, is", quoted(cells[place]), region.name());
        states.set(region, Some(value.ok_or_else(wrong)?));
    }
    Ok(AppearanceFrame { time: seconds(cells[time])?, state, states })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &[u8]) -> Result<Vec<AppearanceFrame>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.appearance.csv");
        std::fs::write(&path, text).unwrap();
        read_appearance_csv(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_name_and_faults_name_their_line() {
        let frames = read(b"timestamp,note,lid_left,wrinkle_chin\n0,a,,0.25\n0.04,b,1,\n").unwrap();
        assert_eq!(frames[0].states.get(Region::Chin), Some(0.25));
        assert_eq!(frames[0].states.get(Region::EyeLeft), None);
        assert_eq!(frames[1].states.get(Region::EyeLeft), Some(1.0));
        for (text, wanted) in [
            ("", "empty"),
            ("timestamp,x\n0,1\n", "no region"),
            ("lid_left\n1\n", "timestamp"),
            ("timestamp,lid_left,lid_left\n", "twice"),
            ("timestamp,lid_left\n", "no rows"),
            ("timestamp,lid_left\n0,1.2\n", "line 2"),
            ("timestamp,lid_left\n0,NaN\n", "no state of eye_left"),
            ("timestamp,lid_left\n0,1\n0,1\n", "line 3"),
            ("timestamp,state,lid_left\n0,asleep,1\n", "asleep"),
        ] {
            let said = read(text.as_bytes()).unwrap_err();
            assert!(said.contains(wanted) && said.contains("take.appearance.csv"), "{said}");
        }
    }

    proptest! {
        #[test]
        fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = read(&bytes);
            let mut table = b"timestamp,lid_left\n".to_vec();
            table.extend(&bytes);
            let _ = read(&table);
        }
    }
}
