//! The smoothest displacement of a surface that moves its handles as asked, as a matrix.
//!
//! Of all displacements d of the vertices the one is taken that makes dᵀ(L M⁻¹ L + αL)d + w Σ|C d − q|² least: L is the
//! cotangent Laplacian, M the vertices' areas, C the handles' barycentric weights and q where they are to go. The first
//! term is the bending of a thin plate on the surface (000 eq. 4.1 in the plane), α draws it taut, and w is so large that
//! handles arrive. It is linear in q, so d = B·q with B solved for once.

use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{
        SparseColMat, Triplet,
        linalg::solvers::{Llt, SymbolicLlt},
    },
};
use nalgebra::Point3;

use super::{DeformError, SurfaceLaplacian};

/// Vertices that are solved for at most: beyond, factor and matrix no longer fit a desktop's memory.
const MOST_VERTICES: usize = 60_000;
/// w in units of the bending term's diagonal at the handle: handles arrive where the motion is smooth, and two that lie in one
/// triangle and disagree do not tear it.
const GRIP: f64 = 3.0;
/// A little of everything's own place keeps islands without handles solvable, in units of the same diagonal.
const REST: f64 = 1e-10;
/// Handles solved for at once: so many right-hand sides fill the solver's registers and stay in its cache.
const BLOCK: usize = 64;
/// No vertex follows a column by more than this factor; beyond it the surface is folded or torn.
const MOST_SHARE: f64 = 40.0;

/// A point of the surface that is moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Handle {
    /// Vertices of its triangle; for a vertex, three times itself.
    pub vertices: [u32; 3],
    /// Their weights, together 1.
    pub weights: [f64; 3],
    /// The columns of B that it follows, and by what share of each.
    pub follows: [(usize, f64); 2],
}

impl Handle {
    /// At a vertex, following one column.
    pub fn at(vertex: u32, column: usize) -> Self {
        Self { vertices: [vertex; 3], weights: [1.0, 0.0, 0.0], follows: [(column, 1.0), (column, 0.0)] }
    }
}

/// How taut the surface is against how stiff.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// α, per squared unit of the positions: 0 bends like a plate, more pulls like a membrane, so that motion dies away
    /// sooner.
    pub tension: f64,
}

/// B and which vertices it moves.
#[derive(Debug, Clone)]
pub struct SurfaceWarp {
    /// Vertices that have a row, in order.
    pub vertices: Vec<u32>,
    /// Column by column a share for each of `vertices`.
    columns: Vec<f32>,
}

impl SurfaceWarp {
    /// Solves for B. `positions` V, `triangles` T × 3, in one frame and unit; the handles follow `columns` columns. A
    /// vertex moves unless `still` (V) says otherwise or no handle lies on its piece of the surface. One thread; the same
    /// input gives the same bytes.
    pub fn new(
        positions: &[Point3<f64>],
        triangles: &[[u32; 3]],
        handles: &[Handle],
        columns: usize,
        still: &[bool],
        stiffness: Stiffness,
    ) -> Result<Self, DeformError> {
        check(positions, triangles, handles, columns)?;
        let laplacian = SurfaceLaplacian::new(positions, triangles);
        let reached = reached(&laplacian, handles, still);
        let vertices: Vec<u32> = (0..positions.len() as u32).filter(|&v| reached[v as usize]).collect();
        if vertices.is_empty() {
            return Err(DeformError::NoHandles);
        }
        if vertices.len() > MOST_VERTICES {
            return Err(DeformError::TooLarge { vertices: vertices.len(), most: MOST_VERTICES });
        }
        let mut rows = vec![usize::MAX; positions.len()];
        for (row, &vertex) in vertices.iter().enumerate() {
            rows[vertex as usize] = row;
        }
        let (factor, grips) = factor(&laplacian, &rows, vertices.len(), handles, stiffness)?;
        let mut followers: Vec<Vec<(usize, f64)>> = vec![Vec::new(); columns];
        for (index, handle) in handles.iter().enumerate() {
            for (column, share) in handle.follows.into_iter().filter(|(_, share)| *share != 0.0) {
                followers[column].push((index, share));
            }
        }
        let mut shares = Vec::with_capacity(vertices.len() * columns);
        for block in followers.chunks(BLOCK) {
            let mut right = Mat::<f64>::zeros(vertices.len(), block.len());
            for (j, followers) in block.iter().enumerate() {
                for &(index, share) in followers {
                    let (handle, grip) = (&handles[index], grips[index]);
                    for (&vertex, weight) in handle.vertices.iter().zip(handle.weights) {
                        let row = rows[vertex as usize];
                        if row != usize::MAX {
                            right[(row, j)] += grip * weight * share;
                        }
                    }
                }
            }
            factor.solve_in_place(right.as_mut());
            for j in 0..block.len() {
                shares.extend((0..vertices.len()).map(|row| right[(row, j)] as f32));
            }
        }
        match shares.iter().find(|share| share.is_nan() || share.abs() > MOST_SHARE as f32) {
            Some(share) => {
                Err(DeformError::Broken { reason: format!("a vertex follows a handle {share} times over") })
            }
            None => Ok(Self { vertices, columns: shares }),
        }
    }

