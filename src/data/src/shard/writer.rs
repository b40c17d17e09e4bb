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
    /// [`ShardError::Image`] if the image has no pixels.
    pub fn encode(record: FrameRecord, image: RgbImage) -> Result<Self, ShardError> {
        let png = encode_rgb(&image)?;
        Ok(Self { record, image, png })
    }
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
    out: PathBuf,
    /// Bytes of the images so far.
    images: u64,
}

impl ShardWriter {
    /// Starts the session `session` of `samples` samples (1 to [`MAX_SAMPLES`]) in the folder
    /// `out`, which must exist. `mask` holds 0 and 255 only and has the size of the images.
    ///
    /// # Errors
    /// [`ShardError::Refused`] for another name or number of samples, [`ShardError::Image`] if the
    /// mask has other values or no pixels, [`ShardError::Busy`] if the session is being written already,
    /// [`ShardError::Io`].
    pub fn create(
        out: &Path,
        layout: Layout,
        session: &str,
        samples: u32,
        mask: &GrayImage,
    ) -> Result<Self, ShardError> {
        names::check_session(session)?;
        if samples == 0 || samples > MAX_SAMPLES {
            return Err(ShardError::Refused(format!(
                "a session of {samples} samples cannot be written: give 1 to {MAX_SAMPLES}"
            )));
        }
        check_mask(mask)?;
        let mask_png = encode_mask(mask)?;
        let size = [mask.width(), mask.height()];
        let store = match layout {
            Layout::Webdataset => Store::Spool(SpoolStore::create(out, session, samples)?),
            Layout::Paper => Store::Folder(FolderStore::create(out, session, samples, size)?),
        };
        Ok(Self {
            session: session.to_owned(),
            size,
            mask_blake3: Digest::hash(&mask_png),
            mask_png,
            rows: vec![None; samples as usize],
            store,
            out: out.to_owned(),
            images: 0,
        })
    }

    /// Adds a sample. Each index must be given exactly once, in any order.
    ///
    /// # Errors
    /// [`ShardError::Refused`] if it is another session's, its index is too large or was given already, a number
    /// is not finite, or image, record and mask differ in size; [`ShardError::DiskFull`], [`ShardError::Io`]. The
    /// sample is then not added.
    pub fn push(&mut self, sample: Sample) -> Result<(), ShardError> {
        let Sample { record, image, png } = sample;
        self.check(&record, &image).map_err(ShardError::Refused)?;
        let index = record.index;
        let pushed = match &mut self.store {
            Store::Spool(spool) => spool.push(index, &png),
            Store::Folder(folder) => folder.push(index, &png, &image),
        };
        let (needed, written) = self.needs();
        pushed.map_err(|error| {
            error.with_needs(
                &format!("session {}", self.session),
                &self.out,
                needed,
                written,
            )
        })?;
        self.images += png.len() as u64;
        if let Some(row) = self.rows.get_mut(index as usize) {
            *row = Some(TableRow {
                png_blake3: Digest::hash(&png),
                record,
                mask_blake3: self.mask_blake3,
            });
        }
        Ok(())
    }

    /// The record of a sample that was added and the digest of its image's PNG.
    pub fn sample(&self, index: u32) -> Option<(&FrameRecord, Digest)> {
        let row = self.rows.get(index as usize)?.as_ref()?;
        Some((&row.record, row.png_blake3))
    }

    /// The record of a sample that was added, to complete it by what only the whole turn shows.
    pub fn record_mut(&mut self, index: u32) -> Option<&mut FrameRecord> {
        let row = self.rows.get_mut(index as usize)?.as_mut()?;
        Some(&mut row.record)
    }

    /// Writes the session's files under their final names, replacing older ones.
    ///
    /// # Errors
    /// [`ShardError::Refused`] if samples were not given or a number is not finite; [`ShardError::DiskFull`],
    /// [`ShardError::Io`] or [`ShardError::Table`] if a file could not be written. Then nothing of the session is left,
    /// except files that got their names before the error, which `dataset.json` does not list.
    pub fn finish(self) -> Result<ShardFiles, ShardError> {
        let (needed, written) = self.needs();
        let (what, out) = (format!("session {}", self.session), self.out.clone());
        self.write_files()
            .map_err(|error| error.with_needs(&what, &out, needed, written))
    }

