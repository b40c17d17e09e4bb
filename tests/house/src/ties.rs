//! Which file of a crate uses what of which other file.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{
    Arm, Attribute, Field, FieldValue, ImplItem, ImplItemFn, Item, ItemFn, ItemUse, Lit, Local,
    Macro, Meta, PatIdent, Path, Stmt, TraitItemFn, Visibility,
};

use crate::local_names::{LocalNames, is_variable};
use crate::names::{Found, Names};
use crate::source::{FileId, ModuleId, Source};
use crate::test_only::{is_test_only, is_test_only_item};
use crate::use_tree::{self, ImportedAs, WrittenPath, plain};

/// The ties between the files of a crate.
#[derive(Default)]
pub(crate) struct Ties {
    /// From a file to another: the names that it uses.
    pub(crate) uses: BTreeMap<(FileId, FileId), BTreeSet<String>>,
    /// Paths that begin in the crate and lead nowhere: what the check does not understand.
    pub(crate) lost: BTreeSet<(FileId, String)>,
}

impl Ties {
    /// Those of a crate. A re-export ties nothing: who uses the name is tied to its definition.
    pub(crate) fn of(source: &Source, names: &Names) -> Self {
        let mut ties = Self::default();
        for (module, content) in source.modules.iter().enumerate() {
            let mut reader = Reader {
                names,
                module,
                file: content.file,
                local: None,
                ties: &mut ties,
            };
            for item in &content.items {
                match item {
                    Item::Use(item) if !matches!(item.vis, Visibility::Inherited) => {
                        reader.check_re_exports(item);
                    }
                    item => reader.visit_item(item),
                }
            }
        }
        ties
    }
}

/// Reads the items of one module.
struct Reader<'a> {
    names: &'a Names,
    module: ModuleId,
    file: FileId,
    /// The names of the function that is being read.
    local: Option<LocalNames>,
    ties: &'a mut Ties,
}

