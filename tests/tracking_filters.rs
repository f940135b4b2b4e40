//! The filters against others' code: `tests/reference/tracking_filters.py`.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use nalgebra::SVector;
use serde::Deserialize;
use understudy::{
    capture::Timestamp,
    tracking::filter::{OneEuro, OneEuroSettings, ZeroPhase},
};

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    #[serde(flatten)]
    filter: Filter,
    times: Vec<i64>,
    values: Vec<Vec<f64>>,
    expected: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Filter {
    OneEuro { cutoff: f64, beta: f64 },
    Parabola { bandwidth: f64 },
}

impl Case {
    /// The largest difference to what the other program made of the signal.
    fn difference<const N: usize>(&self) -> f64 {
        let times: Vec<_> = self.times.iter().map(|&time| Timestamp(time)).collect();
        let values: Vec<_> = self.values.iter().map(|row| SVector::<f64, N>::from_row_slice(row)).collect();
        let found = match self.filter {
            Filter::OneEuro { cutoff, beta } => {
                let mut filter = OneEuro::new(OneEuroSettings { minimum_cutoff: cutoff, beta });
                times.iter().zip(&values).map(|(&time, &value)| filter.filter(time, value)).collect()
            }
            Filter::Parabola { bandwidth } => ZeroPhase::new(&times, bandwidth).apply(&values),
        };
        assert_eq!(found.len(), self.expected.len());
        found
            .iter()
            .zip(&self.expected)
            .map(|(found, expected)| (found - SVector::<f64, N>::from_row_slice(expected)).amax())
            .fold(0.0, f64::max)
    }
}

#[test]
fn filtered_signals_agree_with_other_programs() {
    let reference: Reference = serde_json::from_str(include_str!("reference/tracking_filters.json")).unwrap();
    assert_eq!(reference.cases.len(), 7);
    for (i, case) in reference.cases.iter().enumerate() {
        let difference = match case.values[0].len() {
            1 => case.difference::<1>(),
            3 => case.difference::<3>(),
            channels => panic!("case {i} has {channels} channels"),
        };
        // The signals are of the order of 10 and have six decimals.
        assert!(difference < 1e-10, "case {i}: {difference:e}");
    }
}