    fn write_files(self) -> Result<ShardFiles, ShardError> {
        let session = self.session;
        let rows = complete(&session, self.rows).map_err(ShardError::Refused)?;
        let (shard, table) = match self.store {
            Store::Spool(spool) => {
                let tar = spool.seal(&rows, &self.mask_png)?;
                let table = seal_table(&self.out, &session, &rows)?;
                let tar = tar.publish()?;
                let shard = ShardEntry {
                    file: tar.file,
                    session,
                    samples: rows.len() as u32,
                    bytes: tar.bytes,
                    blake3: tar.blake3,
                    mask: None,
                    mean_img: None,
                };
                (shard, table)
            }
            Store::Folder(folder) => {
                let table = seal_table(&self.out, &session, &rows)?;
                (folder.publish(&rows, &self.mask_png)?, table)
            }
        };
        Ok(ShardFiles {
            shards: vec![shard],
            table: table.publish()?,
        })
    }

    /// What all files take until the last is written, by the images so far, and the images.
    fn needs(&self) -> (u64, u64) {
        let (samples, mask) = (self.rows.len() as u64, self.mask_png.len() as u64);
        let pushed = self.rows.iter().flatten().count() as u64;
        let images = self.images.checked_div(pushed).unwrap_or_default() * samples;
        let needed = match self.store {
            // The images are in the spool and in the tar, whose members have headers and are padded.
            Store::Spool(_) => 2 * images + samples * (mask + RECORD_BYTES + 3 * TAR_MEMBER_BYTES),
            Store::Folder(_) => images + samples * IMAGE_PADDING,
        };
        (needed, self.images)
    }

    /// Why a sample is not taken.
    fn check(&self, record: &FrameRecord, image: &RgbImage) -> Result<(), String> {
        let (index, session) = (record.index, &self.session);
        if record.session != *session {
            let found = &record.session;
            return Err(format!(
                "sample {index} belongs to session {found:?}, but {session:?} is being written"
            ));
        }
        let sizes = [
            ("the image", [image.width(), image.height()]),
            ("the record's size", record.size),
        ];
        let [width, height] = self.size;
        for (what, [w, h]) in sizes {
            if [w, h] != self.size {
                return Err(format!(
                    "{what} is {w}x{h} pixels, but {width}x{height} were expected"
                ));
            }
        }
        check_finite(session, record)?;
        match self.rows.get(index as usize) {
            Some(None) => Ok(()),
            Some(Some(_)) => Err(format!(
                "sample {index} of session {session:?} was given twice"
            )),
            None => Err(format!(
                "session {session:?} has samples 0 to {}, but sample {index} was given",
                self.rows.len() - 1
            )),
        }
    }
}

/// All rows, or what is wrong with them.
fn complete(session: &str, rows: Vec<Option<TableRow>>) -> Result<Vec<TableRow>, String> {
    let missing = rows.iter().filter(|row| row.is_none()).count();
    if let Some(index) = rows.iter().position(Option::is_none) {
        return Err(format!(
            "session {session:?} is not complete: {missing} samples were not given, the first is sample {index}"
        ));
    }
    let rows: Vec<TableRow> = rows.into_iter().flatten().collect();
    rows.iter()
        .try_for_each(|row| check_finite(session, &row.record))?;
    Ok(rows)
}

/// That all numbers of a record are such as JSON can hold.
fn check_finite(session: &str, record: &FrameRecord) -> Result<(), String> {
    let [dx, dy] = record.shift_px.unwrap_or_default();
    let [r, g, b] = record.mean_rgb;
    let fields = [
        ("angle_deg", record.angle_deg),
        ("shift_px", Some(dx + dy)),
        ("align_confidence", record.align_confidence),
        ("shift_interpolated_sd_px", record.shift_interpolated_sd_px),
        ("saturated_fraction", Some(record.saturated_fraction)),
        ("mean_rgb", Some(r + g + b)),
        ("sharpness", Some(record.sharpness)),
        ("exposure_step", record.exposure_step),
        ("blur", record.blur),
    ];
    let is_wrong = |(_, value): &&(_, Option<f64>)| value.is_some_and(|value| !value.is_finite());
    match fields.iter().find(is_wrong) {
        Some((field, _)) => Err(format!(
            "{field} of sample {} of session {session:?} is not a finite number",
            record.index
        )),
        None => Ok(()),
    }
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
