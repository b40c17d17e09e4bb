//! The modules of a crate and the files that they stand in, found from the root module on.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use syn::{Attribute, Expr, Item, ItemMod, Lit, Meta};

use crate::error::HouseError;
use crate::test_only::{is_test_only, is_test_only_item};
use crate::use_tree::plain;

/// Reads a source file; a path without a file is [`io::ErrorKind::NotFound`].
pub(crate) type ReadFile<'a> = &'a dyn Fn(&Path) -> io::Result<String>;

/// The position of a module in [`Source::modules`]; the root is 0.
pub(crate) type ModuleId = usize;

/// The position of a file in [`Source::files`].
pub(crate) type FileId = usize;

/// The root module of a crate.
pub(crate) const ROOT: ModuleId = 0;

/// A crate: its modules without those of the tests.
pub(crate) struct Source {
    /// The modules, parents before children.
    pub(crate) modules: Vec<Module>,
    /// The files, each once.
    pub(crate) files: Vec<PathBuf>,
}

/// A module, in a file of its own or inside of another's.
pub(crate) struct Module {
    /// Its name; that of the root is empty.
    pub(crate) name: String,
    /// The module that declares it.
    pub(crate) parent: Option<ModuleId>,
    /// The file that holds its items.
    pub(crate) file: FileId,
    /// Its items without modules and tests.
    pub(crate) items: Vec<Item>,
}

/// Where the files of a module's children are looked for.
#[derive(Clone)]
struct Place {
    file: PathBuf,
    /// The folder of `mod child;`.
    children: PathBuf,
    /// The folder that a `#[path]` is relative to.
    by_path: PathBuf,
}

struct Loader<'a> {
    read: ReadFile<'a>,
    source: Source,
    files: BTreeMap<PathBuf, FileId>,
}

impl Source {
    /// Reads the crate whose root module is `root`.
    pub(crate) fn load(root: &Path, read: ReadFile<'_>) -> Result<Self, HouseError> {
        let mut loader = Loader {
            read,
            source: Self {
                modules: Vec::new(),
                files: Vec::new(),
            },
            files: BTreeMap::new(),
        };
        let text = loader.text(root)?;
        let folder = parent(root);
        let place = Place {
            file: root.to_owned(),
            children: folder.clone(),
            by_path: folder,
        };
        loader.add_file(String::new(), None, &place, &text)?;
        Ok(loader.source)
    }
}

impl Loader<'_> {
    fn text(&self, path: &Path) -> Result<String, HouseError> {
        (self.read)(path).map_err(|source| HouseError::Read {
            path: path.to_owned(),
            source,
        })
    }

    fn add_file(
        &mut self,
        name: String,
        parent: Option<ModuleId>,
        place: &Place,
        text: &str,
    ) -> Result<(), HouseError> {
        let file = syn::parse_file(text).map_err(|source| HouseError::Syntax {
            path: place.file.clone(),
            line: source.span().start().line,
            source,
        })?;
        if is_test_only(&file.attrs) {
            return Ok(());
        }
        self.add_module(name, parent, place, file.items)
    }

    fn add_module(
        &mut self,
        name: String,
        parent: Option<ModuleId>,
        place: &Place,
        items: Vec<Item>,
    ) -> Result<(), HouseError> {
        let id = self.source.modules.len();
        let file = self.file_id(&place.file);
        let mut own = Vec::new();
        let mut children = Vec::new();
        for item in items {
            match item {
                item if is_test_only_item(&item) => {}
                Item::Mod(child) => children.push(child),
                item => own.push(item),
            }
        }
        self.source.modules.push(Module {
            name,
            parent,
            file,
            items: own,
        });
        for child in children {
            self.add_child(id, place, child)?;
        }
        Ok(())
    }

    fn add_child(
        &mut self,
        parent: ModuleId,
        place: &Place,
        child: ItemMod,
    ) -> Result<(), HouseError> {
        let name = plain(&child.ident);
        let path = path_attribute(&child.attrs);
        if let Some((_, items)) = child.content {
            let folder = path.map_or_else(|| place.children.join(&name), |p| place.by_path.join(p));
            let inside = Place {
                file: place.file.clone(),
                children: folder.clone(),
                by_path: folder,
            };
            return self.add_module(name, Some(parent), &inside, items);
        }
        let candidates = match path {
            Some(path) => {
                let file = normal(&place.by_path.join(path));
                let folder = self::parent(&file);
                vec![Place {
                    file,
                    children: folder.clone(),
                    by_path: folder,
                }]
            }
            None => candidates(place, &name),
        };
        for candidate in candidates {
            match (self.read)(&candidate.file) {
                Ok(text) => return self.add_file(name, Some(parent), &candidate, &text),
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(source) => {
                    return Err(HouseError::Read {
                        path: candidate.file,
                        source,
                    });
                }
            }
        }
        Err(HouseError::NoModuleFile {
            declared_in: place.file.clone(),
            module: name,
        })
    }

    fn file_id(&mut self, path: &Path) -> FileId {
        let files = &mut self.source.files;
        *self.files.entry(path.to_owned()).or_insert_with(|| {
            files.push(path.to_owned());
            files.len() - 1
        })
    }
}

