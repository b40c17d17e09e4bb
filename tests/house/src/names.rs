//! What each module declares, and where a path leads: through imports and re-exports to the file
//! that defines the item.

use std::collections::HashMap;

use syn::{ForeignItem, Item, ItemMacro};

use crate::source::{FileId, ModuleId, ROOT, Source};
use crate::use_tree::{self, ImportedAs, WrittenPath, plain};

/// Rust keeps names of these kinds apart: a module and a function may share one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Namespace {
    /// Types, traits and modules.
    Types,
    /// Functions, constants and statics.
    Values,
    /// Macros.
    Macros,
}

const NAMESPACES: [Namespace; 3] = [Namespace::Types, Namespace::Values, Namespace::Macros];

/// An item of the crate, with the file that defines it.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Definition {
    /// Its name.
    pub(crate) name: String,
    /// The file.
    pub(crate) file: FileId,
    /// The variants of an enum, which can be imported too.
    variants: Vec<String>,
}

/// Where a path leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Found<'a> {
    /// To a module.
    Module(ModuleId),
    /// To an item.
    Item(&'a Definition),
    /// Into another crate.
    Foreign,
}

enum Binding {
    Module(ModuleId),
    Item(Definition),
    Import(WrittenPath),
    Foreign,
}

#[derive(Default)]
struct Declared {
    bindings: HashMap<(Namespace, String), Vec<Binding>>,
    globs: Vec<WrittenPath>,
    /// Stands for what the module's macros may define, which the check does not see.
    by_macro: Option<Definition>,
}

/// The names of a crate.
pub(crate) struct Names {
    modules: Vec<Declared>,
    parents: Vec<Option<ModuleId>>,
}

/// One look-up, with all that it needs on the way.
struct Search<'a> {
    names: &'a Names,
    /// Whether a name that a module does not have is one that its macros define.
    trusts_macros: bool,
    /// What is being looked up, so that imports in a circle end.
    pending: Vec<(ModuleId, Namespace, String)>,
}

impl Names {
    /// The names that the modules of a crate declare.
    pub(crate) fn of(source: &Source) -> Self {
        let mut names = Self {
            modules: source.modules.iter().map(|_| Declared::default()).collect(),
            parents: source.modules.iter().map(|module| module.parent).collect(),
        };
        for (id, module) in source.modules.iter().enumerate() {
            if let Some(parent) = module.parent {
                names.modules[parent].bind(Namespace::Types, &module.name, Binding::Module(id));
            }
            for item in &module.items {
                names.declare(id, module.file, item);
            }
        }
        names
    }

    /// Where a path that is written in `module` leads, in each namespace; nothing if a module of the
    /// crate does not have what it names.
    pub(crate) fn resolve(&self, module: ModuleId, path: &WrittenPath) -> Vec<Found<'_>> {
        for trusts_macros in [false, true] {
            let mut found = Vec::new();
            for namespace in NAMESPACES {
                let mut search = Search {
                    names: self,
                    trusts_macros,
                    pending: Vec::new(),
                };
                found.extend(search.follow(module, path, namespace));
            }
            if !found.is_empty() {
                return found;
            }
        }
        Vec::new()
    }

    fn declare(&mut self, module: ModuleId, file: FileId, item: &Item) {
        use Namespace::{Types, Values};
        let declared = &mut self.modules[module];
        match item {
            Item::Const(item) => declared.define(Values, &plain(&item.ident), file),
            Item::Static(item) => declared.define(Values, &plain(&item.ident), file),
            Item::Fn(item) => declared.define(Values, &plain(&item.sig.ident), file),
            Item::Struct(item) => {
                declared.define(Types, &plain(&item.ident), file);
                declared.define(Values, &plain(&item.ident), file);
            }
            Item::Enum(item) => {
                let variants = item
                    .variants
                    .iter()
                    .map(|variant| plain(&variant.ident))
                    .collect();
                let name = plain(&item.ident);
                let definition = Definition {
                    name: name.clone(),
                    file,
                    variants,
                };
                declared.bind(Types, &name, Binding::Item(definition));
            }
            Item::Trait(item) => declared.define(Types, &plain(&item.ident), file),
            Item::TraitAlias(item) => declared.define(Types, &plain(&item.ident), file),
            Item::Type(item) => declared.define(Types, &plain(&item.ident), file),
            Item::Union(item) => declared.define(Types, &plain(&item.ident), file),
            Item::ForeignMod(block) => {
                for item in &block.items {
                    declared.define_foreign(item, file);
                }
            }
            Item::ExternCrate(item) => {
                let name = item.rename.as_ref().map_or(&item.ident, |(_, name)| name);
                declared.bind(Types, &plain(name), Binding::Foreign);
            }
            Item::Macro(item) => self.declare_macro(module, file, item),
            Item::Use(item) => {
                for (path, imported_as) in use_tree::imports(item) {
                    declared.import(path, imported_as);
                }
            }
            _ => {}
        }
    }

    fn declare_macro(&mut self, module: ModuleId, file: FileId, item: &ItemMacro) {
        let Some(name) = &item.ident else {
            let name = format!("made by {}!", macro_name(item));
            self.modules[module].by_macro = Some(Definition {
                name,
                file,
                variants: Vec::new(),
            });
            return;
        };
        let name = plain(name);
        self.modules[module].define(Namespace::Macros, &name, file);
        let is_exported = item.attrs.iter().any(|a| a.path().is_ident("macro_export"));
        if is_exported && module != ROOT {
            self.modules[ROOT].define(Namespace::Macros, &name, file);
        }
    }
}

