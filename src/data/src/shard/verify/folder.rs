//! Checks the layout `paper`: a folder of images with the session's samples.

use std::io;
use std::path::Path;

use image::RgbImage;
use rayon::prelude::*;

use super::sample::{SessionMask, check_image};
use super::session::{SessionCheck, ShardContents};
use crate::causes::with_causes;
use crate::image_stats::MaskSpans;
use crate::shard::codec::decode_rgb;
use crate::shard::digest::{Digest, FolderHasher};
use crate::shard::file::{FileEntry, compare, read_limited};
use crate::shard::folder::MeanImage;
use crate::shard::{ShardError, names, output};

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// Images that are checked in parallel.
const BATCH: usize = 32;

pub(super) fn check(check: &mut SessionCheck<'_>) -> ShardContents {
    check_names(check);
    let mask = check_mask(check);
    let images = check_images(check, mask.as_ref());
    let entry = (check.shard.bytes, check.shard.blake3);
    if images.count == u64::from(check.session.samples) {
        let found = (images.bytes, images.hasher.finish());
        if let Err(error) = compare(&check.shard.file, entry, found) {
            check.note(None, with_causes(&error));
        }
    }
    check_mean(check, images.mean.as_ref());
    ShardContents {
        samples: images.count,
        records: Vec::new(),
    }
}

/// Checks that the folder holds the images `0.png` to `n-1.png` and nothing else.
fn check_names(check: &mut SessionCheck<'_>) {
    let folder = check.out.join(&check.shard.file);
    let listed = match output::names_in(&folder) {
        Ok(listed) => listed,
        Err(error) => return check.note(None, with_causes(&error)),
    };
    let samples = check.session.samples;
    let mut present = vec![false; samples as usize];
    for name in listed {
        let number = name
            .strip_suffix(".png")
            .and_then(|number| number.parse::<u32>().ok());
        let index = number.filter(|index| format!("{index}.png") == name);
        match index.and_then(|index| present.get_mut(index as usize)) {
            Some(slot) => *slot = true,
            None => check.note(None, format!("{name:?} does not belong here")),
        }
    }
    for (index, _) in (0..samples).zip(present).filter(|(_, present)| !present) {
        check.note(Some(index), "the image is missing".to_owned());
    }
}

/// The session's mask, if it is valid.
fn check_mask(check: &mut SessionCheck<'_>) -> Option<MaskSpans> {
    let file = names::mask_file(&check.session.id);
    let entry = check_entry(check, check.shard.mask.as_ref(), &file)?;
    let png = match read(&check.out.join(&entry.file)) {
        Ok(png) => png,
        Err(error) => {
            check.note_in(&file, None, with_causes(&error));
            return None;
        }
    };
    let mut mask = SessionMask::default();
    let mut problems = mask.check(&png, check.row(0).map(|row| &row.mask_blake3));
    let rows = check.rows.as_deref().unwrap_or_default();
    if rows
        .windows(2)
        .any(|pair| pair[0].mask_blake3 != pair[1].mask_blake3)
    {
        problems.push("the table lists more than one mask".to_owned());
    }
    for what in problems {
        check.note_in(&file, None, what);
    }
    mask.get().map(|spans| MaskSpans::clone(&spans))
}

/// Checks the mask or mean image `file` against its entry, and returns the entry.
fn check_entry(
    check: &mut SessionCheck<'_>,
    entry: Option<&FileEntry>,
    file: &str,
) -> Option<FileEntry> {
    let problem = match entry {
        None => Some("dataset.json does not list it".to_owned()),
        Some(entry) if entry.file != file => Some(format!("it is listed as {:?}", entry.file)),
        Some(entry) => entry
            .check(check.out)
            .err()
            .map(|error| with_causes(&error)),
    };
    if let Some(what) = problem {
        check.note_in(file, None, what);
    }
    entry.filter(|entry| entry.file == file).cloned()
}

/// The sums over all images.
struct Images {
    /// Number of images that were read.
    count: u64,
    bytes: u64,
    hasher: FolderHasher,
    /// Their mean, if all could be decoded and have one size.
    mean: Option<MeanImage>,
}

/// One image that was checked.
struct CheckedImage {
    problems: Vec<String>,
    read: Option<(u64, Digest)>,
    image: Option<RgbImage>,
}

fn check_images(check: &mut SessionCheck<'_>, mask: Option<&MaskSpans>) -> Images {
    let mut images = Images {
        count: 0,
        bytes: 0,
        hasher: FolderHasher::default(),
        mean: mask.map(|mask| MeanImage::new(mask.size())),
    };
    let indices: Vec<u32> = (0..check.session.samples).collect();
    for batch in indices.chunks(BATCH) {
        let all = &*check;
        let checked: Vec<CheckedImage> = batch
            .par_iter()
            .map(|&index| check_one(all, index, mask))
            .collect();
        for (&index, checked) in batch.iter().zip(checked) {
            for what in &checked.problems {
                check.note(Some(index), what.clone());
            }
            images.add(&checked, mask);
        }
        check.progress.add(batch.len());
    }
    images
}

impl Images {
    fn add(&mut self, checked: &CheckedImage, mask: Option<&MaskSpans>) {
        if let Some((bytes, digest)) = &checked.read {
            self.count += 1;
            self.bytes += bytes;
            self.hasher.add(digest);
        }
        let fits = |image: &&RgbImage| {
            mask.is_some_and(|mask| mask.size() == [image.width(), image.height()])
        };
        match (checked.image.as_ref().filter(fits), &mut self.mean) {
            (Some(image), Some(mean)) => mean.add(image),
            _ => self.mean = None,
        }
    }
}

fn check_one(check: &SessionCheck<'_>, index: u32, mask: Option<&MaskSpans>) -> CheckedImage {
    let unread = |problems| CheckedImage {
        problems,
        read: None,
        image: None,
    };
    let folder = check.out.join(&check.shard.file);
    let png = match read(&folder.join(format!("{index}.png"))) {
        Ok(png) => png,
        // Missing images are reported by `check_names`.
        Err(ShardError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            return unread(Vec::new());
        }
        Err(error) => return unread(vec![with_causes(&error)]),
    };
    let row = check.row(index);
    let record = row.map(|row| &row.record);
    let digest = Digest::hash(&png);
    let (problems, image) = check_image(check.settings, &png, &digest, row, record, mask);
    CheckedImage {
        problems,
        read: Some((png.len() as u64, digest)),
        image,
    }
}

/// Checks that the mean image is the mean of the images.
fn check_mean(check: &mut SessionCheck<'_>, mean: Option<&MeanImage>) {
    let file = names::mean_file(&check.session.id);
    let Some(entry) = check_entry(check, check.shard.mean_img.as_ref(), &file) else {
        return;
    };
    let stored = read(&check.out.join(&entry.file)).and_then(|png| decode_rgb(&png));
    let what = match (stored, mean.map(MeanImage::image)) {
        (Err(error), _) => with_causes(&error),
        (Ok(stored), Some(Ok(mean))) if stored != mean => {
            "it is not the mean of the session's images".to_owned()
        }
        _ => return,
    };
    check.note_in(&file, None, what);
}

fn read(path: &Path) -> Result<Vec<u8>, ShardError> {
    read_limited(path, MAX_BYTES).map_err(ShardError::io("read", path))
}
