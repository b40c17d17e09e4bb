//! The layout `paper`: images in a folder that gets its final name when it is complete.

use std::fs;
use std::path::{Path, PathBuf};

use image::RgbImage;

use super::codec::encode_rgb;
use super::dataset::ShardEntry;
use super::digest::FolderHasher;
use super::output;
use super::parquet_table::TableRow;
use super::{ShardError, names};

/// The images of a session that are written into a folder.
pub(super) struct FolderStore {
    out: PathBuf,
    session: String,
    samples: u32,
    partial: PartialFolder,
    mean: MeanImage,
    bytes: u64,
}

/// A folder under its temporary name; removed when dropped.
struct PartialFolder {
    path: PathBuf,
}

impl Drop for PartialFolder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.path);
    }
}

impl FolderStore {
    pub(super) fn create(
        out: &Path,
        session: &str,
        samples: u32,
        size: [u32; 2],
    ) -> Result<Self, ShardError> {
        for folder in [names::IMAGES, names::MASKS, names::MEANS] {
            let path = out.join(folder);
            fs::create_dir_all(&path).map_err(ShardError::io("make the folder", &path))?;
        }
        let path = out.join(names::IMAGES).join(names::partial(session));
        fs::create_dir(&path).map_err(output::busy("make the folder", &path))?;
        Ok(Self {
            out: out.to_owned(),
            session: session.to_owned(),
            samples,
            partial: PartialFolder { path },
            mean: MeanImage::new(size),
            bytes: 0,
        })
    }

    pub(super) fn push(
        &mut self,
        index: u32,
        png: &[u8],
        image: &RgbImage,
    ) -> Result<(), ShardError> {
        let path = self.image_path(index);
        fs::write(&path, png).map_err(ShardError::io("write", &path))?;
        self.mean.add(image);
        self.bytes += png.len() as u64;
        Ok(())
    }

    /// Renames folder, mask and mean image to their final names, replacing older ones.
    pub(super) fn publish(
        self,
        rows: &[TableRow],
        mask_png: &[u8],
    ) -> Result<ShardEntry, ShardError> {
        output::sync_content(&self.partial.path)?;
        let mask = output::seal_whole(&self.out, &names::mask_file(&self.session), mask_png)?;
        let mean_png = encode_rgb(&self.mean.image()?)?;
        let mean_img = output::seal_whole(&self.out, &names::mean_file(&self.session), &mean_png)?;
        self.replace_folder()?;
        let mut hasher = FolderHasher::default();
        rows.iter().for_each(|row| hasher.add(&row.png_blake3));
        Ok(ShardEntry {
            file: names::image_folder(&self.session),
            session: self.session.clone(),
            samples: self.samples,
            bytes: self.bytes,
            blake3: hasher.finish(),
            mask: Some(mask.publish()?),
            mean_img: Some(mean_img.publish()?),
        })
    }

    /// Renames the folder to its final name. An older folder stays complete until then.
    fn replace_folder(&self) -> Result<(), ShardError> {
        let images = self.out.join(names::IMAGES);
        let path = images.join(&self.session);
        let old = images.join(names::outgoing(&self.session));
        output::remove_folder(&old)?;
        if path.exists() {
            fs::rename(&path, &old).map_err(ShardError::io("move away", &path))?;
        }
        if let Err(source) = fs::rename(&self.partial.path, &path) {
            // Restore the older one; if that fails too, the next run does it.
            let _ = fs::rename(&old, &path);
            return Err(ShardError::io("rename a finished folder to", &path)(source));
        }
        output::sync(&images)?;
        output::remove_folder(&old)
    }

    fn image_path(&self, index: u32) -> PathBuf {
        self.partial.path.join(format!("{index}.png"))
    }
}

/// The mean of images, channel by channel, rounded to the nearest value (half up).
pub(super) struct MeanImage {
    size: [u32; 2],
    sums: Vec<u64>,
    count: u64,
}

impl MeanImage {
    pub(super) fn new([width, height]: [u32; 2]) -> Self {
        let sums = vec![0; width as usize * height as usize * 3];
        Self {
            size: [width, height],
            sums,
            count: 0,
        }
    }

    /// Adds an image of this size.
    pub(super) fn add(&mut self, image: &RgbImage) {
        for (sum, &value) in self.sums.iter_mut().zip(image.as_raw()) {
            *sum += u64::from(value);
        }
        self.count += 1;
    }

    pub(super) fn image(&self) -> Result<RgbImage, ShardError> {
        let [width, height] = self.size;
        let round = |sum: &u64| (2 * sum + self.count) / (2 * self.count).max(1);
        let pixels = self
            .sums
            .iter()
            .map(|sum| u8::try_from(round(sum)).unwrap_or(u8::MAX));
        RgbImage::from_raw(width, height, pixels.collect())
            .ok_or_else(|| ShardError::Image("the mean image has another size".to_owned()))
    }
}
