//! Links of Markdown documents to files of the repository and to headings in them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders in which nothing of the repository lies.
const NOT_OURS: [&str; 2] = ["target", "node_modules"];

/// The links of all documents below `root` that lead nowhere, each with its document.
pub(crate) fn broken(root: &Path) -> Vec<String> {
    let mut documents = Vec::new();
    collect(root, &mut documents);
    let mut broken = Vec::new();
    for document in &documents {
        let text = fs::read_to_string(document).unwrap();
        for link in links(&text) {
            if !leads_somewhere(document, &link) {
                broken.push(format!("{}: {link}", document.display()));
            }
        }
    }
    broken
}

/// The Markdown documents in a folder and below it.
fn collect(folder: &Path, documents: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if entry.file_type().unwrap().is_dir() {
            if !name.starts_with('.') && !NOT_OURS.contains(&&*name) {
                collect(&path, documents);
            }
        } else if name.ends_with(".md") {
            documents.push(path);
        }
    }
}

/// Text without blocks of code, and without code in lines.
fn prose(text: &str) -> String {
    let mut prose = String::new();
    let mut is_fenced = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_fenced = !is_fenced;
        } else if !is_fenced && !line.starts_with("    ") {
            prose.push_str(line);
            prose.push('\n');
        }
    }
    let outside = prose.split('`').step_by(2);
    outside.collect::<Vec<_>>().join("`")
}

/// The targets of links and images that do not lead to other sites.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let targets = prose.split("](").skip(1);
    let targets = targets.filter_map(|rest| rest.split_once(')').map(|(target, _)| target));
    let ours = targets.filter(|target| !target.contains("://") && !target.starts_with("mailto:"));
    ours.map(|target| target.split_whitespace().collect())
        .collect()
}

/// Whether there are the file and, in it, the heading that a link of a document names.
fn leads_somewhere(document: &Path, link: &str) -> bool {
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = if file.is_empty() {
        document.to_owned()
    } else {
        let folder = document.parent().unwrap_or(Path::new(""));
        folder.join(file)
    };
    if anchor.is_empty() {
        return target.exists();
    }
    fs::read_to_string(&target).is_ok_and(|text| anchors(&text).contains(anchor))
}

/// The names by which a document's headings, and its own `<a id="...">`, are linked to.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    let mut is_fenced = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_fenced = !is_fenced;
        } else if !is_fenced && line.starts_with('#') {
            anchors.insert(anchor_of(line.trim_start_matches('#').trim()));
        }
        for rest in line.split("<a id=\"").skip(1) {
            anchors.extend(rest.split_once('"').map(|(id, _)| id.to_owned()));
        }
    }
    anchors
}

/// The name by which GitHub links to a heading.
fn anchor_of(heading: &str) -> String {
    let kept = heading.chars().filter_map(|character| match character {
        ' ' => Some('-'),
        '-' | '_' => Some(character),
        _ if character.is_alphanumeric() => Some(character),
        _ => None,
    });
    kept.flat_map(char::to_lowercase).collect()
}
