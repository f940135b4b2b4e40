//! The part of the command line that says how motion is carried and spread, and from which library it comes.

use std::{borrow::Cow, path::Path};

use clap::{Args, ValueEnum};
use understudy::{
    actions::{ActionError, ActionLibrary},
    rig::{Method, TransferRule, WarpKind},
};

/// Rule, warp, or a published combination of both.
#[derive(Args)]
pub struct MethodArgs {
    /// How vectors are carried from one face to the other
    #[arg(long, value_enum, value_name = "RULE")]
    transfer: Option<RuleArg>,
    /// How the control points' motion reaches every vertex
    #[arg(long, value_enum, value_name = "WARP")]
    warp: Option<WarpArg>,
    /// A published combination of rule and warp; --transfer and --warp still have their say
    #[arg(long, value_enum)]
    preset: Option<PresetArg>,
}

#[derive(Clone, Copy, ValueEnum)]
enum RuleArg {
    /// Bent with the regularised landmark spline (default)
    Spline,
    /// As they are
    Copy,
    /// Those of the lower face scaled by the mouths' widths, the others as they are (Erdoğdu)
    Mouth,
    /// Scaled by the distances of the eyes
    Eyes,
    /// Scaled along each axis by the faces' extents
    Axes,
}

#[derive(Clone, Copy, ValueEnum)]
enum WarpArg {
    /// Over the surface; where the mesh is too broken, through space (default)
    Surface,
    /// Through space, either side of the lips by itself
    Spline,
    /// Through space, upper and lower face apart, on the scan as it is (Erdoğdu)
    Regions,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetArg {
    /// Erdoğdu's thesis: --transfer mouth --warp regions
    Thesis,
}

impl MethodArgs {
    /// Whether a warp was asked for, by itself or with a preset.
    pub fn names_warp(&self) -> bool {
        self.warp.is_some() || self.preset.is_some()
    }

    pub fn method(&self) -> Method {
        let mut method = match self.preset {
            Some(PresetArg::Thesis) => Method::THESIS,
            None => Method::default(),
        };
        if let Some(rule) = self.transfer {
            method.rule = match rule {
                RuleArg::Spline => TransferRule::Spline,
                RuleArg::Copy => TransferRule::Copy,
                RuleArg::Mouth => TransferRule::Mouth,
                RuleArg::Eyes => TransferRule::Eyes,
                RuleArg::Axes => TransferRule::Axes,
            };
        }
        if let Some(warp) = self.warp {
            method.warp = match warp {
                WarpArg::Surface => WarpKind::Surface,
                WarpArg::Spline => WarpKind::Spline,
                WarpArg::Regions => WarpKind::Regions,
            };
        }
        method
    }
}

/// A library file, or the built-in one.
pub fn library(path: Option<&Path>) -> Result<Cow<'static, ActionLibrary>, ActionError> {
    path.map_or(Ok(Cow::Borrowed(ActionLibrary::built_in())), |path| {
        ActionLibrary::read(path).map(Cow::Owned)
    })
}
