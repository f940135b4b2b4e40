//! `understudy plot`: contraction curves in, charts out; edited on the way if asked for.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use clap::Args;
use understudy::{
    capture::{self, Frame, Timestamp},
    export::{Draft, write_live_link, write_muscle_csv, write_text},
    muscle::{CurveTake, MuscleCurves, different_moments, find_muscle},
    view::{Chart, Moment, as_picture, save_png},
};

use super::{
    Outcome,
    curve_files::{CurveFile, EditArgs},
    inputs,
};

const EXAMPLES: &str = "\
Examples:
  understudy plot take.muscles.csv -o curves.svg -o curves.png
  understudy plot take.muscles.csv -o few.svg --muscles jawOpen,browInnerUp
  understudy plot take.muscles.csv -o error.svg --error
  understudy plot take.muscles.csv -o moments.png --snapshots auto --clip clip.mp4
  understudy plot take.muscles.csv -o moments.svg --snapshots 1.2,3.4 --clip avatar.mp4
  understudy plot iphone.csv -o calmer.livelink.csv -o calmer.png --edit edits.toml

Curves are those of `understudy animate -o take.muscles.csv`, or a recording of Live Link Face.

Outputs:
  .svg           the chart, for papers and the web
  .png           the chart as a picture
  .muscles.csv   the curves as a table, with the edits
  .livelink.csv  a recording of Live Link Face with the edits; its own timecodes, head and eyes

Edits, in TOML; mirror comes first, then scale, offset, clamp:
  mirror = true          # left and right change places
  [all]
  scale = 1.1
  [jawOpen]
  scale = 0.8
  offset = 0.05
  clamp = [0.0, 1.0]
  [cheekPuff]
  mute = true";

/// Moments that are chosen by themselves, as many as in the paper.
const MOMENTS: usize = 4;

/// Draw contraction curves as charts, and edit them
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Plot {
    /// The curves: .csv of contractions, or of Live Link Face
    curves: PathBuf,
    /// What to write, by extension: .svg, .png, .muscles.csv, .livelink.csv; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// The muscles to show, separated by commas; those that move most if not given
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    muscles: Vec<String>,
    /// Show the marker error of upper and lower face below a few curves, over the frames' numbers
    #[arg(long, conflicts_with = "snapshots")]
    error: bool,
    /// Show moments with a bar for every muscle: seconds separated by commas, or `auto` for the most different
    #[arg(long, value_name = "TIMES|auto", value_parser = parse_times)]
    snapshots: Option<Times>,
    /// The film of performer or avatar whose pictures stand beside the bars
    #[arg(long, value_name = "FILE", requires = "snapshots")]
    clip: Option<PathBuf>,
    #[command(flatten)]
    edits: EditArgs,
}

/// Which moments are shown.
#[derive(Debug, Clone)]
enum Times {
    Auto,
    Seconds(Vec<f64>),
}

fn parse_times(text: &str) -> Result<Times, String> {
    if text == "auto" {
        return Ok(Times::Auto);
    }
    let parse = |part: &str| part.trim().parse().ok().filter(|time: &f64| (0.0..1e9).contains(time));
    let times: Option<Vec<f64>> = text.split(',').map(parse).collect();
    times.map(Times::Seconds).ok_or_else(|| "write seconds such as 1.2,3.4, or auto".to_owned())
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Svg,
    Png,
    Curves(CurveFile),
}

impl Kind {
    fn of(path: &Path) -> Result<Self, String> {
        if let Some(curves) = CurveFile::of(path) {
            return Ok(Self::Curves(curves));
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let ends = [(".svg", Self::Svg), (".png", Self::Png)];
        ends.into_iter().find(|(end, _)| name.ends_with(end)).map(|(_, kind)| kind).ok_or_else(|| {
            format!("cannot write {}: name it .svg, .png, .muscles.csv or .livelink.csv", path.display())
        })
    }
}

impl Plot {
    pub fn run(&self, quiet: bool) -> Outcome {
        let outputs = self.outputs()?;
        let mut take = CurveTake::read(&self.curves)?;
        if let Some(edits) = self.edits.read()? {
            take = self.edits.of_take(&edits, take)?;
        }
        let curves = &take.curves;
        let muscles: Vec<usize> = self
            .muscles
            .iter()
            .map(|name| find_muscle(curves.muscles(), name.trim()))
            .collect::<Result<_, _>>()?;
        if outputs.iter().any(|(kind, _)| *kind == Kind::Curves(CurveFile::LiveLink))
            && take.live_link.is_none()
        {
            return Err(format!(
                "{} has no head and eyes, which .livelink.csv needs. Write it with `understudy animate -o take.livelink.csv`",
                self.curves.display()
            )
            .into());
        }
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut title = name(&self.curves);
        if let Some(path) = &self.edits.edit {
            title = format!("{title}, edited by {}", name(path));
        }
        let muscles = (!muscles.is_empty()).then_some(muscles.as_slice());
        let moments = self.moments(curves)?;
        let chart = self.chart(&title, curves, muscles, &moments)?;
        for (kind, path) in outputs {
            match kind {
                Kind::Svg => write_text(path, &chart.svg()?)?,
                Kind::Png => save_png(path, &chart.picture()?)?,
                Kind::Curves(CurveFile::Muscles) => write_muscle_csv(path, curves)?,
                Kind::Curves(CurveFile::LiveLink) => {
                    if let Some(extras) = &take.live_link {
                        write_live_link(path, curves, &extras.angles, extras.base)?;
                    }
                }
            }
            if !quiet {
                say!("wrote {}", path.display());
            }
        }
        Ok(())
    }

