//! Circles between the folders of a crate: the one imports from the other, on whatever way, and the other from the one.
//!
//! Sources are read as text. What counts is each path in the code that begins with `crate`, `super` or `self`, and each path
//! of a `use`; names that a folder's own file imports again are followed. Modules that are built for tests alone do not count,
//! nor does a folder's tie to those that it lies in.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

/// A folder of modules by its path from the crate's root, which is the empty one.
type Folder = Vec<String>;

/// The modules of a crate.
#[derive(Default)]
pub(crate) struct Source {
    /// The code of each module by its path, with the module's file.
    modules: BTreeMap<Vec<String>, (PathBuf, String)>,
    /// What each module imports, by the name that it has there.
    imports: BTreeMap<Vec<String>, Vec<(String, Vec<String>)>>,
}

impl Source {
    /// Follows the modules that a crate's root file declares.
    pub(crate) fn read(
        root: &Path,
        read: &dyn Fn(&Path) -> io::Result<String>,
    ) -> Result<Self, String> {
        let mut source = Self::default();
        let mut waiting = vec![(Vec::new(), root.to_owned())];
        while let Some((module, file)) = waiting.pop() {
            let text = read(&file).map_err(|error| format!("{}: {error}", file.display()))?;
            let code = code_of(&text);
            // The folder in which the modules that a file declares lie.
            let own = module.last().map_or("", String::as_str);
            let is_own = file.file_stem().is_some_and(|stem| stem == own);
            let mut folder = file.parent().unwrap_or(Path::new("")).to_owned();
            if is_own {
                folder.push(own);
            }
            for (name, path) in declared(&code) {
                let inner = [module.as_slice(), std::slice::from_ref(&name)].concat();
                let file = match path {
                    Some(path) => file.with_file_name(path),
                    None => {
                        let nested = folder.join(&name).join("mod.rs");
                        let flat = folder.join(format!("{name}.rs"));
                        if read(&flat).is_ok() { flat } else { nested }
                    }
                };
                waiting.push((inner, file));
            }
            source.imports.insert(module.clone(), imported(&code));
            source.modules.insert(module, (file, code));
        }
        Ok(source)
    }

    /// The circles, each as the ties that close it.
    pub(crate) fn circles(&self) -> Vec<String> {
        let ties = self.ties();
        let reaches = |from: &Folder, to: &Folder| {
            let (mut seen, mut waiting) = (BTreeSet::new(), vec![from]);
            while let Some(folder) = waiting.pop() {
                let next = ties.keys().filter(|(one, _)| one == folder);
                waiting.extend(next.map(|(_, two)| two).filter(|&two| seen.insert(two)));
            }
            seen.contains(to)
        };
        let in_circle =
            ties.iter()
                .filter(|((from, to), _)| reaches(to, from))
                .map(|((from, to), why)| {
                    let [from, to] = [from, to].map(|folder| folder.join("::"));
                    format!("the folders `{from}` and `{to}` are in a circle: {why}")
                });
        in_circle.collect()
    }

    /// Which folder imports from which that lies beside it, with the first file that does, and what it names.
    fn ties(&self) -> BTreeMap<(Folder, Folder), String> {
        let mut ties = BTreeMap::new();
        for (module, (file, code)) in &self.modules {
            let own = self.folder_of(module);
            let paths = paths_in(code).into_iter();
            let imports = self.imports[module].iter().map(|(_, path)| path.clone());
            for path in paths.chain(imports) {
                let Some(target) = self.resolved(module, &path, 8) else {
                    continue;
                };
                let other = self.folder_of(&target);
                let common = own.iter().zip(&other).take_while(|(a, b)| a == b).count();
                if common < own.len() && common < other.len() {
                    let [from, to] = [&own, &other].map(|folder| folder[..=common].to_vec());
                    let why = format!("{} uses {}", file.display(), path.join("::"));
                    ties.entry((from, to)).or_insert(why);
                }
            }
        }
        ties
    }

    /// The folder in which a module lies: the nearest module around it, or it itself, that has others in it.
    fn folder_of(&self, module: &[String]) -> Folder {
        let has_modules = |folder: &[String]| {
            let inner =
                |other: &&Vec<String>| other.len() > folder.len() && other.starts_with(folder);
            self.modules.keys().any(|other| inner(&other))
        };
        let longest = (0..=module.len()).rev();
        let folder = longest
            .map(|length| &module[..length])
            .find(|folder| has_modules(folder));
        folder.unwrap_or_default().to_vec()
    }

    /// The module that a path in another one leads to; `None` if it leads out of the crate.
    fn resolved(&self, from: &[String], path: &[String], depth: usize) -> Option<Vec<String>> {
        let (mut at, mut rest) = (from.to_vec(), path);
        loop {
            match rest.first()?.as_str() {
                "crate" => at.clear(),
                "super" => drop(at.pop()?),
                "self" => {}
                _ => break,
            }
            rest = &rest[1..];
        }
        if rest.len() == path.len() && !self.has(&at, rest.first()?) {
            return None;
        }
        while let Some(name) = rest.first() {
            at.push(name.clone());
            if !self.modules.contains_key(&at) {
                at.pop();
                let imports = self.imports.get(&at)?.iter();
                let again = imports.filter(|(own, _)| own == name).map(|(_, path)| path);
                let deeper = again.filter(|again| depth > 0 && again.as_slice() != path);
                let mut found = deeper.filter_map(|path| self.resolved(&at, path, depth - 1));
                return found.next().or(Some(at.clone()));
            }
            rest = &rest[1..];
        }
        Some(at)
    }

