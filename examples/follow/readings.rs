//! What is compared of the two faces, and how it is read off the performer's landmarks.
//!
//! Both faces are read with the head's turn taken out, and as the performer's camera sees them: a place counts where its
//! ray meets the plane, parallel to the picture, in which it rests. A jaw that opens goes back as it goes down, which in a
//! picture taken from near makes it look a fifth less open, and how far back it goes is the network's guess.

use nalgebra::{Point2, Point3, Vector2, Vector3, center};
use understudy::{
    anatomy::{LOWER_INNER, UPPER_INNER},
    capture::Timestamp,
    head::HeadPose,
    lift::{Expression, EyeMeasure, LidRange, LiftError, NeutralEyes, Performer, measure_eyes},
    pipeline::{Motion, Performance},
    tracking::{Landmarks, index},
};

/// One curve of each face.
pub struct Measure {
    /// What it is.
    pub name: &'static str,
    /// In what.
    pub unit: &'static str,
}

/// What is compared, in the order of a [`Reading`].
pub const MEASURES: [Measure; 7] = [
    Measure { name: "mouth gap", unit: "mm" },
    Measure { name: "mouth width", unit: "of neutral" },
    Measure { name: "right lids", unit: "of neutral" },
    Measure { name: "left lids", unit: "of neutral" },
    Measure { name: "chin lowered", unit: "eye distances" },
    Measure { name: "gaze, yaw", unit: "degrees" },
    Measure { name: "gaze, pitch", unit: "degrees" },
];

/// A value for each of [`MEASURES`]; NaN where there is none.
pub type Reading = [f64; MEASURES.len()];

/// The middle pair of the inner lips.
pub const MIDDLE: usize = UPPER_INNER.len() / 2;
/// Outer corners.
pub const EYES: [usize; 2] = [index::RIGHT_EYE_OUTER, index::LEFT_EYE_OUTER];
/// An eye that is less open than this share hides its iris.
const HALF_OPEN: f64 = 0.5;

/// Places on a face that has been flattened by a [`Lens`], millimetres.
pub struct Marks {
    /// Inner rims of the upper and the lower lip, in the middle.
    pub lips: [Point2<f64>; 2],
    /// Corners of the mouth.
    pub corners: [Point2<f64>; 2],
    /// Lowest point.
    pub chin: Point2<f64>,
}

/// What a face is measured in, and from where.
#[derive(Default)]
pub struct Proportions {
    /// Of the mouth at rest, millimetres.
    pub mouth: f64,
    /// Between the outer corners of the eyes, millimetres.
    pub eyes: f64,
    /// Across the line through the eyes.
    down: Vector2<f64>,
    chin: Point2<f64>,
}

impl Proportions {
    /// By the marks at rest and the outer corners of the eyes.
    pub fn new(rest: &Marks, eyes: [Point2<f64>; 2]) -> Self {
        let along = eyes[1] - eyes[0];
        let down = Vector2::new(along.y, -along.x) / along.norm();
        Self { mouth: width(rest), eyes: along.norm(), down, chin: rest.chin }
    }

    /// Gap of the mouth in millimetres, its width and how far the chin is lowered in the face's own measure.
    pub fn measure(&self, marks: &Marks) -> [f64; 3] {
        let gap = (marks.lips[0] - marks.lips[1]).norm();
        [gap, width(marks) / self.mouth, (marks.chin - self.chin).dot(&self.down) / self.eyes]
    }
}

fn width(marks: &Marks) -> f64 {
    (marks.corners[0] - marks.corners[1]).norm()
}

/// The performer's camera before a face: level frame, from the middle between the outer corners of the eyes.
pub struct Lens {
    eye: Vector3<f64>,
    axis: Vector3<f64>,
}

impl Lens {
    /// Before the performer's own face, millimetres.
    fn of(performer: &Performer, pose: &HeadPose) -> Self {
        let level = performer.level();
        let eyes = EYES.map(|landmark| performer.neutral()[landmark]);
        let eye = pose.to_scan(&Point3::origin()) - center(&eyes[0], &eyes[1]);
        Self { eye: level * eye, axis: level * (pose.rotation.inverse() * Vector3::z()) }
    }

    /// As far from another face, in its own measure.
    pub fn scaled(&self, scale: f64) -> Self {
        Self { eye: self.eye * scale, axis: self.axis }
    }

    /// Where the ray through a place meets the plane in which it rests; all in the lens's frame.
    pub fn flat(&self, place: &Vector3<f64>, rest: &Vector3<f64>) -> Vector3<f64> {
        let ray = place - self.eye;
        self.eye + ray * ((rest - self.eye).dot(&self.axis) / ray.dot(&self.axis))
    }
}

/// A frame of the clip as the networks saw it.
pub struct Seen<'a> {
    time: Timestamp,
    landmarks: &'a Landmarks,
    /// What these very landmarks say of the head.
    pose: HeadPose,
    eyes: [EyeMeasure; 2],
}

/// Every frame of the clip; `None` where no face was seen.
pub fn seen<'a>(motion: &Motion, performance: &'a Performance) -> Result<Vec<Option<Seen<'a>>>, LiftError> {
    let performer = &motion.performer;
    let mut previous = None;
    let mut frames = Vec::with_capacity(performance.frames.len());
    for frame in &performance.frames {
        let Some(landmarks) = &frame.landmarks else {
            frames.push(None);
            continue;
        };
        let pose = performer.pose(landmarks, previous.as_ref())?;
        previous = Some(pose);
        let eyes = measure_eyes(performer, landmarks, &pose);
        frames.push(Some(Seen { time: frame.timestamp, landmarks, pose, eyes }));
    }
    Ok(frames)
}

