//! What has been learnt of a performer's skin, and its file.
//!
//! A file is `UNDRSKIN`, the version, the SHA-256 of what follows, and that: the skin as `postcard` writes it.

use std::{fs::File, io::Read as _, path::Path};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{AppearanceError, AppearanceStates, Classifier, Region, Samples, TextureVolume};

const MAGIC: [u8; 8] = *b"UNDRSKIN";
/// Rises with every change of what is stored or of how samples are taken.
const VERSION: u32 = 1;
const CHECKSUM: usize = 32;
/// Eleven regions of six layers are some 12 MB.
const MOST_BYTES: u64 = 64 << 20;
const MOST_TAKES: usize = 1000;
const MOST_NAME: usize = 1000;
const REMEDY: &str = "Learn it again with `understudy learn-appearance`";

/// Frames of which one layer was made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Exemplar {
    /// The place of the take in [`Skin::takes`].
    pub take: u16,
    /// Frames of the take that were averaged; none for a layer that was blended from its neighbours.
    pub frames: Vec<u64>,
}

/// One region of a performer's skin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegionSkin {
    /// Tells its state.
    pub classifier: Classifier,
    /// Its look in every state: a layer for each template.
    pub volume: TextureVolume,
    /// What each layer was made of.
    pub exemplars: Vec<Exemplar>,
}

/// A performer's skin: templates and texture volumes of the regions that were learnt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    performer: String,
    takes: Vec<String>,
    regions: Vec<RegionSkin>,
}

impl Skin {
    /// Of regions in the order of [`Region::ALL`], each at most once and at least one.
    pub fn new(performer: String, takes: Vec<String>, regions: Vec<RegionSkin>) -> Result<Self, String> {
        let skin = Self { performer, takes, regions };
        skin.check()?;
        Ok(skin)
    }

    fn check(&self) -> Result<(), String> {
        if self.regions.is_empty() {
            return Err("it holds no region".into());
        }
        if self.takes.is_empty() || self.takes.len() > MOST_TAKES {
            return Err(format!("it was learnt from {} takes", self.takes.len()));
        }
        if self.takes.iter().chain([&self.performer]).any(|name| name.len() > MOST_NAME) {
            return Err("a name in it is too long".into());
        }
        if !self.regions.windows(2).all(|pair| pair[0].volume.region() < pair[1].volume.region()) {
            return Err("its regions are not in their order".into());
        }
        for region in &self.regions {
            let name = region.volume.region().name();
            let layers = region.volume.layers().len();
            if !region.classifier.is_sound() || !region.volume.is_whole() {
                return Err(format!("what it holds of the region {name} is damaged"));
            }
            if region.classifier.templates().len() != layers || region.exemplars.len() != layers {
                return Err(format!("templates and layers of the region {name} are not the same number"));
            }
            if region.exemplars.iter().any(|exemplar| usize::from(exemplar.take) >= self.takes.len()) {
                return Err(format!("a layer of the region {name} comes from a take that is not named"));
            }
        }
        Ok(())
    }

    /// The performer's name.
    pub fn performer(&self) -> &str {
        &self.performer
    }

    /// Names of the clips it was learnt from.
    pub fn takes(&self) -> &[String] {
        &self.takes
    }

    /// The regions that were learnt, in the order of [`Region::ALL`].
    pub fn regions(&self) -> &[RegionSkin] {
        &self.regions
    }

    /// What was learnt of a region.
    pub fn region(&self, region: Region) -> Option<&RegionSkin> {
        self.regions.iter().find(|learnt| learnt.volume.region() == region)
    }

    /// The state of every region in a frame (002 §V.ii). A look that is farther from all templates than the performer's own ever
    /// was is something else, such as a hand: its region is absent.
    pub fn classify(&self, samples: &Samples) -> AppearanceStates {
        let mut states = AppearanceStates::default();
        for learnt in &self.regions {
            let region = learnt.volume.region();
            let Ok(sample) = &samples[region.index()] else { continue };
            let found = learnt.classifier.classify(&sample.versions());
            states.set(region, (found.score <= learnt.classifier.reach()).then_some(found.state));
        }
        states
    }

