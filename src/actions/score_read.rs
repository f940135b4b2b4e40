//! The two files a score is read from: keyframes, and tables of intensities with OpenFace's columns.

use std::{collections::BTreeMap, path::Path};

use super::{ActionError, ActionKey, Catalogue, Score, score::Track};
use crate::{
    capture::Timestamp,
    rows::{Lines, quoted, seconds},
};

/// Rows of a table: four and a half hours at 60 a second.
const MOST_ROWS: usize = 1_000_000;
/// OpenFace's intensities go from 0 to this.
const FULL: f64 = 5.0;
/// So far outside it they are still intensities; its regression overshoots.
const OVERSHOOT: f64 = 1.0;
const HEADERS: &str = "Begin it with the line `time,au,magnitude` for keyframes, or with a header that names `timestamp` and at \
                       least one of `AU01_r`, `AU12_r`, `AU12L_r`, … for a table";

pub(super) fn read(path: &Path) -> Result<Score, ActionError> {
    let mut lines = Lines::open(path)?;
    let header: Vec<String> = match lines.next()? {
        Some(cells) => cells.into_iter().map(str::to_owned).collect(),
        None => return Err(lines.whole_fault("it is empty".into(), HEADERS).into()),
    };
    let place = |name: &str| header.iter().position(|cell| cell.eq_ignore_ascii_case(name));
    if let (Some(time), Some(au), Some(magnitude)) = (place("time"), place("au"), place("magnitude")) {
        return keyframes(lines, [time, au, magnitude]);
    }
    let columns = Columns::find(&header).map_err(|reason| lines.fault(&reason))?;
    match place("timestamp") {
        Some(time) if !columns.places.is_empty() => {
            table(lines, header.len(), time, place("success"), columns)
        }
        _ => {
            let names: Vec<_> = header.iter().take(4).map(|name| quoted(name)).collect();
            let reason = format!(
                "line {}: the header {}{} is neither that of keyframes nor that of a table of action units",
                lines.number(),
                names.join(", "),
                if header.len() > names.len() { ", …" } else { "" }
            );
            Err(lines.whole_fault(reason, HEADERS).into())
        }
    }
}

fn keyframes(mut lines: Lines<'_>, places: [usize; 3]) -> Result<Score, ActionError> {
    let mut keys: BTreeMap<ActionKey, BTreeMap<Timestamp, f64>> = BTreeMap::new();
    let (mut start, mut end) = (Timestamp(i64::MAX), Timestamp(0));
    while let Some(cells) = lines.next()? {
        let row = keyframe(&cells, places);
        let (time, actions, magnitude) = row.map_err(|reason| lines.fault(&reason))?;
        (start, end) = (start.min(time), end.max(time));
        for key in actions {
            keys.entry(key).or_default().insert(time, magnitude);
        }
    }
    if keys.is_empty() {
        let reason = "it has a header and no keyframes".to_owned();
        return Err(lines.whole_fault(reason, "Add rows such as `0.5,12,0.8`").into());
    }
    let tracks = keys.into_iter().map(|(key, times)| (key, times.into_iter().collect())).collect();
    Ok(Score::new(tracks, [start, end], None, Vec::new()))
}

fn keyframe(cells: &[&str], places: [usize; 3]) -> Result<(Timestamp, Vec<ActionKey>, f64), String> {
    let wanted =
        "a keyframe is a time in seconds, an action unit or emotion, and a magnitude, such as `0.5,12L,0.8`";
    let cell = |k: usize| cells.get(places[k]).copied().filter(|cell| !cell.is_empty()).ok_or(wanted);
    let (time, unit, magnitude) = (seconds(cell(0)?)?, cell(1)?, cell(2)?);
    let value = magnitude.parse::<f64>().ok().filter(|value| (0.0..=1.0).contains(value));
    let value = value.ok_or_else(|| format!("{} is no magnitude: write 0 to 1", quoted(magnitude)))?;
    Ok((time, named(unit)?, value))
}

/// The actions that `12`, `AU4`, `12L` or `happiness` stand for.
fn named(unit: &str) -> Result<Vec<ActionKey>, String> {
    if unit.chars().count() > 40 {
        return Err(format!("{} is no action unit", quoted(unit)));
    }
    let after = unit.get(..2).filter(|start| start.eq_ignore_ascii_case("au")).map_or(unit, |_| &unit[2..]);
    if after.starts_with(|c: char| c.is_ascii_digit()) {
        return ActionKey::parse(unit).map_err(|error| error.to_string());
    }
    let catalogue = Catalogue::get();
    let emotion = catalogue.emotion(unit).map_err(|_| {
        let emotions: Vec<_> = catalogue.emotions.iter().map(|emotion| emotion.name.as_str()).collect();
        format!(
            "{} is neither an action unit ({}; a side as in 12L) nor an emotion ({})",
            quoted(unit),
            catalogue.numbers(),
            emotions.join(", ")
        )
    })?;
    let parsed: Result<Vec<_>, _> =
        emotion.actions.iter().map(|au| ActionKey::parse(&au.to_string())).collect();
    Ok(parsed.map_err(|error| error.to_string())?.concat())
}

/// Which column each action is read from.
struct Columns {
    places: BTreeMap<ActionKey, usize>,
    ignored: Vec<String>,
}

