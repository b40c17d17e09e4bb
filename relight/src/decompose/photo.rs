//! Photographs with their masks, as files and shards hold them.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::decomposer::{DecomposeOptions, SATURATED_VALUE};
use super::error::DecomposeError;
use super::mask::{MaskSource, Rectangle, find_mask, is_empty, read_mask};
use crate::data::{Encoding, SampleId, Source, Turns};
use crate::image::{
    ColourSpace, Extent, Gamma22, ImageError, Linear, Planes, Rgb, Samples, Srgb, StoredImage,
    Transfer,
};

/// How the files of photographs end.
const PHOTOS: [&str; 5] = ["png", "jpg", "jpeg", "exr", "hdr"];
/// How far a gamma may be from one that is known.
const SAME_GAMMA: f32 = 0.02;

/// A picture with its mask.
#[derive(Debug, Clone)]
pub struct Photo {
    /// Its name: the file's without ending, or a frame's key `<session>/<index>`.
    pub name: String,
    /// The light.
    pub picture: Rgb<Linear>,
    /// 1 on the object, else 0.
    pub mask: Planes<1>,
    /// What said so.
    pub mask_source: MaskSource,
    /// The alpha that its file has, 0 to 1, as it stands there.
    pub alpha: Option<Planes<1>>,
    saturated_from: f32,
    saturated_fraction: Option<f64>,
}

/// How photographs are read.
#[derive(Debug, Clone, Default)]
pub struct PhotoReading {
    /// A file with the mask, or a folder with one of the photograph's name, `<name>.png`.
    pub mask: Option<PathBuf>,
    /// A rectangle around the object.
    pub rectangle: Option<Rectangle>,
    /// How integers are encoded, where the file is not to be asked.
    pub transfer: Option<Transfer>,
}

/// Where a photograph is.
#[derive(Clone)]
pub enum PhotoInput {
    /// In a file.
    File(PathBuf),
    /// In a shard.
    Frame(Arc<Turns>, SampleId),
}

impl PhotoInput {
    /// The photographs of files, of folders of photographs or shards, and of shards (`*.tar`), of each
    /// turn the first `most`.
    ///
    /// # Errors
    /// Where a folder cannot be read or holds none, a shard cannot be opened, or two photographs would
    /// be written to one folder.
    pub fn find(paths: &[PathBuf], most: Option<u32>) -> Result<Vec<Self>, DecomposeError> {
        let mut found = Vec::new();
        for path in paths {
            if path.is_dir() {
                add_folder(&mut found, path, most)?;
            } else if has_ending(path, &["tar"]) {
                add_turns(&mut found, path, most)?;
            } else {
                found.push(Self::File(path.clone()));
            }
        }
        check_names(&found)?;
        Ok(found)
    }

    /// How an error names it.
    #[must_use]
    pub fn place(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Frame(turns, id) => {
                let turn = turns.names().nth(id.turn as usize).unwrap_or_default();
                format!("{turn}, sample {}", id.position)
            }
        }
    }

    /// Reads the photograph, and its mask: that of `reading`, or its alpha, or what is not black before a
    /// black background, or the rectangle. A frame of a shard has its own.
    ///
    /// # Errors
    /// Where a file cannot be read or does not fit, or nothing says where the object is.
    pub fn load(&self, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
        match self {
            Self::File(path) => read_photo(path, reading),
            Self::Frame(turns, id) => read_frame(turns, *id),
        }
    }
}

impl Photo {
    /// These options with what is known of the photograph's saturation.
    #[must_use]
    pub fn options(&self, options: &DecomposeOptions) -> DecomposeOptions {
        DecomposeOptions {
            saturated_from: self.saturated_from,
            saturated_fraction: self.saturated_fraction,
            ..*options
        }
    }
}

