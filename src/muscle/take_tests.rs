//! Files of curves as they come: whole, cut, hostile and random.

use std::fs;

use proptest::prelude::*;

use super::*;
use crate::{capture::Timestamp, lift::FaceState, muscle::Channel};

const TABLE: &str = "frame,timestamp,state,jawOpen,browInnerUp,error_upper_mm,error_lower_mm,jawOpen_s,browInnerUp_s\n\
                     1,0.000000000,waiting,0.000000,0.000000,,,measured,weak\n\
                     2,0.040000000,tracking,0.500000,-0.250000,0.125,1.500,measured,weak\n";

fn read(bytes: impl AsRef<[u8]>) -> Result<CurveTake, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.csv");
    fs::write(&path, bytes).unwrap();
    CurveTake::read(&path).map_err(|error| error.to_string())
}

fn live_link(rows: &[(&str, &str)]) -> String {
    let mut text = String::from("Timecode,BlendshapeCount,JawOpen,EyeBlinkLeft,HeadYaw\n");
    for (code, rest) in rows {
        text.extend([code, ",", rest, "\n"]);
    }
    text
}

#[test]
fn a_table_is_read_by_its_names() {
    let take = read(TABLE).unwrap();
    assert!(take.live_link.is_none());
    let curves = take.curves;
    assert_eq!(curves.muscles(), ["jawOpen", "browInnerUp"]);
    assert_eq!(curves.channels(), [Channel::Measured, Channel::Weak]);
    assert_eq!(curves.rate().to_string(), "25");
    let [first, second] = curves.frames() else { panic!("two frames") };
    assert_eq!((first.state, first.error), (FaceState::Waiting, None));
    assert_eq!((second.time, second.error), (Timestamp(40_000_000), Some([0.125, 1.5])));
    assert_eq!(second.contractions, [0.5, -0.25]);

    let spare =
        read("\u{feff}browInnerUp, timestamp\r\n# by hand\r\n\r\n \"0.5\" , 1e-1\r\n").unwrap().curves;
    assert_eq!(spare.channels(), [Channel::Measured]);
    assert_eq!(spare.frames()[0].time, Timestamp(100_000_000));
    assert_eq!(spare.frames()[0].state, FaceState::Tracking);
}

#[test]
fn mistakes_in_a_table_are_named_with_their_line_and_remedy() {
    let said = |from: &str, to: &str| {
        let text = TABLE.replacen(from, to, 1);
        assert_ne!(text, TABLE, "{from}");
        read(text).unwrap_err()
    };
    for (from, to, wanted) in [
        ("timestamp", "time", "does not name the column timestamp"),
        ("browInnerUp,", "jawOpen,", "names the column \"jawOpen\" twice"),
        ("frame", "face_id", "a table of motion"),
        ("0.500000", "NaN", "line 3: \"NaN\" is no contraction of jawOpen"),
        ("0.500000", "1e300", "jawOpen is 1"),
        ("0.500000", "", "line 3: \"\" is no contraction of jawOpen"),
        ("0.500000,", "", "line 3: it has 8 cells, and the header names 9"),
        ("tracking", "lost", "line 3: \"lost\" is no state"),
        ("0.040000000", "0.000", "line 3: its time 0 s is not after"),
        ("0.040000000", "-1", "line 3: \"-1\" is no time"),
        ("1.500", "", "line 3: \"0.125\" and \"\" are not two marker errors"),
        ("1.500", "-1", "are not two marker errors"),
        ("1.500,measured", "1.500,good", "\"good\" is no channel of jawOpen"),
        ("1.500,measured", "1.500,absent", "the channel of jawOpen is absent here and another above"),
        ("jawOpen,browInnerUp,", ",browInnerUp,", "cannot name a column"),
    ] {
        let error = said(from, to);
        assert!(error.contains(wanted) && error.contains("take.csv"), "{wanted}: {error}");
    }
    assert!(read("").unwrap_err().contains("empty"));
    assert!(read("timestamp,jawOpen\n").unwrap_err().contains("no rows"));
    assert!(read("timestamp,state\n0,tracking\n").unwrap_err().contains("names no muscle"));
    assert!(read(b"timestamp,jawOpen\n0,\xff\n").unwrap_err().contains("not UTF-8"));
    assert!(read(b"timestamp,jawOpen\n0,\0\n").unwrap_err().contains("NUL"));
    let cut = &TABLE[..TABLE.len() - 20];
    assert!(read(cut).unwrap_err().contains("line 3"));
    let wide: Vec<String> = (0..2000).map(|k| format!("m{k}")).collect();
    assert!(read(format!("timestamp,{}\n", wide.join(","))).unwrap_err().contains("2000 muscles"));
}

