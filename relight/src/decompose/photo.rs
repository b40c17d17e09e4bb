//! Photographs with their masks, as files and shards hold them.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use relit_data::shard::Dataset;

use super::decomposer::{DecomposeOptions, SATURATED_VALUE, check_size};
use super::error::DecomposeError;
use super::mask::{MaskSource, NoObject, Rectangle, find_mask, is_empty, read_mask};
use crate::data::{Encoding, SampleId, Source, Turns};
use crate::image::{
    ColourSpace, Extent, Gamma22, ImageError, Linear, Planes, Rgb, Samples, Srgb, StoredImage,
    Transfer,
};

/// How the files of photographs end.
const PHOTOS: [&str; 5] = ["png", "jpg", "jpeg", "exr", "hdr"];
/// The transfer function of ITU-T H.273 that says nothing.
const UNSPECIFIED: u8 = 2;
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
                found.push((path.clone(), Self::File(path.clone())));
            }
        }
        check_names(&found)?;
        Ok(found.into_iter().map(|(_, input)| input).collect())
    }

    /// Whether a path is a shard, or a folder with shards or another data set of turns: their frames have
    /// masks of their own.
    #[must_use]
    pub fn has_frames(path: &Path) -> bool {
        if !path.is_dir() {
            return has_ending(path, &["tar"]);
        }
        let is_shard = |path: PathBuf| is_visible(&path) && has_ending(&path, &["tar"]);
        let entries = fs::read_dir(path).into_iter().flatten().flatten();
        path.join(Dataset::FILE).is_file() || entries.map(|entry| entry.path()).any(is_shard)
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

/// Photographs, each with the path under which it was found: its own, or that of its data set.
type Found = Vec<(PathBuf, PhotoInput)>;

fn add_folder(found: &mut Found, folder: &Path, most: Option<u32>) -> Result<(), DecomposeError> {
    let mut photos = Vec::new();
    for entry in fs::read_dir(folder).map_err(DecomposeError::read(folder))? {
        let path = entry.map_err(DecomposeError::read(folder))?.path();
        if is_visible(&path) && path.is_file() && has_ending(&path, &PHOTOS) {
            photos.push(path);
        }
    }
    let has_frames = PhotoInput::has_frames(folder);
    if photos.is_empty() && !has_frames {
        return Err(DecomposeError::NoPhotos {
            path: folder.to_owned(),
        });
    }
    photos.sort();
    found.extend(
        photos
            .into_iter()
            .map(|path| (path.clone(), PhotoInput::File(path))),
    );
    if has_frames {
        add_turns(found, folder, most)?;
    }
    Ok(())
}

fn add_turns(found: &mut Found, path: &Path, most: Option<u32>) -> Result<(), DecomposeError> {
    let turns = Arc::new(Turns::open(path, Encoding::Linear)?);
    for (turn, samples) in (0..).zip(turns.turns()) {
        for position in 0..samples.min(most.unwrap_or(u32::MAX)) {
            let id = SampleId { turn, position };
            found.push((path.to_owned(), PhotoInput::Frame(Arc::clone(&turns), id)));
        }
    }
    Ok(())
}

fn is_visible(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    !name.as_encoded_bytes().starts_with(b".")
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|found| {
        endings
            .iter()
            .any(|known| found.eq_ignore_ascii_case(known))
    })
}

/// Whether every file and every turn has a folder of its own for its results.
fn check_names(inputs: &Found) -> Result<(), DecomposeError> {
    let mut names = BTreeMap::new();
    let mut last_turn = None;
    for (path, input) in inputs {
        let name = match input {
            PhotoInput::File(path) => Some(name_of(path)),
            PhotoInput::Frame(turns, id) => {
                let turn = (Arc::as_ptr(turns), id.turn);
                if last_turn.replace(turn) == Some(turn) {
                    continue;
                }
                session_of(turns, id.turn)
            }
        };
        let Some(name) = name else { continue };
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

/// The folder of a turn's results: the first part of its frames' keys, by the first frame that can be read.
fn session_of(turns: &Turns, turn: u32) -> Option<String> {
    let samples = *turns.turns().get(turn as usize)?;
    let key = |position| {
        let (batch, _) = turns.batch(&[SampleId { turn, position }], None);
        batch.frames.first().map(|frame| within(&frame.key))
    };
    let key = (0..samples).find_map(key)?;
    key.split('/').next().map(str::to_owned)
}

fn name_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

fn read_photo(path: &Path, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
    if let Some(extent) = stated_extent(path) {
        check_size("photograph", extent)?;
    }
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
            find_mask(&encoded, image.alpha.as_ref(), reading.rectangle).map_err(|why| {
                let path = path.to_owned();
                match why {
                    NoObject::Background => DecomposeError::NoMask { path },
                    NoObject::Black => DecomposeError::Black { path },
                }
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

/// The size that a file says it has; none where it cannot be read.
fn stated_extent(path: &Path) -> Option<Extent> {
    let reader = ::image::ImageReader::open(path).ok()?;
    let sides = reader.with_guessed_format().ok()?.into_dimensions().ok()?;
    Some(Extent::new(sides.0 as usize, sides.1 as usize))
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
        Some(
            rectangle @ Rectangle {
                x,
                y,
                width,
                height,
            },
        ) if rectangle.touches(mask.extent()) => Err(DecomposeError::EmptyRectangle {
            x,
            y,
            width,
            height,
        }),
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

/// The picture's values as a screen takes them.
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
    if let Some(points) = info.coding_independent_code_points
        && points.transfer_function != UNSPECIFIED
    {
        return transfer_of_points(points.transfer_function).map_err(|transfer| {
            DecomposeError::UnknownTransfer {
                path: path.to_owned(),
                transfer,
            }
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

/// What a transfer function of ITU-T H.273 is read as, or its name where it is not read. Those of BT.709 and its like
/// are shown as sRGB is.
fn transfer_of_points(function: u8) -> Result<Transfer, String> {
    let name = match function {
        8 => return Ok(Transfer::Linear),
        4 => return Ok(Transfer::Gamma22),
        1 | 6 | 7 | 11..=15 => return Ok(Transfer::Srgb),
        5 => "the power 1 / 2.8",
        9 | 10 => "a logarithm",
        16 => "PQ",
        17 => "SMPTE ST 428-1",
        18 => "HLG",
        _ => "an unknown function",
    };
    Err(format!("{name} (transfer function {function} in cICP)"))
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
