//! What `benches/peers/muscle_takes.py` writes.

use std::{error::Error, path::Path};

use nalgebra::{Matrix3, Point3, Rotation3, Vector2, Vector3};
use serde::Deserialize;

#[derive(Debug, Clone, Deserialize)]
pub struct Entry {
    pub file: String,
    pub name: String,
    pub kind: String,
    pub focal: Option<f64>,
    pub size: Option<[i32; 2]>,
    #[serde(default)]
    pub shapes: Option<Vec<String>>,
}

#[derive(Deserialize)]
struct Header {
    arrays: Vec<(String, Vec<usize>)>,
}

/// One take, its arrays by name.
pub struct Take {
    pub entry: Entry,
    arrays: Vec<(String, Vec<usize>, Vec<f32>)>,
}

pub fn index(folder: &Path) -> Result<Vec<Entry>, Box<dyn Error>> {
    let text = std::fs::read_to_string(folder.join("takes.json"))?;
    Ok(serde_json::from_str(&text)?)
}

impl Take {
    pub fn read(folder: &Path, entry: &Entry) -> Result<Self, Box<dyn Error>> {
        let bytes = std::fs::read(folder.join(&entry.file))?;
        let end = bytes.iter().position(|&b| b == b'\n').ok_or("no header")?;
        let header: Header = serde_json::from_slice(&bytes[..end])?;
        let mut rest = bytes[end + 1..].chunks_exact(4);
        let arrays = header
            .arrays
            .into_iter()
            .map(|(name, sizes)| {
                let count = sizes.iter().product();
                let values = rest.by_ref().take(count).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
                let values: Vec<f32> = values.collect();
                (name, sizes, values)
            })
            .collect();
        Ok(Self { entry: entry.clone(), arrays })
    }

    /// The size of an array's first axis, and its numbers; nothing where there is none.
    fn array(&self, name: &str) -> (usize, &[f32]) {
        self.arrays.iter().find(|(own, ..)| own == name).map_or((0, &[]), |(_, s, v)| (s[0], v))
    }

    fn vectors(values: &[f32]) -> Vec<Vector3<f64>> {
        values.chunks_exact(3).map(|v| Vector3::new(v[0], v[1], v[2]).map(f64::from)).collect()
    }

    pub fn neutral(&self) -> Vec<Point3<f64>> {
        Self::vectors(self.array("neutral").1).into_iter().map(Point3::from).collect()
    }

    /// T × 468.
    pub fn displacements(&self, name: &str) -> Vec<Vec<Vector3<f64>>> {
        let (count, values) = self.array(name);
        values.chunks_exact(values.len() / count.max(1)).map(Self::vectors).collect()
    }

    /// T × 51.
    pub fn weights(&self) -> Vec<Vec<f64>> {
        let (count, values) = self.array("weights");
        let rows = values.chunks_exact(values.len() / count.max(1));
        rows.map(|row| row.iter().copied().map(f64::from).collect()).collect()
    }

    /// T × 468.
    pub fn pixels(&self) -> Vec<Vec<Vector2<f64>>> {
        let (count, values) = self.array("pixels");
        let rows = values.chunks_exact(values.len() / count.max(1));
        rows.map(|row| row.chunks_exact(2).map(|p| Vector2::new(p[0], p[1]).map(f64::from)).collect())
            .collect()
    }

    /// Rotation and translation from the scan frame to the camera's.
    pub fn poses(&self) -> Vec<(Rotation3<f64>, Vector3<f64>)> {
        let rotations = self.array("rotation").1.chunks_exact(9);
        let turns = rotations
            .map(|r| Rotation3::from_matrix(&Matrix3::from_row_iterator(r.iter().copied().map(f64::from))));
        turns.zip(Self::vectors(self.array("translation").1)).collect()
    }
}
