//! A face on a grid: places with a mask, cells as quads, landmarks on the grid's vertices.

use nalgebra::Point3;

use super::{GridError, Raster, Sample};
use crate::scan::Mesh;

/// A cell whose depths differ by more than this many times its longer side spans a jump from one surface to another.
const JUMP: f64 = 10.0;

/// A face resampled to a quad grid, in the face's own axes and millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceGrid {
    /// Where the grid lies.
    pub raster: Raster,
    /// Columns · rows; `None` where the grid point is not on the face.
    pub points: Vec<Option<Point3<f64>>>,
    /// Cells of which all corners are on the face, as numbers of grid points, counter-clockwise seen from the front.
    pub cells: Vec<[usize; 4]>,
    /// Cells that were left out because a jump in depth runs through them.
    pub jumps: usize,
}

impl FaceGrid {
    /// Of depths, one for each grid point that is on the face.
    pub fn new(raster: Raster, depths: &[Option<f64>]) -> Result<Self, GridError> {
        let step = raster.step();
        let limit = JUMP * step.x.max(step.y);
        let (mut cells, mut jumps) = (Vec::new(), 0);
        for cell in raster.cells() {
            if let [Some(a), Some(b), Some(c), Some(d)] = cell.map(|i| depths.get(i).copied().flatten()) {
                if a.max(b).max(c).max(d) - a.min(b).min(c).min(d) <= limit {
                    cells.push(cell);
                } else {
                    jumps += 1;
                }
            }
        }
        if cells.is_empty() {
            return Err(GridError::NoFace);
        }
        let place = |number: usize| {
            let at = raster.at(number);
            depths.get(number).copied().flatten().map(|z| Point3::new(at.x, at.y, z))
        };
        Ok(Self { raster, points: (0..raster.len()).map(place).collect(), cells, jumps })
    }

    /// Of what a [`Raster`] has seen of a surface.
    pub fn of_samples(raster: Raster, samples: &[Option<Sample>]) -> Result<Self, GridError> {
        Self::new(raster, &samples.iter().map(|s| s.map(|s| s.depth)).collect::<Vec<_>>())
    }

    /// How many grid points are on the face.
    pub fn valid(&self) -> usize {
        self.points.iter().flatten().count()
    }

    /// For each grid point on the face its number among those: the vertex that it becomes.
    pub fn vertex_numbers(&self) -> Vec<Option<u32>> {
        let mut next = 0;
        let number = |point: &Option<Point3<f64>>| {
            point.map(|_| {
                next += 1;
                next - 1
            })
        };
        self.points.iter().map(number).collect()
    }

    /// The grid as a mesh, and its quads. Vertices are the points on the face, row by row from the lowest; texture
    /// coordinates (one a vertex) are column / (columns − 1), row / (rows − 1), which tell each vertex's place in the
    /// grid. `place` moves points to the frame in which the mesh is wanted. Triangles are the quads' halves.
    pub fn mesh(&self, place: impl Fn(&Point3<f64>) -> Point3<f64>) -> (Mesh, Vec<[u32; 4]>) {
        let numbers = self.vertex_numbers();
        let quads: Vec<[u32; 4]> =
            self.cells.iter().map(|cell| cell.map(|i| numbers[i].unwrap_or(0))).collect();
        let triangles: Vec<[u32; 3]> =
            quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let on_the_face = || (0..).zip(&self.points).filter_map(|(i, p)| p.map(|p| (i, p)));
        let mesh = Mesh {
            positions: on_the_face().map(|(_, p)| place(&p)).collect(),
            uvs: on_the_face().map(|(i, _)| self.raster.uv(i).map(|c| c as f32)).collect(),
            uv_triangles: triangles.clone(),
            triangles,
            ..Mesh::default()
        };
        (mesh, quads)
    }

    /// The grid point on the face that is nearest to `landmark`, and how far it is, millimetres; of equally near ones the
    /// first (000 section 5.4: MATLAB's `nearestNeighbor`).
    pub fn nearest(&self, landmark: &Point3<f64>) -> Option<(Point3<f64>, f64)> {
        let near = |p: &&Point3<f64>| (**p - landmark).norm_squared();
        let point = self.points.iter().flatten().min_by(|a, b| near(a).total_cmp(&near(b)))?;
        Some((*point, (point - landmark).norm()))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    fn raster() -> Raster {
        Raster::new(4, 3, Point2::new(0.0, 0.0), Point2::new(3.0, 2.0)).unwrap()
    }

    #[test]
    fn only_cells_with_four_corners_become_quads() {
        let mut depths = vec![Some(1.0); 12];
        depths[0] = None;
        depths[7] = Some(50.0);
        let grid = FaceGrid::new(raster(), &depths).unwrap();
        assert_eq!((grid.valid(), grid.cells.len(), grid.jumps), (11, 3, 2));
        let (mesh, quads) = grid.mesh(|p| p * 2.0);
        mesh.validate().unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (11, 6));
        assert_eq!(mesh.positions[0], Point3::new(2.0, 0.0, 2.0));
        assert_eq!(quads[0], [0, 1, 5, 4]);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            assert!((b - a).cross(&(c - a)).z > 0.0);
        }
        let (nearest, off) = grid.nearest(&Point3::new(0.1, 0.1, 1.0)).unwrap();
        assert_eq!(nearest, Point3::new(1.0, 0.0, 1.0));
        assert!((off - 0.906).abs() < 1e-2);
    }

    #[test]
    fn no_cell_is_no_face() {
        let mut depths = vec![None; 12];
        depths[4] = Some(1.0);
        assert_eq!(FaceGrid::new(raster(), &depths).unwrap_err(), GridError::NoFace);
    }
}