impl Declared {
    fn bind(&mut self, namespace: Namespace, name: &str, binding: Binding) {
        self.bindings
            .entry((namespace, name.to_owned()))
            .or_default()
            .push(binding);
    }

    fn define(&mut self, namespace: Namespace, name: &str, file: FileId) {
        let definition = Definition {
            name: name.to_owned(),
            file,
            variants: Vec::new(),
        };
        self.bind(namespace, name, Binding::Item(definition));
    }

    fn define_foreign(&mut self, item: &ForeignItem, file: FileId) {
        match item {
            ForeignItem::Fn(item) => self.define(Namespace::Values, &plain(&item.sig.ident), file),
            ForeignItem::Static(item) => self.define(Namespace::Values, &plain(&item.ident), file),
            ForeignItem::Type(item) => self.define(Namespace::Types, &plain(&item.ident), file),
            _ => {}
        }
    }

    fn import(&mut self, path: WrittenPath, imported_as: ImportedAs) {
        match imported_as {
            ImportedAs::Name(name) => {
                for namespace in NAMESPACES {
                    self.bind(namespace, &name, Binding::Import(path.clone()));
                }
            }
            ImportedAs::Nameless => {}
            ImportedAs::Glob => self.globs.push(path),
        }
    }

    fn bound(&self, namespace: Namespace, name: &str) -> &[Binding] {
        self.bindings
            .get(&(namespace, name.to_owned()))
            .map_or(&[], Vec::as_slice)
    }
}

impl<'a> Search<'a> {
    fn follow(
        &mut self,
        module: ModuleId,
        path: &WrittenPath,
        namespace: Namespace,
    ) -> Vec<Found<'a>> {
        if path.is_global {
            return vec![Found::Foreign];
        }
        let last = path.segments.len().saturating_sub(1);
        let mut found = Vec::new();
        for (position, name) in path.segments.iter().enumerate() {
            let namespace = if position == last {
                namespace
            } else {
                Namespace::Types
            };
            found = if position == 0 {
                self.begin(module, name, namespace)
            } else {
                found
                    .into_iter()
                    .flat_map(|place| self.step(place, name, namespace))
                    .collect()
            };
        }
        found
    }

    /// What the first name of a path means. One that the module does not know is another crate's or
    /// the language's.
    fn begin(&mut self, module: ModuleId, name: &str, namespace: Namespace) -> Vec<Found<'a>> {
        match name {
            "crate" => return vec![Found::Module(ROOT)],
            "self" => return vec![Found::Module(module)],
            "super" => {
                return self.names.parents[module]
                    .map(Found::Module)
                    .into_iter()
                    .collect();
            }
            _ => {}
        }
        let mut found = self.look_up(module, name, namespace);
        if found.is_empty() && namespace == Namespace::Macros {
            found = self.macro_around(module, name);
        }
        if found.is_empty() {
            vec![Found::Foreign]
        } else {
            found
        }
    }

    /// The macros of a module are known in the children that it declares after them.
    fn macro_around(&self, module: ModuleId, name: &str) -> Vec<Found<'a>> {
        let mut around = self.names.parents[module];
        while let Some(module) = around {
            for binding in self.names.modules[module].bound(Namespace::Macros, name) {
                if let Binding::Item(definition) = binding {
                    return vec![Found::Item(definition)];
                }
            }
            around = self.names.parents[module];
        }
        Vec::new()
    }

    fn step(&mut self, place: Found<'a>, name: &str, namespace: Namespace) -> Vec<Found<'a>> {
        let Found::Module(module) = place else {
            // What follows is a variant or belongs to a type: it counts as the item.
            return vec![place];
        };
        if name == "super" {
            return self.names.parents[module]
                .map(Found::Module)
                .into_iter()
                .collect();
        }
        let mut found = self.look_up(module, name, namespace);
        if found.is_empty() && self.trusts_macros {
            found.extend(
                self.names.modules[module]
                    .by_macro
                    .as_ref()
                    .map(Found::Item),
            );
        }
        found
    }

    /// What a module has under a name: its own items and imports, then those of its globs.
    fn look_up(&mut self, module: ModuleId, name: &str, namespace: Namespace) -> Vec<Found<'a>> {
        let question = (module, namespace, name.to_owned());
        if self.pending.contains(&question) {
            return Vec::new();
        }
        self.pending.push(question);
        let mut found = self.look_up_bound(module, name, namespace);
        if found.is_empty() {
            found = self.look_up_globs(module, name, namespace);
        }
        self.pending.pop();
        found
    }

    fn look_up_bound(
        &mut self,
        module: ModuleId,
        name: &str,
        namespace: Namespace,
    ) -> Vec<Found<'a>> {
        let mut found = Vec::new();
        for binding in self.names.modules[module].bound(namespace, name) {
            match binding {
                Binding::Module(id) => found.push(Found::Module(*id)),
                Binding::Item(definition) => found.push(Found::Item(definition)),
                Binding::Foreign => found.push(Found::Foreign),
                Binding::Import(path) => found.extend(self.follow(module, path, namespace)),
            }
        }
        found
    }

    fn look_up_globs(
        &mut self,
        module: ModuleId,
        name: &str,
        namespace: Namespace,
    ) -> Vec<Found<'a>> {
        let mut found = Vec::new();
        let mut may_be_foreign = false;
        for glob in &self.names.modules[module].globs {
            for place in self.follow(module, glob, Namespace::Types) {
                match place {
                    Found::Module(module) => found.extend(self.look_up(module, name, namespace)),
                    Found::Item(item) if item.variants.iter().any(|variant| variant == name) => {
                        found.push(place);
                    }
                    Found::Item(_) => {}
                    Found::Foreign => may_be_foreign = true,
                }
            }
        }
        if found.is_empty() && may_be_foreign {
            found.push(Found::Foreign);
        }
        found
    }
}

