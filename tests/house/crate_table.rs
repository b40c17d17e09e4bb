//! The table of crates in docs/architecture.md against the manifests: which crates there are, where
//! they are, and which others each knows.

use std::collections::{BTreeMap, BTreeSet};

/// What the table and the manifests both say about a crate.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CrateFacts {
    /// Its name.
    pub(crate) name: String,
    /// Its folder, from the root of the workspace.
    pub(crate) folder: String,
    /// The crates of the workspace that it knows.
    pub(crate) knows: BTreeSet<String>,
}

/// The rows of all tables with the columns `crate`, `folder` and `knows`.
pub(crate) fn rows(document: &str) -> Vec<CrateFacts> {
    let mut columns: Option<Columns> = None;
    let mut rows = Vec::new();
    for line in document.lines() {
        let Some(cells) = cells(line) else {
            columns = None;
            continue;
        };
        match &columns {
            None => columns = Some(Columns::from_header(&cells)),
            Some(columns) => rows.extend(columns.read(&cells)),
        }
    }
    rows
}

/// Where the table and the manifests differ.
pub(crate) fn findings(document: &str, table: &[CrateFacts], found: &[CrateFacts]) -> Vec<String> {
    let known: BTreeMap<&str, &CrateFacts> =
        table.iter().map(|row| (row.name.as_str(), row)).collect();
    let mut findings = Vec::new();
    let mut report = |what: String| findings.push(what);
    for facts in found {
        let name = &facts.name;
        let Some(row) = known.get(name.as_str()) else {
            report(format!(
                "{document} has no row for the crate `{name}` in {}/",
                facts.folder
            ));
            continue;
        };
        if row.folder != facts.folder {
            report(format!(
                "`{name}` is in {}/, and {document} says in {}/",
                facts.folder, row.folder
            ));
        }
        for other in facts.knows.difference(&row.knows) {
            report(format!(
                "`{name}` depends on `{other}`, which {document} does not let it know"
            ));
        }
        for other in row.knows.difference(&facts.knows) {
            report(format!(
                "`{name}` does not depend on `{other}`, which {document} lets it know"
            ));
        }
    }
    for row in table
        .iter()
        .filter(|row| !found.iter().any(|facts| facts.name == row.name))
    {
        report(format!(
            "{document} has a row for `{}`, which is no crate",
            row.name
        ));
    }
    findings
}

/// The positions of the columns that count; a table without them is another one.
#[derive(Default)]
struct Columns {
    name: Option<usize>,
    folder: Option<usize>,
    knows: Option<usize>,
}

impl Columns {
    fn from_header(header: &[&str]) -> Self {
        let position = |title: &str| header.iter().position(|cell| *cell == title);
        Self {
            name: position("crate"),
            folder: position("folder"),
            knows: position("knows"),
        }
    }

    fn read(&self, cells: &[&str]) -> Option<CrateFacts> {
        let name = quoted(cells.get(self.name?)?).next()?.to_owned();
        let folder = quoted(cells.get(self.folder?)?)
            .next()?
            .trim_end_matches('/')
            .to_owned();
        let knows = quoted(cells.get(self.knows?)?).map(str::to_owned).collect();
        Some(CrateFacts {
            name,
            folder,
            knows,
        })
    }
}

fn cells(line: &str) -> Option<Vec<&str>> {
    let inner = line.trim().strip_prefix('|')?;
    Some(
        inner
            .strip_suffix('|')
            .unwrap_or(inner)
            .split('|')
            .map(str::trim)
            .collect(),
    )
}

/// What stands in backticks.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "
| crate | folder | purpose | knows |
| --- | --- | --- | --- |
| `top` | `src/top/` | programs | `middle`, `data` |
| `data` | `src/data/` | files | |

| crate | module |
| --- | --- |
| `top` | `cli` |
";

    fn facts(name: &str, folder: &str, knows: &[&str]) -> CrateFacts {
        CrateFacts {
            name: name.to_owned(),
            folder: folder.to_owned(),
            knows: knows.iter().map(|name| (*name).to_owned()).collect(),
        }
    }

    fn findings_of(found: &[CrateFacts]) -> Vec<String> {
        findings("table.md", &rows(TABLE), found)
    }

    #[test]
    fn a_table_is_read_by_the_titles_of_its_columns() {
        assert_eq!(
            rows(TABLE),
            [
                facts("top", "src/top", &["data", "middle"]),
                facts("data", "src/data", &[])
            ]
        );
    }

    #[test]
    fn manifests_as_in_the_table_are_no_finding() {
        let found = [
            facts("data", "src/data", &[]),
            facts("top", "src/top", &["data", "middle"]),
        ];
        assert_eq!(findings_of(&found), [""; 0]);
    }

    #[test]
    fn every_difference_is_a_finding() {
        let found = [
            facts("data", "src/files", &["top"]),
            facts("top", "src/top", &["middle"]),
            facts("new", "src/new", &[]),
        ];
        assert_eq!(
            findings_of(&found),
            [
                "`data` is in src/files/, and table.md says in src/data/",
                "`data` depends on `top`, which table.md does not let it know",
                "`top` does not depend on `data`, which table.md lets it know",
                "table.md has no row for the crate `new` in src/new/",
            ]
        );
        assert_eq!(
            findings_of(&[facts("top", "src/top", &["data", "middle"])]),
            ["table.md has a row for `data`, which is no crate"]
        );
    }
}
