//! The faces with known motion that `benches/peers/transfer_faces.py` writes.

use std::{collections::BTreeMap, error::Error, path::Path};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;
use understudy::{
    export::Pc2Reader,
    scan::{Mesh, read_mesh},
};

pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// `protocol.json`; vertices are counted from 0.
#[derive(Deserialize)]
pub struct Protocol {
    pub expressions: Vec<Expression>,
    pub evaluation_mask: Vec<usize>,
    pub landmarks_468: Vec<usize>,
    pub landmarks_68: Vec<usize>,
    pub rims: BTreeMap<String, Rim>,
    pub zero_anchors: Vec<usize>,
    pub extras: Vec<usize>,
    pub cases: Vec<CaseFacts>,
}

#[derive(Deserialize)]
pub struct Expression {
    pub name: String,
}

#[derive(Deserialize)]
pub struct Rim {
    pub upper: Vec<usize>,
    pub lower: Vec<usize>,
    pub corners: Vec<usize>,
}

#[derive(Deserialize)]
pub struct CaseFacts {
    pub folder: String,
    pub unseen: bool,
}

impl Protocol {
    pub fn read(folder: &Path) -> Outcome<Self> {
        Ok(serde_json::from_str(&std::fs::read_to_string(folder.join("protocol.json"))?)?)
    }

    /// Vertices of all rims.
    pub fn rim_vertices(&self) -> impl Iterator<Item = usize> + '_ {
        self.rims.values().flat_map(|rim| rim.upper.iter().chain(&rim.lower).chain(&rim.corners).copied())
    }
}

/// A face and how far each of its vertices goes in each expression, millimetres.
pub struct Face {
    pub mesh: Mesh,
    pub motions: Vec<Vec<Vector3<f64>>>,
}

impl Face {
    pub fn read(folder: &Path, mesh: &str, cache: &str) -> Outcome<Self> {
        let mesh = read_mesh(&folder.join(mesh))?;
        let motions = motions(&folder.join(cache), &mesh)?;
        Ok(Self { mesh, motions })
    }
}

/// The samples of a point cache as displacements from a mesh.
pub fn motions(path: &Path, mesh: &Mesh) -> Outcome<Vec<Vec<Vector3<f64>>>> {
    let mut reader = Pc2Reader::open(path)?;
    let mut sample = Vec::new();
    let mut motions = Vec::new();
    for index in 0..reader.samples() {
        reader.read_sample(index, &mut sample)?;
        let moved = sample.iter().zip(&mesh.positions);
        motions.push(moved.map(|(to, from)| Point3::from(to.map(f64::from)) - from).collect());
    }
    Ok(motions)
}

/// One target under both tasks.
pub struct Case {
    pub name: String,
    pub target: Face,
    /// The same identity before its warp.
    pub a1: Face,
}

impl Case {
    pub fn read(folder: &Path, facts: &CaseFacts) -> Outcome<Self> {
        let own = folder.join(&facts.folder);
        Ok(Self {
            name: facts.folder.clone(),
            target: Face::read(&own, "target.obj", "target_truth.pc2")?,
            a1: Face::read(&own, "a1_source.obj", "a1_source.pc2")?,
        })
    }
}

/// RMS error over RMS true motion, over the vertices of `mask`.
pub fn error(found: &[Vector3<f64>], truth: &[Vector3<f64>], mask: &[usize]) -> f64 {
    let wrong: f64 = mask.iter().map(|&v| (found[v] - truth[v]).norm_squared()).sum();
    let whole: f64 = mask.iter().map(|&v| truth[v].norm_squared()).sum();
    (wrong / whole.max(f64::MIN_POSITIVE)).sqrt()
}