fn add_folder(
    found: &mut Vec<PhotoInput>,
    folder: &Path,
    most: Option<u32>,
) -> Result<(), DecomposeError> {
    let mut photos = Vec::new();
    let mut has_shards = folder.join(relit_data::shard::Dataset::FILE).is_file();
    for entry in fs::read_dir(folder).map_err(DecomposeError::read(folder))? {
        let path = entry.map_err(DecomposeError::read(folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with('.') || !path.is_file() {
            continue;
        }
        has_shards |= has_ending(&path, &["tar"]);
        if has_ending(&path, &PHOTOS) {
            photos.push(path);
        }
    }
    if has_shards {
        return add_turns(found, folder, most);
    }
    if photos.is_empty() {
        return Err(DecomposeError::NoPhotos {
            path: folder.to_owned(),
        });
    }
    photos.sort();
    found.extend(photos.into_iter().map(PhotoInput::File));
    Ok(())
}

fn add_turns(
    found: &mut Vec<PhotoInput>,
    path: &Path,
    most: Option<u32>,
) -> Result<(), DecomposeError> {
    let turns = Arc::new(Turns::open(path, Encoding::Linear)?);
    for (turn, samples) in (0..).zip(turns.turns()) {
        for position in 0..samples.min(most.unwrap_or(u32::MAX)) {
            found.push(PhotoInput::Frame(
                Arc::clone(&turns),
                SampleId { turn, position },
            ));
        }
    }
    Ok(())
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|found| {
        endings
            .iter()
            .any(|known| found.eq_ignore_ascii_case(known))
    })
}

/// Whether every file has a name of its own.
fn check_names(inputs: &[PhotoInput]) -> Result<(), DecomposeError> {
    let mut names = BTreeMap::new();
    for input in inputs {
        let PhotoInput::File(path) = input else {
            continue;
        };
        let name = name_of(path);
        if let Some(first) = names.insert(name.clone(), path) {
            return Err(DecomposeError::SameName {
                first: first.clone(),
                second: path.clone(),
                name,
            });
        }
    }
    Ok(())
}

fn name_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

fn read_photo(path: &Path, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
    let image = StoredImage::read(path)?;
    let transfer = match (image.samples, reading.transfer) {
        (Samples::Float, _) => None,
        (Samples::Integer, Some(transfer)) => Some(transfer),
        (Samples::Integer, None) => Some(stated_transfer(path)?),
    };
    let name = name_of(path);
    let extent = image.planes.extent();
    let (mask, mask_source) = match &reading.mask {
        Some(file) => (
            read_mask(&mask_file(file, &name)?, extent)?,
            MaskSource::File,
        ),
        None => {
            let encoded = shown(&image.planes, transfer);
            let found = find_mask(&encoded, image.alpha.as_ref(), reading.rectangle);
            found.ok_or_else(|| DecomposeError::NoMask {
                path: path.to_owned(),
            })?
        }
    };
    check_mask(&mask, reading.rectangle)?;
    Ok(Photo {
        name,
        picture: Rgb::new(image.planes.map(to_linear(transfer))),
        mask,
        mask_source,
        alpha: image.alpha,
        saturated_from: match transfer {
            // There is no largest value in floating point: what a screen shows as white counts.
            None => Srgb::to_linear(SATURATED_VALUE),
            Some(_) => to_linear(transfer)(SATURATED_VALUE),
        },
        saturated_fraction: None,
    })
}

fn mask_file(given: &Path, name: &str) -> Result<PathBuf, DecomposeError> {
    if !given.is_dir() {
        return Ok(given.to_owned());
    }
    let path = given.join(format!("{name}.png"));
    if path.is_file() {
        Ok(path)
    } else {
        Err(DecomposeError::MaskMissing { path })
    }
}

fn check_mask(mask: &Planes<1>, rectangle: Option<Rectangle>) -> Result<(), DecomposeError> {
    match rectangle {
        _ if !is_empty(mask) => Ok(()),
        None => Err(DecomposeError::EmptyMask),
        Some(Rectangle {
            x,
            y,
            width,
            height,
        }) => Err(DecomposeError::Rectangle {
            x,
            y,
            width,
            height,
            photo: mask.extent(),
        }),
    }
}

/// What turns a file's values into light.
fn to_linear(transfer: Option<Transfer>) -> fn(f32) -> f32 {
    match transfer {
        None | Some(Transfer::Linear) => Linear::to_linear,
        Some(Transfer::Srgb) => Srgb::to_linear,
        Some(Transfer::Gamma22) => Gamma22::to_linear,
    }
}

/// The picture as a screen shows it, in which what looks black is dark.
fn shown(planes: &Planes<3>, transfer: Option<Transfer>) -> Planes<3> {
    match transfer {
        None | Some(Transfer::Linear) => planes.clone().map(Srgb::from_linear),
        Some(_) => planes.clone(),
    }
}

/// How a file of integers says that they are encoded; sRGB where it says nothing.
///
/// A PNG says it by the chunks cICP, sRGB or gAMA. 1 / 2.2 in gAMA is what programs write for sRGB.
fn stated_transfer(path: &Path) -> Result<Transfer, DecomposeError> {
    let file = File::open(path).map_err(|source| ImageError::Open {
        path: path.to_owned(),
        source,
    })?;
    // What is no PNG says nothing.
    let Ok(reader) = png::Decoder::new(BufReader::new(file)).read_info() else {
        return Ok(Transfer::Srgb);
    };
    let info = reader.info();
    if let Some(points) = info.coding_independent_code_points {
        // ITU-T H.273: 8 is linear, 4 is the power 2.2.
        return Ok(match points.transfer_function {
            8 => Transfer::Linear,
            4 => Transfer::Gamma22,
            _ => Transfer::Srgb,
        });
    }
    let gamma = match info.gama_chunk {
        Some(gamma) if info.srgb.is_none() => gamma.into_value(),
        _ => return Ok(Transfer::Srgb),
    };
    let near = |known: f32| (gamma / known - 1.0).abs() < SAME_GAMMA;
    if near(1.0) {
        Ok(Transfer::Linear)
    } else if near(1.0 / 2.2) {
        Ok(Transfer::Srgb)
    } else {
        Err(DecomposeError::UnknownGamma {
            path: path.to_owned(),
            gamma: 1.0 / gamma,
        })
    }
}

/// A frame's key as a path that leads nowhere else.
fn within(key: &str) -> String {
    let parts = Path::new(key).components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy()),
        _ => None,
    });
    parts.collect::<Vec<_>>().join("/")
}

