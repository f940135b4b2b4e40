//! Fixed decimals by integer arithmetic: the motion table prints a million numbers a second.

use std::io::Write;

/// Products up to here are whole numbers that f64 holds exactly.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Appends `value` with `decimals` (0 to 9) decimals, halves away from zero; zero has no sign.
///
/// The value is scaled in f64 and rounded to an integer, so its last digit may differ from correct rounding where the
/// exact value lies within one unit of f64's last place of a half. `value` must be finite.
pub(super) fn push_fixed(line: &mut Vec<u8>, value: f64, decimals: usize) {
    const SCALES: [u64; 10] =
        [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];
    let scale = SCALES[decimals];
    let scaled = (value.abs() * scale as f64).round();
    if scaled >= EXACT {
        // Writing to a Vec cannot fail.
        let _ = write!(line, "{value:.decimals$}");
        return;
    }
    let scaled = scaled as u64;
    if value < 0.0 && scaled > 0 {
        line.push(b'-');
    }
    push_integer(line, scaled / scale);
    push_fraction(line, scaled % scale, decimals);
}

/// Appends integer nanoseconds as seconds with nine decimals, exactly.
pub(super) fn push_nanoseconds(line: &mut Vec<u8>, nanoseconds: i64) {
    if nanoseconds < 0 {
        line.push(b'-');
    }
    let size = nanoseconds.unsigned_abs();
    push_integer(line, size / 1_000_000_000);
    push_fraction(line, size % 1_000_000_000, 9);
}

/// Appends a whole number.
pub(super) fn push_integer(line: &mut Vec<u8>, mut value: u64) {
    let mut digits = [0_u8; 20];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    line.extend_from_slice(&digits[at..]);
}

fn push_fraction(line: &mut Vec<u8>, mut value: u64, decimals: usize) {
    if decimals == 0 {
        return;
    }
    let mut digits = [b'0'; 10];
    digits[0] = b'.';
    for digit in digits[1..=decimals].iter_mut().rev() {
        *digit = b'0' + (value % 10) as u8;
        value /= 10;
    }
    line.extend_from_slice(&digits[..=decimals]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fixed(value: f64, decimals: usize) -> String {
        let mut line = Vec::new();
        push_fixed(&mut line, value, decimals);
        String::from_utf8(line).unwrap()
    }

    #[test]
    fn known_values() {
        assert_eq!(fixed(0.0, 3), "0.000");
        assert_eq!(fixed(-0.0001, 3), "0.000");
        assert_eq!(fixed(-0.0005, 3), "-0.001");
        assert_eq!(fixed(639.9996, 3), "640.000");
        assert_eq!(fixed(12.5, 0), "13");
        assert_eq!(fixed(1e17, 3), "100000000000000000.000");
        assert_eq!(fixed(-1e300, 3), format!("{:.3}", -1e300));
        assert_eq!(fixed(f64::MAX, 9), format!("{:.9}", f64::MAX));
    }

    #[test]
    fn nanoseconds_are_exact() {
        for (nanoseconds, text) in [
            (0, "0.000000000"),
            (33_366_666, "0.033366666"),
            (-1, "-0.000000001"),
            (i64::MAX, "9223372036.854775807"),
            (i64::MIN, "-9223372036.854775808"),
        ] {
            let mut line = Vec::new();
            push_nanoseconds(&mut line, nanoseconds);
            assert_eq!(line, text.as_bytes());
        }
    }

    proptest! {
        #[test]
        fn within_half_a_unit_of_the_value(value in -1e5..1e5_f64, decimals in 0_usize..=9) {
            let printed: f64 = fixed(value, decimals).parse().unwrap();
            let unit = 10_f64.powi(-(decimals as i32));
            prop_assert!((printed - value).abs() <= 0.5 * unit + value.abs() * 1e-15);
        }
    }
}