#[test]
fn a_recording_is_read_with_its_angles_and_lost_faces() {
    let text = live_link(&[
        ("23:59:59:58.500", "61,0.25,0.5,0.1"),
        ("23:59:59:59.500", "0,,,"),
        ("00:00:00:00.500", "0"),
        ("00:00:00:01.500", "61,0.75,0.5,-0.1"),
    ]);
    let take = read(text).unwrap();
    let extras = take.live_link.unwrap();
    assert_eq!(extras.base.nominal, 60);
    assert_eq!(extras.angles.iter().map(|a| a.head[0]).collect::<Vec<_>>(), [0.1, 0.1, 0.1, -0.1]);
    let curves = take.curves;
    let jaw = curves.muscles().iter().position(|name| name == "jawOpen").unwrap();
    assert_eq!(curves.track(jaw).collect::<Vec<_>>(), [0.25, 0.25, 0.25, 0.75]);
    assert_eq!((curves.muscles().len(), curves.channels()[jaw]), (52, Channel::Measured));
    assert_eq!(curves.channels().iter().filter(|channel| **channel == Channel::Absent).count(), 50);
    let states: Vec<_> = curves.frames().iter().map(|frame| frame.state.name()).collect();
    assert_eq!(states, ["tracking", "holding", "holding", "tracking"]);
    let last = curves.frames()[3].time.0;
    assert!((last - 50_000_000).abs() < 2, "{last}");
}

#[test]
fn mistakes_in_a_recording_are_named() {
    let said = |rows: &[(&str, &str)]| read(live_link(rows)).unwrap_err();
    assert!(said(&[]).contains("no rows"));
    assert!(said(&[("1:2", "61,0,0,0")]).contains("line 2: \"1:2\" is no timecode"));
    assert!(said(&[("00:00:00:00", "61,0,0")]).contains("line 2: it has 4 cells"));
    assert!(said(&[("00:00:00:00", "61,inf,0,0")]).contains("\"inf\" is no value of JawOpen"));
    let twice = [("00:00:00:01.0", "61,0,0,0"), ("00:00:00:01.0", "61,0,0,0")];
    assert!(said(&twice).contains("line 3: its timecode is not after"));
    let days = ["23:00:00:00", "01:00:00:00", "23:00:00:00", "01:00:00:00"].map(|code| (code, "0"));
    assert!(said(&days).contains("line 5: its timecode passes midnight once more"));
    let header = "Timecode,BlendShapeCount,JawOpen,jawopen\n00:00:00:01,61,0,0\n";
    assert!(read(header).unwrap_err().contains("names \"jawopen\" twice"));
    assert!(read("Timecode,BlendShapeCount\n00:00:00:01,61\n").unwrap_err().contains("52 shapes"));
}

/// Something like a file of curves, with mistakes.
fn scrap() -> impl Strategy<Value = Vec<u8>> {
    let word = prop::sample::select(vec![
        "timestamp",
        "state",
        "jawOpen",
        "jawOpen_s",
        "Timecode",
        "BlendShapeCount",
        "error_upper_mm",
        "error_lower_mm",
        "0",
        "0.04",
        "00:00:00:01.5",
        "61",
        "tracking",
        "measured",
        "NaN",
        "-1e308",
        "",
        "#",
        "\"",
        "é",
        "\n",
        "\n",
        "\r\n",
    ]);
    prop::collection::vec(word, 0..60).prop_map(|words| words.join(",").replace(",\n,", "\n").into_bytes())
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(bytes);
    }

    #[test]
    fn no_scrap_makes_it_panic(bytes in scrap()) {
        let _ = read(bytes);
    }
}
