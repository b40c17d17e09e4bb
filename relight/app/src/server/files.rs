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

/// The files of the page.
#[derive(Debug, Clone)]
pub struct PageFiles {
    files: BTreeMap<String, PageFile>,
}

/// A file.
#[derive(Debug, Clone)]
pub(super) struct PageFile {
    pub(super) content: axum::body::Bytes,
    pub(super) kind: &'static str,
    /// In quotes, as HTTP has it.
    pub(super) tag: String,
}

/// Why a page cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageFault {
    /// There is none.
    #[error("{} holds no page of relight: build it by 'make app', or give its folder by --page", path.display())]
    NoPage {
        /// The folder.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// The list of its files is none.
    #[error("{} is no list of the page's files: build the page again by 'make app'", path.display())]
    List {
        /// The list.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A file of the list is missing, or leads elsewhere.
    #[error("{} of the page cannot be read: build the page again by 'make app'", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
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

#[derive(Deserialize)]
struct FileList {
    files: Vec<String>,
}

impl PageFiles {
    /// Reads the page of a folder.
    ///
    /// # Errors
    /// Where there is none, or a file of its list is missing.
    pub fn read(folder: &Path) -> Result<Self, PageFault> {
        let path = folder.join(LIST);
        let list = fs::read(&path).map_err(|source| PageFault::NoPage {
            path: folder.to_owned(),
            source,
        })?;
        let FileList { files: names } =
            serde_json::from_slice(&list).map_err(|source| PageFault::List { path, source })?;
        let mut files = BTreeMap::new();
        for name in names {
            let path = folder.join(&name);
            let content = if is_plain(&name) {
                fs::read(&path)
            } else {
                Err(io::ErrorKind::InvalidInput.into())
            };
            let content = content.map_err(|source| PageFault::Missing { path, source })?;
            files.insert(name.clone(), PageFile::new(&name, content));
        }
        files.insert(LIST.to_owned(), PageFile::new(LIST, list));
        Ok(Self { files })
    }

    /// The file of this name.
    pub(super) fn get(&self, name: &str) -> Option<&PageFile> {
        self.files.get(name)
    }

    /// How many there are, and their bytes.
    #[must_use]
    pub fn size(&self) -> (usize, u64) {
        let bytes = self.files.values().map(|file| file.content.len() as u64);
        (self.files.len(), bytes.sum())
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
        let texts = texts.iter().map(|(name, text)| (*name, text.as_bytes()));
        let own = self
            .files
            .iter()
            .map(|(name, file)| (name.as_str(), &file.content[..]));
        // The list comes last: what it names is there.
        let (list, files): (Vec<_>, Vec<_>) = own.chain(texts).partition(|(name, _)| *name == LIST);
        for (name, content) in files.into_iter().chain(list) {
            let path = folder.join(name);
            write_whole(&path, content).map_err(failed(&path))?;
        }
        Ok(())
    }
}

impl PageFile {
    fn new(name: &str, content: Vec<u8>) -> Self {
        Self {
            kind: kind(name),
            tag: format!("\"{}\"", &blake3::hash(&content).to_hex()[..32]),
            content: content.into(),
        }
    }
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
         The server has to send .wasm as application/wasm. It should send these headers, which many hosts read\n\
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
            r#"{"version": "1", "files": ["index.html", "a.wasm"]}"#,
        )
        .unwrap();
        fs::write(folder.join("index.html"), "<!doctype html>").unwrap();
        fs::write(folder.join("a.wasm"), b"\0asm").unwrap();
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
        assert_eq!(PageFiles::read(&out).unwrap().size(), files.size());
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
        let fault = PageFiles::read(folder.path()).unwrap_err().to_string();
        assert!(fault.contains("make app"), "{fault}");
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
        fs::remove_file(built.join("a.wasm")).unwrap();
        assert!(matches!(
            PageFiles::read(&built),
            Err(PageFault::Missing { .. })
        ));
        fs::write(built.join(LIST), r#"{"files": ["../secret"]}"#).unwrap();
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
}
