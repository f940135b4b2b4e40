//! What classification says of one frame.

use super::{REGION_COUNT, Region};

/// The state of every region in one frame: 0 is neutral, 1 the most expressive layer that the performer has shown.
///
/// 002 §V.ii calls the state Qⁱ and lets it run to the last template, p − 1; here it is divided by p − 1, so that it means
/// the same whatever the number of layers. `None` is a region that cannot be told: too small in the picture, hidden,
/// turned away, or never learnt.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AppearanceStates([Option<f32>; REGION_COUNT]);

impl AppearanceStates {
    /// The state of a region.
    pub fn get(&self, region: Region) -> Option<f32> {
        self.0[region.index()]
    }

    /// Sets the state of a region, held within 0..=1; what is not a number is none.
    pub fn set(&mut self, region: Region, state: Option<f32>) {
        self.0[region.index()] = state.filter(|state| !state.is_nan()).map(|state| state.clamp(0.0, 1.0));
    }

    /// The states in the order of [`Region::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = (Region, Option<f32>)> + '_ {
        Region::ALL.into_iter().zip(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_stay_in_range() {
        let mut states = AppearanceStates::default();
        assert!(states.iter().all(|(_, state)| state.is_none()));
        states.set(Region::Chin, Some(3.0));
        states.set(Region::Forehead, Some(f32::NAN));
        assert_eq!(states.get(Region::Chin), Some(1.0));
        assert_eq!(states.get(Region::Forehead), None);
    }
}
