//! The files of the page: read whole from a folder, and written to another for any web server.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::durable::write_whole;
use serde::Deserialize;

/// The list of the files, by which the page keeps them for work without a network.
pub(super) const LIST: &str = "files.json";
/// The headers that a server of the exported page should send, as several hosts read them from a file.
const HEADERS: &str = "_headers";
/// How the page is served, for the person who exported it.
const README: &str = "README.txt";

/// What the page may load: only its own files, and nothing runs in it that is not part of them.
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

/// How large a page is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageSize {
    /// Files that a browser can ask for.
    pub files: usize,
    /// Their bytes.
    pub bytes: u64,
    /// The bytes that a browser receives which takes every coding.
    pub compressed: u64,
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
#[non_exhaustive]
pub enum PageFault {
    /// No folder is there in which a page would be.
    #[error(
        "there is no page of relight in {}: build it by 'make app', install the Debian package relight, or give its folder by --page",
        either(places)
    )]
    NotInstalled {
        /// Where it would be.
        places: Vec<PathBuf>,
    },
    /// The folder has no list of files.
    #[error(
        "{} holds no page of relight: build it by 'make app', install the Debian package relight, or give its folder by --page",
        path.display()
    )]
    NoPage {
        /// The folder.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// The list cannot be parsed.
    #[error("{} is not a list of the page's files: build the page again by 'make app'", path.display())]
    List {
        /// The list.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A file of the list is missing, or leads elsewhere.
    #[error("the page is incomplete, {} cannot be read: build the page again by 'make app'", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// A file is shorter or longer than the list says.
    #[error(
        "the page is incomplete, {} has {found} bytes instead of {expected}: build the page again by 'make app'",
        path.display()
    )]
    Length {
        /// The file.
        path: PathBuf,
        /// Its bytes.
        found: u64,
        /// The bytes that it has in the list.
        expected: u64,
    },
    /// The folder for the export holds something else.
    #[error("{} is not empty, and holds no page of relight: give a new folder", path.display())]
    Occupied {
        /// The folder.
        path: PathBuf,
    },
    /// A file cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
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
    /// Where there is none, or a file of its list is missing or not whole.
    pub fn read(folder: &Path) -> Result<Self, PageFault> {
        let path = folder.join(LIST);
        let list = fs::read(&path).map_err(|source| PageFault::NoPage {
            path: folder.to_owned(),
            source,
        })?;
        let FileList { files: listed } =
            serde_json::from_slice(&list).map_err(|source| PageFault::List { path, source })?;
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

    /// How large it is.
    #[must_use]
    pub fn size(&self) -> PageSize {
        let bytes = |of: fn(&PageFile) -> Option<&Encoding>| {
            let encodings = self.files.values().filter_map(of);
            encodings
                .map(|encoding| encoding.content.len() as u64)
                .sum()
        };
        PageSize {
            files: self.files.len(),
            bytes: bytes(|file| file.encodings.last()),
            compressed: bytes(|file| file.encodings.first()),
        }
    }

    /// Writes the page into a folder, which is made where there is none, with the headers that its server should send. An older
    /// page in it is replaced.
    ///
    /// # Errors
    /// Where the folder holds something else, or a file cannot be written.
    pub fn export(&self, folder: &Path) -> Result<(), PageFault> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            |source| PageFault::Write { path, source }
        };
        fs::create_dir_all(folder).map_err(failed(folder))?;
        let mut others = fs::read_dir(folder).map_err(failed(folder))?;
        if others.next().is_some() && !folder.join(LIST).is_file() {
            return Err(PageFault::Occupied {
                path: folder.to_owned(),
            });
        }
        let texts = [(HEADERS, headers()), (README, readme())];
        let texts = texts.map(|(name, text)| (name.to_owned(), text.into()));
        let own = self.files.iter().flat_map(|(name, file)| file.named(name));
        // The list comes last: what it names is there.
        let (list, files): (Vec<_>, Vec<_>) = own.chain(texts).partition(|(name, _)| name == LIST);
        for (name, content) in files.iter().chain(&list) {
            let path = folder.join(name);
            write_whole(&path, content).map_err(failed(&path))?;
        }
        Ok(())
    }
}