/// Reads the performer.
pub struct Reader<'a> {
    performer: &'a Performer,
    rest: Proportions,
    /// The target's mouth over the performer's.
    ratio: f64,
    ranges: [LidRange; 2],
    /// Yaw and pitch while neutral, degrees.
    gaze: [f64; 2],
}

impl<'a> Reader<'a> {
    /// `mouth` is the width of the target's, millimetres.
    pub fn new(motion: &'a Motion, frames: &[Option<Seen>], mouth: f64) -> Self {
        let performer = &motion.performer;
        let neutral = |landmark: usize| performer.neutral()[landmark];
        let eyes = EYES.map(|landmark| (performer.level() * neutral(landmark)).xy());
        let rest = Proportions::new(&marks(performer, neutral), eyes);
        let is_neutral = |frame: &&Seen| (motion.neutral.0..=motion.neutral.1).contains(&frame.time);
        let neutral: Vec<_> = frames.iter().flatten().filter(is_neutral).map(|frame| frame.eyes).collect();
        let open = NeutralEyes::new(&neutral).apertures();
        let span = motion.frames.last().map_or(0.0, |frame| frame.timestamp.seconds());
        let interval = span / motion.frames.len().saturating_sub(1).max(1) as f64;
        let ranges = [0, 1].map(|side| {
            let eyes = frames.iter().flatten().map(|frame| &frame.eyes[side]);
            let apertures: Vec<f64> = eyes.filter(|eye| eye.seen).map(|eye| eye.aperture).collect();
            LidRange::of_take(open[side], &apertures, interval)
        });
        let mut reader = Self { performer, ratio: mouth / rest.mouth, rest, ranges, gaze: [0.0; 2] };
        let gazes: Vec<[f64; 2]> = neutral.iter().map(|eyes| reader.gaze(eyes)).collect();
        reader.gaze = [0, 1].map(|axis| {
            let known = || gazes.iter().map(|gaze| gaze[axis]).filter(|angle| angle.is_finite());
            known().sum::<f64>() / known().count().max(1) as f64
        });
        reader
    }

    /// A frame as the network saw it, nothing steadied.
    pub fn as_tracked(&self, frame: &Seen) -> Reading {
        let flat = |landmark| self.performer.lift_flat(frame.landmarks, &frame.pose, landmark);
        let openings = [0, 1].map(|side| self.opening(side, &frame.eyes[side]));
        self.reading(&marks(self.performer, flat), openings, self.gaze(&frame.eyes))
    }

    /// A frame as the avatar was told to follow it: steadied, lids and gaze by their own filters.
    pub fn as_told(&self, expression: &Expression) -> Reading {
        let (level, neutral) = (self.performer.level(), self.performer.neutral());
        let lens = self.lens(&expression.pose);
        let eyes = center(&neutral[EYES[0]], &neutral[EYES[1]]);
        let moved = |i: usize| {
            let rest = level * (neutral[i] - eyes);
            let flat = lens.flat(&(rest + level * expression.displacements.vectors[i]), &rest);
            eyes + level.inverse() * flat
        };
        let (right, left) = (&expression.eyes.right, &expression.eyes.left);
        let gaze = [f64::midpoint(right.yaw, left.yaw), f64::midpoint(right.pitch, left.pitch)];
        let openings = [right, left].map(|eye| 1.0 - eye.closure);
        self.reading(&marks(self.performer, moved), openings, gaze.map(f64::to_degrees))
    }

    /// Between the outer corners of the eyes, millimetres.
    pub fn eyes(&self) -> f64 {
        self.rest.eyes
    }

    /// The camera before the performer in some pose.
    pub fn lens(&self, pose: &HeadPose) -> Lens {
        Lens::of(self.performer, pose)
    }

    fn reading(&self, marks: &Marks, [right, left]: [f64; 2], [yaw, pitch]: [f64; 2]) -> Reading {
        let [gap, width, chin] = self.rest.measure(marks);
        [gap * self.ratio, width, right, left, chin, yaw, pitch]
    }

    /// 1 as in the neutral, 0 at what counts as closed for this performer.
    fn opening(&self, side: usize, eye: &EyeMeasure) -> f64 {
        let range = &self.ranges[side];
        ((eye.aperture - range.closed()) / (range.open() - range.closed())).max(0.0)
    }

    /// Yaw and pitch of both eyes together, degrees since the neutral; none where a lid hides an iris.
    fn gaze(&self, eyes: &[EyeMeasure; 2]) -> [f64; 2] {
        let hidden = |side: usize| !eyes[side].seen || self.opening(side, &eyes[side]) < HALF_OPEN;
        let both = [f64::midpoint(eyes[0].yaw, eyes[1].yaw), f64::midpoint(eyes[0].pitch, eyes[1].pitch)];
        let is_hidden = hidden(0) || hidden(1);
        [0, 1].map(|axis| if is_hidden { f64::NAN } else { both[axis].to_degrees() - self.gaze[axis] })
    }
}

/// The performer's marks where `place` says that landmarks lie, scan frame.
fn marks(performer: &Performer, place: impl Fn(usize) -> Point3<f64>) -> Marks {
    let at = |landmark: usize| (performer.level() * place(landmark)).xy();
    Marks {
        lips: [UPPER_INNER[MIDDLE], LOWER_INNER[MIDDLE]].map(at),
        corners: [index::MOUTH_RIGHT, index::MOUTH_LEFT].map(at),
        chin: at(index::CHIN),
    }
}
