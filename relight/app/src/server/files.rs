//! The files of the page, read whole from a folder.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;

/// The list of the files that the page stores for offline use.
pub(super) const LIST: &str = "files.json";
/// What the page may load: only its own files and their scripts.
pub(super) const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; \
    img-src 'self' blob: data:; media-src 'self' blob:; connect-src 'self' blob:; worker-src 'self'; \
    manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Content codings, the smallest result first: the name in HTTP, and how the names of files end that hold a file so.
const CODINGS: [(&str, &str); 2] = [("br", "br"), ("gzip", "gz")];

/// The files of the page.
#[derive(Debug, Clone)]
pub struct PageFiles {
    files: BTreeMap<String, PageFile>,
}

/// A file, which was compressed when the page was built.
#[derive(Debug, Clone)]
pub(super) struct PageFile {
    pub(super) kind: &'static str,
    /// The smallest first; the last is the file itself.
    encodings: Vec<Encoding>,
}

/// The bytes of a file in one content coding.
#[derive(Debug, Clone)]
pub(super) struct Encoding {
    /// The coding's name in HTTP; none of the file itself.
    pub(super) coding: Option<&'static str>,
    pub(super) content: axum::body::Bytes,
    /// In quotes, as HTTP has it.
    pub(super) tag: String,
}

/// Why a page cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PageFault {
    /// There is none where one would be.
    #[error(
        "{} does not contain the app's page: build it with 'make app', install the Debian package relight, or give its folder \
         with --page",
        either(places)
    )]
    NoPage {
        /// Where it would be.
        places: Vec<PathBuf>,
    },
    /// Its list or a file of that is missing, damaged or not whole.
    #[error("the page is incomplete, {} {why}: build it again with 'make app'", path.display())]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// The fault.
        why: String,
    },
}

/// Folders as a sentence names them.
fn either(places: &[PathBuf]) -> String {
    let places = places.iter().map(|place| place.display().to_string());
    places.collect::<Vec<_>>().join(" or ")
}

/// The list: what a browser can ask for, with the bytes of each.
#[derive(Deserialize)]
struct FileList {
    files: BTreeMap<String, u64>,
}

impl PageFiles {
    /// Reads the page of a folder.
    ///
    /// # Errors
    /// If the folder has no page, or a file of its list is missing or incomplete.
    pub fn read(folder: &Path) -> Result<Self, PageFault> {
        let path = folder.join(LIST);
        let list = fs::read(&path).map_err(|_| PageFault::NoPage {
            places: vec![folder.to_owned()],
        })?;
        let listed = serde_json::from_slice(&list).map_err(|fault| PageFault::Incomplete {
            path,
            why: format!("is not a list of its files ({fault})"),
        });
        let FileList { files: listed } = listed?;
        let mut files = BTreeMap::new();
        for (name, expected) in listed {
            files.insert(name.clone(), PageFile::read(folder, &name, expected)?);
        }
        let encodings = vec![Encoding::new(None, list)];
        let kind = kind(LIST);
        files.insert(LIST.to_owned(), PageFile { kind, encodings });
        Ok(Self { files })
    }

    /// The file of this name.
    pub(super) fn get(&self, name: &str) -> Option<&PageFile> {
        self.files.get(name)
    }
}

impl PageFile {
    /// Reads a file and its compressed versions.
    fn read(folder: &Path, name: &str, expected: u64) -> Result<Self, PageFault> {
        let path = folder.join(name);
        let content = if is_plain(name) {
            fs::read(&path)
        } else {
            Err(io::ErrorKind::InvalidInput.into())
        };
        let whole = match content {
            Ok(content) if content.len() as u64 == expected => Ok(content),
            Ok(content) => Err(format!("has {} bytes instead of {expected}", content.len())),
            Err(error) => Err(format!("cannot be read ({error})")),
        };
        let content = whole.map_err(|why| PageFault::Incomplete { path, why })?;
        let compressed = |(coding, ending)| {
            let content = fs::read(folder.join(format!("{name}.{ending}"))).ok()?;
            Some(Encoding::new(Some(coding), content))
        };
        let mut encodings: Vec<_> = CODINGS.into_iter().filter_map(compressed).collect();
        encodings.push(Encoding::new(None, content));
        let kind = kind(name);
        Ok(Self { kind, encodings })
    }

