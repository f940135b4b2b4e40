//! Tables of markers: a row a frame, three columns a marker.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::{
    FrameRate, Timestamp,
    marker_take::{Fault, Table},
};

const TIMES: [&str; 4] = ["time_s", "time", "timestamp", "t"];
const FRAMES: [&str; 3] = ["frame", "frame_number", "index"];
const REMEDY: &str = "Correct that line, or export the table again";
const HEADER: &str = "Its first line is time_s,NAME_x,NAME_y,NAME_z,... with three columns a marker";

/// Where time and markers stand in a row.
struct Columns {
    names: Vec<String>,
    places: Vec<[usize; 3]>,
    time: Option<usize>,
    frame: Option<usize>,
}

impl Columns {
    fn find(header: &[&str]) -> Result<Self, Fault> {
        let mut axes: BTreeMap<&str, [Option<usize>; 3]> = BTreeMap::new();
        let mut order = Vec::new();
        let (mut time, mut frame) = (None, None);
        for (place, cell) in header.iter().enumerate() {
            let lower = cell.to_ascii_lowercase();
            if TIMES.contains(&lower.as_str()) {
                time = time.or(Some(place));
            } else if FRAMES.contains(&lower.as_str()) {
                frame = frame.or(Some(place));
            } else if let Some((name, axis)) = split_axis(cell) {
                let found = axes.entry(name).or_insert_with(|| {
                    order.push(name);
                    [None; 3]
                });
                if found[axis].replace(place).is_some() {
                    let reason = format!("line 1 names the column {cell} twice");
                    return Err(Fault::new(reason, "Give each marker its own name"));
                }
            }
        }
        let mut places = Vec::with_capacity(order.len());
        for &name in &order {
            let [Some(x), Some(y), Some(z)] = axes[name] else {
                let reason = format!("line 1 does not give all of x, y and z of {name}");
                return Err(Fault::new(reason, HEADER));
            };
            places.push([x, y, z]);
        }
        if order.is_empty() {
            return Err(Fault::new("line 1 names no markers", HEADER));
        }
        Ok(Self { names: order.into_iter().map(str::to_owned).collect(), places, time, frame })
    }
}

/// `Mouth_Lend_x` is x of `Mouth_Lend`; exporters also write `.X`, `:x` or a blank before the axis.
fn split_axis(cell: &str) -> Option<(&str, usize)> {
    let (name, axis) = cell.rsplit_once(['_', '.', ':', ' ', '-'])?;
    let axis = ["x", "y", "z"].iter().position(|known| axis.eq_ignore_ascii_case(known))?;
    let name = name.trim();
    (!name.is_empty()).then_some((name, axis))
}

/// Reads a whole table. An empty cell and NaN stand for a marker that was not seen; time is in seconds; without a column
/// of times, frame numbers (or rows) count at `rate`. Other columns are passed over.
pub(super) fn parse(bytes: &[u8], rate: FrameRate) -> Result<Table, Fault> {
    let text = std::str::from_utf8(bytes)
        .map_err(|error| Fault::new(format!("byte {} is no text", error.valid_up_to()), HEADER))?;
    let mut lines =
        text.trim_start_matches('\u{feff}').lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((_, header)) = lines.next() else {
        return Err(Fault::new("it holds nothing but blanks", HEADER));
    };
    let tidy = |line: &str| -> Vec<String> { line.split(',').map(|c| unquoted(c).to_owned()).collect() };
    let header = tidy(header);
    let names: Vec<&str> = header.iter().map(String::as_str).collect();
    let columns = Columns::find(&names)?;
    let mut table = Table { names: columns.names, ..Table::default() };
    let mut first_frame = None;
    let mut cells = Vec::with_capacity(header.len());
    for (row, (number, line)) in lines.enumerate() {
        let number = number + 1;
        cells.clear();
        cells.extend(line.split(',').map(unquoted));
        if cells.len() != header.len() {
            let reason =
                format!("line {number} has {} cells, and line 1 names {}", cells.len(), header.len());
            return Err(Fault::new(reason, REMEDY));
        }
        let fail = |place: usize, wanted: &str| {
            let reason =
                format!("line {number}, column {}: {:?} is not {wanted}", names[place], cells[place]);
            Fault::new(reason, REMEDY)
        };
        let time = match (columns.time, columns.frame) {
            (Some(place), _) => {
                Timestamp::from_decimal(cells[place]).ok_or_else(|| fail(place, "a time in seconds"))?
            }
            (None, Some(place)) => {
                let frame: u64 = cells[place].parse().map_err(|_| fail(place, "a frame number"))?;
                let since = frame.checked_sub(*first_frame.get_or_insert(frame));
                rate.tick(since.ok_or_else(|| fail(place, "a later frame"))?)
            }
            (None, None) => rate.tick(row as u64),
        };
        if table.times.last().is_some_and(|last| time <= *last) {
            let reason = format!("line {number} is not later than the line before");
            return Err(Fault::new(reason, "Export the frames in their order, each once"));
        }
        let value = |place: usize| match cells[place] {
            "" => Ok(f64::NAN),
            cell => {
                cell.parse().ok().filter(|v: &f64| !v.is_infinite()).ok_or_else(|| fail(place, "a number"))
            }
        };
        let mut frame = Vec::with_capacity(columns.places.len());
        for &[x, y, z] in &columns.places {
            let place = Point3::new(value(x)?, value(y)?, value(z)?);
            frame.push(place.iter().all(|c| c.is_finite()).then_some(place));
        }
        table.times.push(time);
        table.frames.push(frame);
    }
    Ok(table)
}

