//! Progress bars on standard error; silent when nobody watches.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar for `total` frames, or a counter where the total is unknown.
pub fn bar(title: &'static str, total: Option<u64>, quiet: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(total, target(quiet)).with_message(title);
    let template = if total.is_some() {
        "{msg:<12} {bar:30} {pos}/{len} frames, {per_sec}, {eta} left"
    } else {
        "{msg:<12} {spinner} {pos} frames, {per_sec}"
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// A bar for `total` of the things named `what`.
pub fn count(title: &'static str, what: &str, total: u64, quiet: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), target(quiet)).with_message(title);
    let template = format!("{{msg:<12}} {{bar:30}} {{pos}}/{{len}} {what}, {{eta}} left");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// A sign of life for work whose steps cannot be counted.
pub fn spinner(title: &'static str, quiet: bool) -> ProgressBar {
    let spinner = ProgressBar::with_draw_target(None, target(quiet)).with_message(title);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
        spinner.set_style(style);
    }
    spinner.enable_steady_tick(Duration::from_millis(200));
    spinner
}

fn target(quiet: bool) -> ProgressDrawTarget {
    if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) }
}