    /// The smallest encoding that a browser accepts by the values of its header `Accept-Encoding`.
    pub(super) fn accepted(&self, accept: &str) -> Option<&Encoding> {
        let accepted =
            |encoding: &&Encoding| encoding.coding.is_none_or(|coding| accepts(accept, coding));
        self.encodings.iter().find(accepted)
    }
}

impl Encoding {
    fn new(coding: Option<&'static str>, content: Vec<u8>) -> Self {
        Self {
            coding,
            tag: format!("\"{}\"", &blake3::hash(&content).to_hex()[..32]),
            content: content.into(),
        }
    }
}

/// Whether a header `Accept-Encoding` names a coding, with a weight above 0 (RFC 9110, section 12.5.3).
fn accepts(accept: &str, coding: &str) -> bool {
    accept.split(',').any(|item| {
        let mut parts = item.split(';').map(str::trim);
        let is_named = parts
            .next()
            .is_some_and(|name| name.eq_ignore_ascii_case(coding));
        let weight = parts.find_map(|part| part.strip_prefix("q="));
        is_named
            && weight.is_none_or(|weight| weight.parse::<f32>().is_ok_and(|weight| weight > 0.0))
    })
}

/// Whether a name is that of a file in the folder itself.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && !name.starts_with('.') && !name.contains(['/', '\\'])
}

fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => relit_web::SCRIPT,
        Some("css") => relit_web::STYLE,
        Some("json") => "application/json",
        Some("webmanifest") => "application/manifest+json",
        Some("wasm") => "application/wasm",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        fs::write(
            folder.join(LIST),
            r#"{"version": "1", "files": {"index.html": 15, "a.wasm": 4}}"#,
        )
        .unwrap();
        fs::write(folder.join("index.html"), "<!doctype html>").unwrap();
        fs::write(folder.join("a.wasm"), b"\0asm").unwrap();
        fs::write(folder.join("a.wasm.br"), "br").unwrap();
        fs::write(folder.join("a.wasm.gz"), "gz").unwrap();
    }

    #[test]
    fn another_server_of_the_page_is_told_the_same_policy() {
        let headers = include_str!("../../page/_headers");
        assert!(headers.contains(&format!("Content-Security-Policy: {POLICY}\n")));
    }

    #[test]
    fn what_is_no_whole_page_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(
            PageFiles::read(folder.path()),
            Err(PageFault::NoPage { .. })
        ));
        let built = folder.path().join("built");
        page(&built);
        fs::write(built.join("a.wasm"), b"\0as").unwrap();
        let incomplete = || match PageFiles::read(&built) {
            Err(PageFault::Incomplete { path, why }) => (path, why),
            other => panic!("{other:?}"),
        };
        let (path, why) = incomplete();
        assert!(
            path.ends_with("a.wasm") && why.contains('3') && why.contains('4'),
            "{why}"
        );
        fs::remove_file(built.join("a.wasm")).unwrap();
        assert!(incomplete().0.ends_with("a.wasm"));
        fs::write(built.join(LIST), r#"{"files": {"../secret": 1}}"#).unwrap();
        fs::write(folder.path().join("secret"), "x").unwrap();
        assert!(incomplete().0.ends_with("secret"));
        fs::write(built.join(LIST), "[").unwrap();
        assert!(incomplete().0.ends_with(LIST));
    }

    #[test]
    fn a_browser_gets_the_smallest_encoding_that_it_accepts() {
        let folder = tempfile::tempdir().unwrap();
        page(folder.path());
        let files = PageFiles::read(folder.path()).unwrap();
        let coding =
            |name: &str, accept: &str| files.get(name).unwrap().accepted(accept).unwrap().coding;
        assert_eq!(coding("a.wasm", "gzip, deflate, br, zstd"), Some("br"));
        assert_eq!(coding("a.wasm", "gzip, deflate"), Some("gzip"));
        assert_eq!(coding("a.wasm", "BR;q=0.5,gzip;q=1.0"), Some("br"));
        assert_eq!(coding("a.wasm", "br;q=0, gzip; q=0.1"), Some("gzip"));
        for accept in [
            "", "identity", "deflate", "gzip;q=0", "gzip;q=x", "xbr, brr",
        ] {
            assert_eq!(coding("a.wasm", accept), None, "{accept}");
        }
        assert_eq!(coding("index.html", "br, gzip"), None);
    }
}
