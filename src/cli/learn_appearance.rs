//! `understudy learn-appearance`: a performer's skin from takes.

use std::{
    collections::BTreeMap,
    error::Error,
    path::{Path, PathBuf},
};

use clap::Args;
use understudy::{
    appearance::Region,
    assets::Assets,
    capture,
    export::{Draft, write_obj, write_skin},
    pipeline::{
        Choice, TakeLooks, learn_skin, neutral_look, performer_avatar, read_choices, read_face_frame,
        skin_sheet,
    },
    view::save_png,
};

use super::{Outcome, clip::ClipArgs, inputs, progress};

const EXAMPLES: &str = "\
Examples:
  understudy learn-appearance faces.mp4 -o me.skin --sheet me.png
  understudy learn-appearance brows.mp4 smile.mp4 -o me.skin
  understudy learn-appearance faces.mp4 -o me.skin --use forehead=12,80,143 --use glabella=12,60,61,95
  understudy learn-appearance brows.mp4 smile.mp4 -o me.skin --edit me.toml
  understudy learn-appearance faces.mp4 -o me.skin --avatar face.obj
  understudy animate clip.mp4 --target face.obj --skin me.skin --skin-mode own -o avatar.mp4
  understudy track clip.mp4 --skin me.skin -o take.appearance.csv

Perform in even light, near the camera: raise your brows, frown, smile broadly with squinting eyes, wrinkle your nose, draw the
corners of your mouth back, push your chin up, and close your eyes; each slowly, with a neutral face between.

The sheet shows what was chosen, with the numbers of the frames. --use and --edit choose others, 3 to 6 a region, neutral first. A
file for --edit:
  forehead = [12, 80, 143]             # frames of the first take
  nasolabial_left = [12, \"2:40\", \"2:77\"]   # frames 40 and 77 of the second
  chin = []                            # left out
Regions: forehead, glabella, crows_feet_right, crows_feet_left, nasolabial_right, nasolabial_left, eye_right, eye_left,
  mouth_corner_right, mouth_corner_left, chin";

/// Learn a performer's wrinkles and lids from takes
///
/// Finds the neutral and the most expressive look of every region of the face, and writes them for `track --skin` and for
/// living skin on a target. docs/appearance.md describes it.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct LearnAppearance {
    #[command(flatten)]
    clip: ClipArgs,
    /// More takes of the same performer
    #[arg(value_name = "TAKE")]
    more: Vec<PathBuf>,
    /// Where to write the skin
    #[arg(short, long, value_name = "FILE.skin")]
    output: PathBuf,
    /// A picture of what was chosen for every region
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
    /// The performer's own face out of the first take, as a textured scan for --target
    #[arg(long, value_name = "FILE.obj")]
    avatar: Option<PathBuf>,
    /// The performer's name; the output's name if not given
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Frames for a region, neutral first, such as forehead=12,80,143; may be given several times
    #[arg(long = "use", value_name = "REGION=FRAME,FRAME,…", value_parser = parse_use)]
    chosen: Vec<(Region, Choice)>,
    /// The same for several regions in a TOML file
    #[arg(long, value_name = "FILE.toml")]
    edit: Option<PathBuf>,
}

