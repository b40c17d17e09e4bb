//! Public types and traits that share a name. Functions may: `read` and `run` say enough behind
//! their module's name, and two of them in one file are told apart by it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use syn::{Ident, Item, Visibility};

use crate::finding::Finding;
use crate::source::{ModuleId, Source};

/// Where a public name stands.
#[derive(Debug, Clone)]
struct Place {
    crate_name: String,
    module: ModuleId,
    kind: &'static str,
    file: PathBuf,
    line: usize,
}

/// The public types and traits of the library crates.
#[derive(Default)]
pub(crate) struct PublicNames(BTreeMap<String, Vec<Place>>);

impl PublicNames {
    /// Adds those of a library, whether other crates reach them or not.
    pub(crate) fn add(&mut self, crate_name: &str, source: &Source) {
        for (id, module) in source.modules.iter().enumerate() {
            for item in &module.items {
                let Some((kind, name)) = public_type(item) else {
                    continue;
                };
                let places = self.0.entry(name.to_string()).or_default();
                // Two in one module are one name, for different systems.
                if places
                    .iter()
                    .any(|place| place.module == id && place.crate_name == crate_name)
                {
                    continue;
                }
                places.push(Place {
                    crate_name: crate_name.to_owned(),
                    module: id,
                    kind,
                    file: source.files[module.file].clone(),
                    line: name.span().start().line,
                });
            }
        }
    }

    /// How many names there are.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The names that stand for several things.
    pub(crate) fn findings(&self, shown: &dyn Fn(&Path) -> String) -> Vec<Finding> {
        self.0
            .iter()
            .filter(|(_, places)| places.len() > 1)
            .map(|(name, places)| {
                let places = places
                    .iter()
                    .map(|place| format!("{}:{} ({})", shown(&place.file), place.line, place.kind))
                    .collect::<Vec<_>>()
                    .join(", ");
                Finding::new(format!(
                    "the public name `{name}` stands for several things: {places}"
                ))
            })
            .collect()
    }
}

fn public_type(item: &Item) -> Option<(&'static str, &Ident)> {
    let (visibility, kind, name) = match item {
        Item::Struct(item) => (&item.vis, "struct", &item.ident),
        Item::Enum(item) => (&item.vis, "enum", &item.ident),
        Item::Union(item) => (&item.vis, "union", &item.ident),
        Item::Trait(item) => (&item.vis, "trait", &item.ident),
        Item::TraitAlias(item) => (&item.vis, "trait", &item.ident),
        Item::Type(item) => (&item.vis, "type", &item.ident),
        _ => return None,
    };
    matches!(visibility, Visibility::Public(_)).then_some((kind, name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::in_memory;

    fn findings_of(crates: &[(&str, &str)]) -> Vec<String> {
        let mut names = PublicNames::default();
        for (name, text) in crates {
            names.add(name, &in_memory::load(&[("lib.rs", text)]));
        }
        let findings = names.findings(&|path| path.display().to_string());
        findings.into_iter().map(|finding| finding.what).collect()
    }

    #[test]
    fn a_name_in_two_places_is_found_with_both() {
        let findings = findings_of(&[
            ("x", "pub struct Scene;"),
            ("y", "mod inner {\n    pub trait Scene {}\n}"),
        ]);
        assert_eq!(
            findings,
            [
                "the public name `Scene` stands for several things: lib.rs:1 (struct), lib.rs:2 (trait)"
            ]
        );
    }

    #[test]
    fn names_within_a_crate_and_functions_and_those_of_tests_may_repeat() {
        let findings = findings_of(&[
            (
                "x",
                "pub struct A; pub(crate) struct B; pub fn f() {} pub struct C;",
            ),
            (
                "y",
                "struct A; pub struct B; pub fn f() {} #[cfg(test)] mod t { pub struct C; }",
            ),
            (
                "z",
                "#[cfg(unix)] pub struct D; #[cfg(not(unix))] pub struct D;",
            ),
        ]);
        assert_eq!(findings, [""; 0]);
    }
}