fn read_frame(turns: &Turns, id: SampleId) -> Result<Photo, DecomposeError> {
    let (batch, mut damage) = turns.batch(&[id], None);
    if let Some(damage) = damage.pop() {
        return Err(damage.into());
    }
    let Extent { width, height } = batch.extent;
    let pixels = width * height;
    let [red, green, blue] = [0, 1, 2].map(|c| batch.images[c * pixels..][..pixels].to_vec());
    let frame = batch.frames.first();
    let record = frame.and_then(|frame| frame.record.as_ref());
    let photo = Photo {
        name: frame.map(|frame| within(&frame.key)).unwrap_or_default(),
        picture: Rgb::new(Planes::from_planes(batch.extent, [red, green, blue])?),
        mask: Planes::from_planes(batch.extent, [batch.masks])?,
        mask_source: MaskSource::Shard,
        alpha: None,
        saturated_from: Srgb::to_linear(SATURATED_VALUE),
        saturated_fraction: record.map(|record| record.saturated_fraction),
    };
    check_mask(&photo.mask, None)?;
    Ok(photo)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_of_a_frame_leads_nowhere_but_into_the_folder_for_results() {
        assert_eq!(
            within("20261120T093015Z-mug/0007"),
            "20261120T093015Z-mug/0007"
        );
        assert_eq!(within("../../etc/./passwd"), "etc/passwd");
        assert_eq!(within("/tmp/x"), "tmp/x");
    }
}
