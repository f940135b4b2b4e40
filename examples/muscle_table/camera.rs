//! Displacements in space from one camera's landmarks: nothing, the plane, the basis.

use std::error::Error;

use nalgebra::{Point3, Rotation3, Vector2, Vector3};
use understudy::{
    actions::Catalogue,
    head::{Camera, HeadPose, PoseSolver},
    muscle::{CameraFit, CameraSolver, FaceBasis, MuscleBasis},
    rig::SourceFace,
    tracking::{Region, SKIN_LANDMARK_COUNT, index, landmark_table},
};

use super::takes::Take;

/// Sums of squares over frames and landmarks.
#[derive(Default, Clone, Copy)]
pub struct Rms(f64, f64);

impl Rms {
    pub fn add(&mut self, square: f64) {
        if square.is_finite() {
            self.0 += square;
            self.1 += 1.0;
        }
    }

    pub fn get(self) -> f64 {
        (self.0 / self.1.max(1.0)).sqrt()
    }
}

pub struct Errors {
    pub still: f64,
    pub plane: f64,
    pub basis: f64,
    pub mixed: f64,
    pub rigid_pose: f64,
    pub pose: f64,
    pub weights: f64,
}

/// Whether a landmark is counted: the outline is another line in every view.
pub fn is_scored(landmark: usize) -> bool {
    landmark_table()[landmark].region != Region::Oval
}

pub fn face_of(neutral: &[Point3<f64>]) -> SourceFace {
    let mut points = neutral.to_vec();
    points.resize(understudy::tracking::LANDMARK_COUNT, Point3::origin());
    SourceFace {
        points: Catalogue::get().place_between(&points),
        level: Rotation3::identity(),
        closed_lips: [0.0; index::UPPER_INNER.len()],
        has_depth: true,
    }
}

/// The generic shapes on a face, vector for vector.
fn as_basis(generic: &Take, points: &[Point3<f64>]) -> MuscleBasis {
    let shapes = generic.displacements("shapes");
    let names = generic.entry.shapes.clone().unwrap_or_default();
    let elements = names.into_iter().zip(shapes).map(|(name, mut vectors)| {
        vectors.resize(points.len(), Vector3::zeros());
        understudy::muscle::Element {
            name,
            part: understudy::muscle::Part::Lower,
            channel: understudy::muscle::Channel::Measured,
            closure: [0.0; 2],
            vectors,
        }
    });
    MuscleBasis {
        name: "generic".into(),
        face: points.to_vec(),
        elements: elements.collect(),
        turns_jaw: false,
    }
}

pub fn measure(
    take: &Take,
    names_of: &[String],
    basis: &MuscleBasis,
    generic: Option<&Take>,
    fit: CameraFit,
    part: f64,
) -> Result<Errors, Box<dyn Error>> {
    let neutral = take.neutral();
    let truth = take.displacements("truth");
    let (pixels, poses) = (take.pixels(), take.poses());
    let [width, height] = take.entry.size.ok_or("no size")?;
    let focal = take.entry.focal.ok_or("no focal length")?;
    let centre = Vector2::new(f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0);
    let camera = Camera { focal, centre };
    let rigid_weights = landmark_table()[..SKIN_LANDMARK_COUNT].iter().map(|f| f.pose_weight).collect();
    let rigid = PoseSolver::new(camera, neutral.clone(), rigid_weights);
    let face = face_of(&neutral);
    let on_face = match generic {
        None => FaceBasis::new(basis, &face)?,
        Some(generic) => FaceBasis::own(&as_basis(generic, &face.points)),
    };
    let mut solver = CameraSolver::new(camera, on_face, fit);
    let names: Vec<_> = solver.basis().muscles.iter().map(|m| m.name.clone()).collect();
    let weights = take.weights();
    let mut x = vec![0.0; names.len()];
    let mut fitted = Vec::new();
    let [mut still, mut plane, mut alone, mut mixed, mut rigid_pose, mut pose_error, mut weight_error] =
        [Rms::default(); 7];
    let mut previous: Option<HeadPose> = None;
    for (t, pixels) in pixels.iter().enumerate() {
        let seen: Vec<(usize, Vector2<f64>)> =
            pixels.iter().copied().enumerate().filter(|(_, p)| p.x.is_finite()).collect();
        let start = if seen.len() == SKIN_LANDMARK_COUNT {
            rigid.solve(pixels, previous.as_ref())?
        } else {
            let weights = seen.iter().map(|(i, _)| landmark_table()[*i].pose_weight).collect();
            let some = PoseSolver::new(camera, seen.iter().map(|(i, _)| neutral[*i]).collect(), weights);
            some.solve(&seen.iter().map(|s| s.1).collect::<Vec<_>>(), previous.as_ref())?
        };
        previous = Some(start);
        let pose = solver.solve(pixels, &start, &mut x);
        solver.basis().synthesize(&x, &mut fitted);
        let (rotation, _) = &poses[t];
        rigid_pose.add(start.rotation.angle_to(rotation).to_degrees().powi(2));
        pose_error.add(pose.rotation.angle_to(rotation).to_degrees().powi(2));
        for i in (0..SKIN_LANDMARK_COUNT).filter(|&i| is_scored(i)) {
            let t = truth[t][i];
            still.add(t.norm_squared());
            let flat = |pose: &HeadPose, base: Vector3<f64>| {
                let depth = pose.to_camera(&(neutral[i] + base)).z;
                pose.to_scan(&camera.at_depth(pixels[i], depth)) - neutral[i]
            };
            plane.add((flat(&start, Vector3::zeros()) - t).norm_squared());
            alone.add((fitted[i] - t).norm_squared());
            mixed.add((fitted[i] + (flat(&pose, fitted[i]) - fitted[i]) * part - t).norm_squared());
        }
        for (own, name) in x.iter().zip(&names) {
            if let Some(k) = names_of.iter().position(|shape| shape == name) {
                weight_error.add((own - weights[t][k]).powi(2));
            }
        }
    }
    Ok(Errors {
        still: still.get(),
        plane: plane.get(),
        basis: alone.get(),
        mixed: mixed.get(),
        rigid_pose: rigid_pose.get(),
        pose: pose_error.get(),
        weights: weight_error.get(),
    })
}