    /// How much each of [`SurfaceWarp::vertices`] follows a column's displacement.
    pub fn column(&self, column: usize) -> &[f32] {
        let length = self.vertices.len();
        &self.columns[column * length..(column + 1) * length]
    }
}

fn check(
    positions: &[Point3<f64>],
    triangles: &[[u32; 3]],
    handles: &[Handle],
    columns: usize,
) -> Result<(), DeformError> {
    let exists = |vertices: &[u32; 3]| vertices.iter().all(|&v| (v as usize) < positions.len());
    let bad = |what, index: Option<usize>| index.map(|index| DeformError::Unusable { what, index });
    let fault = bad("position", positions.iter().position(|p| !p.iter().all(|c| c.is_finite())))
        .or_else(|| bad("triangle", triangles.iter().position(|t| !exists(t))))
        .or_else(|| {
            let usable = |h: &Handle| {
                exists(&h.vertices)
                    && h.weights.iter().all(|w| w.is_finite())
                    && h.follows.iter().all(|(column, share)| *column < columns && share.is_finite())
            };
            bad("handle", handles.iter().position(|h| !usable(h)))
        });
    fault.map_or(Ok(()), Err)
}

/// The vertices that may move and hang together with a handle.
fn reached(laplacian: &SurfaceLaplacian, handles: &[Handle], still: &[bool]) -> Vec<bool> {
    let mut reached = vec![false; still.len()];
    let corners = handles.iter().flat_map(|handle| {
        handle.vertices.iter().zip(handle.weights).filter(|(_, weight)| *weight > 0.0).map(|(v, _)| *v)
    });
    let mut open: Vec<u32> = corners.collect();
    while let Some(vertex) = open.pop() {
        let v = vertex as usize;
        if !still[v] && !std::mem::replace(&mut reached[v], true) {
            open.extend(laplacian.neighbours(v).iter().map(|entry| entry.0));
        }
    }
    reached
}