impl LearnAppearance {
    pub fn run(&self, quiet: bool) -> Outcome {
        let is = |path: &Path, wanted: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted));
        if !is(&self.output, "skin") {
            return Err(format!("cannot write {}: name it .skin", self.output.display()).into());
        }
        if let Some(sheet) = self.sheet.as_deref().filter(|sheet| !is(sheet, "png")) {
            return Err(format!("cannot write {}: name it .png", sheet.display()).into());
        }
        if let Some(avatar) = self.avatar.as_deref().filter(|avatar| !is(avatar, "obj")) {
            return Err(format!("cannot write {}: name it .obj", avatar.display()).into());
        }
        if let (Some(avatar), Some(sheet)) = (&self.avatar, &self.sheet)
            && avatar.with_extension("png") == *sheet
        {
            let (avatar, sheet) = (avatar.display(), sheet.display());
            return Err(format!("{sheet} will be the texture of {avatar}: name one of them otherwise").into());
        }
        if !self.more.is_empty() && self.clip.names_neutral() {
            return Err("--neutral names a stretch of one take: learn from one take with it".into());
        }
        let clips: Vec<&Path> =
            [&self.clip.clip].into_iter().chain(&self.more).map(PathBuf::as_path).collect();
        let read: Vec<&Path> = clips.iter().copied().chain(self.edit.as_deref()).collect();
        for output in [&self.output].into_iter().chain(&self.sheet).chain(&self.avatar) {
            inputs::spare(output, &read)?;
            drop(Draft::create(output)?);
        }
        let choices = self.choices(clips.len())?;
        for clip in &clips {
            drop(capture::open(clip, self.clip.fps)?);
        }
        let assets = Assets::locate()?;
        let frame = read_face_frame(&assets.verified("canonical_face")?)?;
        let takes = self.gather(&assets, &clips, &frame, quiet)?;
        let stem = self.output.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let name = self.name.clone().or(stem).unwrap_or_default();
        let bar = progress::count("learning", "regions", Region::ALL.len() as u64, quiet);
        let open = |take: usize| capture::open(clips[take], self.clip.fps);
        let learnt = learn_skin(name, &takes, &frame, &choices, open, |done| bar.set_position(done))?;
        bar.finish_and_clear();
        if let Some(sheet) = &self.sheet {
            save_png(sheet, &skin_sheet(&learnt.skin))?;
        }
        write_skin(&self.output, &learnt.skin)?;
        if quiet {
            return Ok(());
        }
        for region in learnt.skin.regions() {
            say!("learnt {}: {} layers", region.volume.region().name(), region.volume.layers().len());
        }
        for missing in &learnt.missing {
            say!("not {missing}");
        }
        for path in self.sheet.iter().chain(&self.avatar).chain([&self.output]) {
            say!("wrote {}", path.display());
        }
        Ok(())
    }

    fn choices(&self, takes: usize) -> Result<BTreeMap<Region, Choice>, Box<dyn Error>> {
        let mut choices = self.edit.as_deref().map(read_choices).transpose()?.unwrap_or_default();
        choices.extend(self.chosen.iter().cloned());
        for (region, choice) in &choices {
            if let Some((take, _)) = choice.iter().find(|(take, _)| usize::from(*take) >= takes) {
                let take = u32::from(*take) + 1;
                return Err(format!("{} is to show take {take}, and there are {takes}", region.name()).into());
            }
        }
        Ok(choices)
    }

    fn gather(
        &self,
        assets: &Assets,
        clips: &[&Path],
        frame: &understudy::appearance::FaceFrame,
        quiet: bool,
    ) -> Result<Vec<TakeLooks>, Box<dyn Error>> {
        let mut networks = ClipArgs::networks(assets)?;
        let mut takes = Vec::new();
        for (place, path) in (0..).zip(clips) {
            let clip = self.clip.on(path);
            let lift = clip.lift(&mut networks)?;
            let take = clip.solve(assets, networks, lift, quiet)?;
            networks = take.networks;
            if let Some(path) = self.avatar.as_ref().filter(|_| place == 0) {
                let look = neutral_look(clip.open()?, &take.motion, frame)?;
                write_obj(path, &performer_avatar(&take.motion.performer, frame, &look)?)?;
            }
            let source = clip.open()?;
            let bar = progress::bar("looking", Some(take.motion.frames.len() as u64), quiet);
            takes.push(TakeLooks::gather(place, source, take.motion, frame, |done| bar.set_position(done))?);
            bar.finish_and_clear();
        }
        Ok(takes)
    }
}

fn parse_use(text: &str) -> Result<(Region, Choice), String> {
    let wanted = "write a region and its frames, neutral first, such as forehead=12,80,143";
    let (name, frames) = text.split_once('=').ok_or(wanted)?;
    let region =
        Region::named(name.trim()).ok_or_else(|| format!("{} is no region; {wanted}", name.trim()))?;
    let frames = frames.split(',').map(str::trim).filter(|frame| !frame.is_empty());
    let choice = frames
        .map(|frame| understudy::pipeline::parse_frame(frame).ok_or(wanted))
        .collect::<Result<_, _>>()?;
    Ok((region, choice))
}
