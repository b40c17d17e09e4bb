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

/// A column: its name, and how its value is taken from a row and put into one.
struct Column {
    name: &'static str,
    /// True if tables of earlier versions lack it. It is null then.
    is_later: bool,
    kind: Kind,
}

/// The type of a column's values, and where in a row they are.
enum Kind {
    Text(Access<String>),
    Hash(Access<Digest>),
    U32(Access<u32>),
    I32(Access<i32>),
    U64(Access<u64>),
    I64(Access<i64>),
    Real(Access<f64>),
    MaybeReal(Access<Option<f64>>),
    MaybeU64(Access<Option<u64>>),
    Flag(Access<bool>),
}

/// How a value is taken from a row, and how one is put into it: false where it contradicts what the row has already.
struct Access<T> {
    get: fn(&TableRow) -> T,
    set: fn(&mut TableRow, T) -> bool,
}

/// `column!(KIND "name": PLACE)` is the column of the value at that place of a row; `KIND?` is one that tables of earlier
/// versions lack.
macro_rules! column {
    ($kind:ident $name:literal: $($place:tt)+) => {
        column!($kind, $name, false, $($place)+)
    };
    ($kind:ident? $name:literal: $($place:tt)+) => {
        column!($kind, $name, true, $($place)+)
    };
    ($kind:ident, $name:literal, $is_later:literal, $($place:tt)+) => {
        Column {
            name: $name,
            is_later: $is_later,
            kind: Kind::$kind(Access {
                get: |row| row.$($place)+.to_owned(),
                set: |row, value| {
                    row.$($place)+ = value;
                    true
                },
            }),
        }
    };
}

/// All columns, in the order of the file, for writing and for reading.
const COLUMNS: [Column; 32] = [
    column!(Text "session": record.session),
    column!(Text "object": record.object),
    column!(U32 "index": record.index),
    column!(U64 "source_frame": record.source_frame),
    column!(I64 "t_us": record.t_us),
    column!(MaybeReal "angle_deg": record.angle_deg),
    column!(Flag "duplicate": record.duplicate),
    column!(I32 "crop_x": record.crop.x),
    column!(I32 "crop_y": record.crop.y),
    column!(U32 "crop_w": record.crop.w),
    column!(U32 "crop_h": record.crop.h),
    column!(U32 "size_w": record.size[0]),
    column!(U32 "size_h": record.size[1]),
    Column {
        name: "shift_dx",
        is_later: false,
        kind: Kind::MaybeReal(Access {
            get: |row| row.record.shift_px.map(|[dx, _]| dx),
            set: |row, dx| {
                row.record.shift_px = dx.map(|dx| [dx, 0.0]);
                true
            },
        }),
    },
    Column {
        name: "shift_dy",
        is_later: false,
        kind: Kind::MaybeReal(Access {
            get: |row| row.record.shift_px.map(|[_, dy]| dy),
            set: |row, dy| match (&mut row.record.shift_px, dy) {
                (Some(shift), Some(dy)) => {
                    shift[1] = dy;
                    true
                }
                (shift, dy) => shift.is_none() && dy.is_none(),
            },
        }),
    },
    column!(Flag "shift_applied": record.shift_applied),
    column!(MaybeReal? "align_confidence": record.align_confidence),
    column!(MaybeReal? "shift_interpolated_sd_px": record.shift_interpolated_sd_px),
    column!(U64 "mask_px": record.mask_px),
    column!(U64 "saturated_px": record.saturated_px),
    column!(Real "saturated_fraction": record.saturated_fraction),
    column!(U64 "saturated_any_px": record.saturated_any_px),
    column!(Flag "spec_net": record.spec_net),
    column!(Real "mean_r": record.mean_rgb[0]),
    column!(Real "mean_g": record.mean_rgb[1]),
    column!(Real "mean_b": record.mean_rgb[2]),
    column!(Real "sharpness": record.sharpness),
    column!(MaybeReal? "exposure_step": record.exposure_step),
    column!(MaybeU64? "identical_to": record.identical_to),
    column!(MaybeReal? "blur": record.blur),
    column!(Hash "png_blake3": png_blake3),
    column!(Hash "mask_blake3": mask_blake3),
];

