//! Views on disk: each is cast once. A file's name is a hash of all that the view follows from; a file that cannot be
//! read is cast again.

use std::fs;
use std::path::{Path, PathBuf};

use glam::Vec3;
use half::f16;
use half::slice::HalfFloatSliceExt;
use relit_data::shard::Digest;
use serde::{Deserialize, Serialize};

use super::cast::{RadianceTransfer, TransferFinish};
use super::environment_lights::EnvironmentLights;
use super::turn_sample::TurnSample;
use super::views::TransferRecipe;
use super::{BOUNCE_COEFFICIENTS, COEFFICIENTS};
use crate::SynthError;
use crate::library::Library;

/// The format, and what is computed: another number casts all views again.
const FORMAT: &str = "relight.transfer/1";

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
    for pixel in &transfer.pixels {
        bytes.extend(pixel.to_le_bytes());
    }
    bytes.extend(transfer.mirrors.iter().map(|&mirrors| u8::from(mirrors)));
    push_halves(&mut bytes, transfer.blocked.as_flattened());
    push_halves(&mut bytes, transfer.bounced.as_flattened());
    push_vectors(&mut bytes, &transfer.towards_eye);
    for finish in &transfer.finishes {
        push_vectors(&mut bytes, &finish.normals);
        push_vectors(&mut bytes, &finish.albedo);
    }
    let digest = Digest::hash(&bytes).to_string();
    bytes.extend(digest.as_bytes());
    bytes
}

fn push_halves(bytes: &mut Vec<u8>, values: &[f32]) {
    bytes.extend(
        values
            .iter()
            .flat_map(|&value| f16::from_f32(value).to_le_bytes()),
    );
}

fn push_vectors(bytes: &mut Vec<u8>, vectors: &[Vec3]) {
    for vector in vectors {
        push_halves(bytes, &vector.to_array());
    }
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
    let mut rest = Rest(&bytes[end + 1..]);
    let count = header.pixels;
    let pixels = rest
        .take(4 * count)?
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&bytes| u32::from_le_bytes(bytes))
        .collect();
    let mirrors = rest.take(count)?.iter().map(|&byte| byte == 1).collect();
    let blocked = rest.halves(count * COEFFICIENTS)?;
    let bounced = rest.halves(count * BOUNCE_COEFFICIENTS)?;
    let towards_eye = rest.vectors(count)?;
    let finishes = (0..header.finishes)
        .map(|_| {
            Some(TransferFinish {
                normals: rest.vectors(count)?,
                albedo: rest.vectors(count)?,
            })
        })
        .collect::<Option<Vec<_>>>()?;
    (header.format == FORMAT && rest.0.is_empty()).then(|| RadianceTransfer {
        size: header.size,
        elevation: header.elevation,
        pixels,
        towards_eye,
        mirrors,
        blocked: blocked.as_chunks().0.to_vec(),
        bounced: bounced.as_chunks().0.to_vec(),
        finishes,
    })
}

/// Bytes that are not decoded yet.
struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn halves(&mut self, count: usize) -> Option<Vec<f32>> {
        let bytes = self.take(count.checked_mul(2)?)?;
        let halves: Vec<f16> = bytes
            .as_chunks::<2>()
            .0
            .iter()
            .map(|&bytes| f16::from_le_bytes(bytes))
            .collect();
        Some(halves.to_f32_vec())
    }

    fn vectors(&mut self, count: usize) -> Option<Vec<Vec3>> {
        let values = self.halves(count.checked_mul(3)?)?;
        Some(
            values
                .as_chunks::<3>()
                .0
                .iter()
                .map(|&v| Vec3::from_array(v))
                .collect(),
        )
    }
}
