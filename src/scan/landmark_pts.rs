//! iBUG's `.pts`: `version: 1`, `n_points: N`, then N lines `x y` or `x y z` between braces.
//!
//! Numbers stay as the file has them; in 2D that is pixels counted from 1. An unknown landmark is a line of `nan`.

use nalgebra::Point3;

use super::error::Fault;
use super::landmark_file::{LandmarkFile, MAX_LANDMARKS, decimal};

pub(super) fn parse(text: &str) -> Result<LandmarkFile, Fault> {
    let mut announced = None;
    let mut inside = false;
    let mut dimensions = None;
    let mut points = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        let fault = |what: &str| Fault::corrupt(format!("line {}: {what}", number + 1));
        if line.is_empty() || line.starts_with('#') || line.starts_with("//") {
            continue;
        }
        if !inside {
            if line == "{" {
                inside = true;
            } else if let Some(count) = line.strip_prefix("n_points:") {
                let count: usize = count.trim().parse().map_err(|_| fault("n_points is no number"))?;
                announced = Some(count);
            } else if !line.starts_with("version:") {
                return Err(fault("expected version:, n_points: or {"));
            }
            continue;
        }
        if line == "}" {
            return finish(points, announced, dimensions);
        }
        let values: Vec<f64> = line
            .split_whitespace()
            .take(4)
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map_err(|_| fault("expected numbers"))?;
        if !(values.len() == 2 || values.len() == 3) || dimensions.is_some_and(|d| d != values.len()) {
            return Err(fault("expected two or three numbers, as many in every line"));
        }
        if points.len() == MAX_LANDMARKS {
            return Err(fault("too many landmarks"));
        }
        dimensions = Some(values.len());
        let p = Point3::new(values[0], values[1], values.get(2).copied().unwrap_or(0.0));
        points.push((!p.iter().any(|c| c.is_nan())).then_some(p));
    }
    Err(Fault::corrupt("its list of points has no end"))
}

fn finish(
    points: Vec<Option<Point3<f64>>>,
    announced: Option<usize>,
    dimensions: Option<usize>,
) -> Result<LandmarkFile, Fault> {
    if let Some(count) = announced.filter(|n| *n != points.len()) {
        return Err(Fault::corrupt(format!("it announces {count} landmarks and has {}", points.len())));
    }
    let mut file = LandmarkFile::new("", points);
    file.dimensions = dimensions.unwrap_or(3);
    Ok(file)
}

pub(super) fn format(file: &LandmarkFile) -> String {
    let mut out = format!("version: 1\nn_points: {}\n{{\n", file.points.len());
    for point in &file.points {
        let numbers: Vec<String> = (0..file.dimensions.clamp(2, 3))
            .map(|axis| point.map_or_else(|| "nan".to_owned(), |p| decimal(p[axis])))
            .collect();
        out.push_str(&numbers.join(" "));
        out.push('\n');
    }
    out.push_str("}\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_and_three_dimensions() {
        let file = parse("version: 1\nn_points:  2\n{\n1.5 2\n3 4e1\n}\n").unwrap();
        assert_eq!((file.dimensions, file.points[1]), (2, Some(Point3::new(3.0, 40.0, 0.0))));
        assert_eq!(parse(&format(&file)).unwrap(), file);
        let file = parse("version: 1\r\nn_points: 2\r\n{\r\n1 2 3\r\nnan nan nan\r\n}").unwrap();
        assert_eq!((file.dimensions, file.points[1]), (3, None));
        assert_eq!(parse(&format(&file)).unwrap(), file);
    }

    #[test]
    fn says_what_is_wrong() {
        let reason = |text: &str| parse(text).unwrap_err().reason;
        assert!(reason("n_points: 3\n{\n1 2\n}").contains("announces 3 landmarks and has 1"));
        assert!(reason("{\n1 2\n1 2 3\n}").starts_with("line 3: expected two or three"));
        assert!(reason("{\n1 2\n").contains("no end"));
        assert!(reason("hello").contains("line 1"));
        assert!(reason("").contains("no end"));
    }
}
