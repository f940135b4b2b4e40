//! Tables 3-2 and 3-3 of 000 and the control points of §5.5, read from `catalogue.toml`.

use std::sync::LazyLock;

use nalgebra::Point3;
use serde::Deserialize;

use super::ActionError;
use crate::{
    lift::Side,
    scan::Surface,
    tracking::{SKIN_LANDMARK_COUNT, landmark_table},
};

/// Which part of the face an action moves (000 §5.6.2; the nose is a region of its own, as §7.2 asks).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FaceRegion {
    /// Forehead, brows, lids, and the cheeks' upper edge.
    Upper,
    /// Nose and what it wrinkles.
    Nose,
    /// Cheeks, mouth, chin.
    Lower,
}

/// One action unit.
#[derive(Debug, Clone, Deserialize)]
pub struct ActionFacts {
    /// FACS's number.
    pub au: u8,
    /// FACS's name.
    pub name: String,
    /// The muscles that act.
    pub muscle: String,
    /// What they move.
    pub region: FaceRegion,
    /// Whether each side can act alone.
    #[serde(default = "yes")]
    pub sides: bool,
    /// Names of the points where the muscle pulls.
    pub muscle_points: Vec<String>,
    /// Names of the points where skin folds.
    pub wrinkle_points: Vec<String>,
    /// The shapes from which the built-in library is measured.
    pub shapes: Vec<String>,
}

/// A named place on the face, relative to its landmarks.
#[derive(Debug, Clone)]
pub struct ControlPoint {
    /// As in the catalogue.
    pub name: String,
    /// `None` on the midline.
    pub side: Option<Side>,
    /// Landmarks and their weights, together 1.
    pub at: Vec<(usize, f64)>,
    /// Whether any action's muscle pulls here.
    pub is_muscle: bool,
    /// Whether any action folds the skin here.
    pub is_wrinkle: bool,
}

/// An emotion as a set of actions.
#[derive(Debug, Clone, Deserialize)]
pub struct Emotion {
    /// Its English name.
    pub name: String,
    /// Numbers of its actions.
    pub actions: Vec<u8>,
}

/// All that is known of action units beforehand.
#[derive(Debug, Clone)]
pub struct Catalogue {
    /// By ascending number.
    pub actions: Vec<ActionFacts>,
    /// In the file's order; of a pair the right one first.
    pub points: Vec<ControlPoint>,
    /// Table 3-3.
    pub emotions: Vec<Emotion>,
}

#[derive(Deserialize)]
struct Document {
    emotions: Vec<Emotion>,
    point: Vec<PointEntry>,
    action: Vec<ActionFacts>,
}

#[derive(Deserialize)]
struct PointEntry {
    name: String,
    #[serde(default)]
    midline: bool,
    at: Vec<(usize, f64)>,
}

fn yes() -> bool {
    true
}

#[allow(clippy::expect_used, reason = "compile-time data; a test reads all of it")]
static CATALOGUE: LazyLock<Catalogue> =
    LazyLock::new(|| Catalogue::parse(include_str!("catalogue.toml")).expect("the catalogue is valid TOML"));

