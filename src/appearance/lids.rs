//! Lids by two witnesses: the look of the eye, and how far the landmarks of its lids stand apart.

/// Weight of the look beside the aperture; `docs/benchmarks/appearance.md` measures both alone and together.
const LOOK: f32 = 0.3;
/// A lid state from which the eye counts as closed.
pub const CLOSED_LID: f32 = 0.7;

/// The state of a lid, 0 open to 1 closed: from the closure that the aperture tells (lids opened wider than in the neutral count
/// as open) and the state that the look tells (0..=1). The eyeball's turn is apart from both: it is `lift::EyeState`'s.
pub fn lid_state(closure: f32, look: f32) -> f32 {
    let aperture = closure.clamp(0.0, 1.0);
    (aperture + LOOK * (look - aperture)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_aperture_leads_and_the_look_sways() {
        assert!(lid_state(-0.3, 0.0).abs() < 1e-6 && (lid_state(1.0, 1.0) - 1.0).abs() < 1e-6);
        assert!(lid_state(1.0, 0.0) >= CLOSED_LID - 1e-6 && lid_state(0.0, 1.0) < CLOSED_LID);
        assert!(lid_state(0.6, 1.0) > CLOSED_LID && lid_state(0.6, 0.2) < CLOSED_LID);
    }
}
