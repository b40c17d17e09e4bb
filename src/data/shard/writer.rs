//! Writing the shard and the table of one session from samples in any order.

use std::path::{Path, PathBuf};

use image::{GrayImage, RgbImage};

use super::codec::{check_mask, encode_mask, encode_rgb};
use super::dataset::ShardEntry;
use super::digest::Digest;
use super::file::FileEntry;
use super::folder::FolderStore;
use super::output::{PartialFile, SealedFile};
use super::parquet_table::{TableRow, write_rows};
use super::record::FrameRecord;
use super::settings::Layout;
use super::spool::SpoolStore;
use super::{MAX_SAMPLES, ShardError, names};

/// One sample, ready to be written.
#[derive(Debug, Clone)]
pub struct Sample {
    /// The frame's record.
    pub record: FrameRecord,
    /// The image, 0 outside the mask.
    pub image: RgbImage,
    /// The image as PNG, encoded by [`encode_rgb`].
    pub png: Vec<u8>,
}

impl Sample {
    /// A sample of this record and image. It encodes the image, which is the part worth running on
    /// many threads.
    ///
    /// # Errors
    /// [`ShardError::Encode`] if the image has no pixels.
    pub fn encode(record: FrameRecord, image: RgbImage) -> Result<Self, ShardError> {
        let png = encode_rgb(&image)?;
        Ok(Self { record, image, png })
    }
}

/// What only the whole turn shows of a sample: fields of its record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnFinding {
    /// The sample.
    pub index: u32,
    /// [`FrameRecord::exposure_step`].
    pub exposure_step: Option<f64>,
    /// [`FrameRecord::identical_to`].
    pub identical_to: Option<u64>,
    /// [`FrameRecord::blur`].
    pub blur: Option<f64>,
}

/// The files of a session that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShardFiles {
    /// The shards: one.
    pub shards: Vec<ShardEntry>,
    /// The table.
    pub table: FileEntry,
}

/// Where images are kept until the session is complete.
enum Store {
    Spool(SpoolStore),
    Folder(FolderStore),
}

/// The bytes of a session that is being written, for a message about a full disk.
#[derive(Debug, Clone)]
struct Needs {
    out: PathBuf,
    layout: Layout,
    samples: u64,
    pushed: u64,
    images: u64,
    mask: u64,
}

impl Needs {
    /// What all files take until the last is written, by the images so far.
    fn estimate(&self) -> u64 {
        let images = self.images.checked_div(self.pushed).unwrap_or_default() * self.samples;
        match self.layout {
            // The images are in the spool and in the tar, whose members have headers and are padded.
            Layout::Webdataset => {
                2 * images + self.samples * (self.mask + RECORD_BYTES + 3 * TAR_MEMBER_BYTES)
            }
            Layout::Relit => images + self.samples * IMAGE_PADDING,
        }
    }

    fn explain(&self, session: &str, error: ShardError) -> ShardError {
        let (needed, written) = (self.estimate(), self.images);
        error.with_needs(&format!("session {session}"), &self.out, needed, written)
    }
}

/// A record as JSON, about.
const RECORD_BYTES: u64 = 700;
/// A member's header in a tar, and half a block of padding.
const TAR_MEMBER_BYTES: u64 = 512 + 256;
/// What a file takes beyond its bytes, about: half a block.
const IMAGE_PADDING: u64 = 2048;

/// Writes the shard and the table of one session. The files appear under their names in
/// [`finish`](Self::finish); a writer that is dropped leaves nothing behind. Memory does not grow with
/// the images, which are kept on disk. The bytes of all files do not depend on the order in which the
/// samples come.
///
/// The folder should be locked by an [`OutputFolder`](super::OutputFolder). Several sessions may be
/// written into it at the same time.
pub struct ShardWriter {
    session: String,
    size: [u32; 2],
    mask_png: Vec<u8>,
    mask_blake3: Digest,
    rows: Vec<Option<TableRow>>,
    store: Store,
    needs: Needs,
}

