//! Takes of markers whose contractions are known.

use nalgebra::Vector3;
use understudy::{
    muscle::{MarkerBasis, MarkerSeat, MuscleBasis, Part},
    tracking::SKIN_LANDMARK_COUNT,
};

/// Frames per second.
pub const RATE: f64 = 30.0;

/// Numbers that look random and are the same everywhere, in -1..1.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }
}

/// Every fourth landmark.
pub fn seats() -> Vec<Option<MarkerSeat>> {
    (0..SKIN_LANDMARK_COUNT).step_by(4).map(|landmark| MarkerSeat::mean(&[landmark])).collect()
}

/// Each muscle comes and goes in its own time up to `most`, in turn and together with others; those of `idle` never do.
pub fn contractions(frames: usize, muscles: usize, most: f64, idle: &[usize]) -> Vec<Vec<f64>> {
    let at = |t: usize, muscle: usize| {
        let (t, m) = (t as f64 / RATE, muscle as f64);
        let wave = (t * (1.1 + 0.13 * m) + 2.4 * m).sin();
        let calm = (t * (0.31 + 0.023 * m) + 1.7 * m).sin().max(0.0);
        if idle.contains(&muscle) { 0.0 } else { most * wave.max(0.0).powi(2) * calm }
    };
    (0..frames).map(|t| (0..muscles).map(|muscle| at(t, muscle)).collect()).collect()
}

/// The basis with muscles that leave the other part of the face alone, as 001 takes them to.
pub fn apart(mut basis: MarkerBasis) -> MarkerBasis {
    for (muscle, vectors) in basis.muscles.iter().zip(&mut basis.vectors) {
        for (vector, part) in vectors.iter_mut().zip(&basis.parts) {
            if *part != Some(muscle.part) {
                *vector = Vector3::zeros();
            }
        }
    }
    basis
}

/// What markers show of contractions, with noise, mm.
pub fn played(basis: &MarkerBasis, contractions: &[Vec<f64>], noise: f64) -> Vec<Vec<Option<Vector3<f64>>>> {
    let mut numbers = Numbers(7);
    let mut moved = Vec::new();
    let frame = |x: &Vec<f64>| {
        basis.synthesize(x, &mut moved);
        // The jaw's arc is below as well.
        for (marker, moved) in
            moved.iter_mut().enumerate().filter(|(j, _)| basis.parts[*j] == Some(Part::Upper))
        {
            *moved = basis.vectors.iter().zip(x).map(|(vectors, x)| vectors[marker] * *x).sum();
        }
        moved.iter().map(|v| Some(v + numbers.vector() * noise)).collect()
    };
    contractions.iter().map(frame).collect()
}

/// Each shape larger or smaller, turned, and uneven over the face.
pub fn perturbed(basis: &MuscleBasis) -> MuscleBasis {
    let mut own = basis.clone();
    for (m, element) in own.elements.iter_mut().enumerate() {
        let m = m as f64;
        let amplitude = 1.0 + 0.3 * (2.3 * m).sin();
        for (vector, place) in element.vectors.iter_mut().zip(&basis.face) {
            let field = 1.0 + 0.3 * (place.x / 30.0 + m).sin() * (place.y / 35.0 - m).cos();
            let turn =
                nalgebra::Rotation3::from_euler_angles(0.2 * m.sin(), 0.2 * m.cos(), 0.3 * (1.7 * m).sin());
            *vector = turn * *vector * (amplitude * field);
        }
    }
    own
}
