//! What is downloaded: a file, or sessions as one tar file that is made while it is sent. The length is
//! known beforehand, so that a download that broke off shows, and can go on where it ended.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use axum::body::Bytes;
use futures_util::Stream;
use relit_data::session::{INDEX_FILE, MANIFEST_FILE};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::spawn_blocking;

/// Unit of a tar file, bytes.
const BLOCK: u64 = 512;
/// Bytes that are read at once.
const CHUNK: usize = 256 << 10;
/// Chunks that wait for the client.
const AHEAD: usize = 2;

/// A part of the tar file.
#[derive(Debug, Clone)]
enum Piece {
    Bytes(Vec<u8>),
    File(Part),
}

/// A file as it was when the tar file's headers were made.
#[derive(Debug, Clone)]
struct Part {
    path: PathBuf,
    bytes: u64,
    modified: SystemTime,
}

impl Part {
    /// A file as it is now; its time goes into `version`.
    fn of(path: PathBuf, version: &mut blake3::Hasher) -> io::Result<Self> {
        let data = fs::metadata(&path)?;
        let modified = data.modified()?;
        let since_epoch = modified.duration_since(UNIX_EPOCH).unwrap_or_default();
        version.update(&since_epoch.as_nanos().to_le_bytes());
        Ok(Self {
            path,
            bytes: data.len(),
            modified,
        })
    }

    /// Opens it, if it is still the same.
    fn open(&self) -> io::Result<File> {
        let file = File::open(&self.path)?;
        let data = file.metadata()?;
        match data.len() == self.bytes && data.modified()? == self.modified {
            true => Ok(file),
            false => Err(io::Error::other("the file has changed since")),
        }
    }
}

impl Piece {
    fn len(&self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::File(part) => part.bytes,
        }
    }
}

/// A file, or a tar file that is not there yet.
#[derive(Debug, Clone)]
pub(super) struct Archive {
    pieces: Vec<Piece>,
    version: blake3::Hash,
}

impl Archive {
    /// A file as it is.
    pub(super) fn of_file(path: &Path) -> io::Result<Self> {
        let mut version = blake3::Hasher::new();
        let part = Part::of(path.to_owned(), &mut version)?;
        version.update(&part.bytes.to_le_bytes());
        Ok(Self {
            version: version.finalize(),
            pieces: vec![Piece::File(part)],
        })
    }

    /// The tar file of session folders: all their files but hidden ones, each under
    /// `<session>/<file>`.
    pub(super) fn of(folders: &[(String, PathBuf)]) -> io::Result<Self> {
        let mut pieces = Vec::new();
        let mut version = blake3::Hasher::new();
        for (session, folder) in folders {
            for (name, path) in files_of(folder)? {
                let part = Part::of(path, &mut version)?;
                let bytes = part.bytes;
                let since_epoch = part.modified.duration_since(UNIX_EPOCH);
                let mut header = tar::Header::new_ustar();
                header.set_path(format!("{session}/{name}"))?;
                header.set_entry_type(tar::EntryType::Regular);
                header.set_mode(0o644);
                header.set_mtime(since_epoch.unwrap_or_default().as_secs());
                header.set_size(bytes);
                header.set_cksum();
                version.update(header.as_bytes());
                pieces.push(Piece::Bytes(header.as_bytes().to_vec()));
                pieces.push(Piece::File(part));
                let padding = bytes.next_multiple_of(BLOCK) - bytes;
                pieces.push(Piece::Bytes(vec![0; padding as usize]));
            }
        }
        pieces.push(Piece::Bytes(vec![0; 2 * BLOCK as usize]));
        Ok(Self {
            pieces,
            version: version.finalize(),
        })
    }

    /// Its length, bytes.
    pub(super) fn len(&self) -> u64 {
        self.pieces.iter().map(Piece::len).sum()
    }

    /// What differs between one state of these files and another, for `ETag`.
    pub(super) fn version(&self) -> String {
        format!("\"{}\"", &self.version.to_hex()[..32])
    }

    /// Its bytes from `from` on, so many. A file that is another one by the time it is sent ends them
    /// with an error, and the connection with it.
    pub(super) fn read(self, from: u64, bytes: u64) -> impl Stream<Item = io::Result<Bytes>> {
        let (sender, receiver) = channel(AHEAD);
        spawn_blocking(move || {
            if let Err(error) = send(&self.pieces, from, bytes, &sender) {
                // A client that is gone hears nothing.
                let _ = sender.blocking_send(Err(error));
            }
        });
        futures_util::stream::unfold(receiver, |mut receiver: Receiver<_>| async move {
            Some((receiver.recv().await?, receiver))
        })
    }
}

type Chunks = Sender<io::Result<Bytes>>;

fn send(pieces: &[Piece], from: u64, bytes: u64, to: &Chunks) -> io::Result<()> {
    let (mut skip, mut left) = (from, bytes);
    for piece in pieces {
        let length = piece.len();
        if skip >= length {
            skip -= length;
            continue;
        }
        let wanted = (length - skip).min(left);
        match piece {
            Piece::Bytes(bytes) => {
                let range = skip as usize..(skip + wanted) as usize;
                let part = bytes.get(range).unwrap_or_default();
                give(to, Bytes::copy_from_slice(part))?;
            }
            Piece::File(part) => send_file(part, skip, wanted, to)?,
        }
        skip = 0;
        left -= wanted;
        if left == 0 {
            break;
        }
    }
    Ok(())
}

fn send_file(part: &Part, from: u64, mut left: u64, to: &Chunks) -> io::Result<()> {
    let mut file = part.open()?;
    file.seek(SeekFrom::Start(from))?;
    while left > 0 {
        let mut chunk = vec![0; CHUNK.min(usize::try_from(left).unwrap_or(CHUNK))];
        file.read_exact(&mut chunk)?;
        left -= chunk.len() as u64;
        give(to, chunk.into())?;
    }
    Ok(())
}

fn give(to: &Chunks, chunk: Bytes) -> io::Result<()> {
    to.blocking_send(Ok(chunk))
        .map_err(|_| io::ErrorKind::BrokenPipe.into())
}

/// The files of a session folder, the manifest and the index first.
fn files_of(folder: &Path) -> io::Result<Vec<(String, PathBuf)>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        // Neither links nor what a recorder or `relit-mask` writes at the moment.
        if entry.file_type()?.is_file() && !name.starts_with('.') {
            files.push((name, entry.path()));
        }
    }
    let rank = |name: &str| {
        [MANIFEST_FILE, INDEX_FILE]
            .iter()
            .position(|&first| first == name)
    };
    files.sort_by_key(|(name, _)| (rank(name).unwrap_or(usize::MAX), name.clone()));
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_replaced_meanwhile_ends_the_tar_file() {
        let folder = tempfile::tempdir().unwrap();
        let manifest = folder.path().join(MANIFEST_FILE);
        fs::write(&manifest, "{}").unwrap();
        let session = ("20261120T093015Z-mug".to_owned(), folder.path().to_owned());
        let archive = Archive::of(&[session]).unwrap();
        let sent = || {
            let (sender, _receiver) = channel(8);
            send(&archive.pieces, 0, archive.len(), &sender)
        };
        assert!(sent().is_ok());
        // A longer one would be sent in part, as if it were whole.
        fs::write(&manifest, r#"{"note": "a fly"}"#).unwrap();
        assert!(sent().is_err());
    }
}