impl ShardWriter {
    /// Starts the session `session` of `samples` samples (1 to [`MAX_SAMPLES`]) in the folder
    /// `out`, which must exist. `mask` holds 0 and 255 only and has the size of the images.
    ///
    /// # Errors
    /// [`ShardError::SessionName`], [`ShardError::SampleCount`], [`ShardError::MaskValue`], [`ShardError::Encode`] if the
    /// mask has no pixels, [`ShardError::Busy`] if the session is being written already, [`ShardError::Io`].
    pub fn create(
        out: &Path,
        layout: Layout,
        session: &str,
        samples: u32,
        mask: &GrayImage,
    ) -> Result<Self, ShardError> {
        names::check_session(session)?;
        if samples == 0 || samples > MAX_SAMPLES {
            return Err(ShardError::SampleCount { samples });
        }
        check_mask(mask)?;
        let mask_png = encode_mask(mask)?;
        let size = [mask.width(), mask.height()];
        let store = match layout {
            Layout::Webdataset => Store::Spool(SpoolStore::create(out, session, samples)?),
            Layout::Relit => Store::Folder(FolderStore::create(out, session, samples, size)?),
        };
        let needs = Needs {
            out: out.to_owned(),
            layout,
            samples: u64::from(samples),
            pushed: 0,
            images: 0,
            mask: mask_png.len() as u64,
        };
        Ok(Self {
            session: session.to_owned(),
            needs,
            size,
            mask_blake3: Digest::of(&mask_png),
            mask_png,
            rows: vec![None; samples as usize],
            store,
        })
    }

    /// Adds a sample. Each index must be given exactly once, in any order.
    ///
    /// # Errors
    /// [`ShardError::WrongSession`], [`ShardError::OutOfRange`], [`ShardError::DoubledSample`],
    /// [`ShardError::SizeMismatch`] if image, record and mask differ in size, [`ShardError::NotFinite`],
    /// [`ShardError::DiskFull`], [`ShardError::Io`]. The sample is then not added.
    pub fn push(&mut self, sample: Sample) -> Result<(), ShardError> {
        let Sample { record, image, png } = sample;
        self.check(&record, &image)?;
        let index = record.index;
        let out_of_range = || ShardError::OutOfRange {
            session: self.session.clone(),
            index,
            last: u32::try_from(self.rows.len()).unwrap_or(MAX_SAMPLES) - 1,
        };
        let slot = index as usize;
        if self.rows.get(slot).ok_or_else(out_of_range)?.is_some() {
            return Err(ShardError::DoubledSample {
                session: self.session.clone(),
                index,
            });
        }
        let pushed = match &mut self.store {
            Store::Spool(spool) => spool.push(index, &png),
            Store::Folder(folder) => folder.push(index, &png, &image),
        };
        pushed.map_err(|error| self.needs.explain(&self.session, error))?;
        self.needs.pushed += 1;
        self.needs.images += png.len() as u64;
        if let Some(row) = self.rows.get_mut(slot) {
            *row = Some(TableRow {
                png_blake3: Digest::of(&png),
                record,
                mask_blake3: self.mask_blake3,
            });
        }
        Ok(())
    }

    /// The record of a sample that was added and the digest of its image's PNG.
    #[must_use]
    pub fn sample(&self, index: u32) -> Option<(&FrameRecord, Digest)> {
        let row = self.rows.get(index as usize)?.as_ref()?;
        Some((&row.record, row.png_blake3))
    }

    /// Completes the record of a sample that was added, by what only the whole turn shows.
    ///
    /// # Errors
    /// [`ShardError::NotFinite`]; the record is then as it was.
    pub fn set_finding(&mut self, finding: TurnFinding) -> Result<(), ShardError> {
        let TurnFinding {
            index,
            exposure_step,
            identical_to,
            blur,
        } = finding;
        for (field, value) in [("exposure_step", exposure_step), ("blur", blur)] {
            if value.is_some_and(|value| !value.is_finite()) {
                return Err(ShardError::NotFinite {
                    session: self.session.clone(),
                    index,
                    field,
                });
            }
        }
        if let Some(Some(row)) = self.rows.get_mut(index as usize) {
            row.record.exposure_step = exposure_step;
            row.record.identical_to = identical_to;
            row.record.blur = blur;
        }
        Ok(())
    }

