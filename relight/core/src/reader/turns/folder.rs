//! A turn in a folder of images, in the layout of the paper's released data set.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use relit_data::shard::{MAX_SAMPLES, order, sample_key};
use relit_data::still::StillError;

use super::batch::{Frame, MaskBytes, TurnFrame, extent_of};
use crate::image::{Extent, ImageError, check_extent};
use crate::parallel::caught;
use crate::reader::listing::listed;
use crate::reader::{DamagedSample, ReadError};

/// The images of a video, and its mask.
pub(super) struct FolderTurn {
    name: String,
    folder: PathBuf,
    /// The file of each frame, in order of time; `None` if it is missing.
    files: Vec<Option<String>>,
    /// The frame at each position.
    order: Vec<u32>,
    /// The mask, or why there is none.
    mask: Result<(Arc<Vec<u8>>, Extent), String>,
}

impl FolderTurn {
    /// Looks for the frames of the video `name`; `expected` is their number.
    pub(super) fn open(root: &Path, name: &str, expected: Option<u32>) -> Result<Self, ReadError> {
        let folder = root.join("imgs").join(name);
        let numbered: BTreeMap<u32, String> = listed(&folder, Path::is_file)?
            .iter()
            .filter_map(|path| frame_of(path))
            .collect();
        let last = numbered.keys().next_back().map_or(0, |last| last + 1);
        let count = last.max(expected.unwrap_or(0));
        let mask_file = root.join("masks").join(format!("{name}.png"));
        let mask = read_mask(&mask_file)
            .map_err(|fault| format!("its mask: {}", relit_data::causes::with_causes(&fault)));
        Ok(Self {
            name: name.to_owned(),
            folder,
            files: (0..count).map(|at| numbered.get(&at).cloned()).collect(),
            order: order(count),
            mask,
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn samples(&self) -> u32 {
        u32::try_from(self.files.len()).unwrap_or(u32::MAX)
    }

    /// Bytes of the frames that were found.
    pub(super) fn bytes(&self) -> u64 {
        let found = self.files.iter().flatten();
        let sizes = found.filter_map(|name| fs::metadata(self.folder.join(name)).ok());
        sizes.map(|file| file.len()).sum()
    }

    pub(super) fn frame(&self, position: u32) -> Result<Frame, DamagedSample> {
        let index = self
            .order
            .get(position as usize)
            .copied()
            .unwrap_or(position);
        let frame = caught(|| self.decode(index)).map_err(ReadError::from);
        frame.flatten().map_err(|fault| DamagedSample {
            sample: format!("{}, frame {index}", self.folder.display()),
            fault,
        })
    }

    fn decode(&self, index: u32) -> Result<Frame, ReadError> {
        let file = self.files.get(index as usize).and_then(Option::as_ref);
        let file =
            file.ok_or_else(|| ReadError::missing(&format!("image, {index}.png or .jpg,")))?;
        let (mask, mask_extent) = self
            .mask
            .as_ref()
            .map_err(|why| ReadError::Other(why.clone()))?;
        let image = read_image(&self.folder.join(file))?.into_rgb8();
        let extent = extent_of(image.width(), image.height());
        check_extent("mask", *mask_extent, extent)?;
        Ok(Frame {
            about: TurnFrame {
                key: sample_key(&self.name, index),
                record: None,
            },
            extent,
            pixels: image.into_raw(),
            mask: MaskBytes::Levels(Arc::clone(mask)),
        })
    }
}

/// The number and name of a frame's file.
fn frame_of(path: &Path) -> Option<(u32, String)> {
    let is_image = ["png", "jpg"]
        .iter()
        .any(|known| path.extension().is_some_and(|found| found == *known));
    let number: u32 = path.file_stem()?.to_str()?.parse().ok()?;
    let name = path.file_name()?.to_str()?.to_owned();
    (is_image && number < MAX_SAMPLES).then_some((number, name))
}

fn read_mask(path: &Path) -> Result<(Arc<Vec<u8>>, Extent), ReadError> {
    let mask = read_image(path)?.into_luma8();
    let extent = extent_of(mask.width(), mask.height());
    Ok((Arc::new(mask.into_raw()), extent))
}

fn read_image(path: &Path) -> Result<::image::DynamicImage, ReadError> {
    let bytes = fs::read(path).map_err(ReadError::read(path))?;
    let decoded = ::image::load_from_memory(&bytes).map_err(StillError::Decode);
    Ok(decoded.map_err(ImageError::still(path))?)
}
