//! The table of a session, `<session>.parquet`: all records, one row per sample, in index order.
//!
//! It is written without compression and holds neither time nor path: the same rows always give the
//! same bytes.

use std::collections::HashMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::Field;
use parquet::schema::parser::parse_message_type;

use super::digest::{Digest, HashingReader};
use super::file::{FileEntry, compare};
use super::record::FrameRecord;
use super::{MAX_SAMPLES, ShardError, names};
use crate::geometry::Rect;

/// One row: the record of a sample and the digests of its files, which allow to attribute damage to
/// the sample.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRow {
    /// The record.
    pub record: FrameRecord,
    /// BLAKE3 of the image's PNG file.
    pub png_blake3: Digest,
    /// BLAKE3 of the mask's PNG file.
    pub mask_blake3: Digest,
}

/// How a column gets its value from a row.
enum Column {
    Text(fn(&TableRow) -> String),
    U32(fn(&TableRow) -> u32),
    I32(fn(&TableRow) -> i32),
    U64(fn(&TableRow) -> u64),
    I64(fn(&TableRow) -> i64),
    Real(fn(&TableRow) -> f64),
    MaybeReal(fn(&TableRow) -> Option<f64>),
    MaybeU64(fn(&TableRow) -> Option<u64>),
    Flag(fn(&TableRow) -> bool),
}

impl Column {
    /// The column's line in the schema.
    fn declaration(&self, name: &str) -> String {
        match self {
            Self::Text(_) => format!("required binary {name} (string);"),
            Self::U32(_) => format!("required int32 {name} (integer(32,false));"),
            Self::I32(_) => format!("required int32 {name} (integer(32,true));"),
            Self::U64(_) => format!("required int64 {name} (integer(64,false));"),
            Self::I64(_) => format!("required int64 {name} (integer(64,true));"),
            Self::Real(_) => format!("required double {name};"),
            Self::MaybeReal(_) => format!("optional double {name};"),
            Self::MaybeU64(_) => format!("optional int64 {name} (integer(64,false));"),
            Self::Flag(_) => format!("required boolean {name};"),
        }
    }
}

const COLUMNS: [(&str, Column); 31] = [
    ("session", Column::Text(|r| r.record.session.clone())),
    ("object", Column::Text(|r| r.record.object.clone())),
    ("index", Column::U32(|r| r.record.index)),
    ("source_frame", Column::U64(|r| r.record.source_frame)),
    ("t_us", Column::I64(|r| r.record.t_us)),
    ("angle_deg", Column::MaybeReal(|r| r.record.angle_deg)),
    ("duplicate", Column::Flag(|r| r.record.duplicate)),
    ("crop_x", Column::I32(|r| r.record.crop.x)),
    ("crop_y", Column::I32(|r| r.record.crop.y)),
    ("crop_w", Column::U32(|r| r.record.crop.w)),
    ("crop_h", Column::U32(|r| r.record.crop.h)),
    ("size_w", Column::U32(|r| r.record.size[0])),
    ("size_h", Column::U32(|r| r.record.size[1])),
    (
        "shift_dx",
        Column::MaybeReal(|r| r.record.shift_px.map(|shift| shift[0])),
    ),
    (
        "shift_dy",
        Column::MaybeReal(|r| r.record.shift_px.map(|shift| shift[1])),
    ),
    ("shift_applied", Column::Flag(|r| r.record.shift_applied)),
    (
        "align_confidence",
        Column::MaybeReal(|r| r.record.align_confidence),
    ),
    ("mask_px", Column::U64(|r| r.record.mask_px)),
    ("saturated_px", Column::U64(|r| r.record.saturated_px)),
    (
        "saturated_fraction",
        Column::Real(|r| r.record.saturated_fraction),
    ),
    (
        "saturated_any_px",
        Column::U64(|r| r.record.saturated_any_px),
    ),
    ("spec_net", Column::Flag(|r| r.record.spec_net)),
    ("mean_r", Column::Real(|r| r.record.mean_rgb[0])),
    ("mean_g", Column::Real(|r| r.record.mean_rgb[1])),
    ("mean_b", Column::Real(|r| r.record.mean_rgb[2])),
    ("sharpness", Column::Real(|r| r.record.sharpness)),
    (
        "exposure_step",
        Column::MaybeReal(|r| r.record.exposure_step),
    ),
    ("identical_to", Column::MaybeU64(|r| r.record.identical_to)),
    ("blur", Column::MaybeReal(|r| r.record.blur)),
    ("png_blake3", Column::Text(|r| r.png_blake3.to_string())),
    ("mask_blake3", Column::Text(|r| r.mask_blake3.to_string())),
];

