//! Jitter and lag of contractions and landmarks, live and recorded.

use std::{error::Error, fmt::Write as _, path::Path};

use nalgebra::Vector3;
use understudy::{
    assets::Assets,
    capture::{ClipInfo, FrameRate},
    lift::Smoothing,
    pipeline::{LiftMode, Motion, Networks, Performance, SolveOptions, TrackedFrame, read_canonical_face},
    tracking::{LANDMARK_COUNT, LandmarkState, Landmarks, SKIN_LANDMARK_COUNT, TrackerOptions},
};

use super::{
    camera::{Rms, is_scored},
    takes::{Entry, Take},
};

const RATE: FrameRate = FrameRate { numerator: 30, denominator: 1 };
/// Frames of the recording in one piece.
const STRETCH: usize = 30;

/// A take as if a network had tracked it: the still face first, whose frames are the neutral.
fn performance(still: &Take, take: &Take) -> Performance {
    let landmarks = |pixels: &Vec<nalgebra::Vector2<f64>>| {
        let mut points: Vec<_> = pixels.iter().map(|p| Vector3::new(p.x, p.y, 0.0)).collect();
        // Irises in the middle of their eyes.
        let iris = |a: usize, b: usize| nalgebra::center(&points[a].into(), &points[b].into()).coords;
        let (right, left) = (iris(33, 133), iris(263, 362));
        points.extend([right; 5]);
        points.extend([left; LANDMARK_COUNT - SKIN_LANDMARK_COUNT - 5]);
        Landmarks { points, states: vec![LandmarkState::Observed; LANDMARK_COUNT], presence: 1.0 }
    };
    let frames = still.pixels().iter().chain(&take.pixels()).map(landmarks).collect::<Vec<_>>();
    let frames = (0..).zip(frames).map(|(index, landmarks)| TrackedFrame {
        index,
        timestamp: RATE.tick(index),
        landmarks: Some(landmarks),
    });
    let info =
        ClipInfo { name: "synthetic".into(), width: 640, height: 480, rate: RATE, announced_frames: None };
    Performance { info, frames: frames.collect(), faces_seen: 1 }
}

/// How much landmarks tremble, millimetres: of white noise the second difference has six times the variance.
fn jitter(motion: &Motion, first: usize) -> f64 {
    let mut sum = Rms::default();
    for three in motion.frames[first..].windows(3) {
        let [a, b, c] = [0, 1, 2].map(|k| &three[k].expression.displacements.vectors);
        for i in (0..SKIN_LANDMARK_COUNT).filter(|&i| is_scored(i)) {
            sum.add((a[i] - b[i] * 2.0 + c[i]).norm_squared() / 6.0);
        }
    }
    sum.get()
}

/// A curve's lag behind another in frames, and the ratio of their greatest speeds.
fn lag(own: &[f64], ahead: &[f64]) -> (f64, f64) {
    let match_at = |shift: i32| -> f64 {
        let pairs = (4..own.len() as i32 - 4).map(|t| own[t as usize] - ahead[(t - shift) as usize]);
        pairs.map(|d| d * d).sum()
    };
    let errors: Vec<f64> = (-4..=4).map(match_at).collect();
    let best = (1..8).min_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(4);
    let [a, b, c] = [errors[best - 1], errors[best], errors[best + 1]];
    let bend = a - 2.0 * b + c;
    let fine = if bend > 0.0 { 0.5 * (a - c) / bend } else { 0.0 };
    let speed = |curve: &[f64]| curve.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    (best as f64 - 4.0 + fine, speed(own) / speed(ahead).max(1e-9))
}

/// Rows for one performer.
pub fn section(folder: &Path, entries: &[Entry]) -> Result<String, Box<dyn Error>> {
    let assets = Assets::locate()?;
    let mut networks = Networks::load(&assets, TrackerOptions::default())?;
    let average = read_canonical_face(&assets.verified("canonical_face")?)?;
    let read = |name: &str| -> Result<Take, Box<dyn Error>> {
        Take::read(folder, entries.iter().find(|e| e.name == name).ok_or("no such take")?)
    };
    let (still, turning, acting) =
        (read("frontal_1_noise2")?, read("turning_1_noise2")?, read("personalised_1_noise2_under")?);
    let focal = acting.entry.focal.ok_or("no focal length")?;
    let field_of_view = 2.0 * (320.0 / focal).atan().to_degrees();
    let mut solve = |take: &Take, lift: LiftMode, smoothing| -> Result<Motion, Box<dyn Error>> {
        let neutral = Some((0.0, 0.95));
        let options = SolveOptions { field_of_view, neutral, accept_neutral: true, smoothing, lift };
        let performance = performance(&still, take);
        Ok(Motion::solve(&performance, &average, &mut networks.blendshapes, &options)?)
    };
    let mut text = String::from(
        "| | jitter of a turning neutral, mm | lag of mouthSmileLeft, frames | of jawOpen | of eyeBlinkLeft | speed of eyeBlinkLeft |\n|---|---:|---:|---:|---:|---:|\n",
    );
    let first = still.pixels().len();
    let raw = solve(&acting, LiftMode::default(), Smoothing::Off)?;
    let basis = raw.basis.clone().ok_or("no muscles")?;
    let curve = |motion: &Motion, name: &str, stretch: usize| -> Vec<f64> {
        let k = basis.index(name).unwrap_or_default();
        let from = first + stretch * STRETCH;
        motion.frames[from..from + STRETCH].iter().map(|f| f.expression.contractions[k]).collect()
    };
    for (name, smoothing) in
        [("as solved", Smoothing::Off), ("live", Smoothing::Causal), ("recorded", Smoothing::ZeroPhase)]
    {
        let motion = solve(&acting, LiftMode::default(), smoothing)?;
        let _ = write!(
            text,
            "| muscles, {name} | {:.3} |",
            jitter(&solve(&turning, LiftMode::default(), smoothing)?, first)
        );
        let mut speed = 0.0;
        for muscle in ["mouthSmileLeft", "jawOpen", "eyeBlinkLeft"] {
            // Where it moves most.
            let range = |stretch: usize| {
                let own = curve(&raw, muscle, stretch);
                own.iter().copied().fold(0.0, f64::max) - own.iter().copied().fold(1.0, f64::min)
            };
            let most = (0..5).max_by(|&a, &b| range(a).total_cmp(&range(b))).unwrap_or_default();
            let (behind, ratio) = lag(&curve(&motion, muscle, most), &curve(&raw, muscle, most));
            let _ = write!(text, " {behind:.2} |");
            speed = ratio;
        }
        let _ = writeln!(text, " {speed:.2} |");
    }
    for (name, smoothing) in [("plane, as solved", Smoothing::Off), ("plane, live", Smoothing::Causal)] {
        let motion = solve(&turning, LiftMode::Plane, smoothing)?;
        let _ = writeln!(text, "| {name} | {:.3} | | | | |", jitter(&motion, first));
    }
    Ok(text)
}
