//! The table of a library: `.csv` with a line for each object and panorama.

use std::path::Path;

use relit_data::durable::write_whole;

use super::LibraryEntry;
use crate::SynthError;

const COLUMNS: &str = "kind,name,title,category,author,licence,origin,part,triangles,note\n";

/// An object or a panorama, and whether it was packed.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) kind: &'static str,
    pub(super) entry: LibraryEntry,
    pub(super) is_left_out: bool,
    pub(super) triangles: usize,
    pub(super) note: String,
}

impl Row {
    pub(super) fn new(kind: &'static str, entry: &LibraryEntry) -> Self {
        Self {
            kind,
            entry: entry.clone(),
            is_left_out: false,
            triangles: 0,
            note: String::new(),
        }
    }

    fn part(&self) -> &'static str {
        match (self.is_left_out, self.entry.is_for_validation) {
            (true, _) => "left out",
            (_, true) => "validation",
            _ => "training",
        }
    }
}

/// Writes the table beside a library's file.
pub(super) fn write_table(library: &Path, rows: &[Row]) -> Result<(), SynthError> {
    let path = library.with_extension("csv");
    write_whole(&path, csv(rows).as_bytes()).map_err(SynthError::write(&path))
}

fn csv(rows: &[Row]) -> String {
    let mut text = COLUMNS.to_owned();
    for row in rows {
        let entry = &row.entry;
        let triangles = match row.triangles {
            0 => String::new(),
            count => count.to_string(),
        };
        let fields = [
            row.kind,
            &entry.name,
            &entry.title,
            &entry.category,
            &entry.author,
            &entry.licence,
            &entry.origin,
            row.part(),
            &triangles,
            &row.note,
        ];
        text.push_str(&fields.map(quoted).join(","));
        text.push('\n');
    }
    text
}

/// A field as RFC 4180 has it; line breaks become spaces.
fn quoted(field: &str) -> String {
    let field = field.replace(['\r', '\n'], " ");
    if field.contains([',', '"']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_with_commas_and_quotes_are_quoted() {
        assert_eq!(quoted("a b"), "a b");
        assert_eq!(quoted("a, \"b\"\nc"), "\"a, \"\"b\"\" c\"");
    }
}
