//! Where the time goes, for reports only: nothing computed depends on it.

use std::{
    collections::BTreeMap,
    fmt,
    time::{Duration, Instant},
};

/// Time spent in each stage and how often it was entered.
#[derive(Debug, Clone, Default)]
pub struct Stopwatch {
    stages: BTreeMap<&'static str, (Duration, u64)>,
    order: Vec<&'static str>,
}

impl Stopwatch {
    /// Runs `work` and books its time under `stage`.
    pub fn time<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(stage, start.elapsed(), 1);
        result
    }

    /// Takes over the times of another watch, such as one from another thread.
    pub fn merge(&mut self, other: &Self) {
        for stage in &other.order {
            let (time, count) = other.stages[stage];
            self.add(stage, time, count);
        }
    }

    fn add(&mut self, stage: &'static str, time: Duration, count: u64) {
        let entry = self.stages.entry(stage).or_insert_with(|| {
            self.order.push(stage);
            (Duration::ZERO, 0)
        });
        entry.0 += time;
        entry.1 += count;
    }
}

impl fmt::Display for Stopwatch {
    /// A Markdown table: stage, calls, total and mean milliseconds.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "| stage | calls | total ms | mean ms |\n|---|---:|---:|---:|")?;
        for stage in &self.order {
            let (time, count) = self.stages[stage];
            let total = time.as_secs_f64() * 1e3;
            writeln!(formatter, "| {stage} | {count} | {total:.1} | {:.3} |", total / count.max(1) as f64)?;
        }
        Ok(())
    }
}