/// Writes the rows to `out` in the given order.
pub(super) fn write_rows(out: &mut (impl Write + Send), rows: &[TableRow]) -> ParquetResult<()> {
    let lines: String = COLUMNS
        .iter()
        .map(|(name, column)| column.declaration(name))
        .collect();
    let schema = Arc::new(parse_message_type(&format!(
        "message frames {{ {lines} }}"
    ))?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::UNCOMPRESSED)
        .set_created_by(concat!("relit ", env!("CARGO_PKG_VERSION")).to_owned())
        .build();
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (_, column) in &COLUMNS {
        let mut writer = group
            .next_column()?
            .ok_or_else(|| ParquetError::General("the schema lost a column".to_owned()))?;
        write_column(writer.untyped(), column, rows)?;
        writer.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(())
}

fn write_column(
    writer: &mut ColumnWriter<'_>,
    column: &Column,
    rows: &[TableRow],
) -> ParquetResult<()> {
    fn all<T>(rows: &[TableRow], value: impl Fn(&TableRow) -> T) -> Vec<T> {
        rows.iter().map(value).collect()
    }
    match (writer, column) {
        (ColumnWriter::ByteArrayColumnWriter(w), Column::Text(get)) => {
            let values = all(rows, |r| ByteArray::from(get(r).into_bytes()));
            w.write_batch(&values, None, None)
        }
        (ColumnWriter::Int32ColumnWriter(w), Column::U32(get)) => {
            w.write_batch(&all(rows, |r| get(r).cast_signed()), None, None)
        }
        (ColumnWriter::Int32ColumnWriter(w), Column::I32(get)) => {
            w.write_batch(&all(rows, get), None, None)
        }
        (ColumnWriter::Int64ColumnWriter(w), Column::U64(get)) => {
            w.write_batch(&all(rows, |r| get(r).cast_signed()), None, None)
        }
        (ColumnWriter::Int64ColumnWriter(w), Column::I64(get)) => {
            w.write_batch(&all(rows, get), None, None)
        }
        (ColumnWriter::DoubleColumnWriter(w), Column::Real(get)) => {
            w.write_batch(&all(rows, get), None, None)
        }
        (ColumnWriter::DoubleColumnWriter(w), Column::MaybeReal(get)) => {
            let values: Vec<f64> = rows.iter().filter_map(get).collect();
            let present = all(rows, |r| i16::from(get(r).is_some()));
            w.write_batch(&values, Some(&present), None)
        }
        (ColumnWriter::Int64ColumnWriter(w), Column::MaybeU64(get)) => {
            let values: Vec<i64> = rows.iter().filter_map(get).map(u64::cast_signed).collect();
            let present = all(rows, |r| i16::from(get(r).is_some()));
            w.write_batch(&values, Some(&present), None)
        }
        (ColumnWriter::BoolColumnWriter(w), Column::Flag(get)) => {
            w.write_batch(&all(rows, get), None, None)
        }
        _ => Err(ParquetError::General(
            "a column has another type in the schema".to_owned(),
        )),
    }
    .map(|_| ())
}

/// Reads the table that `entry` lists in the data set `out`. A file whose length or BLAKE3 differs
/// is refused before it is parsed, so that the parser never sees damaged data.
///
/// # Errors
/// [`ShardError::Changed`] if the file differs from its entry, [`ShardError::Table`] if it is not Parquet,
/// [`ShardError::TableValue`] if a column is missing or a value is out of range, [`ShardError::Io`],
/// [`ShardError::UnsafePath`].
pub fn read_table(out: &Path, entry: &FileEntry) -> Result<Vec<TableRow>, ShardError> {
    names::check_path(&entry.file)?;
    let path = out.join(&entry.file);
    let io = |doing| ShardError::io(doing, &path);
    let file = File::open(&path).map_err(io("open"))?;
    let mut hashed = HashingReader::new(&file);
    hashed.drain().map_err(io("read"))?;
    compare(&entry.file, (entry.bytes, entry.blake3), hashed.finish())?;
    read_rows(file, &path)
}

/// Parses a table. The parser panics on some files that are not tables. A file with the right digest
/// is only such a file if somebody meant it, but it must not end the program. The panic hook still
/// runs: by default it prints a message to standard error.
fn read_rows(file: File, path: &Path) -> Result<Vec<TableRow>, ShardError> {
    std::panic::catch_unwind(|| parse_rows(file, path)).unwrap_or_else(|_| {
        let source = ParquetError::General("the file is malformed".to_owned());
        Err(ShardError::Table {
            path: path.to_owned(),
            doing: "read",
            source,
        })
    })
}

fn parse_rows(file: File, path: &Path) -> Result<Vec<TableRow>, ShardError> {
    let failed = |source| ShardError::Table {
        path: path.to_owned(),
        doing: "read",
        source,
    };
    let reader = SerializedFileReader::new(file).map_err(failed)?;
    let rows = reader.get_row_iter(None).map_err(failed)?;
    let mut found = Vec::new();
    for (number, row) in rows.enumerate().take(MAX_SAMPLES as usize) {
        let fields = row.map_err(failed)?.into_columns().into_iter().collect();
        found.push(
            Fields {
                path,
                number,
                fields,
            }
            .row()?,
        );
    }
    Ok(found)
}

/// The values of one row by column.
struct Fields<'a> {
    path: &'a Path,
    number: usize,
    fields: HashMap<String, Field>,
}

