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
use serde_json::{Map, Value};

use super::digest::{Digest, Hashing};
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

/// The type of a column's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Text,
    U32,
    I32,
    U64,
    I64,
    Real,
    MaybeReal,
    MaybeU64,
    Flag,
}

/// All columns, in the order of the file. Their values are those of the record as JSON.
const COLUMNS: [(&str, Kind); 32] = [
    ("session", Kind::Text),
    ("object", Kind::Text),
    ("index", Kind::U32),
    ("source_frame", Kind::U64),
    ("t_us", Kind::I64),
    ("angle_deg", Kind::MaybeReal),
    ("duplicate", Kind::Flag),
    ("crop_x", Kind::I32),
    ("crop_y", Kind::I32),
    ("crop_w", Kind::U32),
    ("crop_h", Kind::U32),
    ("size_w", Kind::U32),
    ("size_h", Kind::U32),
    ("shift_dx", Kind::MaybeReal),
    ("shift_dy", Kind::MaybeReal),
    ("shift_applied", Kind::Flag),
    ("align_confidence", Kind::MaybeReal),
    ("shift_interpolated_sd_px", Kind::MaybeReal),
    ("mask_px", Kind::U64),
    ("saturated_px", Kind::U64),
    ("saturated_fraction", Kind::Real),
    ("saturated_any_px", Kind::U64),
    ("spec_net", Kind::Flag),
    ("mean_r", Kind::Real),
    ("mean_g", Kind::Real),
    ("mean_b", Kind::Real),
    ("sharpness", Kind::Real),
    ("exposure_step", Kind::MaybeReal),
    ("identical_to", Kind::MaybeU64),
    ("blur", Kind::MaybeReal),
    ("png_blake3", Kind::Text),
    ("mask_blake3", Kind::Text),
];

/// Fields of the record that are lists, whose numbers have columns of their own.
const LISTS: [(&str, &[&str]); 4] = [
    ("crop", &["crop_x", "crop_y", "crop_w", "crop_h"]),
    ("size", &["size_w", "size_h"]),
    ("shift_px", &["shift_dx", "shift_dy"]),
    ("mean_rgb", &["mean_r", "mean_g", "mean_b"]),
];

impl Kind {
    /// The column's line in the schema.
    fn declaration(self, name: &str) -> String {
        match self {
            Self::Text => format!("required binary {name} (string);"),
            Self::U32 => format!("required int32 {name} (integer(32,false));"),
            Self::I32 => format!("required int32 {name} (integer(32,true));"),
            Self::U64 => format!("required int64 {name} (integer(64,false));"),
            Self::I64 => format!("required int64 {name} (integer(64,true));"),
            Self::Real => format!("required double {name};"),
            Self::MaybeReal => format!("optional double {name};"),
            Self::MaybeU64 => format!("optional int64 {name} (integer(64,false));"),
            Self::Flag => format!("required boolean {name};"),
        }
    }

    fn is_optional(self) -> bool {
        matches!(self, Self::MaybeReal | Self::MaybeU64)
    }

    /// The value of a field of a table; `None` if it has another type.
    fn value_of(self, field: &Field) -> Option<Value> {
        Some(match (self, field) {
            (Self::Text, Field::Str(text)) => text.as_str().into(),
            (Self::U32, &Field::UInt(value)) => value.into(),
            (Self::I32, &Field::Int(value)) => value.into(),
            (Self::U64 | Self::MaybeU64, &Field::ULong(value)) => value.into(),
            (Self::I64, &Field::Long(value)) => value.into(),
            (Self::Real | Self::MaybeReal, &Field::Double(value)) => value.into(),
            (Self::MaybeReal | Self::MaybeU64, Field::Null) => Value::Null,
            (Self::Flag, &Field::Bool(value)) => value.into(),
            _ => return None,
        })
    }
}