/// `name.rs`, whose children are in the folder `name`, and `name/mod.rs`.
fn candidates(place: &Place, name: &str) -> Vec<Place> {
    let folder = place.children.join(name);
    vec![
        Place {
            file: place.children.join(format!("{name}.rs")),
            children: folder.clone(),
            by_path: place.children.clone(),
        },
        Place {
            file: folder.join("mod.rs"),
            children: folder.clone(),
            by_path: folder,
        },
    ]
}

fn path_attribute(attributes: &[Attribute]) -> Option<String> {
    attributes
        .iter()
        .find_map(|attribute| match &attribute.meta {
            Meta::NameValue(pair) if pair.path.is_ident("path") => match &pair.value {
                Expr::Lit(literal) => match &literal.lit {
                    Lit::Str(path) => Some(path.value()),
                    _ => None,
                },
                _ => None,
            },
            _ => None,
        })
}

fn parent(path: &Path) -> PathBuf {
    path.parent().map(Path::to_owned).unwrap_or_default()
}

/// The path without `..`, so that a file has one name.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            std::path::Component::ParentDir => {
                normal.pop();
            }
            std::path::Component::CurDir => {}
            part => normal.push(part),
        }
    }
    normal
}

#[cfg(test)]
pub(crate) mod in_memory {
    //! Crates for tests, in memory.

    use super::*;

    /// The crate of these files, whose root is `lib.rs`.
    pub(crate) fn load(files: &[(&str, &str)]) -> Source {
        let read = |path: &Path| {
            files
                .iter()
                .find(|(name, _)| Path::new(name) == path)
                .map(|(_, text)| (*text).to_owned())
                .ok_or_else(|| io::ErrorKind::NotFound.into())
        };
        Source::load(Path::new("lib.rs"), &read).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(source: &Source) -> Vec<&str> {
        source
            .files
            .iter()
            .map(|file| file.to_str().unwrap())
            .collect()
    }

    #[test]
    fn modules_are_found_beside_and_below_the_file_that_declares_them() {
        let source = in_memory::load(&[
            ("lib.rs", "mod a; mod b; mod inside { mod d; }"),
            ("a.rs", "mod c;"),
            ("a/c.rs", ""),
            ("b/mod.rs", "mod c;"),
            ("b/c.rs", ""),
            ("inside/d.rs", ""),
        ]);
        assert_eq!(
            files(&source),
            [
                "lib.rs",
                "a.rs",
                "a/c.rs",
                "b/mod.rs",
                "b/c.rs",
                "inside/d.rs"
            ]
        );
    }

    #[test]
    fn a_module_may_name_its_file() {
        let source = in_memory::load(&[
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "#[path = \"../shared/b.rs\"] mod b;"),
            ("shared/b.rs", "mod c;"),
            ("shared/c.rs", ""),
        ]);
        assert_eq!(
            files(&source),
            ["lib.rs", "a/mod.rs", "shared/b.rs", "shared/c.rs"]
        );
    }

    #[test]
    fn the_files_of_tests_are_not_read() {
        let source = in_memory::load(&[
            ("lib.rs", "#[cfg(test)] mod tests; mod a;"),
            ("a.rs", "#![cfg(test)] mod b;"),
        ]);
        assert_eq!(files(&source), ["lib.rs"]);
    }
}