impl Fields<'_> {
    fn row(&self) -> Result<TableRow, ShardError> {
        let record = FrameRecord {
            session: self.text("session")?,
            object: self.text("object")?,
            index: self.u32("index")?,
            source_frame: self.u64("source_frame")?,
            t_us: self.i64("t_us")?,
            angle_deg: self.maybe_real("angle_deg")?,
            duplicate: self.flag("duplicate")?,
            crop: Rect::new(
                self.i32("crop_x")?,
                self.i32("crop_y")?,
                self.u32("crop_w")?,
                self.u32("crop_h")?,
            ),
            size: [self.u32("size_w")?, self.u32("size_h")?],
            shift_px: match (self.maybe_real("shift_dx")?, self.maybe_real("shift_dy")?) {
                (Some(dx), Some(dy)) => Some([dx, dy]),
                (None, None) => None,
                _ => return Err(self.invalid("shift_dx")),
            },
            shift_applied: self.flag("shift_applied")?,
            align_confidence: self.later_real("align_confidence")?,
            mask_px: self.u64("mask_px")?,
            saturated_px: self.u64("saturated_px")?,
            saturated_fraction: self.real("saturated_fraction")?,
            saturated_any_px: self.u64("saturated_any_px")?,
            spec_net: self.flag("spec_net")?,
            mean_rgb: [
                self.real("mean_r")?,
                self.real("mean_g")?,
                self.real("mean_b")?,
            ],
            sharpness: self.real("sharpness")?,
            exposure_step: self.later_real("exposure_step")?,
            identical_to: self.later_u64("identical_to")?,
            blur: self.later_real("blur")?,
        };
        let png_blake3 = self.digest("png_blake3")?;
        let mask_blake3 = self.digest("mask_blake3")?;
        Ok(TableRow {
            record,
            png_blake3,
            mask_blake3,
        })
    }

    fn get<T>(
        &self,
        column: &'static str,
        read: impl FnOnce(&Field) -> Option<T>,
    ) -> Result<T, ShardError> {
        self.fields
            .get(column)
            .and_then(read)
            .ok_or_else(|| self.invalid(column))
    }

    fn invalid(&self, column: &'static str) -> ShardError {
        ShardError::TableValue {
            path: self.path.to_owned(),
            row: self.number,
            column,
        }
    }

    fn text(&self, column: &'static str) -> Result<String, ShardError> {
        self.get(column, |field| match field {
            Field::Str(text) => Some(text.clone()),
            _ => None,
        })
    }

    fn digest(&self, column: &'static str) -> Result<Digest, ShardError> {
        self.text(column)?.parse().map_err(|_| self.invalid(column))
    }

    fn u32(&self, column: &'static str) -> Result<u32, ShardError> {
        self.get(column, |field| match field {
            Field::UInt(value) => Some(*value),
            _ => None,
        })
    }

    fn i32(&self, column: &'static str) -> Result<i32, ShardError> {
        self.get(column, |field| match field {
            Field::Int(value) => Some(*value),
            _ => None,
        })
    }

    fn u64(&self, column: &'static str) -> Result<u64, ShardError> {
        self.get(column, |field| match field {
            Field::ULong(value) => Some(*value),
            _ => None,
        })
    }

    fn i64(&self, column: &'static str) -> Result<i64, ShardError> {
        self.get(column, |field| match field {
            Field::Long(value) => Some(*value),
            _ => None,
        })
    }

    fn real(&self, column: &'static str) -> Result<f64, ShardError> {
        self.get(column, |field| match field {
            Field::Double(value) => Some(*value),
            _ => None,
        })
    }

    fn maybe_real(&self, column: &'static str) -> Result<Option<f64>, ShardError> {
        self.get(column, |field| match field {
            Field::Double(value) => Some(Some(*value)),
            Field::Null => Some(None),
            _ => None,
        })
    }

    /// A value that tables of earlier versions do not have.
    fn later_real(&self, column: &'static str) -> Result<Option<f64>, ShardError> {
        match self.fields.contains_key(column) {
            true => self.maybe_real(column),
            false => Ok(None),
        }
    }

    /// As [`later_real`](Self::later_real).
    fn later_u64(&self, column: &'static str) -> Result<Option<u64>, ShardError> {
        match self.fields.get(column) {
            None | Some(Field::Null) => Ok(None),
            Some(Field::ULong(value)) => Ok(Some(*value)),
            Some(_) => Err(self.invalid(column)),
        }
    }

    fn flag(&self, column: &'static str) -> Result<bool, ShardError> {
        self.get(column, |field| match field {
            Field::Bool(value) => Some(*value),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(index: u32) -> TableRow {
        let even = index.is_multiple_of(2);
        TableRow {
            record: FrameRecord {
                session: "s".to_owned(),
                object: "mug \"ö\"".to_owned(),
                index,
                source_frame: u64::MAX - u64::from(index),
                t_us: -5 - i64::from(index),
                angle_deg: even.then_some(0.1 * f64::from(index)),
                duplicate: even,
                crop: Rect::new(-3, i32::MIN, u32::MAX, 7),
                size: [256, 255],
                shift_px: (!even).then_some([0.25, -1.0 / 3.0]),
                shift_applied: !even,
                align_confidence: (!even).then_some(0.75),
                mask_px: 1 << 40,
                saturated_px: 3,
                saturated_fraction: 3.0 / 7.0,
                saturated_any_px: 4,
                spec_net: even,
                mean_rgb: [1.1, 2.2, 1e-300],
                sharpness: 12.5,
                exposure_step: even.then_some(-0.5),
                identical_to: even.then_some(u64::MAX),
                blur: (!even).then_some(1.25),
            },
            png_blake3: Digest::of(&index.to_le_bytes()),
            mask_blake3: Digest::of(b"mask"),
        }
    }

    fn written(rows: &[TableRow]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_rows(&mut bytes, rows).unwrap();
        bytes
    }

    fn on_disk(bytes: &[u8]) -> (tempfile::TempDir, FileEntry) {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("s.parquet"), bytes).unwrap();
        let blake3 = Digest::of(bytes);
        (
            dir,
            FileEntry {
                file: "s.parquet".to_owned(),
                bytes: bytes.len() as u64,
                blake3,
            },
        )
    }

    #[test]
    fn every_value_comes_back_and_the_bytes_are_the_same_each_time() {
        let rows: Vec<TableRow> = (0..50).map(row).collect();
        let bytes = written(&rows);
        assert_eq!(bytes, written(&rows));
        let (dir, entry) = on_disk(&bytes);
        assert_eq!(read_table(dir.path(), &entry).unwrap(), rows);
    }

    #[test]
    fn a_flipped_byte_anywhere_is_refused() {
        let bytes = written(&[row(0), row(1)]);
        let (dir, entry) = on_disk(&bytes);
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            std::fs::write(dir.path().join("s.parquet"), damaged).unwrap();
            let error = read_table(dir.path(), &entry).unwrap_err();
            assert!(matches!(error, ShardError::Changed { .. }), "{at}: {error}");
        }
    }

    #[test]
    fn a_file_with_the_right_digest_that_is_not_a_table_is_an_error() {
        let (dir, entry) = on_disk(b"PAR1 and nothing that belongs to it PAR1");
        assert!(matches!(
            read_table(dir.path(), &entry),
            Err(ShardError::Table { .. })
        ));
    }
}
