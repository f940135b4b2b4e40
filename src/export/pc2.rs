//! PC2 point caches: every vertex of every sample, as Blender's Mesh Cache modifier reads them.
//!
//! Layout, little-endian: `POINTCACHE2\0`, i32 version 1, i32 points, f32 start, f32 sampling, i32 samples, then
//! samples × points × 3 f32. Start and sampling are frames and frames per sample in Blender's exporter; we write 0
//! and 1, one sample a frame. Its modifier ignores both in its usual *Frame* time mode, where sample k shows at frame
//! k after the modifier's own start; its *Seconds* mode takes the same numbers as seconds and plays such a file wrongly.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::{Draft, ExportError};

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const HEADER_BYTES: u64 = 32;
const SAMPLES_OFFSET: u64 = 28;
const BYTES_PER_POINT: u64 = 12;

/// Writes a PC2 sample by sample; nothing but one sample is held in memory.
#[derive(Debug)]
pub struct Pc2Writer {
    draft: Draft,
    points: i32,
    samples: i32,
    bytes: Vec<u8>,
}

impl Pc2Writer {
    /// Starts a cache of `points` vertices at `path`.
    ///
    /// Refuses 0 points and more than 2³¹ − 1, which the header cannot say.
    pub fn create(path: &Path, points: usize) -> Result<Self, ExportError> {
        let count = i32::try_from(points).ok().filter(|count| *count > 0).ok_or_else(|| {
            ExportError::refused(
                path,
                format!("PC2 holds 1 to {} points, not {points}", i32::MAX),
                "Choose another format for this mesh",
            )
        })?;
        let mut draft = Draft::create(path)?;
        let mut header = Vec::with_capacity(HEADER_BYTES as usize);
        header.extend_from_slice(MAGIC);
        header.extend_from_slice(&1_i32.to_le_bytes());
        header.extend_from_slice(&count.to_le_bytes());
        header.extend_from_slice(&0.0_f32.to_le_bytes());
        header.extend_from_slice(&1.0_f32.to_le_bytes());
        header.extend_from_slice(&0_i32.to_le_bytes());
        draft.append(&header)?;
        Ok(Self { draft, points: count, samples: 0, bytes: Vec::new() })
    }

    /// Appends one sample: `points` × 3, in the frame and unit that the caller chose.
    ///
    /// Refuses another number of points, and positions that are not finite.
    pub fn write_sample(&mut self, positions: &[[f32; 3]]) -> Result<(), ExportError> {
        let refuse = |reason, remedy| Err(ExportError::refused(self.draft.destination(), reason, remedy));
        if positions.len() != self.points as usize {
            return refuse(
                format!("sample {} has {} points, not {}", self.samples, positions.len(), self.points),
                "Give every sample the points of the first",
            );
        }
        if let Some(bad) = positions.iter().position(|point| !point.iter().all(|value| value.is_finite())) {
            return refuse(
                format!("point {bad} of sample {} is not finite", self.samples),
                "Leave out frames that could not be solved, or hold the last good one",
            );
        }
        let Some(samples) = self.samples.checked_add(1) else {
            return refuse(
                format!("PC2 holds at most {} samples", i32::MAX),
                "Split the clip into several files",
            );
        };
        self.bytes.clear();
        self.bytes.extend(positions.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        self.draft.append(&self.bytes)?;
        self.samples = samples;
        Ok(())
    }

    /// Writes the number of samples into the header and puts the file in place.
    pub fn commit(mut self) -> Result<(), ExportError> {
        self.draft.overwrite(SAMPLES_OFFSET, &self.samples.to_le_bytes())?;
        self.draft.commit()
    }
}

/// Reads a PC2, any sample in any order.
#[derive(Debug)]
pub struct Pc2Reader {
    path: PathBuf,
    file: BufReader<File>,
    points: usize,
    samples: usize,
    start: f32,
    sampling: f32,
    bytes: Vec<u8>,
}

impl Pc2Reader {
    /// Opens `path` and checks its header against the file's length.
    pub fn open(path: &Path) -> Result<Self, ExportError> {
        let fail = |source| ExportError::read(path, source);
        let malformed = |reason: String| ExportError::Malformed {
            path: path.into(),
            format: "PC2",
            reason,
            remedy: "Export the point cache again",
        };
        let mut file = BufReader::new(File::open(path).map_err(fail)?);
        let length = file.get_ref().metadata().map_err(fail)?.len();
        if length < HEADER_BYTES {
            return Err(malformed(format!(
                "it has {length} bytes, and the header alone takes {HEADER_BYTES}"
            )));
        }
        let mut header = [0; HEADER_BYTES as usize];
        file.read_exact(&mut header).map_err(fail)?;
        let word = |at: usize| [header[at], header[at + 1], header[at + 2], header[at + 3]];
        if &header[..12] != MAGIC {
            return Err(malformed("it does not begin with POINTCACHE2".into()));
        }
        let version = i32::from_le_bytes(word(12));
        if version != 1 {
            return Err(malformed(format!("it is of version {version}, and only 1 is known")));
        }
        let (points, samples) = (i32::from_le_bytes(word(16)), i32::from_le_bytes(word(28)));
        let (Ok(points), Ok(samples)) = (u32::try_from(points), u32::try_from(samples)) else {
            return Err(malformed(format!("it claims {points} points and {samples} samples")));
        };
        // Below 2⁶⁶, hence the wider type.
        let wanted =
            u128::from(HEADER_BYTES) + u128::from(points) * u128::from(samples) * u128::from(BYTES_PER_POINT);
        if wanted != u128::from(length) {
            return Err(malformed(format!(
                "{samples} samples of {points} points take {wanted} bytes, and it has {length}"
            )));
        }
        Ok(Self {
            path: path.into(),
            file,
            points: points as usize,
            samples: samples as usize,
            start: f32::from_le_bytes(word(20)),
            sampling: f32::from_le_bytes(word(24)),
            bytes: Vec::new(),
        })
    }

    /// Vertices in every sample.
    pub fn points(&self) -> usize {
        self.points
    }

    /// How many samples there are.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The header's start, in frames (see the module).
    pub fn start(&self) -> f32 {
        self.start
    }

    /// The header's sampling, in frames per sample (see the module).
    pub fn sampling(&self) -> f32 {
        self.sampling
    }

    /// Fills `positions` with sample `index`, `points` × 3; its capacity is reused.
    pub fn read_sample(&mut self, index: usize, positions: &mut Vec<[f32; 3]>) -> Result<(), ExportError> {
        if index >= self.samples {
            return Err(ExportError::Malformed {
                path: self.path.clone(),
                format: "PC2",
                reason: format!("sample {index} was asked for, and it has {}", self.samples),
                remedy: "Ask for an earlier sample",
            });
        }
        let size = self.points as u64 * BYTES_PER_POINT;
        self.bytes.resize(size as usize, 0);
        self.file
            .seek(SeekFrom::Start(HEADER_BYTES + index as u64 * size))
            .and_then(|_| self.file.read_exact(&mut self.bytes))
            .map_err(|source| ExportError::read(&self.path, source))?;
        let (words, _) = self.bytes.as_chunks::<4>();
        let (triples, _) = words.as_chunks::<3>();
        positions.clear();
        positions.extend(triples.iter().map(|triple| triple.map(f32::from_le_bytes)));
        Ok(())
    }
}
