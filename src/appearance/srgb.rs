//! Between light and what pictures store of it.

/// Linear light of every stored value, 1 is white.
pub(super) fn table() -> [f32; 256] {
    std::array::from_fn(|value| to_linear(value as f32 / 255.0))
}

/// Linear light of an sRGB value in 0..=1.
pub(super) fn to_linear(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// What a picture stores of linear light; beyond 0..=1 it is held there.
pub(super) fn from_linear(light: f32) -> u8 {
    let light = light.clamp(0.0, 1.0);
    let value = if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (value * 255.0).round() as u8
}

/// Luminance of linear light (Rec. 709).
pub(super) fn luminance([red, green, blue]: [f32; 3]) -> f32 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stored_value_comes_back() {
        for (value, light) in (0..=255).zip(table()) {
            assert_eq!(from_linear(light), value);
        }
        // IEC 61966-2-1: half of the light is stored as 188.
        assert_eq!(from_linear(0.5), 188);
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-6);
    }
}
