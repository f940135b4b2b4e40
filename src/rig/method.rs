//! Named choices: the rule for vectors, and the warp that spreads them. `docs/benchmarks/transfer.md` compares them.

use super::VolumeMorph;

/// How a displacement on the source becomes one on the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TransferRule {
    /// Bent by the Jacobian of the regularised landmark spline.
    #[default]
    Spline,
    /// As it is.
    Copy,
    /// 000 eq. 5.8 below the tip of the nose, by the ratio of mouth widths; eq. 5.10 above, as it is.
    Mouth,
    /// By the ratio of the distances between the outer eye corners.
    Eyes,
    /// Along each axis by the ratio of the two faces' extents.
    Axes,
}

/// How the controls' displacements reach every vertex.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum WarpKind {
    /// Over the surface: cotangent bilaplacian with the controls as handles. Where the mesh is too broken or too large
    /// for it, the spline takes its place.
    #[default]
    Surface,
    /// Through space: a spline of kernel r for either side of the lips.
    Spline,
    /// 000 §5.6.2: the face divided at the tip of the nose, a spline of kernel r² ln r² for either region.
    Regions,
    /// 002 §IV: through space from few landmarks, still at the face's edge.
    Volume(VolumeMorph),
}

/// Rule and warp.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Method {
    /// For vectors.
    pub rule: TransferRule,
    /// For vertices.
    pub warp: WarpKind,
}

impl Method {
    /// What 000 publishes.
    pub const THESIS: Self = Self { rule: TransferRule::Mouth, warp: WarpKind::Regions };
}
