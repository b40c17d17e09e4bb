//! What was recorded as files: a session's mask, its video, its shard, and a session as one tar file that is made while
//! it is sent. The length is known beforehand, so that a download that broke off shows.

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;
use std::time::UNIX_EPOCH;

use axum::body::{Body, Bytes};
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use relit_data::session::{INDEX_FILE, MANIFEST_FILE};
use tokio::sync::mpsc::{Sender, channel};
use tokio::task::spawn_blocking;
use tokio_stream::wrappers::ReceiverStream;

use super::library::Library;
use super::permits::{Permits, Work, permit};
use relit_web::Failure;

/// Unit of a tar file, bytes.
const BLOCK: u64 = 512;
/// Bytes that are sent at once.
const CHUNK: usize = 256 << 10;
/// Chunks that wait for the client.
const AHEAD: usize = 2;

/// The video file
///
/// As the camera's stream was written, for download.
pub(super) async fn video(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let name = attachment(&id, "mkv");
    let path = move || library.video_file(&id).map(|video| video.path);
    send_file(&permits, &name, "video/x-matroska", path).await
}

/// The shard
///
/// The session's samples in the data set, for download.
pub(super) async fn shard(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    // The session itself is saved as `<session>.tar`.
    let name = attachment(&id, "shard.tar");
    let path = move || library.shard_file(&id);
    send_file(&permits, &name, "application/x-tar", path).await
}

/// Sends the file that `path` finds.
async fn send_file(
    permits: &Permits,
    name: &str,
    kind: &str,
    path: impl FnOnce() -> Result<PathBuf, Failure> + Send + 'static,
) -> Result<Response, Failure> {
    let file = permits.run(Work::Listing, move || {
        SentFile::from_path(path()?).map_err(unread)
    });
    let file = file.await?;
    send(permits, name, kind, file.bytes, move |to| {
        io::copy(&mut file.open()?, to).map(drop)
    })
}

/// A session
///
/// All its files as one tar file, under `<session>/`: unpacked it is a session that `relit-mask` and
/// `relit-extract` take. The length is sent before: a download that broke off is shorter.
pub(super) async fn session_tar(
    library: Arc<Library>,
    permits: Arc<Permits>,
    id: String,
) -> Result<Response, Failure> {
    let session = id.clone();
    let files = permits.run(Work::Listing, move || {
        files_of(&library.ended(&id)?).map_err(unread)
    });
    let files = files.await?;
    let blocks = files.iter().map(|file| file.bytes.div_ceil(BLOCK) + 1);
    let length = (blocks.sum::<u64>() + 2) * BLOCK;
    let name = attachment(&session, "tar");
    send(&permits, &name, "application/x-tar", length, move |to| {
        write_tar(&session, &files, to)
    })
}

fn unread(error: io::Error) -> Failure {
    Failure::internal(format!("the session cannot be read: {error}"))
}

/// Sends what `write` writes, `length` bytes. Where it fails, the connection ends early.
fn send(
    permits: &Permits,
    name: &str,
    kind: &str,
    length: u64,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()> + Send + 'static,
) -> Result<Response, Failure> {
    let permit = permit(&permits.downloads, "downloads")?;
    let (sender, receiver) = channel(AHEAD);
    spawn_blocking(move || {
        let _permit = permit;
        let mut chunks = BufWriter::with_capacity(CHUNK, Chunks(sender.clone()));
        let written = write(&mut chunks).and_then(|()| chunks.flush());
        if let Err(error) = written {
            // A client that is gone hears nothing.
            let _ = sender.blocking_send(Err(error));
        }
    });
    let answer = Response::builder()
        .header(header::CONTENT_TYPE, kind)
        .header(header::CONTENT_LENGTH, length)
        .header(header::CONTENT_DISPOSITION, name)
        .body(Body::from_stream(ReceiverStream::new(receiver)));
    answer.map_err(|error| Failure::internal(format!("the answer cannot be made: {error}")))
}

/// Hands what is written to the client.
struct Chunks(Sender<io::Result<Bytes>>);

impl Write for Chunks {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let sent = self.0.blocking_send(Ok(Bytes::copy_from_slice(bytes)));
        sent.map_err(|_| io::ErrorKind::BrokenPipe)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A file to be sent, as it was when its length was promised.
struct SentFile {
    path: PathBuf,
    bytes: u64,
    modified_s: u64,
}

impl SentFile {
    fn from_path(path: PathBuf) -> io::Result<Self> {
        let data = fs::metadata(&path)?;
        let since_epoch = data.modified()?.duration_since(UNIX_EPOCH);
        Ok(Self {
            path,
            bytes: data.len(),
            modified_s: since_epoch.unwrap_or_default().as_secs(),
        })
    }

    /// Its content, if it is still the same. One that becomes shorter while it is sent breaks the promise of the
    /// length, which ends the connection.
    fn open(&self) -> io::Result<impl Read + use<>> {
        let now = Self::from_path(self.path.clone())?;
        if (now.bytes, now.modified_s) == (self.bytes, self.modified_s) {
            Ok(File::open(&self.path)?.take(self.bytes))
        } else {
            Err(io::Error::other("the file has changed since"))
        }
    }
}

fn write_tar(session: &str, files: &[SentFile], to: &mut dyn Write) -> io::Result<()> {
    let mut tar = tar::Builder::new(to);
    for file in files {
        let mut header = tar::Header::new_ustar();
        let name = file.path.file_name().unwrap_or_default();
        header.set_path(FilePath::new(session).join(name))?;
        header.set_entry_type(tar::EntryType::Regular);
        header.set_mode(0o644);
        header.set_mtime(file.modified_s);
        header.set_size(file.bytes);
        header.set_cksum();
        tar.append(&header, file.open()?)?;
    }
    tar.finish()
}

/// The files of a session folder, the manifest and the index first: neither links nor what a recorder or
/// `relit-mask` writes at the moment.
fn files_of(folder: &FilePath) -> io::Result<Vec<SentFile>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if let Ok(name) = entry.file_name().into_string()
            && entry.file_type()?.is_file()
            && !name.starts_with('.')
        {
            names.push(name);
        }
    }
    let rank = |name: &str| {
        let mut first = [MANIFEST_FILE, INDEX_FILE].iter();
        first.position(|&first| first == name).unwrap_or(usize::MAX)
    };
    names.sort_by_key(|name| (rank(name), name.clone()));
    let files = names
        .iter()
        .map(|name| SentFile::from_path(folder.join(name)));
    files.collect()
}

/// The mask
pub(super) async fn mask(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let png = permits
        .run(Work::Listing, move || library.mask(&id))
        .await?;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
}

/// The name under which a browser saves the file (RFC 6266, RFC 8187).
fn attachment(session: &str, ending: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.');
    let name: String = session
        .bytes()
        .map(|byte| {
            if plain(byte) {
                char::from(byte).to_string()
            } else {
                format!("%{byte:02X}")
            }
        })
        .collect();
    format!("attachment; filename*=UTF-8''{name}.{ending}")
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_replaced_meanwhile_ends_the_tar_file() {
        let folder = tempfile::tempdir().unwrap();
        let manifest = folder.path().join(MANIFEST_FILE);
        fs::write(&manifest, "{}").unwrap();
        let files = files_of(folder.path()).unwrap();
        let sent = || write_tar("20261120T093015Z-mug", &files, &mut Vec::new());
        assert!(sent().is_ok());
        // A longer one would be sent in part, as if it were whole.
        fs::write(&manifest, r#"{"note": "a fly"}"#).unwrap();
        assert!(sent().is_err());
    }
}
