//! The times of a clip's frames as the container states them, for frames whose time the decoder does not tell.
//!
//! OpenCV's FFmpeg back end (4.6 with FFmpeg 5) gives time 0 for the frames it drains from the decoder at the end of
//! a file: as many as the codec reorders and the decoder's threads hold back, so their number even depends on the
//! machine. `ffprobe` reads the same times from the packets without decoding.

use std::{path::Path, process::Command};

use super::Timestamp;

/// The presentation times of all frames since the first, in order; `None` where they cannot be had.
pub(super) fn packet_times(path: &Path) -> Option<Vec<Timestamp>> {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "v:0", "-of", "csv"])
        .args(["-show_entries", "packet=pts:stream=time_base"])
        .arg(path)
        .output()
        .ok()?;
    if output.status.success() { parse(&String::from_utf8_lossy(&output.stdout)) } else { None }
}

fn parse(text: &str) -> Option<Vec<Timestamp>> {
    let mut ticks: Vec<i128> = Vec::new();
    let mut base: Option<(i128, i128)> = None;
    for line in text.lines() {
        let mut cells = line.split(',');
        match (cells.next(), cells.next()) {
            (Some("packet"), Some(pts)) => ticks.push(pts.parse().ok()?),
            (Some("stream"), Some(fraction)) => {
                let (numerator, denominator) = fraction.split_once('/')?;
                base = Some((numerator.parse().ok()?, denominator.parse().ok()?));
            }
            _ => {}
        }
    }
    let (numerator, denominator) = base.filter(|(_, denominator)| *denominator > 0)?;
    ticks.sort_unstable();
    let first = *ticks.first()?;
    ticks
        .into_iter()
        .map(|tick| {
            let nanoseconds = tick.checked_sub(first)?.checked_mul(numerator)?.checked_mul(1_000_000_000)?;
            // Rounded as the decoder's own times are.
            i64::try_from((nanoseconds + denominator / 2) / denominator).ok().map(Timestamp)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact_and_in_the_order_of_presentation() {
        let text = "packet,1001\npacket,3003,\npacket,2002\nstream,1/30000\n";
        assert_eq!(parse(text), Some(vec![Timestamp(0), Timestamp(33_366_667), Timestamp(66_733_333)]));
    }

    #[test]
    fn what_is_not_stated_is_not_guessed() {
        assert_eq!(parse("packet,N/A\nstream,1/25\n"), None);
        assert_eq!(parse("packet,0\nstream,0/0\n"), None);
        assert_eq!(parse("stream,1/25\n"), None);
        assert_eq!(parse(""), None);
    }
}
