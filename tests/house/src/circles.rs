//! Files that reach each other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::finding::Finding;
use crate::source::{FileId, Source};
use crate::ties::Ties;

/// The circles among the files of a crate, and the paths that could not be followed.
pub(crate) fn findings(
    crate_name: &str,
    source: &Source,
    ties: &Ties,
    shown: &dyn Fn(&Path) -> String,
) -> Vec<Finding> {
    let name = |file: FileId| shown(&source.files[file]);
    let mut findings = circles(ties)
        .into_iter()
        .filter(|circle| crosses_folders(circle.iter().map(|file| source.files[*file].as_path())))
        .map(|circle| Finding {
            what: format!(
                "a circle of {} files in {crate_name}: {}",
                circle.len(),
                circle
                    .iter()
                    .map(|file| name(*file))
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
            details: ties
                .uses
                .iter()
                .filter(|((from, to), _)| circle.contains(from) && circle.contains(to))
                .map(|((from, to), names)| {
                    let names = names
                        .iter()
                        .map(String::as_str)
                        .collect::<Vec<_>>()
                        .join(", ");
                    format!("{} -> {}: {names}", name(*from), name(*to))
                })
                .collect(),
        })
        .collect::<Vec<_>>();
    findings.extend(ties.lost.iter().map(|(file, path)| {
        Finding::new(format!(
            "{}: the check cannot follow the path `{path}`",
            name(*file)
        ))
    }));
    findings
}

/// Whether files lie in folders of which none holds all others. Files of one folder, and of those within it, are one concern
/// and may know each other.
fn crosses_folders<'a>(files: impl Iterator<Item = &'a Path>) -> bool {
    let folders: BTreeSet<&Path> = files.filter_map(Path::parent).collect();
    let holds_all = |outer: &&Path| folders.iter().all(|folder| folder.starts_with(outer));
    !folders.iter().any(holds_all)
}

/// Each set of several files that all reach each other.
pub(crate) fn circles(ties: &Ties) -> Vec<BTreeSet<FileId>> {
    let mut next: BTreeMap<FileId, Vec<FileId>> = BTreeMap::new();
    for (from, to) in ties.uses.keys() {
        next.entry(*from).or_default().push(*to);
    }
    let reached: BTreeMap<FileId, BTreeSet<FileId>> = next
        .keys()
        .map(|file| (*file, reached_from(*file, &next)))
        .collect();
    let mut circles = BTreeSet::new();
    for (file, targets) in &reached {
        let circle: BTreeSet<FileId> = targets
            .iter()
            .copied()
            .filter(|other| reached.get(other).is_some_and(|back| back.contains(file)))
            .collect();
        if circle.len() > 1 {
            circles.insert(circle);
        }
    }
    circles.into_iter().collect()
}

fn reached_from(file: FileId, next: &BTreeMap<FileId, Vec<FileId>>) -> BTreeSet<FileId> {
    let mut reached = BTreeSet::new();
    let mut open = vec![file];
    while let Some(file) = open.pop() {
        for target in next.get(&file).into_iter().flatten() {
            if reached.insert(*target) {
                open.push(*target);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::names::Names;
    use crate::source::in_memory;

    fn circles_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let source = in_memory::load(files);
        circles(&Ties::of(&source, &Names::of(&source)))
            .into_iter()
            .map(|circle| {
                circle
                    .iter()
                    .map(|file| source.files[*file].display().to_string())
                    .collect()
            })
            .collect()
    }

    #[test]
    fn files_that_import_each_other_are_a_circle() {
        let circles = circles_of(&[
            ("lib.rs", "mod a; mod b; mod c; mod d;"),
            ("a.rs", "use super::b::B; pub struct A;"),
            ("b.rs", "use super::c::C; pub struct B;"),
            ("c.rs", "pub struct C; fn f() { crate::a::A }"),
            ("d.rs", "use super::a::A;"),
        ]);
        assert_eq!(circles, [["a.rs", "b.rs", "c.rs"]]);
    }

    #[test]
    fn a_module_that_only_declares_and_re_exports_makes_no_circle() {
        let circles = circles_of(&[
            ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
            ("a.rs", "pub struct A;"),
            ("b.rs", "use super::A; pub struct B;"),
        ]);
        assert_eq!(circles, [[""; 0]; 0]);
    }

    #[test]
    fn a_module_that_calls_its_child_and_defines_what_that_uses_makes_one() {
        let circles = circles_of(&[
            ("lib.rs", "mod a; pub struct Shared; fn f() { a::work() }"),
            (
                "a.rs",
                "use super::Shared; pub fn work() -> Shared { Shared }",
            ),
        ]);
        assert_eq!(circles, [["lib.rs", "a.rs"]]);
    }

    #[test]
    fn a_finding_names_what_ties_the_files() {
        let source = in_memory::load(&[
            ("lib.rs", "mod a; mod b;"),
            ("a/mod.rs", "pub struct Shared; fn f() { crate::b::work() }"),
            (
                "b/mod.rs",
                "use crate::a::Shared; pub fn work() -> Shared { Shared }",
            ),
        ]);
        let ties = Ties::of(&source, &Names::of(&source));
        let findings = findings("x", &source, &ties, &|path| path.display().to_string());
        assert_eq!(findings.len(), 1);
        assert_eq!(
            findings[0].what,
            "a circle of 2 files in x: a/mod.rs, b/mod.rs"
        );
        assert_eq!(
            findings[0].details,
            ["a/mod.rs -> b/mod.rs: work", "b/mod.rs -> a/mod.rs: Shared"]
        );
    }

    #[test]
    fn files_of_one_folder_may_know_each_other() {
        let source = in_memory::load(&[
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "mod b; pub struct Shared; fn f() { b::work() }"),
            (
                "a/b.rs",
                "use super::Shared; pub fn work() -> Shared { Shared }",
            ),
        ]);
        let ties = Ties::of(&source, &Names::of(&source));
        assert!(findings("x", &source, &ties, &|path| path.display().to_string()).is_empty());
    }

    #[test]
    fn the_imports_of_tests_make_none() {
        let circles = circles_of(&[
            (
                "lib.rs",
                "mod a; pub struct Shared; #[cfg(test)] mod tests { use crate::a::work; }",
            ),
            (
                "a.rs",
                "use super::Shared; pub fn work() -> Shared { Shared }",
            ),
        ]);
        assert_eq!(circles, [[""; 0]; 0]);
    }
}
