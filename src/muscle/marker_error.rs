//! What muscles leave unexplained, upper and lower face apart (001 fig. 5).

use crate::{
    lift::Performer,
    tracking::{Region, index, landmark_table},
};

/// Gathers a frame's distances.
#[derive(Debug, Clone)]
pub(super) struct MarkerError {
    /// Of each landmark whether it lies below the lower lids; none of the outline, which belongs to the view.
    lower: Vec<Option<bool>>,
    /// Sum and number, upper and lower face.
    sums: [(f64, usize); 2],
}

impl MarkerError {
    /// The lower lids of a performer's neutral part the face.
    pub fn new(performer: &Performer) -> Self {
        let neutral = performer.neutral();
        let lids = [index::RIGHT_LID_LOWER, index::LEFT_LID_LOWER].map(|landmark| neutral[landmark].y);
        let border = f64::midpoint(lids[0], lids[1]);
        let facts = landmark_table().iter().zip(neutral);
        let lower = facts.map(|(facts, place)| {
            let counts = !matches!(facts.region, Region::Oval | Region::Iris);
            counts.then_some(place.y < border)
        });
        Self { lower: lower.collect(), sums: Default::default() }
    }

    /// Before a frame.
    pub fn clear(&mut self) {
        self.sums = Default::default();
    }

    /// A landmark was seen this many millimetres from where the contractions put it.
    pub fn add(&mut self, landmark: usize, distance: f64) {
        if let Some(is_lower) = self.lower[landmark] {
            let (sum, count) = &mut self.sums[usize::from(is_lower)];
            *sum += distance;
            *count += 1;
        }
    }

    /// The frame's means, upper and lower face, millimetres; none where nothing of one was seen.
    pub fn means(&self) -> Option<[f64; 2]> {
        let [upper, lower] = self.sums.map(|(sum, count)| (count > 0).then(|| sum / count as f64));
        Some([upper?, lower?])
    }
}