impl Columns {
    fn find(header: &[String]) -> Result<Self, String> {
        let (mut even, mut one_sided) = (BTreeMap::new(), BTreeMap::new());
        let mut ignored = Vec::new();
        for (place, name) in header.iter().enumerate() {
            let Some(unit) = intensity_of(name) else { continue };
            let Ok(keys) = ActionKey::parse(unit) else {
                ignored.push(name.clone());
                continue;
            };
            let sided = unit.ends_with(['L', 'R', 'l', 'r']);
            let places = if sided { &mut one_sided } else { &mut even };
            for key in keys {
                if places.insert(key, place).is_some() {
                    return Err(format!("the header names AU{key} twice"));
                }
            }
        }
        even.extend(one_sided);
        Ok(Self { places: even, ignored })
    }
}

/// `AU12` of `AU12_r`, `AU12L` of `AU12L_r`; nothing of anything else.
fn intensity_of(name: &str) -> Option<&str> {
    let unit = name.strip_suffix("_r").or_else(|| name.strip_suffix("_R"))?;
    let number = unit.strip_prefix("AU").or_else(|| unit.strip_prefix("au"))?;
    let digits = number.strip_suffix(['L', 'R', 'l', 'r']).unwrap_or(number);
    let counted = (1..=3).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_digit());
    counted.then_some(unit)
}

fn table(
    mut lines: Lines<'_>,
    width: usize,
    time_place: usize,
    success_place: Option<usize>,
    columns: Columns,
) -> Result<Score, ActionError> {
    let mut tracks: Vec<(ActionKey, usize, Track)> =
        columns.places.into_iter().map(|(key, place)| (key, place, Track::new())).collect();
    let (mut rows, mut good) = (0, 0_usize);
    let (mut start, mut end) = (Timestamp(0), Timestamp(0));
    while let Some(cells) = lines.next()? {
        let row = table_row(&cells, width, time_place, success_place, &tracks);
        let (time, values) = row.map_err(|reason| lines.fault(&reason))?;
        if rows > 0 && time <= end {
            let reason = format!(
                "its time {} s is not after the {} s of the row before; one face's rows, in order, are wanted",
                time.seconds(),
                end.seconds()
            );
            return Err(lines.fault(&reason).into());
        }
        if rows == 0 {
            start = time;
        }
        end = time;
        rows += 1;
        if rows > MOST_ROWS {
            return Err(lines
                .whole_fault(format!("it has more than {MOST_ROWS} rows"), "Cut it into several")
                .into());
        }
        good += usize::from(values.is_some());
        for (at, (_, _, track)) in tracks.iter_mut().enumerate() {
            let value = values.as_ref().map(|values| values[at]).or_else(|| track.last().map(|key| key.1));
            if let Some(value) = value {
                push(track, time, value);
            }
        }
    }
    if good == 0 {
        let reason = if rows == 0 { "it has a header and no rows" } else { "no row has a success of 1" };
        return Err(lines
            .whole_fault(reason.to_owned(), "Give the table of a clip that shows a face")
            .into());
    }
    let tracks = tracks.into_iter().map(|(key, _, track)| (key, track)).collect();
    Ok(Score::new(tracks, [start, end], Some(rows), columns.ignored))
}

/// Time and magnitudes by track; no magnitudes where the face was not found.
fn table_row(
    cells: &[&str],
    width: usize,
    time_place: usize,
    success_place: Option<usize>,
    tracks: &[(ActionKey, usize, Track)],
) -> Result<(Timestamp, Option<Vec<f64>>), String> {
    if cells.len() != width {
        return Err(format!("it has {} cells, and the header names {width}", cells.len()));
    }
    let time = seconds(cells[time_place])?;
    if let Some(place) = success_place {
        match cells[place].parse::<f64>() {
            Ok(0.0) => return Ok((time, None)),
            Ok(found) if found.is_finite() => {}
            _ => return Err(format!("a success of {} is neither 0 nor 1", quoted(cells[place]))),
        }
    }
    let values: Result<Vec<_>, _> =
        tracks.iter().map(|(key, place, _)| intensity(*key, cells[*place])).collect();
    Ok((time, Some(values?)))
}

fn intensity(key: ActionKey, cell: &str) -> Result<f64, String> {
    let value = if cell.is_empty() { Ok(f64::NAN) } else { cell.parse::<f64>() };
    match value {
        Ok(value) if value.is_nan() => Ok(0.0),
        Ok(value) if (-OVERSHOOT..=FULL + OVERSHOOT).contains(&value) => Ok((value / FULL).clamp(0.0, 1.0)),
        _ => Err(format!("{} is no intensity of AU{key}: 0 to 5 are", quoted(cell))),
    }
}

/// Adds a key; of a stretch of equal magnitudes only the ends are kept.
fn push(track: &mut Track, time: Timestamp, value: f64) {
    if let [.., before, last] = track.as_mut_slice()
        && before.1.to_bits() == value.to_bits()
        && last.1.to_bits() == value.to_bits()
    {
        last.0 = time;
    } else {
        track.push((time, value));
    }
}

#[cfg(test)]
#[path = "score_read_tests.rs"]
mod tests;