    /// The bytes of its file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let payload = postcard::to_stdvec(self).map_err(|error| error.to_string())?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend_from_slice(Sha256::digest(&payload).as_slice());
        bytes.extend(payload);
        Ok(bytes)
    }

    /// Reads what [`Skin::to_bytes`] gives. Everything in it is checked.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let no_skin = || "it is no skin of a performer".to_owned();
        let rest = bytes.strip_prefix(&MAGIC).ok_or_else(no_skin)?;
        let (version, rest) = rest.split_first_chunk::<4>().ok_or_else(no_skin)?;
        let version = u32::from_le_bytes(*version);
        if version != VERSION {
            return Err(format!("it has version {version}, and this program reads {VERSION}"));
        }
        let (checksum, payload) =
            rest.split_at_checked(CHECKSUM).ok_or("it ends before its checksum does")?;
        if Sha256::digest(payload).as_slice() != checksum {
            return Err("it is damaged: its checksum is another".into());
        }
        let (skin, left) = postcard::take_from_bytes::<Self>(payload).map_err(|error| error.to_string())?;
        if !left.is_empty() {
            return Err(format!("{} bytes follow its end", left.len()));
        }
        skin.check()?;
        Ok(skin)
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, AppearanceError> {
        let fault = |reason: String, remedy| AppearanceError::File { path: path.into(), reason, remedy };
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes))
            .map_err(|error| fault(error.to_string(), "Name a file that can be read"))?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(fault(format!("it is larger than {} MiB", MOST_BYTES >> 20), REMEDY));
        }
        Self::from_bytes(&bytes).map_err(|reason| fault(reason, REMEDY))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{
        super::{Absence, FINE_SIDE, Layer, Patch, Sample},
        *,
    };

    fn sample(strength: f32) -> Sample {
        let value =
            |at: usize| 120.0 + (at % FINE_SIDE) as f32 + strength * (((at / FINE_SIDE) % 8) as f32 - 3.5);
        Sample::new((0..FINE_SIDE * FINE_SIDE).map(|at| value(at) as u8).collect()).unwrap()
    }

    fn coefficients(strength: f32) -> super::super::haar::Grid {
        let mut grid = sample(strength).own();
        super::super::haar::decompose(&mut grid);
        grid
    }

    fn region(region: Region) -> RegionSkin {
        let patch = Patch { origin: [10, 20], size: [2, 2] };
        let layers = (0..3).map(|at| Layer::new(&[0.1 * at as f32; 4], vec![[at; 3]; 4])).collect();
        RegionSkin {
            classifier: Classifier::new(&[0.0, 4.0, 12.0].map(coefficients), 60.0).unwrap(),
            volume: TextureVolume::new(region, patch, layers).unwrap(),
            exemplars: (0..3).map(|at| Exemplar { take: 0, frames: vec![at, at + 1] }).collect(),
        }
    }

    fn skin() -> Skin {
        let regions = vec![region(Region::Forehead), region(Region::Chin)];
        Skin::new("Somebody".into(), vec!["take.mp4".into()], regions).unwrap()
    }

    #[test]
    fn what_is_written_comes_back_and_other_things_are_refused() {
        let bytes = skin().to_bytes().unwrap();
        assert_eq!(Skin::from_bytes(&bytes), Ok(skin()));
        let refused = |bytes: &[u8]| Skin::from_bytes(bytes).unwrap_err();
        assert!(refused(b"").contains("no skin") && refused(&bytes[..10]).contains("no skin"));
        assert!(refused(&bytes[..30]).contains("checksum"));
        let mut other = bytes.clone();
        other[8] = 9;
        assert!(refused(&other).contains("version 9"));
        other.clone_from(&bytes);
        *other.last_mut().unwrap() ^= 1;
        assert!(refused(&other).contains("damaged"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.skin");
        std::fs::write(&path, &other).unwrap();
        let said = Skin::read(&path).unwrap_err().to_string();
        assert!(said.contains("x.skin") && said.contains("learn-appearance"), "{said}");
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let said = |change: &dyn Fn(&mut Skin)| {
            let mut skin = skin();
            change(&mut skin);
            Skin::from_bytes(&skin.to_bytes().unwrap()).unwrap_err()
        };
        assert!(said(&|skin| skin.regions.clear()).contains("no region"));
        assert!(said(&|skin| skin.takes.clear()).contains("0 takes"));
        assert!(said(&|skin| skin.regions.reverse()).contains("order"));
        assert!(said(&|skin| skin.regions[0].exemplars[2].take = 1).contains("forehead"));
        assert!(said(&|skin| drop(skin.regions[1].exemplars.pop())).contains("chin"));
    }

    #[test]
    fn states_are_told_and_strange_looks_are_absent() {
        let mut samples: Samples = Region::ALL.map(|_| Err(Absence::NoFace));
        samples[Region::Forehead.index()] = Ok(sample(12.0));
        samples[Region::Chin.index()] = Ok(Sample::new(
            (0..FINE_SIDE * FINE_SIDE).map(|at| if at % FINE_SIDE < 20 { 200 } else { 30 }).collect(),
        )
        .unwrap());
        let states = skin().classify(&samples);
        assert!(states.get(Region::Forehead).unwrap() > 0.95);
        assert_eq!(states.get(Region::Chin), None);
        assert_eq!(states.get(Region::Glabella), None);
    }

    proptest! {
        #[test]
        fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            prop_assert!(Skin::from_bytes(&bytes).is_err());
            // Past magic and checksum.
            let mut file = MAGIC.to_vec();
            file.extend(VERSION.to_le_bytes());
            file.extend_from_slice(Sha256::digest(&bytes).as_slice());
            file.extend(&bytes);
            let _ = Skin::from_bytes(&file);
        }

        #[test]
        fn damage_under_a_right_checksum_never_panics(at in 0..4000_usize, value in any::<u8>()) {
            let mut payload = postcard::to_stdvec(&skin()).unwrap();
            let at = at % payload.len();
            payload[at] = value;
            let mut file = MAGIC.to_vec();
            file.extend(VERSION.to_le_bytes());
            file.extend_from_slice(Sha256::digest(&payload).as_slice());
            file.extend(payload);
            if let Ok(read) = Skin::from_bytes(&file) {
                prop_assert!(read.check().is_ok());
            }
        }
    }
}