impl PageFile {
    /// Reads a file, and what lies next to it compressed.
    fn read(folder: &Path, name: &str, expected: u64) -> Result<Self, PageFault> {
        let path = folder.join(name);
        let content = if is_plain(name) {
            fs::read(&path)
        } else {
            Err(io::ErrorKind::InvalidInput.into())
        };
        let content = content.map_err(|source| PageFault::Missing {
            path: path.clone(),
            source,
        })?;
        let found = content.len() as u64;
        if found != expected {
            return Err(PageFault::Length {
                path,
                found,
                expected,
            });
        }
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

    /// The files that hold it, with their content.
    fn named<'a>(
        &'a self,
        name: &'a str,
    ) -> impl Iterator<Item = (String, axum::body::Bytes)> + 'a {
        self.encodings.iter().map(move |encoding| {
            let ending = CODINGS
                .iter()
                .find(|(coding, _)| encoding.coding == Some(*coding));
            let name = match ending {
                Some((_, ending)) => format!("{name}.{ending}"),
                None => name.to_owned(),
            };
            (name, encoding.content.clone())
        })
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

/// The headers in the form that static hosts read.
fn headers() -> String {
    format!(
        "/*\n  Content-Security-Policy: {POLICY}\n  X-Content-Type-Options: nosniff\n  \
         Referrer-Policy: no-referrer\n  Cross-Origin-Opener-Policy: same-origin\n  \
         Cross-Origin-Embedder-Policy: require-corp\n"
    )
}

fn readme() -> String {
    format!(
        "The app of relight, for any web server: copy this folder, and serve it by https (or on localhost).\n\
         It is opened by index.html, and works without a network after that. No picture leaves it.\n\n\
         The server has to send .wasm as application/wasm. Large files are here compressed as well, as NAME.br and\n\
         NAME.gz: let it send these where the browser accepts them (nginx: gzip_static and brotli_static; Caddy:\n\
         precompressed br gzip), or compress by itself. It should send these headers, which many hosts read\n\
         from the file _headers:\n\n{}\n\
         The last two make the page isolated from others, which threads would need; the page also works without.\n",
        headers()
    )
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
    fn a_page_is_exported_with_its_headers_and_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let (built, out) = (folder.path().join("built"), folder.path().join("a/out"));
        page(&built);
        let files = PageFiles::read(&built).unwrap();
        files.export(&out).unwrap();
        // A second time over the first.
        files.export(&out).unwrap();
        let size = files.size();
        assert_eq!((size.files, size.bytes - size.compressed), (3, 2));
        assert_eq!(PageFiles::read(&out).unwrap().size(), size);
        let headers = fs::read_to_string(out.join(HEADERS)).unwrap();
        for name in ["Opener", "Embedder"] {
            assert!(
                headers.contains(&format!("Cross-Origin-{name}-Policy: ")),
                "{headers}"
            );
        }
        assert!(
            fs::read_to_string(out.join(README))
                .unwrap()
                .contains("require-corp")
        );
    }

    #[test]
    fn what_is_no_page_is_refused_and_nothing_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(
            PageFiles::read(folder.path()),
            Err(PageFault::NoPage { .. })
        ));
        let built = folder.path().join("built");
        page(&built);
        let files = PageFiles::read(&built).unwrap();
        let other = folder.path().join("other");
        fs::create_dir(&other).unwrap();
        fs::write(other.join("index.html"), "mine").unwrap();
        assert!(matches!(
            files.export(&other),
            Err(PageFault::Occupied { .. })
        ));
        assert_eq!(
            fs::read_to_string(other.join("index.html")).unwrap(),
            "mine"
        );
        fs::write(built.join("a.wasm"), b"\0as").unwrap();
        assert!(matches!(
            PageFiles::read(&built),
            Err(PageFault::Length {
                found: 3,
                expected: 4,
                ..
            })
        ));
        fs::remove_file(built.join("a.wasm")).unwrap();
        assert!(matches!(
            PageFiles::read(&built),
            Err(PageFault::Missing { .. })
        ));
        fs::write(built.join(LIST), r#"{"files": {"../secret": 1}}"#).unwrap();
        fs::write(folder.path().join("secret"), "x").unwrap();
        assert!(matches!(
            PageFiles::read(&built),
            Err(PageFault::Missing { .. })
        ));
        fs::write(built.join(LIST), "[").unwrap();
        assert!(matches!(
            PageFiles::read(&built),
            Err(PageFault::List { .. })
        ));
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