    fn chart<'a>(
        &self,
        title: &'a str,
        curves: &'a MuscleCurves,
        muscles: Option<&'a [usize]>,
        moments: &'a [Moment],
    ) -> Result<Chart<'a>, Box<dyn Error>> {
        if self.error && curves.frames().iter().all(|frame| frame.error.is_none()) {
            return Err(format!(
                "{} holds no marker error: nothing was measured against it. Leave --error out",
                self.curves.display()
            )
            .into());
        }
        Ok(if self.snapshots.is_some() {
            Chart::Snapshots { title, curves, muscles, moments }
        } else if self.error {
            Chart::Error { title, curves, muscles }
        } else {
            Chart::Curves { title, curves, muscles }
        })
    }

    /// The moments asked for, with their pictures.
    fn moments(&self, curves: &MuscleCurves) -> Result<Vec<Moment>, Box<dyn Error>> {
        let frames = match &self.snapshots {
            None => return Ok(Vec::new()),
            Some(Times::Auto) => different_moments(curves, MOMENTS),
            Some(Times::Seconds(times)) => {
                let last = curves.frames().last().map_or(0.0, |frame| frame.time.seconds());
                if let Some(beyond) = times.iter().find(|time| **time > last + 0.5) {
                    let path = self.curves.display();
                    return Err(format!("there is nothing at {beyond} s: {path} ends at {last:.2} s").into());
                }
                times.iter().map(|time| curves.frame_at(Timestamp((time * 1e9).round() as i64))).collect()
            }
        };
        let mut moments: Vec<Moment> =
            frames.into_iter().map(|frame| Moment { frame, picture: None }).collect();
        if let Some(clip) = &self.clip {
            picture_moments(&mut moments, curves, clip)?;
        }
        Ok(moments)
    }

    /// What to write where; places that cannot be written to are refused before any work is done.
    fn outputs(&self) -> Result<Vec<(Kind, &Path)>, Box<dyn Error>> {
        let mut outputs = Vec::new();
        let read = [Some(&self.curves), self.clip.as_ref(), self.edits.edit.as_ref()];
        let read: Vec<&Path> = read.into_iter().flatten().map(PathBuf::as_path).collect();
        for path in &self.output {
            outputs.push((Kind::of(path)?, path.as_path()));
            inputs::spare(path, &read)?;
            drop(Draft::create(path)?);
        }
        Ok(outputs)
    }
}

/// Gives every moment the clip's picture that is shown at its time.
fn picture_moments(moments: &mut [Moment], curves: &MuscleCurves, clip: &Path) -> Outcome {
    // A clip that is not there is named before it is opened, in the system's own words.
    fs::metadata(clip).map_err(|error| format!("cannot read {}: {error}. Check the path", clip.display()))?;
    let mut source = capture::open(clip, curves.rate())?;
    // Rates round differently in films and tables; half a frame does not count.
    let half = (0.5e9 / curves.rate().per_second()) as i64;
    let mut frame = Frame::default();
    let mut last = Timestamp(0);
    while source.read(&mut frame)? {
        last = frame.timestamp;
        let is_due = |moment: &&mut Moment| {
            moment.picture.is_none() && curves.frames()[moment.frame].time.0 <= last.0 + half
        };
        for moment in moments.iter_mut().filter(is_due) {
            let size = [frame.image.width() as u32, frame.image.height() as u32];
            moment.picture = Some(as_picture(size, frame.image.to_rgba()?)?);
        }
        if moments.iter().all(|moment| moment.picture.is_some()) {
            return Ok(());
        }
    }
    let missing = moments.iter().find(|moment| moment.picture.is_none());
    let wanted = missing.map_or(0.0, |moment| curves.frames()[moment.frame].time.seconds());
    Err(format!(
        "{} ends at {:.2} s and shows nothing of the moment at {wanted:.2} s. Give the film of this take",
        clip.display(),
        last.seconds()
    )
    .into())
}