impl Column {
    /// The column's line in the schema.
    fn declaration(&self) -> String {
        let name = self.name;
        match self.kind {
            Kind::Text(_) | Kind::Hash(_) => format!("required binary {name} (string);"),
            Kind::U32(_) => format!("required int32 {name} (integer(32,false));"),
            Kind::I32(_) => format!("required int32 {name} (integer(32,true));"),
            Kind::U64(_) => format!("required int64 {name} (integer(64,false));"),
            Kind::I64(_) => format!("required int64 {name} (integer(64,true));"),
            Kind::Real(_) => format!("required double {name};"),
            Kind::MaybeReal(_) => format!("optional double {name};"),
            Kind::MaybeU64(_) => format!("optional int64 {name} (integer(64,false));"),
            Kind::Flag(_) => format!("required boolean {name};"),
        }
    }

    /// Puts the value of a field of a table into the row; false if there is no valid one.
    fn read(&self, field: Option<&Field>, row: &mut TableRow) -> bool {
        let Some(field) = field else {
            return self.is_later;
        };
        match (&self.kind, field) {
            (Kind::Text(at), Field::Str(text)) => (at.set)(row, text.clone()),
            (Kind::Hash(at), Field::Str(text)) => {
                text.parse().is_ok_and(|digest| (at.set)(row, digest))
            }
            (Kind::U32(at), &Field::UInt(value)) => (at.set)(row, value),
            (Kind::I32(at), &Field::Int(value)) => (at.set)(row, value),
            (Kind::U64(at), &Field::ULong(value)) => (at.set)(row, value),
            (Kind::I64(at), &Field::Long(value)) => (at.set)(row, value),
            (Kind::Real(at), &Field::Double(value)) => (at.set)(row, value),
            (Kind::MaybeReal(at), &Field::Double(value)) => (at.set)(row, Some(value)),
            (Kind::MaybeReal(at), Field::Null) => (at.set)(row, None),
            (Kind::MaybeU64(at), &Field::ULong(value)) => (at.set)(row, Some(value)),
            (Kind::MaybeU64(at), Field::Null) => (at.set)(row, None),
            (Kind::Flag(at), &Field::Bool(value)) => (at.set)(row, value),
            _ => false,
        }
    }
}

