//! The table of a library: `.csv` with a line for each object and panorama, and `.md` with the facts for model cards.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

use relit_data::durable::write_whole;

use super::{LibraryEntry, LibrarySummary};
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

/// Writes both tables beside a library's file.
pub(super) fn write_tables(
    library: &Path,
    rows: &[Row],
    summary: &LibrarySummary,
) -> Result<(), SynthError> {
    for (extension, text) in [("csv", csv(rows)), ("md", markdown(rows, summary))] {
        let path = library.with_extension(extension);
        write_whole(&path, text.as_bytes()).map_err(SynthError::write(&path))?;
    }
    Ok(())
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

fn markdown(rows: &[Row], summary: &LibrarySummary) -> String {
    /// Training, validation, left out, and authors of what is used.
    #[derive(Default)]
    struct Group<'a> {
        counts: [usize; 3],
        authors: BTreeSet<&'a str>,
    }
    let mut groups: BTreeMap<(&str, &str, &str), Group<'_>> = BTreeMap::new();
    for row in rows {
        let entry = &row.entry;
        let key = (row.kind, entry.origin.as_str(), entry.licence.as_str());
        let group = groups.entry(key).or_default();
        let place = match row.part() {
            "training" => 0,
            "validation" => 1,
            _ => 2,
        };
        group.counts[place] += 1;
        if !row.is_left_out {
            group.authors.insert(&entry.author);
        }
    }
    let mut text = "# What the library holds\n\n\
        | kind | origin | licence | training | validation | left out | authors |\n\
        | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for ((kind, origin, licence), group) in groups {
        let [training, validation, left_out] = group.counts;
        let authors: Vec<&str> = group.authors.into_iter().collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {kind} | {} | {} | {training} | {validation} | {left_out} | {} |",
            cell(origin),
            cell(licence),
            cell(&authors.join(", "))
        );
    }
    text.push_str("\nLeft out:\n\n");
    for (reason, count) in &summary.left_out {
        let _ = writeln!(text, "- {count} {reason}");
    }
    text
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace(['\r', '\n'], " ")
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
