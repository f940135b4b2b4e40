use std::{fmt::Write as _, fs};

use super::*;
use proptest::prelude::*;

fn read_text(text: impl AsRef<[u8]>) -> Result<Score, ActionError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("score.csv");
    fs::write(&path, text).unwrap();
    read(&path)
}

fn at(score: &Score, seconds: f64) -> String {
    let weights = score.at(Timestamp((seconds * 1e9) as i64));
    let on: Vec<_> = weights.iter().map(|(key, m)| format!("{key}={m}")).collect();
    on.join(" ")
}

#[track_caller]
fn refused(text: impl AsRef<[u8]>, words: &[&str]) {
    let said = read_text(text).unwrap_err().to_string();
    for word in words.iter().chain(&["score.csv"]) {
        assert!(said.contains(word), "{word:?} is not in: {said}");
    }
    assert!(said.len() < 600 && said.lines().count() == 1, "{said}");
}

const KEYS: &str = "\u{feff}# a smile\r\n\r\n time , au , magnitude\r\n1.0, AU12 ,1\r\n0.0,12,0\r\n  # then\r\n\
                    1.0,12L,0.5 # weaker, on the left\r\n2,happiness,0\r\n0.5,17,0.25\r\n";

#[test]
fn keyframes_in_any_order_with_comments_blanks_and_emotions() {
    let score = read_text(KEYS).unwrap();
    assert_eq!((score.start(), score.end()), (Timestamp(0), Timestamp(2_000_000_000)));
    assert_eq!(score.frames(), None);
    assert!(score.ignored().is_empty());
    assert_eq!(at(&score, 0.0), "17=0.25");
    assert_eq!(at(&score, 0.5), "12R=0.5 12L=0.25 17=0.25");
    assert_eq!(at(&score, 1.0), "12R=1 12L=0.5 17=0.25");
    assert_eq!(at(&score, 1.5), "12R=0.5 12L=0.25 17=0.25");
    assert_eq!(at(&score, 2.0), "17=0.25");
}

#[test]
fn of_two_rows_for_one_moment_the_later_counts() {
    let score = read_text("time,au,magnitude\n1,anger,1\n1,4,0.5\n1,4R,0.25\n").unwrap();
    assert_eq!(at(&score, 1.0), "4R=0.25 4L=0.5 5R=1 5L=1 7R=1 7L=1 23=1 25=1");
    let score = read_text("time,au,magnitude\n1,4R,0.25\n1,anger,1\n").unwrap();
    assert!(at(&score, 1.0).starts_with("4R=1 4L=1"));
}

#[test]
fn columns_of_keyframes_may_be_quoted_reordered_and_joined_by_others() {
    let score = read_text("\"magnitude\",\"note\",\"time\",\"AU\"\n0.5,\"slow\",1e-3,\"17\"\n").unwrap();
    assert_eq!(at(&score, 0.0), "17=0.5");
    assert_eq!(score.end(), Timestamp(1_000_000));
}

const TABLE: &str = "frame, face_id, timestamp, confidence, success, AU01_r, AU12_r, AU45_r, AU12L_r, AU08_r, AU17L_r, \
                     AU12_c\r\n\
                     1, 0, 0.000, 0.98, 1, 0.00, 2.50, , 1.25, 3, 1, 1\r\n\
                     2, 0, 0.033, 0.98, 1, 5.02, nan, NaN, 0, 3, 1, 1\r\n\
                     3, 0, 0.067, 0.02, 0, 4.00, 4.00, 4, 4, 3, 1, x\r\n\
                     4, 0, 0.1, 0.98, 1, -0.01, 5, 2.5, 5, 3, 1, 1\r\n";

#[test]
fn an_openface_table_with_sided_columns_and_a_lost_face() {
    let score = read_text(TABLE).unwrap();
    assert_eq!(score.frames(), Some(4));
    assert_eq!((score.start(), score.end()), (Timestamp(0), Timestamp(100_000_000)));
    assert_eq!(score.ignored(), ["AU08_r", "AU17L_r"]);
    assert_eq!(at(&score, 0.0), "12R=0.5 12L=0.25");
    assert_eq!(at(&score, 0.033), "1R=1 1L=1");
    assert_eq!(at(&score, 0.067), "1R=1 1L=1");
    assert_eq!(at(&score, 0.1), "12R=1 12L=1 45R=0.5 45L=0.5");
    let on: Vec<_> = score.actions().map(|key| key.to_string()).collect();
    assert_eq!(on, ["1R", "1L", "12R", "12L", "45R", "45L"]);
}

#[test]
fn a_face_that_is_found_late_begins_as_it_is_found() {
    let score = read_text("timestamp,success,AU17_r\n0,0,5\n1,1,2.5\n2,0,0\n").unwrap();
    assert_eq!(at(&score, 0.0), "17=0.5");
    assert_eq!(at(&score, 2.0), "17=0.5");
    assert_eq!((score.start().0, score.end().0), (0, 2_000_000_000));
}

/// Long stretches of one value are kept as their ends, and read as they were written.
#[test]
fn rows_that_repeat_cost_nothing_and_change_nothing() {
    let mut text = "timestamp,AU17_r\n".to_owned();
    let value = |row: u32| if row < 500 { 0.0 } else { f64::from(row % 3) };
    for row in 0..1000 {
        writeln!(text, "{row},{}", value(row)).unwrap();
    }
    let score = read_text(text).unwrap();
    for row in 0..1000 {
        let got = score.at(Timestamp(i64::from(row) * 1_000_000_000)).of(ActionKey { au: 17, side: None });
        assert!((got - value(row) / 5.0).abs() < 1e-12, "{row}");
    }
}