fn macro_name(item: &ItemMacro) -> String {
    item.mac
        .path
        .segments
        .last()
        .map(|segment| plain(&segment.ident))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::in_memory;

    /// The files that a path in the root module leads to.
    fn files_of(files: &[(&str, &str)], path: &str) -> Vec<String> {
        let source = in_memory::load(files);
        let names = Names::of(&source);
        let segments = path.split("::").map(str::to_owned).collect();
        let mut files = names
            .resolve(
                ROOT,
                &WrittenPath {
                    is_global: false,
                    segments,
                },
            )
            .into_iter()
            .filter_map(|found| match found {
                Found::Item(item) => Some(source.files[item.file].display().to_string()),
                Found::Module(_) | Found::Foreign => None,
            })
            .collect::<Vec<_>>();
        files.dedup();
        files
    }

    #[test]
    fn a_path_leads_through_re_exports_to_the_definition() {
        let files = [
            ("lib.rs", "mod a; pub use a::Thing as Other;"),
            ("a/mod.rs", "mod b; pub(crate) use self::b::*;"),
            ("a/b.rs", "mod c; pub(crate) use c::Thing;"),
            ("a/b/c.rs", "pub(crate) enum Thing { One }"),
        ];
        for path in [
            "crate::a::Thing",
            "a::b::c::Thing",
            "Other::One",
            "self::Other",
        ] {
            assert_eq!(files_of(&files, path), ["a/b/c.rs"], "{path}");
        }
    }

    #[test]
    fn a_function_is_told_from_the_module_of_its_name() {
        let files = [
            ("lib.rs", "mod film; pub use film::film;"),
            ("film.rs", "pub fn film() {}"),
        ];
        assert_eq!(files_of(&files, "film"), ["film.rs"]);
        assert_eq!(files_of(&files, "film::film"), ["film.rs"]);
    }

    #[test]
    fn imports_in_a_circle_and_names_of_other_crates_lead_nowhere() {
        let files = [
            ("lib.rs", "mod a; use a::*; use png; use std::fmt;"),
            ("a.rs", "pub use super::*;"),
        ];
        for path in ["nothing", "png::Encoder", "fmt::Display", "a::Missing"] {
            assert_eq!(files_of(&files, path), [""; 0], "{path}");
        }
    }

    #[test]
    fn what_a_macro_defines_belongs_to_its_file() {
        let files = [("lib.rs", "mod a;"), ("a.rs", "structures! { Made }")];
        assert_eq!(files_of(&files, "a::Made"), ["a.rs"]);
    }
}
