//! A data set in the other layout: the same samples, without their videos.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::GrayImage;
use rayon::prelude::*;

use super::codec::{decode_mask, decode_rgb};
use super::combine::bytes_of;
use super::dataset::{Dataset, SessionEntry, ShardEntry};
use super::digest::Hashing;
use super::file::{changed, compare};
use super::names::{self, Part, parse_member};
use super::new_dataset::{FolderImages, NewDataset};
use super::output;
use super::parquet_table::{TableRow, read_table};
use super::settings::Layout;
use super::tar_reader::{Member, TarReader};
use super::writer::{Sample, ShardFiles, ShardWriter};
use super::{Digest, ShardError};

/// Largest member of a tar that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// Images that are decoded in parallel.
const BATCH: usize = 64;

/// Writes the data set in the folder `input` in another layout to the new folder `out`, whole or not at all: the same
/// files as an extraction in that layout gives. Each sample is compared with the table. `progress` is called with
/// the samples done and those of all.
///
/// # Errors
/// [`ShardError::Refused`] if it has this layout already, or `out` holds anything; [`ShardError::Changed`],
/// [`ShardError::ShardDamaged`] and others if a file is not as it was written; [`ShardError::Locked`] while it is being
/// written; those of [`Dataset::read`].
pub fn convert(
    input: &Path,
    out: &Path,
    layout: Layout,
    progress: &dyn Fn(u64, u64),
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
    let mut settings = dataset.settings.clone();
    settings.layout = layout;
    let mut converted = Dataset::new(settings);
    let sizes = dataset
        .sessions
        .iter()
        .map(|session| u64::from(session.samples));
    let all: u64 = sizes.sum();
    let mut done = 0;
    for session in &dataset.sessions {
        let conversion = SessionConversion::new(input, &dataset, session)?;
        let files = conversion.write(&new, layout, &mut |samples| {
            done += samples;
            progress(done, all);
        });
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

/// One session on its way to another layout.
struct SessionConversion<'a> {
    input: &'a Path,
    session: &'a SessionEntry,
    shard: &'a ShardEntry,
    layout: Layout,
    /// One row a sample, in the order of their indices.
    rows: Vec<TableRow>,
}

impl<'a> SessionConversion<'a> {
    fn new(
        input: &'a Path,
        dataset: &'a Dataset,
        session: &'a SessionEntry,
    ) -> Result<Self, ShardError> {
        let mut shards = dataset.shards_of(&session.id);
        let (Some(shard), None) = (shards.next(), shards.next()) else {
            return Err(changed(
                &session.id,
                "it does not have exactly one shard".to_owned(),
            ));
        };
        let rows = read_table(input, &session.table)?;
        let is_whole = rows.len() == session.samples as usize && shard.samples == session.samples;
        let is_in_order = (0..)
            .zip(&rows)
            .all(|(index, row)| row.record.index == index);
        if !is_whole || !is_in_order {
            let what = format!("its rows are not the samples 0 to {}", session.samples);
            return Err(changed(&session.table.file, what));
        }
        Ok(Self {
            input,
            session,
            shard,
            layout: dataset.settings.layout,
            rows,
        })
    }

    fn write(
        &self,
        new: &NewDataset,
        layout: Layout,
        advanced: &mut dyn FnMut(u64),
    ) -> Result<ShardFiles, ShardError> {
        let mut writing = SessionWriting {
            conversion: self,
            out: new.path(),
            layout,
            writer: None,
            batch: Vec::new(),
            advanced,
        };
        match self.layout {
            Layout::Webdataset => self.read_tar(&mut writing)?,
            Layout::Paper => self.read_folder(&mut writing)?,
        }
        writing.finish()
    }

    fn read_tar(&self, writing: &mut SessionWriting<'_, '_>) -> Result<(), ShardError> {
        let file = &self.shard.file;
        names::check_path(file)?;
        let path = self.input.join(file);
        let opened = File::open(&path).map_err(ShardError::io("open", &path))?;
        let source = Hashing::new(BufReader::with_capacity(1 << 18, opened));
        let mut tar = TarReader::new(source, MAX_BYTES);
        // An image stands before its mask, and the writer needs the first mask.
        let mut images = Vec::new();
        while let Some(Member { path, data, .. }) = tar.next()? {
            let member = parse_member(&self.session.id, &path);
            match member.filter(|(index, _)| *index < self.session.samples) {
                Some((index, Part::Image)) => images.push((index, data)),
                Some((index, Part::Mask)) => {
                    writing.take_mask(&data, self.row(index)?.mask_blake3, file)?;
                    for (index, png) in images.drain(..) {
                        writing.take(index, png)?;
                    }
                }
                Some((index, Part::Record)) => self.check_record(index, &data)?,
                None => return Err(changed(file, format!("{path:?} does not belong here"))),
            }
        }
        for (index, png) in images {
            writing.take(index, png)?;
        }
        let mut source = tar.into_inner();
        source.drain().map_err(ShardError::io("read", &path))?;
        let expected = (self.shard.bytes, self.shard.blake3);
        compare(file, expected, source.digest())
    }

    fn read_folder(&self, writing: &mut SessionWriting<'_, '_>) -> Result<(), ShardError> {
        let Some(entry) = &self.shard.mask else {
            return Err(changed(&self.shard.file, "it has no mask".to_owned()));
        };
        entry.check(self.input)?;
        let path = self.input.join(&entry.file);
        let mask = std::fs::read(&path).map_err(ShardError::io("read", &path))?;
        writing.take_mask(&mask, entry.blake3, &entry.file)?;
        names::check_path(&self.shard.file)?;
        let mut images = FolderImages::default();
        for index in 0..self.session.samples {
            writing.take(index, images.read(self.input, self.shard, index)?)?;
        }
        images.check(self.shard)
    }

    fn row(&self, index: u32) -> Result<&TableRow, ShardError> {
        self.rows.get(index as usize).ok_or_else(|| {
            let what = format!("it has no row {index}");
            changed(&self.session.table.file, what)
        })
    }

    /// That a sample's record is the one in the table.
    fn check_record(&self, index: u32, json: &[u8]) -> Result<(), ShardError> {
        if serde_json::from_slice(json).ok().as_ref() == Some(&self.row(index)?.record) {
            Ok(())
        } else {
            let key = names::sample_key(&self.session.id, index);
            let what = format!("the record of {key} is not that of the table");
            Err(changed(&self.shard.file, what))
        }
    }
}

/// A session that is being written in its new layout.
struct SessionWriting<'a, 'b> {
    conversion: &'b SessionConversion<'a>,
    out: &'b Path,
    layout: Layout,
    /// From the first mask on.
    writer: Option<ShardWriter>,
    batch: Vec<(u32, Vec<u8>)>,
    advanced: &'b mut dyn FnMut(u64),
}

impl SessionWriting<'_, '_> {
    /// Takes the session's mask, which each sample of a tar repeats.
    fn take_mask(&mut self, png: &[u8], expected: Digest, file: &str) -> Result<(), ShardError> {
        if Digest::hash(png) != expected {
            return Err(changed(file, "a mask is not that of the table".to_owned()));
        }
        if self.writer.is_none() {
            let mask: GrayImage = decode_mask(png)?;
            let SessionEntry { id, samples, .. } = self.conversion.session;
            let writer = ShardWriter::create(self.out, self.layout, id, *samples, &mask)?;
            self.writer = Some(writer);
        }
        Ok(())
    }

    fn take(&mut self, index: u32, png: Vec<u8>) -> Result<(), ShardError> {
        self.batch.push((index, png));
        if self.batch.len() >= BATCH {
            self.write_batch()
        } else {
            Ok(())
        }
    }

    fn write_batch(&mut self) -> Result<(), ShardError> {
        let conversion = self.conversion;
        let batch = std::mem::take(&mut self.batch);
        let count = batch.len() as u64;
        let samples: Result<Vec<Sample>, ShardError> = batch
            .into_par_iter()
            .map(|(index, png)| {
                let row = conversion.row(index)?;
                if Digest::hash(&png) != row.png_blake3 {
                    let key = names::sample_key(&conversion.session.id, index);
                    let what = format!("the image of {key} is not that of the table");
                    return Err(changed(&conversion.shard.file, what));
                }
                let image = decode_rgb(&png)?;
                let record = row.record.clone();
                Ok(Sample { record, image, png })
            })
            .collect();
        let Some(writer) = &mut self.writer else {
            let what = "it holds no mask".to_owned();
            return Err(changed(&conversion.shard.file, what));
        };
        for sample in samples? {
            writer.push(sample)?;
        }
        (self.advanced)(count);
        Ok(())
    }

    /// Writes what is left, and the files; an error if a sample is missing.
    fn finish(mut self) -> Result<ShardFiles, ShardError> {
        self.write_batch()?;
        match self.writer {
            Some(writer) => writer.finish(),
            None => {
                let what = "it holds no mask".to_owned();
                Err(changed(&self.conversion.shard.file, what))
            }
        }
    }
}
