//! Views on disk: each is cast once. A file's name is a hash of all that the view follows from; a file that cannot be
//! read is cast again.

use std::fs;
use std::path::{Path, PathBuf};

use glam::Vec3;
use half::f16;
use relit_data::shard::Digest;
use serde::{Deserialize, Serialize};

use super::cast::{RadianceTransfer, TransferFinish};
use super::environment_lights::EnvironmentLights;
use super::turn_sample::TurnSample;
use super::views::TransferRecipe;
use crate::SynthError;
use crate::library::Library;

/// The format, and what is computed: another number casts all views again.
const FORMAT: &str = "relight.transfer/2";

/// Views in a folder.
#[derive(Debug, Clone)]
pub struct TransferCache {
    folder: PathBuf,
    recipe: TransferRecipe,
    library: Digest,
}

/// The first line of a file.
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    size: u32,
    elevation: f32,
    pixels: usize,
    finishes: usize,
}

impl TransferCache {
    /// Views in a folder, created if missing.
    ///
    /// # Errors
    /// [`SynthError`] if the folder cannot be made.
    pub fn open(
        folder: &Path,
        recipe: TransferRecipe,
        library: &Library,
    ) -> Result<Self, SynthError> {
        fs::create_dir_all(folder).map_err(SynthError::write(folder))?;
        Ok(Self {
            folder: folder.to_owned(),
            recipe,
            library: library.digest(),
        })
    }

    /// The turn of a seed: a view in a random material and environment light.
    ///
    /// # Errors
    /// [`SynthError`] if the view cannot be written.
    pub fn turn(
        &self,
        library: &Library,
        number: u64,
        rooms: &EnvironmentLights,
        seed: u64,
    ) -> Result<TurnSample, SynthError> {
        Ok(TurnSample::draw(&self.view(library, number)?, rooms, seed))
    }

    /// The view of a number: read where it is there, else cast and kept. The numbers of a view that was read and of one
    /// that was cast are the same.
    pub(super) fn view(
        &self,
        library: &Library,
        number: u64,
    ) -> Result<RadianceTransfer, SynthError> {
        let path = self.path_of(number);
        if let Some(found) = fs::read(&path).ok().and_then(|bytes| decode(&bytes)) {
            return Ok(found);
        }
        let bytes = encode(&self.recipe.cast(library, number));
        relit_data::durable::write_whole(&path, &bytes).map_err(SynthError::write(&path))?;
        // What was written and not what was cast, so that the first use has the rounding of all others.
        Ok(decode(&bytes).unwrap_or_else(|| self.recipe.cast(library, number)))
    }

    fn path_of(&self, number: u64) -> PathBuf {
        // Numbers and texts: this cannot fail.
        let recipe = serde_json::to_string(&self.recipe).unwrap_or_default();
        let all = format!("{FORMAT} {recipe} {} {number}", self.library);
        let hash = Digest::hash(all.as_bytes()).to_string();
        self.folder.join(format!("{hash}.transfer"))
    }
}

/// A line with the header, the pixels, one half after the other, and the digest of all that.
fn encode(transfer: &RadianceTransfer) -> Vec<u8> {
    let header = Header {
        format: FORMAT.to_owned(),
        size: transfer.size,
        elevation: transfer.elevation,
        pixels: transfer.pixels.len(),
        finishes: transfer.finishes.len(),
    };
    let mut bytes = serde_json::to_vec(&header).unwrap_or_default();
    bytes.push(b'\n');
    bytes.extend(transfer.pixels.iter().flat_map(|pixel| pixel.to_le_bytes()));
    let mirrors = transfer.mirrors.iter().map(|&mirrors| f32::from(mirrors));
    let mut values: Vec<f32> = mirrors.collect();
    values.extend(transfer.blocked.as_flattened());
    values.extend(transfer.bounced.as_flattened());
    let finishes = transfer.finishes.iter();
    let finishes = finishes.flat_map(|finish| [&finish.normals, &finish.albedo]);
    for vectors in std::iter::once(&transfer.towards_eye).chain(finishes) {
        values.extend(vectors.iter().flat_map(Vec3::to_array));
    }
    bytes.extend(
        values
            .into_iter()
            .flat_map(|value| f16::from_f32(value).to_le_bytes()),
    );
    let digest = Digest::hash(&bytes).to_string();
    bytes.extend(digest.as_bytes());
    bytes
}

/// `None` if the bytes are not those of a whole file.
fn decode(bytes: &[u8]) -> Option<RadianceTransfer> {
    let digest_length = Digest::hash(&[]).to_string().len();
    let (bytes, digest) = bytes.split_at_checked(bytes.len().checked_sub(digest_length)?)?;
    if Digest::hash(bytes).to_string().as_bytes() != digest {
        return None;
    }
    let end = bytes.iter().position(|&byte| byte == b'\n')?;
    let header: Header = serde_json::from_slice(&bytes[..end]).ok()?;
    if header.format != FORMAT {
        return None;
    }
    let count = header.pixels;
    let (pixels, halves) = bytes[end + 1..].split_at_checked(4 * count)?;
    let halves = halves.as_chunks().0.iter();
    let mut values = halves.map(|&half| f16::from_le_bytes(half).to_f32());
    let mirrors = values.by_ref().take(count).map(|value| value == 1.0);
    Some(RadianceTransfer {
        size: header.size,
        elevation: header.elevation,
        pixels: pixels
            .as_chunks()
            .0
            .iter()
            .map(|&pixel| u32::from_le_bytes(pixel))
            .collect(),
        mirrors: mirrors.collect(),
        blocked: take(&mut values, count),
        bounced: take(&mut values, count),
        towards_eye: take(&mut values, count),
        finishes: (0..header.finishes)
            .map(|_| TransferFinish {
                normals: take(&mut values, count),
                albedo: take(&mut values, count),
            })
            .collect(),
    })
}

/// The next rows of values.
fn take<const N: usize, T: From<[f32; N]>>(
    values: &mut impl Iterator<Item = f32>,
    count: usize,
) -> Vec<T> {
    let row = |_| std::array::from_fn(|_| values.next().unwrap_or_default()).into();
    (0..count).map(row).collect()
}
