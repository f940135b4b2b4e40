//! From frame to frame: find the face once, then follow it.

use super::{Detection, Detector, FaceRegion, Landmarks, TrackingError, network::LandmarkNetwork};
use crate::capture::Image;

/// Below this the network sees no face in its region.
const MINIMUM_PRESENCE: f64 = 0.5;

/// How a face is found and followed.
#[derive(Debug, Clone, Copy)]
pub struct TrackerOptions {
    /// Runs of the landmark network after a fresh detection. One is what MediaPipe does on a still; the second moves
    /// points by pixels on large faces, the third by less than one.
    pub settling_runs: usize,
    /// Frames between looks for a face while none is followed and the thorough search has failed; the quick search
    /// runs on every frame.
    pub thorough_interval: u64,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self { settling_runs: 3, thorough_interval: 10 }
    }
}

/// Follows one face through a clip.
pub struct Tracker {
    short_range: Detector,
    full_range: Detector,
    network: LandmarkNetwork,
    options: TrackerOptions,
    region: Option<FaceRegion>,
    frames_without_face: u64,
    faces_seen: usize,
}

impl Tracker {
    /// Takes over loaded networks.
    pub fn new(
        short_range: Detector,
        full_range: Detector,
        network: LandmarkNetwork,
        options: TrackerOptions,
    ) -> Self {
        Self {
            short_range,
            full_range,
            network,
            options,
            region: None,
            frames_without_face: 0,
            faces_seen: 0,
        }
    }

    /// Forgets the face, as at the start of another clip.
    pub fn reset(&mut self) {
        self.region = None;
        self.frames_without_face = 0;
        self.faces_seen = 0;
    }

    /// The most faces seen at once by any search so far; the largest of them is followed.
    pub fn faces_seen(&self) -> usize {
        self.faces_seen
    }

    /// Landmarks of the followed face in the next frame, or `None` while there is no face.
    pub fn track(&mut self, image: &Image) -> Result<Option<Landmarks>, TrackingError> {
        if let Some(region) = self.region.take()
            && let Some(landmarks) = self.look(image, region)?
        {
            self.follow(image, &landmarks);
            return Ok(Some(landmarks));
        }
        let mut largest: Option<Landmarks> = None;
        for detection in self.search(image)? {
            // A detector's boxes of small faces are up to twice too large: the landmarks tell which face is larger.
            if let Some(landmarks) = self.settle(image, detection.region())?
                && largest.as_ref().is_none_or(|other| extent(&landmarks) > extent(other))
            {
                largest = Some(landmarks);
            }
        }
        if let Some(landmarks) = largest {
            self.frames_without_face = 0;
            self.follow(image, &landmarks);
            return Ok(Some(landmarks));
        }
        self.frames_without_face += 1;
        Ok(None)
    }

    /// Looks at a freshly detected face until its region has settled.
    fn settle(&mut self, image: &Image, mut region: FaceRegion) -> Result<Option<Landmarks>, TrackingError> {
        let mut seen = None;
        for _ in 0..self.options.settling_runs.max(1) {
            if !region.is_usable(image.width(), image.height()) {
                break;
            }
            seen = self.look(image, region)?;
            let Some(landmarks) = &seen else { break };
            region = FaceRegion::around_landmarks(landmarks);
        }
        Ok(seen)
    }

    fn look(&mut self, image: &Image, region: FaceRegion) -> Result<Option<Landmarks>, TrackingError> {
        let landmarks = self.network.run(image, region)?;
        let finite = landmarks.points.iter().all(|p| p.iter().all(|value| value.is_finite()));
        Ok((finite && landmarks.presence >= MINIMUM_PRESENCE).then_some(landmarks))
    }

    fn follow(&mut self, image: &Image, landmarks: &Landmarks) {
        let region = FaceRegion::around_landmarks(landmarks);
        self.region = region.is_usable(image.width(), image.height()).then_some(region);
    }

    /// Faces from the quickest detector that finds any, best score first.
    fn search(&mut self, image: &Image) -> Result<Vec<Detection>, TrackingError> {
        let mut found = self.short_range.detect(image)?;
        if found.is_empty() {
            found = self.full_range.detect(image)?;
        }
        if found.is_empty() && self.frames_without_face.is_multiple_of(self.options.thorough_interval.max(1))
        {
            found = self.full_range.detect_tiled(image)?;
        }
        self.faces_seen = self.faces_seen.max(found.len());
        Ok(found)
    }
}

/// Side of the face in the picture, pixels.
fn extent(landmarks: &Landmarks) -> f64 {
    FaceRegion::around_landmarks(landmarks).side
}