impl Catalogue {
    /// The program's own.
    pub fn get() -> &'static Self {
        &CATALOGUE
    }

    fn parse(text: &str) -> Result<Self, toml::de::Error> {
        let document: Document = toml::from_str(text)?;
        let mut actions = document.action;
        actions.sort_by_key(|action| action.au);
        let is_wrinkle = |name: &String| actions.iter().any(|action| action.wrinkle_points.contains(name));
        let is_muscle = |name: &String| actions.iter().any(|action| action.muscle_points.contains(name));
        let mut points = Vec::new();
        for entry in document.point {
            let point = |side, at| ControlPoint {
                is_muscle: is_muscle(&entry.name),
                is_wrinkle: is_wrinkle(&entry.name),
                name: entry.name.clone(),
                side,
                at,
            };
            if entry.midline {
                points.push(point(None, entry.at));
            } else {
                let mirrored = entry.at.iter().map(|&(i, w)| (landmark_table()[i].mirror, w)).collect();
                points.push(point(Some(Side::Right), entry.at));
                points.push(point(Some(Side::Left), mirrored));
            }
        }
        Ok(Self { actions, points, emotions: document.emotions })
    }

    /// The facts of one action unit.
    pub fn action(&self, au: u8) -> Option<&ActionFacts> {
        self.actions.iter().find(|action| action.au == au)
    }

    /// Names of the control points, as files list them.
    pub fn point_names(&self) -> Vec<String> {
        (SKIN_LANDMARK_COUNT..self.handles()).map(|handle| self.handle_name(handle)).collect()
    }

    /// The numbers, as text.
    pub fn numbers(&self) -> String {
        self.actions.iter().map(|action| action.au.to_string()).collect::<Vec<_>>().join(", ")
    }

    /// The actions of an emotion of table 3-3.
    pub fn emotion(&self, name: &str) -> Result<&Emotion, ActionError> {
        let wanted = name.trim().to_lowercase();
        self.emotions.iter().find(|emotion| emotion.name == wanted).ok_or_else(|| {
            ActionError::UnknownEmotion {
                text: name.to_owned(),
                known: self.emotions.iter().map(|e| e.name.as_str()).collect::<Vec<_>>().join(", "),
            }
        })
    }

    /// Handles of a face: its skin landmarks, then the control points.
    pub fn handles(&self) -> usize {
        SKIN_LANDMARK_COUNT + self.points.len()
    }

    /// What a handle is called.
    pub fn handle_name(&self, handle: usize) -> String {
        let Some(point) = handle.checked_sub(SKIN_LANDMARK_COUNT).and_then(|k| self.points.get(k)) else {
            return format!("landmark {handle}");
        };
        match point.side {
            Some(Side::Right) => format!("{}, right", point.name),
            Some(Side::Left) => format!("{}, left", point.name),
            None => point.name.clone(),
        }
    }

    /// Whether a handle is a muscle or wrinkle control point of an action on one side; landmarks are not.
    pub fn is_point_of(&self, action: &ActionFacts, side: Option<Side>, handle: usize) -> bool {
        let point = handle.checked_sub(SKIN_LANDMARK_COUNT).and_then(|k| self.points.get(k));
        point.is_some_and(|point| {
            let named =
                action.muscle_points.contains(&point.name) || action.wrinkle_points.contains(&point.name);
            named && (point.side.is_none() || side.is_none() || point.side == side)
        })
    }

    /// Handles of a face that is known by its 468 landmarks alone: control points at their weighted mean.
    pub fn place_between(&self, landmarks: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mean = |point: &ControlPoint| {
            let sum = point.at.iter().map(|&(i, weight)| landmarks[i].coords * weight);
            Point3::from(sum.sum::<nalgebra::Vector3<f64>>())
        };
        landmarks[..SKIN_LANDMARK_COUNT].iter().copied().chain(self.points.iter().map(mean)).collect()
    }

    /// Places the handles on a face: landmarks as they are, control points at their weighted mean, moved to the nearest
    /// point of the surface. `None` where a landmark is missing. Frame and unit are the caller's.
    pub fn place(&self, landmarks: &[Option<Point3<f64>>], surface: &Surface) -> Vec<Option<Point3<f64>>> {
        let mean = |point: &ControlPoint| {
            let sum: Option<Vec<_>> = point
                .at
                .iter()
                .map(|&(i, weight)| Some(landmarks.get(i).copied().flatten()?.coords * weight))
                .collect();
            Some(surface.nearest(Point3::from(sum?.iter().sum::<nalgebra::Vector3<f64>>()))?.position)
        };
        let skin = (0..SKIN_LANDMARK_COUNT).map(|i| landmarks.get(i).copied().flatten());
        skin.chain(self.points.iter().map(mean)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::{Region, is_outline};

    #[test]
    fn the_catalogue_holds_what_the_thesis_lists() {
        let catalogue = Catalogue::get();
        let numbers: Vec<u8> = catalogue.actions.iter().map(|action| action.au).collect();
        let wanted = [
            1, 2, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 20, 22, 23, 24, 25, 26, 27, 28, 38, 39,
            41, 42, 43, 44, 45, 46,
        ];
        assert_eq!(numbers, wanted);
        assert_eq!(catalogue.emotions.len(), 6);
        for emotion in &catalogue.emotions {
            assert!(emotion.actions.iter().all(|&au| catalogue.action(au).is_some()), "{}", emotion.name);
        }
        assert!(catalogue.emotion("Happiness").is_ok() && catalogue.emotion("bliss").is_err());
    }

    #[test]
    fn every_point_is_used_and_stands_on_skin_that_moves() {
        let catalogue = Catalogue::get();
        let used = |name: &String| {
            let lists = |a: &ActionFacts| a.muscle_points.contains(name) || a.wrinkle_points.contains(name);
            catalogue.actions.iter().any(lists)
        };
        for point in &catalogue.points {
            assert!(used(&point.name), "{} belongs to no action", point.name);
            let sum: f64 = point.at.iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{}", point.name);
            assert!(
                point.at.iter().all(|&(i, _)| i < SKIN_LANDMARK_COUNT && !is_outline(i)),
                "{}",
                point.name
            );
        }
        for action in &catalogue.actions {
            for name in action.muscle_points.iter().chain(&action.wrinkle_points) {
                assert!(catalogue.points.iter().any(|p| &p.name == name), "AU{}: no point {name}", action.au);
            }
            assert!(!action.muscle_points.is_empty() && !action.shapes.is_empty());
        }
    }

    #[test]
    fn right_points_mirror_left_ones() {
        for pair in Catalogue::get().points.chunk_by(|a, b| a.name == b.name) {
            let [right, left] = pair else { continue };
            assert_eq!((right.side, left.side), (Some(Side::Right), Some(Side::Left)));
            for ((a, _), (b, _)) in right.at.iter().zip(&left.at) {
                assert_eq!(landmark_table()[*a].mirror, *b, "{}", right.name);
                assert_eq!(
                    landmark_table()[*a].region == Region::Lips,
                    landmark_table()[*b].region == Region::Lips
                );
            }
        }
    }
}
