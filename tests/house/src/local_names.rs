//! What a function declares for itself: its variables, items and imports hide the module's.

use std::collections::{HashMap, HashSet};

use syn::visit::{self, Visit};
use syn::{Item, ItemUse, PatIdent};

use crate::use_tree::{self, ImportedAs, WrittenPath, plain};

/// The names of one function. They count in all of it: a check of ties between files needs no
/// finer grain.
#[derive(Default)]
pub(crate) struct LocalNames {
    own: HashSet<String>,
    imports: HashMap<String, WrittenPath>,
}

impl LocalNames {
    /// Those of the function that `collect` visits.
    pub(crate) fn of(collect: impl FnOnce(&mut Collector)) -> Self {
        let mut collector = Collector(Self::default());
        collect(&mut collector);
        collector.0
    }

    /// Whether a name alone is a variable or an item of the function.
    pub(crate) fn hides(&self, path: &WrittenPath) -> bool {
        matches!(path.segments.as_slice(), [name] if self.own.contains(name))
    }

    /// The path with the function's imports put in for their names.
    pub(crate) fn expand(&self, path: WrittenPath) -> WrittenPath {
        let imported = path
            .segments
            .first()
            .and_then(|first| self.imports.get(first));
        match imported {
            Some(import) if !path.is_global => WrittenPath {
                is_global: import.is_global,
                segments: import
                    .segments
                    .iter()
                    .chain(&path.segments[1..])
                    .cloned()
                    .collect(),
            },
            _ => path,
        }
    }
}

/// Collects the names of a function.
pub(crate) struct Collector(LocalNames);

impl<'ast> Visit<'ast> for Collector {
    fn visit_pat_ident(&mut self, pattern: &'ast PatIdent) {
        if is_variable(pattern) {
            self.0.own.insert(plain(&pattern.ident));
        }
        visit::visit_pat_ident(self, pattern);
    }

    fn visit_item(&mut self, item: &'ast Item) {
        let name = match item {
            Item::Const(item) => Some(&item.ident),
            Item::Static(item) => Some(&item.ident),
            Item::Fn(item) => Some(&item.sig.ident),
            Item::Struct(item) => Some(&item.ident),
            Item::Enum(item) => Some(&item.ident),
            Item::Trait(item) => Some(&item.ident),
            Item::Type(item) => Some(&item.ident),
            _ => None,
        };
        self.0.own.extend(name.map(plain));
        visit::visit_item(self, item);
    }

    fn visit_item_use(&mut self, declaration: &'ast ItemUse) {
        for (path, imported_as) in use_tree::imports(declaration) {
            if let ImportedAs::Name(name) = imported_as {
                self.0.imports.insert(name, path);
            }
        }
    }
}

/// A pattern in capitals is a constant or a variant, and no new name.
pub(crate) fn is_variable(pattern: &PatIdent) -> bool {
    !plain(&pattern.ident).starts_with(char::is_uppercase)
}
