//! The avatar's own film, tracked by the networks that tracked the performer.

use std::{error::Error, path::Path};

use nalgebra::Rotation3;
use understudy::{
    actions::ActionLibrary,
    assets::Assets,
    export::{MotionRecord, read_motion_csv},
    pipeline::{Animation, HeadMode, Networks, SolveOptions, Stage, Stopwatch, VideoPlan, write_motion},
    view::{Gpu, Look, Smoothing},
};

use super::{
    curves::{Following, MEASURES, following},
    stand::{Take, solve},
};

/// Pixels of the film's sides.
const SIDE: u32 = 480;

/// How each of the tests' measures follows, by the landmarks as tracked.
pub fn track_again(
    take: &Take,
    animation: &Animation,
    level: &Rotation3<f64>,
    gpu: &Gpu,
    assets: &Assets,
    networks: &mut Networks,
) -> Result<[Following; MEASURES.len()], Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("avatar.mp4");
    let look = Look::default();
    let stage =
        Stage::new(gpu, animation.target, level, [SIDE; 2], look, HeadMode::Follow, Smoothing::Edges)?;
    let plan = VideoPlan { path: path.clone(), stage, beside: None, sound_from: None };
    animation.write_mp4(plan, &mut Stopwatch::default(), |_| {})?;
    let film = solve(&path, assets, networks, &SolveOptions::default())?;
    let table = folder.path().join("landmarks.csv");
    let (performer, avatar) = (as_tracked(take, &table)?, as_tracked(&film, &table)?);
    // The film shows the clip at its nominal rate.
    let shown: Vec<_> = animation.ticks().into_iter().map(|index| performer[index].clone()).collect();
    Ok(MEASURES.map(|measure| following(&measure.curve(&shown), &measure.curve(&avatar))))
}

fn as_tracked(take: &Take, table: &Path) -> Result<Vec<MotionRecord>, Box<dyn Error>> {
    write_motion(table, &take.motion, ActionLibrary::built_in(), Some(&take.performance))?;
    Ok(read_motion_csv(table)?)
}