    fn has(&self, module: &[String], name: &str) -> bool {
        self.modules
            .contains_key(&[module, &[name.to_owned()]].concat())
    }
}

/// The code of a file without comments and without the module of its tests.
fn code_of(text: &str) -> String {
    let lines = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let code: String = lines.flat_map(|line| [line, "\n"]).collect();
    let tests = code.find("#[cfg(test)]\nmod tests {");
    code[..tests.unwrap_or(code.len())].to_owned()
}

/// The modules that a file declares, with the path that an attribute names. Those for tests are left out.
fn declared(code: &str) -> Vec<(String, Option<String>)> {
    let (mut found, mut is_test, mut path) = (Vec::new(), false, None);
    for line in code.lines() {
        let line = line.trim();
        if line.starts_with("#[") {
            is_test |= line.contains("cfg(test)") || line.contains("cfg(all(test");
            let given = line.strip_prefix("#[path = \"");
            path = path.or(given.and_then(|given| given.split('"').next()));
            continue;
        }
        let declaration = line.strip_suffix(';').map(|line| line.split_whitespace());
        let words: Vec<&str> = declaration.into_iter().flatten().collect();
        if let [.., "mod", name] = words[..]
            && !is_test
        {
            found.push((name.to_owned(), path.map(str::to_owned)));
        }
        (is_test, path) = (false, None);
    }
    found
}

/// What the `use` declarations of a file import, each with the name that it has here.
fn imported(code: &str) -> Vec<(String, Vec<String>)> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("use ") {
        let line = code[..at].rsplit('\n').next().unwrap_or_default().trim();
        let Some(end) = code[at..]
            .find(';')
            .filter(|_| line.is_empty() || line.starts_with("pub"))
        else {
            continue;
        };
        expand(&[], &code[at + 4..at + end], &mut found);
    }
    found
}

/// The paths of a tree as `a::{b, c::d}`.
fn expand(before: &[String], tree: &str, found: &mut Vec<(String, Vec<String>)>) {
    let (outer, inner) = tree.split_once('{').unwrap_or((tree, ""));
    let names = outer
        .split("::")
        .map(str::trim)
        .filter(|name| !name.is_empty());
    let mut path = before.to_vec();
    let mut alias = None;
    for name in names {
        let (name, renamed) = name.split_once(" as ").unwrap_or((name, name));
        path.extend((name != "*").then(|| name.to_owned()));
        alias = Some(if name == "self" { "" } else { renamed.trim() });
    }
    if inner.is_empty() {
        found.extend(alias.map(|alias| (alias.to_owned(), path)));
        return;
    }
    let inner = inner.rsplit_once('}').map_or(inner, |(inner, _)| inner);
    let (mut open, mut from) = (0, 0);
    for (at, letter) in inner.char_indices().chain([(inner.len(), ',')]) {
        match letter {
            '{' => open += 1,
            '}' => open -= 1,
            ',' if open == 0 => {
                expand(&path, &inner[from..at], found);
                from = at + 1;
            }
            _ => {}
        }
    }
}

/// The paths in the code that begin in this crate, but for trees, which `imported` reads.
fn paths_in(code: &str) -> Vec<Vec<String>> {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == ':';
    let words = code.split(|letter| !is_part(letter));
    let begins = ["crate::", "super::", "self::"];
    let paths = words.filter(|word| begins.iter().any(|begin| word.starts_with(begin)));
    let names = |path: &str| {
        path.split("::")
            .filter(|name| !name.is_empty())
            .map(str::to_owned)
            .collect()
    };
    paths.map(names).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circles(files: &[(&str, &str)]) -> usize {
        let read = |path: &Path| {
            let mut found = files.iter().filter(|(name, _)| Path::new(name) == path);
            let found = found.next().map(|(_, text)| (*text).to_owned());
            found.ok_or_else(|| io::ErrorKind::NotFound.into())
        };
        Source::read(Path::new("lib.rs"), &read)
            .unwrap()
            .circles()
            .len()
    }

    const ROOT: (&str, &str) = ("lib.rs", "mod a;\npub(crate) mod b;\npub use b::two::Two;");

    #[test]
    fn folders_that_import_each_other_are_a_circle_and_files_of_one_folder_are_none() {
        let (a, b) = (
            ("a/mod.rs", "mod one;"),
            ("b/mod.rs", "mod two;\nmod three;"),
        );
        let one = ("a/one.rs", "fn f() { crate::b::two::go(); }");
        let two = ("b/two.rs", "use super::three::Three;");
        let three = ("b/three.rs", "use super::two::Two;");
        assert_eq!(circles(&[ROOT, a, b, one, two, three]), 0);
        let two = ("b/two.rs", "use crate::{a::one::{One, Other}, b};");
        assert_eq!(circles(&[ROOT, a, b, one, two, three]), 2);
    }

    #[test]
    fn a_name_that_the_root_imports_again_leads_to_its_folder_and_tests_lead_nowhere() {
        let (a, b) = (("a.rs", "mod one;"), ("b/mod.rs", "mod two;"));
        let one = ("a/one.rs", "use crate::Two;");
        let two = ("b/two.rs", "use crate::a::one;");
        assert_eq!(circles(&[ROOT, a, b, one, two]), 2);
        let two = (
            "b/two.rs",
            "#[cfg(test)]\nmod tests {\n    use crate::a::one;\n}",
        );
        assert_eq!(circles(&[ROOT, a, b, one, two]), 0);
    }
}
