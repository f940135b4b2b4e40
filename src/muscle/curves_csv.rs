//! Reading a table of contractions: columns are found by name, in any order.

use std::collections::BTreeMap;

use super::{
    Channel, CurveFrame, MuscleCurves, MuscleError,
    curves::{CHANNEL_SUFFIX, RESERVED, check_names, mean_rate},
};
use crate::{
    capture::Timestamp,
    lift::FaceState,
    rows::{Lines, quoted, seconds},
};

const REMEDY: &str = "Give a table of contractions, as `understudy animate -o take.muscles.csv` writes, or one of Live Link Face";

/// Where each value stands in a row.
struct Columns {
    count: usize,
    timestamp: usize,
    state: Option<usize>,
    errors: Option<[usize; 2]>,
    muscles: Vec<String>,
    contractions: Vec<usize>,
    channels: Vec<Option<usize>>,
}

impl Columns {
    fn find(header: &[String]) -> Result<Self, String> {
        let mut places = BTreeMap::new();
        for (place, name) in header.iter().enumerate() {
            if places.insert(name.as_str(), place).is_some() {
                return Err(format!("the header names the column {} twice", quoted(name)));
            }
        }
        let place = |name: &str| places.get(name).copied();
        let [_, timestamp, state, upper, lower] = RESERVED.map(place);
        let timestamp = timestamp.ok_or("the header does not name the column timestamp")?;
        if ["face_id", "pose_Tx", "x_0"].iter().any(|name| places.contains_key(name)) {
            return Err("it is a table of motion, not of contractions".into());
        }
        let is_muscle = |name: &&String| {
            let stem = name.strip_suffix(CHANNEL_SUFFIX);
            !RESERVED.contains(&name.as_str()) && !stem.is_some_and(|stem| places.contains_key(stem))
        };
        let muscles: Vec<String> = header.iter().filter(is_muscle).cloned().collect();
        if muscles.is_empty() {
            return Err("the header names no muscle".into());
        }
        check_names(&muscles)?;
        Ok(Self {
            count: header.len(),
            timestamp,
            state,
            errors: upper.zip(lower).map(|(upper, lower)| [upper, lower]),
            contractions: muscles.iter().filter_map(|name| place(name)).collect(),
            channels: muscles.iter().map(|name| place(&format!("{name}{CHANNEL_SUFFIX}"))).collect(),
            muscles,
        })
    }

    /// Reads a row's frame, and notes the channels that it names.
    fn frame(&self, cells: &[&str], channels: &mut [Option<Channel>]) -> Result<CurveFrame, String> {
        if cells.len() != self.count {
            return Err(format!("it has {} cells, and the header names {}", cells.len(), self.count));
        }
        let state = match self.state.map(|place| cells[place]) {
            None => FaceState::Tracking,
            Some(word) => word.parse().map_err(|()| {
                format!("{} is no state: waiting, tracking, holding, easing, blending are", quoted(word))
            })?,
        };
        let mut contractions = Vec::with_capacity(self.muscles.len());
        for (name, &place) in self.muscles.iter().zip(&self.contractions) {
            contractions.push(number(cells[place]).ok_or_else(|| {
                format!("{} is no contraction of {name}: a number is wanted", quoted(cells[place]))
            })?);
        }
        let error = match self.errors.map(|places| places.map(|place| cells[place])) {
            None | Some(["", ""]) => None,
            Some(cells) => {
                let lengths = cells.map(|cell| number(cell).filter(|length| *length >= 0.0));
                let [Some(upper), Some(lower)] = lengths else {
                    let [upper, lower] = cells.map(quoted);
                    return Err(format!("{upper} and {lower} are not two marker errors in millimetres"));
                };
                Some([upper, lower])
            }
        };
        for ((name, &place), known) in self.muscles.iter().zip(&self.channels).zip(channels) {
            let Some(word) = place.map(|place| cells[place]).filter(|word| !word.is_empty()) else {
                continue;
            };
            let channel = word.parse().map_err(|()| {
                format!("{} is no channel of {name}: measured, weak, inferred, absent are", quoted(word))
            })?;
            if *known.get_or_insert(channel) != channel {
                return Err(format!(
                    "the channel of {name} is {word} here and another above; a take has one"
                ));
            }
        }
        Ok(CurveFrame { time: seconds(cells[self.timestamp])?, state, contractions, error })
    }
}

/// Reads the rows below `header`.
///
/// Wanted are `timestamp` and a muscle; `frame` is not looked at, without `state` every frame counts as tracked, and a
/// muscle without a channel as measured. The rate is the mean one of the rows' times.
pub(super) fn read(mut lines: Lines<'_>, header: &[String]) -> Result<MuscleCurves, MuscleError> {
    let columns = Columns::find(header)
        .map_err(|reason| lines.whole_fault(format!("line {}: {reason}", lines.number()), REMEDY))?;
    let mut channels = vec![None; columns.muscles.len()];
    let mut frames: Vec<CurveFrame> = Vec::new();
    while let Some(cells) = lines.next()? {
        let frame = columns.frame(&cells, &mut channels).map_err(|reason| lines.fault(&reason))?;
        if let Some(last) = frames.last().filter(|last| frame.time <= last.time) {
            let (this, before) = (frame.time.seconds(), last.time.seconds());
            return Err(lines
                .fault(&format!("its time {this} s is not after the {before} s before it"))
                .into());
        }
        frames.push(frame);
    }
    if frames.is_empty() {
        return Err(lines.whole_fault("it has a header and no rows".into(), REMEDY).into());
    }
    let times: Vec<Timestamp> = frames.iter().map(|frame| frame.time).collect();
    let channels = channels.into_iter().map(Option::unwrap_or_default).collect();
    MuscleCurves::new(columns.muscles, channels, mean_rate(&times), frames)
        .map_err(|error| lines.whole_fault(error.to_string(), "Correct that row").into())
}

/// A finite number.
pub(super) fn number(cell: &str) -> Option<f64> {
    cell.parse().ok().filter(|value: &f64| value.is_finite())
}
