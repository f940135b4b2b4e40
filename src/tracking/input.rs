//! Bytes of a crop as the numbers that a network reads.

use opencv::{core, prelude::*};

/// The network's number for each value of a byte: dividing 256 times instead of 200,000 times a frame.
pub(super) type Shades = [f32; 256];

/// Tabulates a network's scale.
pub(super) fn shades(scale: impl Fn(f32) -> f32) -> Shades {
    std::array::from_fn(|byte| scale(byte as f32))
}

/// Writes a BGR crop as RGB numbers, pixel by pixel.
pub(super) fn fill_input(crop: &core::Mat, shades: &Shades, input: &mut [f32]) -> opencv::Result<()> {
    let (pixels, _) = crop.data_bytes()?.as_chunks::<3>();
    let (values, _) = input.as_chunks_mut::<3>();
    for (&[blue, green, red], value) in pixels.iter().zip(values) {
        *value = [red, green, blue].map(|byte| shades[usize::from(byte)]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_comes_first_and_every_byte_has_its_own_number() {
        let colour = core::Scalar::new(10.0, 20.0, 255.0, 0.0);
        let crop = core::Mat::new_rows_cols_with_default(2, 2, core::CV_8UC3, colour).unwrap();
        let mut input = [0.0; 12];
        fill_input(&crop, &shades(|byte| byte / 255.0), &mut input).unwrap();
        assert_eq!(input[..3], [1.0, 20.0 / 255.0, 10.0 / 255.0]);
        assert_eq!(input[9..], input[..3]);
    }
}
