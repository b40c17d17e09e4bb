//! BLAKE3 digests of bytes, files, streams and folders.

use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

/// A BLAKE3 digest of 32 bytes, written as 64 hexadecimal digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Digest([u8; 32]);

impl Digest {
    /// The digest of `bytes`.
    pub fn hash(bytes: &[u8]) -> Self {
        blake3::hash(bytes).into()
    }

    /// The length in bytes and the digest of the file at `path`, which is read once, in pieces.
    ///
    /// # Errors
    /// If the file cannot be opened or read.
    pub fn hash_file(path: &Path) -> io::Result<(u64, Self)> {
        let mut reader = Hashing::new(File::open(path)?);
        reader.drain()?;
        Ok(reader.digest())
    }

    /// The 32 bytes.
    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

impl From<blake3::Hash> for Digest {
    fn from(hash: blake3::Hash) -> Self {
        Self(*hash.as_bytes())
    }
}

impl From<Digest> for String {
    fn from(digest: Digest) -> Self {
        digest.to_string()
    }
}

impl TryFrom<String> for Digest {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match blake3::Hash::from_hex(&text) {
            Ok(hash) => Ok(hash.into()),
            Err(_) => Err(format!(
                "{text:?} is not a BLAKE3 digest: 64 hexadecimal digits were expected"
            )),
        }
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(blake3::Hash::from_bytes(self.0).to_hex().as_str())
    }
}

/// The digest of a folder of images: BLAKE3 over the digests of the images, 32 bytes each, in order.
#[derive(Default)]
pub(super) struct FolderHasher(blake3::Hasher);

impl FolderHasher {
    pub(super) fn add(&mut self, member: &Digest) {
        self.0.update(member.as_bytes());
    }

    pub(super) fn finish(&self) -> Digest {
        self.0.finalize().into()
    }
}

/// A reader or writer that counts and hashes the bytes that pass through it.
pub(super) struct Hashing<T> {
    inner: T,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<T> Hashing<T> {
    pub(super) fn new(inner: T) -> Self {
        Self {
            inner,
            hasher: blake3::Hasher::new(),
            bytes: 0,
        }
    }

    /// The number of bytes so far and their digest.
    pub(super) fn digest(&self) -> (u64, Digest) {
        (self.bytes, self.hasher.finalize().into())
    }

    pub(super) fn into_inner(self) -> T {
        self.inner
    }

    fn take(&mut self, bytes: &[u8]) {
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
    }
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(buffer)?;
        self.take(buffer.get(..written).unwrap_or(buffer));
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<R: Read> Hashing<R> {
    /// Reads to the end and returns the number of bytes read.
    pub(super) fn drain(&mut self) -> io::Result<u64> {
        let mut rest = BufReader::with_capacity(1 << 17, self);
        io::copy(&mut rest, &mut io::sink())
    }
}

impl<R: Read> Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.take(buffer.get(..read).unwrap_or_default());
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_written_as_hexadecimal_and_read_back() {
        let digest = Digest::hash(b"relit");
        let json = serde_json::to_string(&digest).unwrap();
        assert_eq!(json.len(), 66);
        assert_eq!(serde_json::from_str::<Digest>(&json).unwrap(), digest);
    }

    #[test]
    fn a_text_that_is_no_digest_is_refused() {
        for text in ["", "00", &"g".repeat(64), &"0".repeat(65)] {
            assert!(Digest::try_from(text.to_owned()).is_err(), "{text}");
        }
    }

    #[test]
    fn a_stream_has_the_digest_of_its_bytes_when_written_and_when_read() {
        let bytes = vec![7_u8; 300_000];
        let mut writer = Hashing::new(Vec::new());
        writer.write_all(&bytes).unwrap();
        let (written, digest) = writer.digest();
        let copy = writer.into_inner();
        let mut reader = Hashing::new(copy.as_slice());
        assert_eq!(reader.drain().unwrap(), 300_000);
        assert_eq!(reader.digest(), (written, digest));
        assert_eq!(digest, Digest::hash(&bytes));
    }
}
