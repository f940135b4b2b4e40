//! C3D, the exchange format of optical capture, through `c3dio`.

use std::panic::catch_unwind;

use c3dio::prelude::{C3d, C3dParseError, MarkerPoint};
use nalgebra::Point3;

use super::{
    FrameRate,
    marker_c3d_cut::cut,
    marker_take::{Fault, Table},
};

/// Messages of the crate may quote a whole parameter.
const LONGEST_REASON: usize = 120;

/// Reads a whole file. A point counts as not seen where its residual is negative, as the format has it, where a number is
/// not finite, or where all three are 0, as some exporters have it.
pub(super) fn parse(bytes: &[u8]) -> Result<Table, Fault> {
    let cut = cut(bytes)?;
    // The crate indexes where a damaged file says; what the walk over the file did not find ends here.
    let read = catch_unwind(|| C3d::from_bytes(&cut).map_err(|error| reason(&error)))
        .map_err(|_| Fault::damaged("its parameters contradict each other"))?
        .map_err(Fault::damaged)?;
    let rate = f64::from(read.points.frame_rate);
    if !(0.1..=1000.0).contains(&rate) {
        return Err(Fault::damaged(format!("its rate is {rate} frames a second")));
    }
    let rate = FrameRate::nearest(rate);
    let (frames, markers) = read.points.size();
    let labels = labels(&read)?;
    let names: Vec<String> = (0..markers)
        .map(|m| match labels.get(m).map(|label| label.trim_matches(['\0', ' '])) {
            Some(label) if !label.is_empty() => label.to_owned(),
            _ => format!("unlabelled {}", m + 1),
        })
        .collect();
    let times = (0..frames).map(|f| rate.tick(f as u64)).collect();
    let frames = (0..frames).map(|f| read.points.iter_row(f).map(place).collect()).collect();
    Ok(Table { names, times, frames })
}

/// POINT:LABELS holds at most 255; the rest stands in LABELS2 and so on.
fn labels(read: &C3d) -> Result<Vec<String>, Fault> {
    let mut labels = read.points.labels.clone();
    for next in 2.. {
        let Some(more) = read.parameters.get("POINT", &format!("LABELS{next}")) else { break };
        let more: Vec<String> = more.try_into().map_err(|error| Fault::damaged(reason(&error)))?;
        labels.extend(more);
    }
    Ok(labels)
}

fn place(point: &MarkerPoint) -> Option<Point3<f64>> {
    let place = Point3::from(point.point.map(f64::from));
    let finite = place.iter().all(|c| c.is_finite());
    let seen = !point.residual.is_sign_negative() && finite && place != Point3::origin();
    seen.then_some(place)
}

fn reason(error: &C3dParseError) -> String {
    let text = format!("{error:?}");
    let end = text.char_indices().nth(LONGEST_REASON).map_or(text.len(), |(at, _)| at);
    format!("its parameters say {}", &text[..end])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::capture::MarkerTake;

    const FLOATS: &[u8] = include_bytes!("../../tests/reference/marker_floats.c3d");
    const INTEGERS: &[u8] = include_bytes!("../../tests/reference/marker_integers.c3d");

    #[derive(serde::Deserialize)]
    struct Case {
        file: String,
        rate: f64,
        names: Vec<String>,
        frames: Vec<Vec<Option<[f64; 3]>>>,
    }

    #[test]
    fn files_of_other_writers_read_as_their_own_readers_read_them() {
        let cases: Vec<Case> =
            serde_json::from_str(include_str!("../../tests/reference/marker_files.json")).unwrap();
        for (case, bytes) in cases.iter().zip([FLOATS, INTEGERS]) {
            let table = parse(bytes).unwrap();
            assert_eq!(table.names, case.names, "{}", case.file);
            let wanted: Vec<Vec<_>> =
                case.frames.iter().map(|frame| frame.iter().map(|p| p.map(Point3::from)).collect()).collect();
            assert_eq!(table.frames.len(), wanted.len(), "{}", case.file);
            for (frame, wanted) in table.frames.iter().zip(&wanted) {
                for (place, wanted) in frame.iter().zip(wanted) {
                    assert_eq!(place.is_some(), wanted.is_some(), "{}", case.file);
                    if let (Some(place), Some(wanted)) = (place, wanted) {
                        assert!((place - wanted).norm() < 1e-4, "{}: {place} for {wanted}", case.file);
                    }
                }
            }
            assert!((table.times[6].seconds() - 6.0 / case.rate).abs() < 1e-9);
        }
    }

    #[test]
    fn a_marker_that_no_frame_shows_is_named() {
        let Table { names, times, frames } = parse(FLOATS).unwrap();
        let take = MarkerTake::new("a.c3d".as_ref(), names, times, frames).unwrap();
        assert_eq!((take.never_seen, take.names.len()), (vec!["Lost".to_owned()], 4));
    }

    #[test]
    fn files_cut_off_anywhere_are_refused() {
        for bytes in [FLOATS, INTEGERS] {
            // Some writers fill the last block.
            for length in 0..bytes.len() - 512 {
                assert!(parse(&bytes[..length]).is_err(), "{length}");
            }
        }
        let reason = parse(&FLOATS[..FLOATS.len() - 512]).unwrap_err().reason;
        assert!(reason.contains("promises 9 frames"), "{reason}");
    }

    #[test]
    fn headers_that_cannot_be_are_refused() {
        let refused = |at: usize, values: &[u8]| {
            let mut bytes = FLOATS.to_vec();
            bytes[at..at + values.len()].copy_from_slice(values);
            parse(&bytes).unwrap_err().reason
        };
        assert!(refused(0, &[9]).contains("block 9"));
        assert!(refused(1, &[0]).contains("does not start"));
        assert!(refused(2, &[0, 0]).contains("names no markers"));
        assert!(refused(2, &[255, 255]).contains("65535 markers"));
        assert!(refused(8, &[255, 255]).contains("cut off"));
        assert!(refused(16, &[0, 0]).contains("data would start"));
        assert!(refused(16, &[255, 255]).contains("data would start"));
        assert!(refused(20, &[0; 4]).contains("FrameRateMismatch"));
        assert!(refused(512 + 3, &[0]).contains("processor"));
    }

    #[test]
    fn frames_that_the_crate_would_miscount_are_refused() {
        let name = b"ACTUAL_END_FIELD";
        let at = INTEGERS.windows(name.len()).position(|window| window == name).unwrap() + name.len();
        // After the name: offset, kind, dimensions, and the number's lower and upper half.
        let data = at + 4 + usize::from(INTEGERS[at + 3]);
        let refused = |offset: usize, value: u8| {
            let mut bytes = INTEGERS.to_vec();
            bytes[data + offset] = value;
            parse(&bytes).unwrap_err().reason
        };
        assert!(refused(2, 3).contains("131071"));
        assert!(refused(0, 0).contains("before it starts"));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// No panic gets out, nothing is allocated that is not there, and no walk goes on for ever.
        #[test]
        fn damaged_files_are_read_or_refused(
            which in any::<bool>(),
            damage in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let mut bytes = if which { FLOATS } else { INTEGERS }.to_vec();
            for (at, value) in damage {
                // Three out of four in the header and the parameters.
                let end = if value % 4 == 0 { bytes.len() } else { 1536 };
                let at = at.index(end);
                bytes[at] = value;
            }
            if let Ok(table) = parse(&bytes) {
                prop_assert!(table.frames.iter().all(|frame| frame.len() == table.names.len()));
            }
        }

        #[test]
        fn any_bytes_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
            prop_assert!(parse(&bytes).is_err());
        }
    }
}
