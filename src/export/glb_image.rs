//! Textures as every glTF viewer takes them: sides that are powers of two.

use std::{borrow::Cow, io::Cursor};

use image::{
    DynamicImage, ImageDecoder, ImageFormat, ImageReader, codecs::jpeg::JpegEncoder, imageops::FilterType,
};

use crate::scan::{Texture, TextureFormat};

/// A JPEG that is resized is stored at this quality, percent.
const QUALITY: u8 = 95;
/// Larger sides are not made; a scan's 8k texture stays as it is in both directions.
const LARGEST: u32 = 8192;

/// The texture's own bytes where its sides are powers of two, else its picture resized to the nearest ones: older
/// engines refuse or rescale others, and the validator remarks on them. A picture that cannot be decoded is passed
/// through, for the viewer to judge.
pub(super) fn power_of_two(texture: &Texture) -> Cow<'_, [u8]> {
    resized(texture).map_or(Cow::Borrowed(texture.bytes.as_slice()), Cow::Owned)
}

fn resized(texture: &Texture) -> Option<Vec<u8>> {
    let mut decoder =
        ImageReader::new(Cursor::new(&texture.bytes)).with_guessed_format().ok()?.into_decoder().ok()?;
    let (width, height) = decoder.dimensions();
    if width.is_power_of_two() && height.is_power_of_two() {
        return None;
    }
    // The colour profile says what the numbers mean; it goes along.
    let profile = decoder.icc_profile().ok().flatten();
    let picture = DynamicImage::from_decoder(decoder).ok()?;
    let picture = picture.resize_exact(nearest_power(width), nearest_power(height), FilterType::Lanczos3);
    let mut bytes = Vec::new();
    match texture.format {
        TextureFormat::Png => picture.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).ok()?,
        TextureFormat::Jpeg => {
            let mut encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
            if let Some(profile) = profile {
                image::ImageEncoder::set_icc_profile(&mut encoder, profile).ok()?;
            }
            encoder.encode_image(&picture.to_rgb8()).ok()?;
        }
    }
    Some(bytes)
}

/// On a logarithmic scale, so that neither halving nor doubling is favoured.
fn nearest_power(side: u32) -> u32 {
    let exponent = f64::from(side.max(1)).log2().round() as u32;
    (1 << exponent.min(31)).min(LARGEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, height: u32, format: TextureFormat) -> Texture {
        let kind = match format {
            TextureFormat::Png => ImageFormat::Png,
            TextureFormat::Jpeg => ImageFormat::Jpeg,
        };
        let mut bytes = Vec::new();
        DynamicImage::new_rgb8(width, height).write_to(&mut Cursor::new(&mut bytes), kind).unwrap();
        Texture { name: "skin".into(), format, bytes }
    }

    #[test]
    fn sides_become_powers_of_two_and_those_that_are_stay_untouched() {
        for format in [TextureFormat::Png, TextureFormat::Jpeg] {
            let odd = texture(24, 17, format);
            let bytes = power_of_two(&odd);
            let made = image::load_from_memory(&bytes).unwrap();
            assert_eq!((made.width(), made.height()), (32, 16));
            assert_eq!(TextureFormat::of(&bytes), Some(format));
            let even = texture(32, 16, format);
            assert!(matches!(power_of_two(&even), Cow::Borrowed(_)));
        }
        let broken = Texture { name: "x".into(), format: TextureFormat::Png, bytes: vec![1, 2, 3] };
        assert_eq!(&*power_of_two(&broken), [1, 2, 3]);
    }
}
