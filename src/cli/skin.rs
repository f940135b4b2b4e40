//! The part of the command line that every command with living skin shares.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use understudy::{
    appearance::{AppearanceFrame, AppearanceStates, FaceFrame, Region, Skin, TextureVolume},
    assets::Assets,
    pipeline::{LivingSkin, PipelineError, SharedFace, SkinRelief, Target, bake_skin, classify_take},
    view::{Gpu, SkinMode},
};

use super::{
    clip::{ClipArgs, Take},
    progress,
};

/// Whose skin is shown, and how.
#[derive(Args)]
pub struct SkinArgs {
    /// Show a performer's wrinkles: a file of `learn-appearance`
    #[arg(long, value_name = "FILE")]
    skin: Option<PathBuf>,
    /// What of the skin is shown
    #[arg(long, value_enum, default_value_t = SkinModeArg::Ratio, requires = "skin")]
    skin_mode: SkinModeArg,
    /// What multiplies light and dark: 1 is what the performer has shown
    #[arg(long, value_name = "GAIN", default_value_t = 1.2, value_parser = parse_gain, requires = "skin")]
    skin_gain: f32,
}

#[derive(Clone, Copy, ValueEnum)]
enum SkinModeArg {
    /// Light and dark of the performer's skin on the scan's own colours
    Ratio,
    /// The performer's own colours, for a scan of the performer
    Own,
}

fn parse_gain(text: &str) -> Result<f32, String> {
    let gain: Option<f32> = text.parse().ok().filter(|gain| (0.0..=5.0).contains(gain));
    gain.ok_or_else(|| "write a number from 0 to 5".to_owned())
}

/// What a performer's skin does in every frame of a take, for which the clip is read once more.
pub fn classify(
    clip: &ClipArgs,
    take: &mut Take,
    skin: &Skin,
    frame: &FaceFrame,
    quiet: bool,
) -> Result<Vec<AppearanceFrame>, Box<dyn Error>> {
    let bar = progress::bar("reading the skin", Some(take.motion.frames.len() as u64), quiet);
    let (source, motion) = (clip.open()?, &take.motion);
    let frames = take.watch.time("classify the skin", || {
        classify_take(source, motion, skin, frame, |done| bar.set_position(done))
    })?;
    bar.finish_and_clear();
    Ok(frames)
}

/// A skin that was read, and the face on which all skins lie.
pub struct WornSkin {
    pub skin: Skin,
    pub face: SharedFace,
    pub volumes: Vec<TextureVolume>,
    pub mode: SkinMode,
    pub gain: f32,
}

impl SkinArgs {
    /// The skin's file, if one is named.
    pub fn path(&self) -> Option<&Path> {
        self.skin.as_deref()
    }

    /// Reads the skin, if one is named.
    pub fn read(&self, assets: &Assets) -> Result<Option<WornSkin>, Box<dyn Error>> {
        let Some(path) = &self.skin else { return Ok(None) };
        let skin = Skin::read(path)?;
        let volumes = skin.regions().iter().map(|region| region.volume.clone()).collect();
        let face = SharedFace::read(&assets.verified("canonical_face")?)?;
        let mode = match self.skin_mode {
            SkinModeArg::Ratio => SkinMode::Ratio,
            SkinModeArg::Own => SkinMode::Own,
        };
        Ok(Some(WornSkin { skin, face, volumes, mode, gain: self.skin_gain }))
    }
}

impl WornSkin {
    /// The skin on a target, with what of it moves vertices.
    pub fn on(&self, gpu: &Gpu, target: &Target, relief: &SkinRelief) -> Result<LivingSkin, PipelineError> {
        LivingSkin::new(gpu, target, &self.face, &self.volumes, relief, self.mode, self.gain)
    }

    /// What of the skin moves a target's vertices.
    pub fn relief(&self, target: &Target) -> Result<SkinRelief, PipelineError> {
        SkinRelief::new(target, &self.face, &self.volumes, self.gain)
    }

    /// Writes the skin into a target's textures.
    pub fn bake(&self, folder: &Path, target: &Target) -> Result<Vec<PathBuf>, PipelineError> {
        bake_skin(folder, target, &self.face, &self.volumes, self.mode, self.gain)
    }

    /// States from `REGION=STATE`; a region without its side is both. Refuses names that there are not, and regions that
    /// were never learnt.
    pub fn states(&self, texts: &[String]) -> Result<AppearanceStates, String> {
        let mut states = AppearanceStates::default();
        for text in texts {
            let (name, state) = text.split_once('=').unwrap_or((text, "1"));
            let state: Option<f32> = state.parse().ok().filter(|state| (0.0..=1.0).contains(state));
            let state =
                state.ok_or_else(|| format!("--wrinkle {text}: write REGION=STATE, STATE from 0 to 1"))?;
            let regions: Vec<Region> =
                Region::ALL.into_iter().filter(|region| is_called(*region, name)).collect();
            if regions.is_empty() {
                let names: Vec<&str> = Region::ALL.into_iter().map(Region::name).collect();
                return Err(format!(
                    "--wrinkle {text}: there is no region {name}. Regions are {}",
                    names.join(", ")
                ));
            }
            let learnt = |region: &Region| self.volumes.iter().any(|volume| volume.region() == *region);
            if !regions.iter().any(learnt) {
                let names: Vec<&str> = self.volumes.iter().map(|volume| volume.region().name()).collect();
                return Err(format!("--wrinkle {text}: the skin has no {name}, only {}", names.join(", ")));
            }
            for region in regions.into_iter().filter(learnt) {
                states.set(region, Some(state));
            }
        }
        Ok(states)
    }
}

/// Whether a name is a region's, or that of both sides of a pair.
fn is_called(region: Region, name: &str) -> bool {
    let pair = region.name().trim_end_matches("_right").trim_end_matches("_left");
    region.name() == name || pair == name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_called_without_its_side() {
        let called = |name| Region::ALL.into_iter().filter(|region| is_called(*region, name)).count();
        assert_eq!(
            [called("forehead"), called("nasolabial"), called("eye_left"), called("nose")],
            [1, 2, 1, 0]
        );
    }
}