#[test]
fn headers_that_are_neither_are_explained() {
    let words = &["line", "`time,au,magnitude`", "`timestamp`", "`AU12_r`"];
    for text in
        ["0.0,12,0\n", "a\n", "frame,timestamp,success\n1,0,1\n", "AU12_r\n1\n", "time;au;magnitude\n"]
    {
        refused(text, words);
    }
    refused("", &["empty", "`time,au,magnitude`"]);
    refused("# only\n\n", &["empty"]);
    refused("frame, timestamp, AU99_r\n", &["neither", "\"frame\""]);
}

#[test]
fn faults_name_the_line() {
    let keys = |row: &str| format!("time,au,magnitude\n# comment\n\n{row}\n");
    for (row, word) in [
        ("0.5,12", "a keyframe is"),
        ("0.5,12,", "a keyframe is"),
        ("-1,12,0", "no time"),
        ("NaN,12,0", "no time"),
        ("inf,12,0", "no time"),
        ("1e300,12,0", "no time"),
        ("99999999999,12,0", "no time"),
        ("soon,12,0", "no time"),
        ("1,99,0", "Known: 1, 2, 4"),
        ("1,17L,0", "no sides"),
        ("1,bliss,0", "happiness"),
        ("1,12,1.01", "0 to 1"),
        ("1,12,-0.1", "0 to 1"),
        ("1,12,NaN", "0 to 1"),
        ("1,12,0,8", ""),
    ] {
        if word.is_empty() {
            // A further cell is a further column.
            assert!(read_text(keys(row)).is_ok());
        } else {
            refused(keys(row), &["line 4", word]);
        }
    }
    refused("time,au,magnitude\n", &["no keyframes"]);
    for (row, word) in [
        ("0.1,1,1,1", "4 cells"),
        ("0.1,1", "2 cells"),
        ("0.0,1,1", "not after"),
        ("-1,1,1", "no time"),
        ("0.1,maybe,1", "success"),
        ("0.1,1,inf", "no intensity"),
        ("0.1,1,80", "no intensity"),
        ("0.1,1,high", "no intensity"),
    ] {
        refused(format!("timestamp,success,AU12_r\n0.0,1,1\n{row}\n"), &["line 3", word]);
    }
    refused("timestamp,success,AU12_r\n0,0,1\n", &["no row"]);
    refused("timestamp,AU12_r\n", &["no rows"]);
    refused("timestamp,AU12_r,AU12_r\n0,1,1\n", &["twice"]);
}

#[test]
fn hostile_files_are_errors() {
    refused(b"time,au,magnitude\n0,12,0\0\n", &["line 2", "NUL"]);
    refused(b"\xff\xfet\0i\0m\0e\0", &["line 1"]);
    refused(b"time,au,magnitude\n0,12\xff,0\n", &["line 2", "UTF-8"]);
    refused(format!("time,au,magnitude\n0,{},0\n", "x".repeat(1 << 20)), &["line 2"]);
    refused(format!("time,au,magnitude\n0,{}12,0\n", "0".repeat(1 << 20)), &["line 2"]);
    let wide = format!("{}timestamp,AU12_r\n", "AU12_c,".repeat(1_000_000));
    assert_eq!(read_text(format!("{wide}{}0,5\n", ",".repeat(1_000_000))).unwrap().frames(), Some(1));
    refused(format!("{wide}0,5\n"), &["line 2", "2 cells"]);
    let folder = tempfile::tempdir().unwrap();
    assert!(read(folder.path()).is_err());
    let none = read(&folder.path().join("none.csv")).unwrap_err().to_string();
    assert!(none.contains("none.csv"), "{none}");
    let huge = folder.path().join("huge.csv");
    fs::File::create(&huge).unwrap().set_len((256 << 20) + 1).unwrap();
    assert!(read(&huge).unwrap_err().to_string().contains("256 MiB"));
}

proptest! {
    #[test]
    fn nothing_makes_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_text(bytes);
    }

    #[test]
    fn nothing_after_a_header_makes_it_panic(
        header in prop::sample::select(vec!["time,au,magnitude", "timestamp, success, AU12_r, AU12L_r, AU99_r"]),
        rows in prop::collection::vec("[-0-9.,AULRelnaif#\" ]{0,24}", 0..8),
        cut in 0..200_usize,
    ) {
        let text = format!("{header}\n{}", rows.join("\n"));
        let end = text.len() - cut.min(text.len());
        if let Ok(score) = read_text(&text.as_bytes()[..end]) {
            for time in [score.start(), score.end(), Timestamp(i64::MIN), Timestamp(i64::MAX)] {
                prop_assert!(score.at(time).iter().all(|(_, m)| (0.0..=1.0).contains(&m)));
            }
        }
    }

    #[test]
    fn shuffled_keyframes_are_the_same_score(
        keys in prop::collection::vec((0..2000_i64, 0..=100_u8), 1..30),
        turn in 0..30_usize,
    ) {
        let mut keys: Vec<_> = keys.into_iter().collect::<BTreeMap<_, _>>().into_iter().collect();
        let text = |keys: &[(i64, u8)]| {
            keys.iter().fold("time,au,magnitude\n".to_owned(), |text, (t, m)| {
                text + &format!("{:.3},12,{:.2}\n", *t as f64 / 1000.0, f64::from(*m) / 100.0)
            })
        };
        let sorted = read_text(text(&keys)).unwrap();
        let turn = turn % keys.len();
        keys.rotate_left(turn);
        prop_assert_eq!(read_text(text(&keys)).unwrap(), sorted);
    }
}
