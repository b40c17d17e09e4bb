//! A data set in the other layout: the same samples, without their videos.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::GrayImage;
use rayon::prelude::*;

use super::ShardError;
use super::codec::{decode_mask, decode_rgb};
use super::combine::bytes_of;
use super::dataset::{Dataset, SessionEntry, ShardEntry};
use super::file::changed;
use super::new_dataset::{NewDataset, image_name};
use super::output;
use super::parquet_table::read_table;
use super::reader::ShardReader;
use super::settings::Layout;
use super::verify::verify;
use super::writer::{Sample, ShardFiles, ShardWriter};

/// Images that are decoded in parallel.
const BATCH: usize = 64;

/// The image of a sample, with its index.
type IndexedPng = Result<(u32, Vec<u8>), ShardError>;

/// Writes the data set in the folder `input` in another layout to the new folder `out`, whole or not at all: the same
/// files as an extraction in that layout gives. It is verified first. `progress` is called with the samples that were
/// verified or written, and with twice those of all.
///
/// # Errors
/// [`ShardError::Refused`] if it has this layout already, is not as it was written, or `out` holds anything;
/// [`ShardError::Locked`] while it is being written; those of [`Dataset::read`].
pub fn convert(
    input: &Path,
    out: &Path,
    layout: Layout,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Dataset, ShardError> {
    let _lock = output::lock_for_reading(input)?;
    let dataset = Dataset::read(input)?;
    if dataset.settings.layout == layout {
        return Err(ShardError::Refused(format!(
            "{} has the layout {layout} already: copy the folder",
            input.display()
        )));
    }
    let new = NewDataset::create(out)?;
    let verified = verify(input, &|done, of| progress(done, 2 * of))?;
    if let Some(problem) = verified.problems.first() {
        return Err(ShardError::Refused(problem.to_string()));
    }
    let mut settings = dataset.settings.clone();
    settings.layout = layout;
    let mut converted = Dataset::new(settings);
    let mut done = verified.samples;
    for session in &dataset.sessions {
        let files = write_session(
            input,
            &dataset,
            session,
            new.path(),
            layout,
            &mut |samples| {
                done += samples;
                progress(done, 2 * verified.samples);
            },
        );
        let needed = bytes_of(&dataset, &session.id);
        let what = format!("session {}", session.id);
        let files = files.map_err(|error| error.with_needs(&what, out, needed, 0))?;
        if let Some(report) = &session.report {
            new.copy(input, report)?;
        }
        let entry = SessionEntry {
            table: files.table,
            ..session.clone()
        };
        converted.replace(entry, files.shards);
    }
    new.finish(&converted)?;
    Ok(converted)
}

/// Writes a session of the data set in `input` to the folder `out`.
fn write_session(
    input: &Path,
    dataset: &Dataset,
    session: &SessionEntry,
    out: &Path,
    layout: Layout,
    advanced: &mut dyn FnMut(u64),
) -> Result<ShardFiles, ShardError> {
    let missing = |what: &str| changed(&session.id, format!("it has no {what}"));
    let shard = dataset.shards_of(&session.id).next();
    let shard = shard.ok_or_else(|| missing("shard"))?;
    let rows = read_table(input, &session.table)?;
    let tar = input.join(&shard.file);
    let opened = match dataset.settings.layout {
        Layout::Webdataset => open_tar(&tar)?,
        Layout::Paper => open_folder(input, shard)?,
    };
    let (mask, mut images) = opened.ok_or_else(|| missing("mask"))?;
    let mut writer = ShardWriter::create(out, layout, &session.id, session.samples, &mask)?;
    loop {
        let batch: Result<Vec<_>, _> = images.by_ref().take(BATCH).collect();
        let batch = batch?;
        if batch.is_empty() {
            return writer.finish();
        }
        let samples: Result<Vec<Sample>, ShardError> = batch
            .into_par_iter()
            .map(|(index, png)| {
                let row = rows.get(index as usize).ok_or_else(|| missing("row"))?;
                let (image, record) = (decode_rgb(&png)?, row.record.clone());
                Ok(Sample { record, image, png })
            })
            .collect();
        let samples = samples?;
        advanced(samples.len() as u64);
        samples
            .into_iter()
            .try_for_each(|sample| writer.push(sample))?;
    }
}

type MaskAndImages<'a> = (GrayImage, Box<dyn Iterator<Item = IndexedPng> + 'a>);

fn open_tar(path: &Path) -> Result<Option<MaskAndImages<'_>>, ShardError> {
    let open = || -> Result<_, ShardError> {
        let file = File::open(path).map_err(ShardError::io("open", path))?;
        Ok(ShardReader::new(BufReader::with_capacity(1 << 18, file)))
    };
    let first = open()?.next().transpose()?;
    let Some(mask) = first.as_ref().and_then(|sample| sample.member("mask.png")) else {
        return Ok(None);
    };
    let images = open()?.map(|sample| {
        let sample = sample?;
        let index = sample
            .key
            .rsplit('/')
            .next()
            .and_then(|key| key.parse().ok());
        match (index, sample.member("png")) {
            (Some(index), Some(png)) => Ok((index, png.to_vec())),
            _ => Err(changed(&sample.key, "it is not a sample".to_owned())),
        }
    });
    Ok(Some((decode_mask(mask)?, Box::new(images))))
}

fn open_folder<'a>(
    input: &Path,
    shard: &ShardEntry,
) -> Result<Option<MaskAndImages<'a>>, ShardError> {
    let read = |path: &Path| std::fs::read(path).map_err(ShardError::io("read", path));
    let Some(entry) = &shard.mask else {
        return Ok(None);
    };
    let mask = decode_mask(&read(&input.join(&entry.file))?)?;
    let folder = input.join(&shard.file);
    let images =
        (0..shard.samples).map(move |index| Ok((index, read(&folder.join(image_name(index)))?)));
    Ok(Some((mask, Box::new(images))))
}
