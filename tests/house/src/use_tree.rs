//! A `use` declaration as the paths that it imports.

use syn::{ItemUse, UseTree};

/// A path as it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WrittenPath {
    /// Whether it begins with `::`, and so with the name of another crate.
    pub(crate) is_global: bool,
    /// The names in it.
    pub(crate) segments: Vec<String>,
}

/// What one path of a `use` declaration is imported as.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ImportedAs {
    /// By this name.
    Name(String),
    /// For its methods only: `as _`.
    Nameless,
    /// All that is in it: `*`.
    Glob,
}

/// The paths of a `use` declaration.
pub(crate) fn imports(declaration: &ItemUse) -> Vec<(WrittenPath, ImportedAs)> {
    let mut imports = Vec::new();
    let mut prefix = Vec::new();
    walk(
        &declaration.tree,
        &mut prefix,
        &mut |segments, imported_as| {
            let is_global = declaration.leading_colon.is_some();
            imports.push((
                WrittenPath {
                    is_global,
                    segments,
                },
                imported_as,
            ));
        },
    );
    imports
}

/// The name of an identifier, whether it is written raw or not.
pub(crate) fn plain(ident: &impl ToString) -> String {
    let name = ident.to_string();
    name.strip_prefix("r#").map(str::to_owned).unwrap_or(name)
}

fn walk(tree: &UseTree, prefix: &mut Vec<String>, found: &mut impl FnMut(Vec<String>, ImportedAs)) {
    match tree {
        UseTree::Path(path) => {
            prefix.push(plain(&path.ident));
            walk(&path.tree, prefix, found);
            prefix.pop();
        }
        UseTree::Group(group) => {
            for tree in &group.items {
                walk(tree, prefix, found);
            }
        }
        UseTree::Glob(_) => found(prefix.clone(), ImportedAs::Glob),
        UseTree::Name(name) => {
            let path = joined(prefix, plain(&name.ident));
            let own = path.last().cloned().unwrap_or_default();
            found(path, ImportedAs::Name(own));
        }
        UseTree::Rename(rename) => {
            let path = joined(prefix, plain(&rename.ident));
            let own = plain(&rename.rename);
            let imported_as = if own == "_" {
                ImportedAs::Nameless
            } else {
                ImportedAs::Name(own)
            };
            found(path, imported_as);
        }
    }
}

/// `self` in braces is what stands before them.
fn joined(prefix: &[String], name: String) -> Vec<String> {
    let mut path = prefix.to_vec();
    if name != "self" || path.is_empty() {
        path.push(name);
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_taken_apart_into_its_paths() {
        let declaration =
            syn::parse_str("use crate::a::{self, b::{C as D, *}, Trait as _};").unwrap();
        let imports = imports(&declaration)
            .into_iter()
            .map(|(path, imported_as)| (path.segments.join("::"), imported_as))
            .collect::<Vec<_>>();
        let named = |name: &str| ImportedAs::Name(name.to_owned());
        assert_eq!(
            imports,
            [
                ("crate::a".to_owned(), named("a")),
                ("crate::a::b::C".to_owned(), named("D")),
                ("crate::a::b".to_owned(), ImportedAs::Glob),
                ("crate::a::Trait".to_owned(), ImportedAs::Nameless),
            ]
        );
    }
}
