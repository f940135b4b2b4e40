//! Exemplars that a person chooses: a TOML file, and the sheet on which they are looked at.

use std::{collections::BTreeMap, path::Path};

use image::{RgbaImage, imageops};

use super::Choice;
use crate::{
    appearance::{AppearanceError, Region, RegionSkin, Skin},
    rows::read_text,
    view::contact_sheet,
};

const MOST_BYTES: u64 = 1 << 20;
const REMEDY: &str = "Write lines such as `forehead = [12, 80, 143]`: frames of a region, neutral first";
/// Pixels of the sheet's pictures, across and down at most.
const SIDE: u32 = 190;

/// Reads exemplars: `forehead = [12, 80, "2:143"]` names frames 12 and 80 of the first take and 143 of the second; an empty list
/// leaves the region out.
pub fn read_choices(path: &Path) -> Result<BTreeMap<Region, Choice>, AppearanceError> {
    let fault = |reason: String| AppearanceError::File { path: path.into(), reason, remedy: REMEDY };
    let text = read_text(path, MOST_BYTES, "file of exemplars").map_err(fault)?;
    parse(&text).map_err(fault)
}

fn parse(text: &str) -> Result<BTreeMap<Region, Choice>, String> {
    let table: toml::Table = toml::from_str(text).map_err(|error| error.message().replace('\n', " "))?;
    let mut choices = BTreeMap::new();
    for (name, value) in table {
        let region = Region::named(&name).ok_or_else(|| format!("{name} is no region"))?;
        let frames = value.as_array().ok_or_else(|| format!("{name} is no list of frames"))?;
        let frame = |value: &toml::Value| match value {
            toml::Value::Integer(frame) => u64::try_from(*frame).ok().map(|frame| (0, frame)),
            toml::Value::String(text) => parse_frame(text),
            _ => None,
        };
        let choice: Option<Choice> = frames.iter().map(frame).collect();
        choices.insert(region, choice.ok_or_else(|| format!("{name} names what is no frame"))?);
    }
    Ok(choices)
}

/// `80` is frame 80 of the first take, `2:80` of the second.
pub fn parse_frame(text: &str) -> Option<(u16, u64)> {
    let (take, frame) = text.split_once(':').unwrap_or(("1", text));
    let take: u16 = take.trim().parse().ok()?;
    Some((take.checked_sub(1)?, frame.trim().parse().ok()?))
}

/// Every layer of every region with its state and the frames it is made of; a row for each region.
pub fn skin_sheet(skin: &Skin) -> RgbaImage {
    let columns = skin.regions().iter().map(|region| region.volume.layers().len()).max().unwrap_or(1);
    let mut cells: Vec<(RgbaImage, String)> = Vec::new();
    for region in skin.regions() {
        for layer in 0..columns {
            cells.push(if layer < region.volume.layers().len() {
                (picture(region, layer), caption(region, layer))
            } else {
                (RgbaImage::new(1, 1), String::new())
            });
        }
    }
    let cells: Vec<(&RgbaImage, &str)> =
        cells.iter().map(|(picture, words)| (picture, words.as_str())).collect();
    contact_sheet(&cells, columns as u32)
}

/// A layer in the performer's own colours.
fn picture(region: &RegionSkin, layer: usize) -> RgbaImage {
    let [width, height] = region.volume.patch().size.map(u32::from);
    let layer = &region.volume.layers()[layer];
    let picture = RgbaImage::from_fn(width, height, |x, y| {
        let [r, g, b] = layer.colour((y * width + x) as usize);
        image::Rgba([r, g, b, 255])
    });
    let scale = f64::from(SIDE) / f64::from(width.max(height));
    let side = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
    imageops::resize(&picture, side(width), side(height), imageops::FilterType::CatmullRom)
}

fn caption(region: &RegionSkin, layer: usize) -> String {
    let exemplar = &region.exemplars[layer];
    let name = if layer == 0 {
        region.volume.region().name().to_owned()
    } else {
        format!("{:.2}", layer as f64 / (region.exemplars.len() - 1) as f64)
    };
    match (exemplar.frames.first(), exemplar.frames.last()) {
        (Some(first), Some(last)) if exemplar.take == 0 => format!("{name} {first}-{last}"),
        (Some(first), Some(last)) => format!("{name} {}:{first}-{last}", exemplar.take + 1),
        _ => format!("{name} blend"),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn frames_are_read_with_their_take() {
        let choices = parse("forehead = [12, \"2:80\"]\nchin = []\n").unwrap();
        assert_eq!(choices[&Region::Forehead], [(0, 12), (1, 80)]);
        assert!(choices[&Region::Chin].is_empty());
        for (text, wanted) in [
            ("nose = [1]", "no region"),
            ("chin = 3", "no list"),
            ("chin = [-1]", "no frame"),
            ("chin = [\"0:4\"]", "no frame"),
            ("chin = [", "array"),
        ] {
            assert!(parse(text).unwrap_err().contains(wanted), "{text}: {:?}", parse(text));
        }
    }

    proptest! {
        #[test]
        fn garbage_never_panics(text in ".{0,80}") {
            let _ = parse(&text);
            let _ = parse_frame(&text);
        }
    }
}