    /// Writes the session's files under their final names, replacing older ones.
    ///
    /// # Errors
    /// [`ShardError::MissingSample`] if samples were not given; [`ShardError::DiskFull`], [`ShardError::Io`],
    /// [`ShardError::Table`] or [`ShardError::Json`] if a file could not be written. Then nothing of the session is left, except
    /// files that got their names before the error, which `dataset.json` does not list.
    pub fn finish(self) -> Result<ShardFiles, ShardError> {
        let (needs, session) = (self.needs.clone(), self.session.clone());
        self.write_files()
            .map_err(|error| needs.explain(&session, error))
    }

    fn write_files(self) -> Result<ShardFiles, ShardError> {
        let Self {
            session,
            mask_png,
            rows,
            store,
            ..
        } = self;
        let rows = complete(&session, rows)?;
        match store {
            Store::Spool(spool) => {
                let shard = spool.seal(&rows, &mask_png)?;
                let table = seal_table(spool.out(), &session, &rows)?;
                Ok(ShardFiles {
                    shards: vec![shard.publish()?],
                    table: table.publish()?,
                })
            }
            Store::Folder(folder) => {
                let table = seal_table(folder.out(), &session, &rows)?;
                let shard = folder.publish(&rows, &mask_png)?;
                Ok(ShardFiles {
                    shards: vec![shard],
                    table: table.publish()?,
                })
            }
        }
    }

    fn check(&self, record: &FrameRecord, image: &RgbImage) -> Result<(), ShardError> {
        let index = record.index;
        if record.session != self.session {
            let (found, expected) = (record.session.clone(), self.session.clone());
            return Err(ShardError::WrongSession {
                index,
                found,
                expected,
            });
        }
        let sizes = [
            ("the image", [image.width(), image.height()]),
            ("the record's size", record.size),
        ];
        for (what, size) in sizes {
            if size != self.size {
                return Err(ShardError::SizeMismatch {
                    what,
                    size,
                    expected: self.size,
                });
            }
        }
        match first_not_finite(record) {
            Some(field) => Err(ShardError::NotFinite {
                session: self.session.clone(),
                index,
                field,
            }),
            None => Ok(()),
        }
    }
}

/// All rows, or an error with the first missing index.
fn complete(session: &str, rows: Vec<Option<TableRow>>) -> Result<Vec<TableRow>, ShardError> {
    let missing = rows.iter().filter(|row| row.is_none()).count();
    if let Some(index) = rows.iter().position(Option::is_none) {
        let index = u32::try_from(index).unwrap_or(MAX_SAMPLES);
        return Err(ShardError::MissingSample {
            session: session.to_owned(),
            index,
            missing,
        });
    }
    Ok(rows.into_iter().flatten().collect())
}

fn first_not_finite(record: &FrameRecord) -> Option<&'static str> {
    let [dx, dy] = record.shift_px.unwrap_or_default();
    let [r, g, b] = record.mean_rgb;
    let fields = [
        ("angle_deg", record.angle_deg.unwrap_or_default()),
        ("shift_px", dx + dy),
        (
            "align_confidence",
            record.align_confidence.unwrap_or_default(),
        ),
        (
            "shift_interpolated_sd_px",
            record.shift_interpolated_sd_px.unwrap_or_default(),
        ),
        ("saturated_fraction", record.saturated_fraction),
        ("mean_rgb", r + g + b),
        ("sharpness", record.sharpness),
        ("exposure_step", record.exposure_step.unwrap_or_default()),
        ("blur", record.blur.unwrap_or_default()),
    ];
    fields
        .into_iter()
        .find(|(_, value)| !value.is_finite())
        .map(|(field, _)| field)
}

fn seal_table(out: &Path, session: &str, rows: &[TableRow]) -> Result<SealedFile, ShardError> {
    let file = names::table_file(session);
    let mut partial = PartialFile::create(out, &file)?;
    write_rows(&mut partial, rows).map_err(|source| ShardError::Table {
        path: out.join(&file),
        doing: "written",
        source,
    })?;
    partial.seal()
}