fn unquoted(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(cell).trim()
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Result<Table, String> {
        parse(text.as_bytes(), FrameRate::nearest(50.0)).map_err(|fault| fault.reason)
    }

    #[test]
    fn columns_in_any_order_with_blanks_quotes_and_a_mark() {
        let table = read(
            "\u{feff}\"B.Z\", Frame, time_s, A_x, A_y, A_z, B.X, B.Y, note\r\n\
             3, 7, 0.5, 1, 2, 3, -1e0, 2.5, x\r\n\r\n\
             , 9, 0.75, 4, nan, 6, 1, 2,\r\n",
        )
        .unwrap();
        assert_eq!(table.names, ["B", "A"]);
        assert_eq!(table.times, [Timestamp(500_000_000), Timestamp(750_000_000)]);
        assert_eq!(table.frames[0], [Some(Point3::new(-1.0, 2.5, 3.0)), Some(Point3::new(1.0, 2.0, 3.0))]);
        assert_eq!(table.frames[1], [None, None]);
    }

    #[test]
    fn frames_and_rows_count_at_the_rate() {
        let frames = read("frame,A_x,A_y,A_z\n10,1,2,3\n12,1,2,3\n").unwrap();
        assert_eq!(frames.times, [Timestamp(0), Timestamp(40_000_000)]);
        let rows = read("A_x,A_y,A_z\n1,2,3\n1,2,3\n").unwrap();
        assert_eq!(rows.times, [Timestamp(0), Timestamp(20_000_000)]);
    }

    #[test]
    fn errors_give_line_and_column() {
        let error = |text: &str| read(text).unwrap_err();
        assert!(error(" \n").contains("blanks"));
        assert!(error("time_s,a,b\n0,1,2").contains("names no markers"));
        assert!(error("A_x,A_y\n1,2").contains("x, y and z of A"));
        assert!(error("A_x,A_y,A_z,A_x\n").contains("A_x twice"));
        assert!(error("A_x,A_y,A_z\n1,2\n").contains("line 2 has 2 cells"));
        let cell = error("A_x,A_y,A_z\n1,2,3\n1,oops,3\n");
        assert!(cell.contains("line 3, column A_y") && cell.contains("oops"), "{cell}");
        assert!(error("A_x,A_y,A_z\n1,inf,3\n").contains("A_y"));
        assert!(error("time,A_x,A_y,A_z\n1e3,1,2,3\n").contains("time in seconds"));
        assert!(error("time,A_x,A_y,A_z\n1,1,2,3\n1,1,2,3").contains("line 3 is not later"));
        assert!(error("frame,A_x,A_y,A_z\n5,1,2,3\n4,1,2,3").contains("later frame"));
        assert!(parse(b"A_x\xff", FrameRate::nearest(50.0)).unwrap_err().reason.contains("byte 3"));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&bytes, FrameRate::nearest(60.0));
        }

        #[test]
        fn anything_like_a_table_is_read_or_refused(text in "[tfraABxyz_.,\n\r0-9eE+\"-]{0,200}") {
            let text = format!("time_s,A_x,A_y,A_z\n{text}");
            if let Ok(table) = read(&text) {
                prop_assert_eq!(table.times.len(), table.frames.len());
                prop_assert!(table.frames.iter().all(|frame| frame.len() == table.names.len()));
            }
        }

        #[test]
        fn numbers_come_back(
            rows in proptest::collection::vec(
                proptest::collection::vec(proptest::option::of(-1e6..1e6_f64), 6), 1..20),
        ) {
            let mut text = "frame,A_x,A_y,A_z,B_x,B_y,B_z\n".to_owned();
            for (f, row) in rows.iter().enumerate() {
                let cells: Vec<String> =
                    row.iter().map(|v| v.map_or(String::new(), |v| v.to_string())).collect();
                let _ = writeln!(text, "{f},{}", cells.join(","));
            }
            let table = read(&text).unwrap();
            for (frame, row) in table.frames.iter().zip(&rows) {
                for (place, cells) in frame.iter().zip(row.chunks(3)) {
                    let wanted = match cells {
                        [Some(x), Some(y), Some(z)] => Some(Point3::new(*x, *y, *z)),
                        _ => None,
                    };
                    prop_assert_eq!(*place, wanted);
                }
            }
        }
    }
}
