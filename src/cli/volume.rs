//! The part of the command line that says how a volume morph is made.

use clap::{Args, ValueEnum};
use understudy::{
    rig::{VolumeMorph, VolumePoints},
    spline::Kernel,
};

/// Options of `--drive volume`.
#[derive(Args)]
pub struct VolumeArgs {
    /// --drive volume: the tracked points that move it [default: 18]
    #[arg(long, value_enum, value_name = "NUMBER")]
    points: Option<PointsArg>,
    /// --drive volume: the radial function [default: hardy]
    #[arg(long, value_enum, value_name = "NAME")]
    kernel: Option<KernelArg>,
    /// --drive volume: how far points may be missed for a smoother face, 0 or above [default: 0.01]
    #[arg(long, value_name = "LAMBDA", value_parser = at_least_nothing, allow_negative_numbers = true)]
    lambda: Option<f64>,
    /// --drive volume: factor on each point's distance to the next, which is how softly it acts [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = above_nothing, allow_negative_numbers = true)]
    stiffness: Option<f64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum PointsArg {
    /// Corners of the eyes, nose, brows, lips and chin (Fidaleo et al.)
    #[value(name = "18")]
    Tracked,
    /// iBUG's 68
    #[value(name = "68")]
    Ibug,
    /// All landmarks of the skin
    #[value(name = "468")]
    All,
}

#[derive(Clone, Copy, ValueEnum)]
enum KernelArg {
    /// Hardy's multiquadric
    Hardy,
    /// A Gaussian, which smooths fine motion over
    Gaussian,
}

impl VolumeArgs {
    /// The morph, published where nothing else was asked for.
    pub fn morph(&self) -> VolumeMorph {
        let published = VolumeMorph::default();
        VolumeMorph {
            points: self.points.map_or(published.points, |points| match points {
                PointsArg::Tracked => VolumePoints::Tracked,
                PointsArg::Ibug => VolumePoints::Ibug,
                PointsArg::All => VolumePoints::All,
            }),
            kernel: self.kernel.map_or(published.kernel, |kernel| match kernel {
                KernelArg::Hardy => Kernel::Hardy,
                KernelArg::Gaussian => Kernel::Gaussian,
            }),
            lambda: self.lambda.unwrap_or(published.lambda),
            stiffness: self.stiffness.unwrap_or(published.stiffness),
        }
    }

    /// The first option that was given.
    pub fn given(&self) -> Option<&'static str> {
        [
            ("--points", self.points.is_some()),
            ("--kernel", self.kernel.is_some()),
            ("--lambda", self.lambda.is_some()),
            ("--stiffness", self.stiffness.is_some()),
        ]
        .into_iter()
        .find_map(|(name, is_given)| is_given.then_some(name))
    }
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "not a finite number".to_owned())
}

fn at_least_nothing(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| if value >= 0.0 { Ok(value) } else { Err("below 0".to_owned()) })
}

fn above_nothing(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| if value > 0.0 { Ok(value) } else { Err("not above 0".to_owned()) })
}