/// The values of a row by column.
fn values_of(row: &TableRow) -> ParquetResult<Map<String, Value>> {
    let record = serde_json::to_value(&row.record);
    let Value::Object(mut values) = record.map_err(|e| ParquetError::External(e.into()))? else {
        return Err(ParquetError::General(
            "a record is not an object".to_owned(),
        ));
    };
    for (field, columns) in LISTS {
        let list = values.remove(field).unwrap_or_default();
        for (at, column) in columns.iter().enumerate() {
            let value = list.get(at).cloned().unwrap_or_default();
            values.insert((*column).to_owned(), value);
        }
    }
    for (column, digest) in [
        ("png_blake3", row.png_blake3),
        ("mask_blake3", row.mask_blake3),
    ] {
        values.insert(column.to_owned(), digest.to_string().into());
    }
    Ok(values)
}

/// Writes the rows to `out` in the given order.
pub(super) fn write_rows(out: &mut (impl Write + Send), rows: &[TableRow]) -> ParquetResult<()> {
    let lines = COLUMNS.map(|(name, kind)| kind.declaration(name)).concat();
    let schema = Arc::new(parse_message_type(&format!(
        "message frames {{ {lines} }}"
    ))?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::UNCOMPRESSED)
        .set_created_by(concat!("relit ", env!("CARGO_PKG_VERSION")).to_owned())
        .build();
    let rows: Vec<Map<String, Value>> = rows.iter().map(values_of).collect::<ParquetResult<_>>()?;
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (name, kind) in COLUMNS {
        let mut writer = group
            .next_column()?
            .ok_or_else(|| ParquetError::General("the schema lost a column".to_owned()))?;
        let values: Vec<&Value> = rows
            .iter()
            .map(|row| row.get(name).unwrap_or(&Value::Null))
            .collect();
        write_column(writer.untyped(), kind, &values)?;
        writer.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(())
}

fn write_column(writer: &mut ColumnWriter<'_>, kind: Kind, values: &[&Value]) -> ParquetResult<()> {
    /// What is null is left out: in a column that needs each value, the library notices that.
    fn all<T>(values: &[&Value], value: impl Fn(&Value) -> Option<T>) -> Vec<T> {
        values.iter().filter_map(|found| value(found)).collect()
    }
    let present = all(values, |value| Some(i16::from(!value.is_null())));
    let present = kind.is_optional().then_some(present.as_slice());
    let long = |value: &Value| {
        value
            .as_i64()
            .or_else(|| value.as_u64().map(u64::cast_signed))
    };
    match writer {
        ColumnWriter::ByteArrayColumnWriter(w) => {
            let texts = all(values, |value| value.as_str().map(ByteArray::from));
            w.write_batch(&texts, present, None)
        }
        ColumnWriter::Int32ColumnWriter(w) => {
            let numbers = all(values, |value| long(value).map(|number| number as i32));
            w.write_batch(&numbers, present, None)
        }
        ColumnWriter::Int64ColumnWriter(w) => w.write_batch(&all(values, long), present, None),
        ColumnWriter::DoubleColumnWriter(w) => {
            w.write_batch(&all(values, Value::as_f64), present, None)
        }
        ColumnWriter::BoolColumnWriter(w) => {
            w.write_batch(&all(values, Value::as_bool), present, None)
        }
        _ => {
            let text = "a column has another type in the schema".to_owned();
            return Err(ParquetError::General(text));
        }
    }
    .map(|_| ())
}

/// Reads the table that `entry` lists in the data set `out`. A file whose length or BLAKE3 differs
/// is refused before it is parsed, so that the parser never sees damaged data.
///
/// # Errors
/// [`ShardError::Changed`] if the file differs from its entry, [`ShardError::Table`] if it is not Parquet, a column
/// is missing or a value is out of range, [`ShardError::Io`], [`ShardError::Refused`].
pub fn read_table(out: &Path, entry: &FileEntry) -> Result<Vec<TableRow>, ShardError> {
    names::check_path(&entry.file)?;
    let path = out.join(&entry.file);
    let io = |doing| ShardError::io(doing, &path);
    let file = File::open(&path).map_err(io("open"))?;
    let mut hashed = Hashing::new(&file);
    hashed.drain().map_err(io("read"))?;
    compare(&entry.file, (entry.bytes, entry.blake3), hashed.digest())?;
    read_rows(file, &path)
}

/// Parses a table. The parser panics on some files that are not tables. A file with the right digest
/// is only such a file if somebody meant it, but it must not end the program. The panic hook still
/// runs: by default it prints a message to standard error.
fn read_rows(file: File, path: &Path) -> Result<Vec<TableRow>, ShardError> {
    let parsed = std::panic::catch_unwind(|| parse_rows(file))
        .unwrap_or_else(|_| Err(ParquetError::General("the file is malformed".to_owned())));
    parsed.map_err(|source| ShardError::Table {
        path: path.to_owned(),
        doing: "read",
        source,
    })
}

fn parse_rows(file: File) -> ParquetResult<Vec<TableRow>> {
    let reader = SerializedFileReader::new(file)?;
    let rows = reader.get_row_iter(None)?;
    let mut found = Vec::new();
    for (number, row) in rows.enumerate().take(MAX_SAMPLES as usize) {
        let fields = row?.into_columns().into_iter().collect();
        let wrong = |what| ParquetError::General(format!("row {number} has {what}"));
        found.push(row_of(&fields).map_err(wrong)?);
    }
    Ok(found)
}

/// The row with these values, or what is wrong with them.
fn row_of(fields: &HashMap<String, Field>) -> Result<TableRow, String> {
    let mut values = Map::new();
    for (name, kind) in COLUMNS {
        let value = fields.get(name).and_then(|field| kind.value_of(field));
        let value = value.ok_or_else(|| format!("no valid {name}"))?;
        values.insert(name.to_owned(), value);
    }
    for (field, columns) in LISTS {
        let list: Vec<Value> = columns.iter().filter_map(|at| values.remove(*at)).collect();
        let is_null = list.iter().all(Value::is_null);
        values.insert(
            field.to_owned(),
            if is_null { Value::Null } else { list.into() },
        );
    }
    let mut digest = |name: &str| {
        let digest = values.remove(name).unwrap_or_default();
        serde_json::from_value(digest).map_err(|error| error.to_string())
    };
    let (png_blake3, mask_blake3) = (digest("png_blake3")?, digest("mask_blake3")?);
    let record = serde_json::from_value(values.into());
    Ok(TableRow {
        record: record.map_err(|error| error.to_string())?,
        png_blake3,
        mask_blake3,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rect;
    use crate::image_stats::Measures;
    use crate::spec_net_gate::SPEC_NET_GATE;

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
                source_frame: u64::MAX - u64::from(index),
                t_us: -5 - i64::from(index),
                angle_deg: even.then_some(0.1 * f64::from(index)),
                size: [256, 255],
                shift_px: (!even).then_some([0.25, -1.0 / 3.0]),
                shift_applied: !even,
                align_confidence: (!even).then_some(0.75),
                shift_interpolated_sd_px: (!even).then_some(0.3),
                ..FrameRecord::new("s", "mug \"ö\"", index, crop, &measures, SPEC_NET_GATE)
            },
            png_blake3: Digest::hash(&index.to_le_bytes()),
            mask_blake3: Digest::hash(b"mask"),
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
        let blake3 = Digest::hash(bytes);
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
    fn every_column_is_needed_and_both_numbers_of_a_shift() {
        let field = |(name, kind)| match kind {
            Kind::Text if name == "session" || name == "object" => Field::Str("s".to_owned()),
            Kind::Text => Field::Str(Digest::hash(b"x").to_string()),
            Kind::U32 => Field::UInt(1),
            Kind::I32 => Field::Int(1),
            Kind::U64 | Kind::MaybeU64 => Field::ULong(1),
            Kind::I64 => Field::Long(1),
            Kind::Real | Kind::MaybeReal => Field::Double(0.5),
            Kind::Flag => Field::Bool(true),
        };
        let whole: HashMap<String, Field> = COLUMNS
            .map(|column| (column.0.to_owned(), field(column)))
            .into();
        let with = |name: &str, field| {
            let mut fields = whole.clone();
            fields.insert(name.to_owned(), field);
            row_of(&fields)
        };
        assert_eq!(row_of(&whole).unwrap().record.shift_px, Some([0.5; 2]));
        for (name, kind) in COLUMNS {
            let mut fields = whole.clone();
            fields.remove(name);
            assert_eq!(row_of(&fields), Err(format!("no valid {name}")));
            let is_shift = name.starts_with("shift_d");
            assert_eq!(
                with(name, Field::Null).is_ok(),
                kind.is_optional() && !is_shift,
                "{name}"
            );
        }
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
