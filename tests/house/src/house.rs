//! All checks over one workspace.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use crate::circles;
use crate::crate_table::{self, CrateFacts};
use crate::error::HouseError;
use crate::finding::Finding;
use crate::names::Names;
use crate::public_names::PublicNames;
use crate::source::Source;
use crate::ties::Ties;
use crate::workspace::{self, Package};

/// The file with the table of crates.
const TABLE: &str = "docs/architecture.md";

/// What was looked at and what was found.
pub(crate) struct Inspection {
    /// What is not as it should be.
    pub(crate) findings: Vec<Finding>,
    crates: usize,
    files: usize,
    circles: usize,
    public_names: usize,
}

impl Inspection {
    /// The last line of the output.
    pub(crate) fn summary(&self) -> String {
        format!(
            "house: {} crates, {} files, {} circles, {} public names",
            self.crates, self.files, self.circles, self.public_names
        )
    }
}

/// Checks the workspace at `root`.
pub(crate) fn inspect(root: &Path) -> Result<Inspection, HouseError> {
    let read_error = |path: &Path| {
        let path = path.to_owned();
        move |source: io::Error| HouseError::Read { path, source }
    };
    let root = root.canonicalize().map_err(read_error(root))?;
    let shown = |path: &Path| {
        path.strip_prefix(&root)
            .unwrap_or(path)
            .display()
            .to_string()
    };
    let packages = workspace::packages(&root)?;

    let mut findings = Vec::new();
    let mut files = BTreeSet::<PathBuf>::new();
    let mut circles = 0;
    let mut public_names = PublicNames::default();
    for package in &packages {
        for target in package.shipped_targets() {
            let source = Source::load(&target.src_path, &|path| std::fs::read_to_string(path))?;
            let ties = Ties::of(&source, &Names::of(&source));
            circles += circles::circles(&ties).len();
            findings.extend(circles::findings(&target.name, &source, &ties, &shown));
            if target.is_library() {
                public_names.add(&target.name, &source);
            }
            files.extend(source.files);
        }
    }
    findings.extend(public_names.findings(&shown));
    let table = root.join(TABLE);
    let document = std::fs::read_to_string(&table).map_err(read_error(&table))?;
    findings.extend(crate_table::findings(
        TABLE,
        &crate_table::rows(&document),
        &facts(&packages, &shown),
    ));
    Ok(Inspection {
        findings,
        crates: packages.len(),
        files: files.len(),
        circles,
        public_names: public_names.count(),
    })
}

fn facts(packages: &[Package], shown: &dyn Fn(&Path) -> String) -> Vec<CrateFacts> {
    let names = packages
        .iter()
        .map(|package| package.name.as_str())
        .collect::<BTreeSet<_>>();
    packages
        .iter()
        .map(|package| {
            let folder = shown(package.folder());
            CrateFacts {
                name: package.name.clone(),
                folder: if folder.is_empty() {
                    ".".to_owned()
                } else {
                    folder
                },
                knows: package
                    .dependencies
                    .iter()
                    .filter(|dependency| dependency.is_normal())
                    .filter(|dependency| names.contains(dependency.name.as_str()))
                    .map(|dependency| dependency.name.clone())
                    .collect(),
            }
        })
        .collect()
}