impl Reader<'_> {
    fn use_path(&mut self, path: WrittenPath) {
        let path = match &self.local {
            Some(local) if local.hides(&path) => return,
            Some(local) => local.expand(path),
            None => path,
        };
        let found = self.names.resolve(self.module, &path);
        if found.is_empty() {
            self.lose(&path);
        }
        for found in found {
            if let Found::Item(item) = found
                && item.file != self.file
            {
                let names = self.ties.uses.entry((self.file, item.file)).or_default();
                names.insert(item.name.clone());
            }
        }
    }

    fn lose(&mut self, path: &WrittenPath) {
        self.ties.lost.insert((self.file, path.segments.join("::")));
    }

    fn check_re_exports(&mut self, declaration: &ItemUse) {
        for (path, _) in use_tree::imports(declaration) {
            if self.names.resolve(self.module, &path).is_empty() {
                self.lose(&path);
            }
        }
    }

    /// Reads a function with the names that it declares for itself.
    fn in_function(&mut self, names: impl FnOnce() -> LocalNames, read: impl FnOnce(&mut Self)) {
        if self.local.is_some() {
            return read(self);
        }
        self.local = Some(names());
        read(self);
        self.local = None;
    }

    /// The paths in a macro's arguments: what looks like one, since the macro alone knows.
    fn read_tokens(&mut self, tokens: TokenStream) {
        let mut paths = TokenPaths::default();
        paths.read(tokens);
        for path in paths.found {
            self.use_path(path);
        }
    }

    /// The functions and types that serde's attributes name in strings.
    fn read_strings(&mut self, tokens: TokenStream) {
        for token in tokens {
            match token {
                TokenTree::Group(group) => self.read_strings(group.stream()),
                TokenTree::Literal(literal) => {
                    if let Lit::Str(text) = Lit::new(literal)
                        && let Ok(path) = text.parse::<Path>()
                        && path.segments.len() > 1
                    {
                        self.use_path(written(&path));
                    }
                }
                TokenTree::Ident(_) | TokenTree::Punct(_) => {}
            }
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if !is_test_only_item(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, declaration: &'ast ItemUse) {
        for (path, imported_as) in use_tree::imports(declaration) {
            // What is used of a glob is tied where it is used.
            if imported_as != ImportedAs::Glob {
                self.use_path(path);
            }
        }
    }

    fn visit_item_fn(&mut self, function: &'ast ItemFn) {
        self.in_function(
            || LocalNames::of(|collector| visit::visit_item_fn(collector, function)),
            |reader| visit::visit_item_fn(reader, function),
        );
    }

    fn visit_impl_item_fn(&mut self, function: &'ast ImplItemFn) {
        self.in_function(
            || LocalNames::of(|collector| visit::visit_impl_item_fn(collector, function)),
            |reader| visit::visit_impl_item_fn(reader, function),
        );
    }

    fn visit_trait_item_fn(&mut self, function: &'ast TraitItemFn) {
        self.in_function(
            || LocalNames::of(|collector| visit::visit_trait_item_fn(collector, function)),
            |reader| visit::visit_trait_item_fn(reader, function),
        );
    }

    fn visit_path(&mut self, path: &'ast Path) {
        self.use_path(written(path));
        visit::visit_path(self, path);
    }

    fn visit_pat_ident(&mut self, pattern: &'ast PatIdent) {
        if !is_variable(pattern) {
            let segments = vec![plain(&pattern.ident)];
            self.use_path(WrittenPath {
                is_global: false,
                segments,
            });
        }
        visit::visit_pat_ident(self, pattern);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.use_path(written(&call.path));
        self.read_tokens(call.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Meta::List(list) = &attribute.meta {
            self.read_tokens(list.tokens.clone());
            if list.path.is_ident("serde") {
                self.read_strings(list.tokens.clone());
            }
        }
    }

    fn visit_visibility(&mut self, _: &'ast Visibility) {}

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        let attributes = match item {
            ImplItem::Const(item) => &item.attrs,
            ImplItem::Fn(item) => &item.attrs,
            ImplItem::Type(item) => &item.attrs,
            _ => return visit::visit_impl_item(self, item),
        };
        if !is_test_only(attributes) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_field(&mut self, field: &'ast Field) {
        if !is_test_only(&field.attrs) {
            visit::visit_field(self, field);
        }
    }

    fn visit_field_value(&mut self, field: &'ast FieldValue) {
        if !is_test_only(&field.attrs) {
            visit::visit_field_value(self, field);
        }
    }

    fn visit_arm(&mut self, arm: &'ast Arm) {
        if !is_test_only(&arm.attrs) {
            visit::visit_arm(self, arm);
        }
    }

    fn visit_local(&mut self, local: &'ast Local) {
        if !is_test_only(&local.attrs) {
            visit::visit_local(self, local);
        }
    }

    fn visit_stmt(&mut self, statement: &'ast Stmt) {
        if !matches!(statement, Stmt::Macro(call) if is_test_only(&call.attrs)) {
            visit::visit_stmt(self, statement);
        }
    }
}

fn written(path: &Path) -> WrittenPath {
    WrittenPath {
        is_global: path.leading_colon.is_some(),
        segments: path
            .segments
            .iter()
            .map(|segment| plain(&segment.ident))
            .collect(),
    }
}

/// What looks like a path among tokens.
#[derive(Default)]
struct TokenPaths {
    found: Vec<WrittenPath>,
    /// The path that the next token may continue.
    open: Option<WrittenPath>,
    /// The punctuation since the last name, group or literal.
    before: String,
}

impl TokenPaths {
    fn read(&mut self, tokens: TokenStream) {
        for token in tokens {
            match token {
                TokenTree::Ident(name) => self.name(plain(&name)),
                TokenTree::Punct(mark) => self.before.push(mark.as_char()),
                TokenTree::Group(group) => {
                    self.close();
                    self.read(group.stream());
                    self.close();
                }
                TokenTree::Literal(_) => self.close(),
            }
        }
        self.close();
    }

    fn name(&mut self, name: String) {
        let before = std::mem::take(&mut self.before);
        if before == "::"
            && let Some(path) = &mut self.open
        {
            path.segments.push(name);
            return;
        }
        self.finish(&before);
        // A field, a lifetime, a variable of a macro, and what belongs to a type in angle brackets.
        let is_none = (before.ends_with('.') && !before.ends_with(".."))
            || before.ends_with('\'')
            || (before.ends_with('$') && name != "crate")
            || before.ends_with("::");
        if !is_none {
            self.open = Some(WrittenPath {
                is_global: false,
                segments: vec![name],
            });
        }
    }

    fn close(&mut self) {
        let before = std::mem::take(&mut self.before);
        self.finish(&before);
    }

    /// Ends the open path. A name before a single colon is a field's or a variable's.
    fn finish(&mut self, after: &str) {
        if let Some(path) = self.open.take() {
            let is_label = after.starts_with(':') && !after.starts_with("::");
            if !is_label || path.segments.len() > 1 {
                self.found.push(path);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::in_memory;

    fn ties_of(files: &[(&str, &str)]) -> Vec<String> {
        let source = in_memory::load(files);
        let ties = Ties::of(&source, &Names::of(&source));
        assert!(ties.lost.is_empty(), "{:?}", ties.lost);
        let name = |file: FileId| source.files[file].display().to_string();
        ties.uses
            .iter()
            .map(|((from, to), names)| {
                let names = names.iter().cloned().collect::<Vec<_>>().join(", ");
                format!("{} -> {}: {names}", name(*from), name(*to))
            })
            .collect()
    }

    /// What `a.rs` with this text uses of a module `b` and of its re-exports in the root.
    fn uses_of(text: &str) -> Vec<String> {
        ties_of(&[
            (
                "lib.rs",
                "mod a; mod b; pub use b::{Thing, Kind, LIMIT, make};",
            ),
            ("a.rs", text),
            (
                "b.rs",
                "pub struct Thing; pub enum Kind { One } pub const LIMIT: u8 = 1; pub fn make() {}",
            ),
        ])
    }

    #[test]
    fn a_path_anywhere_in_the_code_is_a_use() {
        for (text, name) in [
            ("use crate::Thing;", "Thing"),
            ("use super::b::{self, Thing as Other};", "Thing"),
            ("use super::b; fn f() { b::make() }", "make"),
            ("fn f(x: super::Thing) {}", "Thing"),
            ("fn f() -> Vec<crate::b::Thing> { Vec::new() }", "Thing"),
            ("fn f() { assert!(g() < crate::LIMIT, \"{}\", 1) }", "LIMIT"),
            ("fn f() { use super::Kind; g(Kind::One) }", "Kind"),
            (
                "use super::*; fn f(k: u8) { match k { LIMIT => {} _ => {} } }",
                "LIMIT",
            ),
            ("impl From<crate::Thing> for u8 {}", "Thing"),
            (
                "#[derive(Deserialize)] struct S { #[serde(default = \"crate::make\")] x: u8 }",
                "make",
            ),
        ] {
            assert_eq!(uses_of(text), [format!("a.rs -> b.rs: {name}")], "{text}");
        }
    }

    #[test]
    fn what_only_looks_like_a_use_is_none() {
        for text in [
            "pub use super::Thing;",
            "use super::b;",
            "#[cfg(test)] use super::Thing;",
            "#[cfg(test)] mod tests { use crate::Thing; }",
            "struct S; impl S { #[cfg(test)] fn f(x: crate::Thing) {} }",
            "use super::*; fn f() { let make = 1; g(make); println!(\"{}\", make) }",
            "use super::*; fn f() { vec![S { make: 1 }, x.make] }",
            "use std::fmt; fn f() { fmt::format(1) }",
            "/// See [`crate::Thing`].\nfn f() {}",
        ] {
            assert_eq!(uses_of(text), [""; 0], "{text}");
        }
    }

    #[test]
    fn a_child_is_tied_to_the_sibling_and_not_to_the_re_export() {
        let ties = ties_of(&[
            ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
            ("a.rs", "pub struct A;"),
            ("b.rs", "use super::A; pub struct B(A);"),
        ]);
        assert_eq!(ties, ["b.rs -> a.rs: A"]);
    }

    #[test]
    fn a_parent_is_tied_by_what_its_own_code_uses() {
        let ties = ties_of(&[
            (
                "lib.rs",
                "mod a; pub use a::A; pub struct Root; fn f() { A::new() }",
            ),
            ("a.rs", "pub struct A(crate::Root);"),
        ]);
        assert_eq!(ties, ["lib.rs -> a.rs: A", "a.rs -> lib.rs: Root"]);
    }

    #[test]
    fn a_path_that_leads_nowhere_is_not_passed_over() {
        let source = in_memory::load(&[("lib.rs", "fn f() { crate::missing() }")]);
        let ties = Ties::of(&source, &Names::of(&source));
        assert_eq!(
            ties.lost.into_iter().collect::<Vec<_>>(),
            [(0, "crate::missing".to_owned())]
        );
    }
}