/// Writes the rows to `out` in the given order.
pub(super) fn write_rows(out: &mut (impl Write + Send), rows: &[TableRow]) -> ParquetResult<()> {
    let lines: String = COLUMNS.iter().map(Column::declaration).collect();
    let schema = Arc::new(parse_message_type(&format!(
        "message frames {{ {lines} }}"
    ))?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::UNCOMPRESSED)
        .set_created_by(concat!("relit ", env!("CARGO_PKG_VERSION")).to_owned())
        .build();
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for column in &COLUMNS {
        let mut writer = group
            .next_column()?
            .ok_or_else(|| ParquetError::General("the schema lost a column".to_owned()))?;
        write_column(writer.untyped(), &column.kind, rows)?;
        writer.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(())
}

fn write_column(
    writer: &mut ColumnWriter<'_>,
    kind: &Kind,
    rows: &[TableRow],
) -> ParquetResult<()> {
    fn all<T>(rows: &[TableRow], value: impl Fn(&TableRow) -> T) -> Vec<T> {
        rows.iter().map(value).collect()
    }
    let text = |value: String| ByteArray::from(value.into_bytes());
    match (writer, kind) {
        (ColumnWriter::ByteArrayColumnWriter(w), Kind::Text(at)) => {
            w.write_batch(&all(rows, |row| text((at.get)(row))), None, None)
        }
        (ColumnWriter::ByteArrayColumnWriter(w), Kind::Hash(at)) => w.write_batch(
            &all(rows, |row| text((at.get)(row).to_string())),
            None,
            None,
        ),
        (ColumnWriter::Int32ColumnWriter(w), Kind::U32(at)) => {
            w.write_batch(&all(rows, |row| (at.get)(row).cast_signed()), None, None)
        }
        (ColumnWriter::Int32ColumnWriter(w), Kind::I32(at)) => {
            w.write_batch(&all(rows, at.get), None, None)
        }
        (ColumnWriter::Int64ColumnWriter(w), Kind::U64(at)) => {
            w.write_batch(&all(rows, |row| (at.get)(row).cast_signed()), None, None)
        }
        (ColumnWriter::Int64ColumnWriter(w), Kind::I64(at)) => {
            w.write_batch(&all(rows, at.get), None, None)
        }
        (ColumnWriter::DoubleColumnWriter(w), Kind::Real(at)) => {
            w.write_batch(&all(rows, at.get), None, None)
        }
        (ColumnWriter::DoubleColumnWriter(w), Kind::MaybeReal(at)) => {
            let values: Vec<f64> = rows.iter().filter_map(at.get).collect();
            let present = all(rows, |row| i16::from((at.get)(row).is_some()));
            w.write_batch(&values, Some(&present), None)
        }
        (ColumnWriter::Int64ColumnWriter(w), Kind::MaybeU64(at)) => {
            let values: Vec<i64> = rows
                .iter()
                .filter_map(at.get)
                .map(u64::cast_signed)
                .collect();
            let present = all(rows, |row| i16::from((at.get)(row).is_some()));
            w.write_batch(&values, Some(&present), None)
        }
        (ColumnWriter::BoolColumnWriter(w), Kind::Flag(at)) => {
            w.write_batch(&all(rows, at.get), None, None)
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
        let row = row_of(&fields).map_err(|column| ShardError::TableValue {
            path: path.to_owned(),
            row: number,
            column,
        })?;
        found.push(row);
    }
    Ok(found)
}

/// The row with these values, or the column without a valid one.
fn row_of(fields: &HashMap<String, Field>) -> Result<TableRow, &'static str> {
    let mut row = TableRow {
        record: FrameRecord::empty(),
        png_blake3: Digest::of(&[]),
        mask_blake3: Digest::of(&[]),
    };
    for column in &COLUMNS {
        if !column.read(fields.get(column.name), &mut row) {
            return Err(column.name);
        }
    }
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;
    use crate::image_stats::{Measures, SPEC_NET_GATE};

    fn row(index: u32) -> TableRow {
        let even = index.is_multiple_of(2);
        let crop = Rect::new(-3, i32::MIN, u32::MAX, 7);
        let measures = Measures {
            mask_px: 1 << 40,
            saturated_px: 3,
            saturated_any_px: 4,
            mean_rgb: [1.1, 2.2, 1e-300],
            sharpness: 12.5,
        };
        TableRow {
            record: FrameRecord {
                duplicate: even,
                spec_net: even,
                exposure_step: even.then_some(-0.5),
                identical_to: even.then_some(u64::MAX),
                blur: (!even).then_some(1.25),
                ..FrameRecord::new("s", "mug \"ö\"", index, crop, &measures, SPEC_NET_GATE)
                    .of_frame(
                        u64::MAX - u64::from(index),
                        -5 - i64::from(index),
                        even.then_some(0.1 * f64::from(index)),
                    )
                    .scaled_to([256, 255])
                    .aligned(
                        (!even).then_some([0.25, -1.0 / 3.0]),
                        !even,
                        (!even).then_some(0.75),
                    )
                    .interpolated((!even).then_some(0.3))
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
    fn a_shift_of_which_one_number_is_missing_is_refused() {
        let mut fields: HashMap<String, Field> = HashMap::new();
        let mut read = |name: &str, field| {
            fields.insert(name.to_owned(), field);
            row_of(&fields)
        };
        for column in &COLUMNS {
            let field = match column.kind {
                Kind::Text(_) => Field::Str("s".to_owned()),
                Kind::Hash(_) => Field::Str(Digest::of(b"x").to_string()),
                Kind::U32(_) => Field::UInt(1),
                Kind::I32(_) => Field::Int(1),
                Kind::U64(_) | Kind::MaybeU64(_) => Field::ULong(1),
                Kind::I64(_) => Field::Long(1),
                Kind::Real(_) | Kind::MaybeReal(_) => Field::Double(0.5),
                Kind::Flag(_) => Field::Bool(true),
            };
            let _ = read(column.name, field);
        }
        assert_eq!(
            read("mean_r", Field::Double(0.5)).unwrap().record.shift_px,
            Some([0.5; 2])
        );
        assert_eq!(read("shift_dy", Field::Null), Err("shift_dy"));
        assert!(read("shift_dx", Field::Null).is_ok());
        assert_eq!(read("shift_dy", Field::Double(0.5)), Err("shift_dy"));
    }

    #[test]
    fn only_a_column_that_later_versions_added_may_be_missing() {
        let needed: Vec<&str> = COLUMNS
            .iter()
            .filter(|column| !column.read(None, &mut row(0)))
            .map(|column| column.name)
            .collect();
        assert_eq!(needed.len(), COLUMNS.len() - 5);
        assert!(needed.contains(&"angle_deg") && !needed.contains(&"blur"));
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