/// The factored equations, and w of each handle.
fn factor(
    laplacian: &SurfaceLaplacian,
    rows: &[usize],
    size: usize,
    handles: &[Handle],
    stiffness: Stiffness,
) -> Result<(Llt<usize, f64>, Vec<f64>), DeformError> {
    let mut entries: Vec<Triplet<usize, usize, f64>> = Vec::new();
    let mut push = |i: usize, j: usize, value: f64| {
        if i >= j && i != usize::MAX && j != usize::MAX {
            entries.push(Triplet::new(i, j, value));
        }
    };
    let mut diagonal = vec![0.0; size];
    for vertex in 0..rows.len() {
        // A vertex beyond the border has equations of its own only as far as it touches what moves.
        let touches = rows[vertex] != usize::MAX
            || laplacian.neighbours(vertex).iter().any(|(n, _)| rows[*n as usize] != usize::MAX);
        if !touches {
            continue;
        }
        let area = laplacian.area(vertex);
        for (a, wa) in laplacian.row(vertex) {
            for (b, wb) in laplacian.row(vertex) {
                push(rows[a], rows[b], wa * wb / area);
            }
            if rows[vertex] != usize::MAX {
                push(rows[vertex], rows[a], stiffness.tension * wa);
            }
            if rows[a] != usize::MAX {
                diagonal[rows[a]] += wa * wa / area;
            }
        }
    }
    let mean = (diagonal.iter().sum::<f64>() / size as f64).max(f64::MIN_POSITIVE);
    for row in 0..size {
        push(row, row, REST * mean);
    }
    // Small triangles are stiff: what holds a cheek would not hold a lid.
    let stiffness_at = |v: u32| diagonal.get(rows[v as usize]).copied().unwrap_or(mean);
    let grips: Vec<f64> = handles
        .iter()
        .map(|handle| {
            let corners = handle.vertices.iter().zip(handle.weights);
            GRIP * corners.map(|(&v, weight)| weight * stiffness_at(v)).sum::<f64>()
        })
        .collect();
    for (handle, &grip) in handles.iter().zip(&grips) {
        for (&a, wa) in handle.vertices.iter().zip(handle.weights) {
            for (&b, wb) in handle.vertices.iter().zip(handle.weights) {
                if wa * wb != 0.0 {
                    push(rows[a as usize], rows[b as usize], grip * wa * wb);
                }
            }
        }
    }
    let broken = |reason: String| DeformError::Broken { reason };
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(size, size, &entries)
        .map_err(|error| broken(format!("{error:?}")))?;
    let symbolic =
        SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).map_err(|error| broken(format!("{error:?}")))?;
    let factor = Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower)
        .map_err(|error| broken(format!("{error:?}")))?;
    Ok((factor, grips))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(n: u32, shift: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let positions =
            (0..n * n).map(|i| Point3::new(f64::from(i % n), f64::from(i / n) + shift, 0.0)).collect();
        let cells = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| y * n + x));
        (positions, cells.flat_map(|i| [[i, i + 1, i + n + 1], [i, i + n + 1, i + n]]).collect())
    }

    fn built(
        positions: &[Point3<f64>],
        triangles: &[[u32; 3]],
        handles: &[Handle],
        still: &[bool],
        tension: f64,
    ) -> SurfaceWarp {
        let stiffness = Stiffness { tension };
        SurfaceWarp::new(positions, triangles, handles, handles.len(), still, stiffness).unwrap()
    }

    #[test]
    fn handles_arrive_and_what_is_still_stays() {
        let (positions, triangles) = sheet(15, 0.0);
        let mut still = vec![false; positions.len()];
        still[..15].fill(true);
        let inside = Handle { vertices: [112, 113, 128], weights: [0.25, 0.25, 0.5], ..Handle::at(0, 0) };
        let handles = [inside, Handle::at(200, 1)];
        let warp = built(&positions, &triangles, &handles, &still, 0.1);
        assert_eq!(warp.vertices, (15..225).collect::<Vec<u32>>());
        for (j, own) in handles.iter().enumerate() {
            for k in 0..handles.len() {
                let at = |v: u32| f64::from(warp.column(k)[v as usize - 15]);
                let arrived: f64 = own.vertices.iter().zip(own.weights).map(|(&v, w)| w * at(v)).sum();
                // They hold as springs do: alone at a peak a handle gives way by a hundredth.
                assert!((arrived - f64::from(u8::from(j == k))).abs() < 0.02, "{j} {k} {arrived}");
            }
        }
    }

    #[test]
    fn without_still_vertices_and_tension_shares_add_up_to_one() {
        let (positions, triangles) = sheet(10, 0.0);
        let handles =
            [3, 47, 71, 88].map(|v| Handle::at(v, [3, 47, 71, 88].iter().position(|w| *w == v).unwrap()));
        let still = vec![false; 100];
        let warp = built(&positions, &triangles, &handles, &still, 0.0);
        for v in 0..100 {
            let sum: f32 = (0..4).map(|j| warp.column(j)[v]).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{v}: {sum}");
        }
    }

    #[test]
    fn motion_does_not_leap_a_gap() {
        let (mut positions, mut triangles) = sheet(8, 0.0);
        let (other, more) = sheet(8, 7.001);
        triangles.extend(more.iter().map(|t| t.map(|v| v + 64)));
        positions.extend(other);
        let still = vec![false; 128];
        let handles = [Handle::at(60, 0)];
        let warp = built(&positions, &triangles, &handles, &still, 0.1);
        assert_eq!(warp.vertices, (0..64).collect::<Vec<u32>>());
    }

    #[test]
    fn unusable_input_is_named() {
        let (mut positions, triangles) = sheet(3, 0.0);
        let build = |p: &[Point3<f64>], h: &[Handle], still: bool| {
            SurfaceWarp::new(p, &triangles, h, 1, &[still; 9], Stiffness { tension: 0.0 }).map(|_| ())
        };
        assert_eq!(build(&positions, &[], false), Err(DeformError::NoHandles));
        assert_eq!(build(&positions, &[Handle::at(4, 0)], true), Err(DeformError::NoHandles));
        let fault = |what, index| Err(DeformError::Unusable { what, index });
        assert_eq!(build(&positions, &[Handle::at(9, 0)], false), fault("handle", 0));
        positions[5].y = f64::NAN;
        assert_eq!(build(&positions, &[Handle::at(4, 0)], false), fault("position", 5));
    }
}
