//! The tar that a shard is: headers as they are written, and a reader for any tar, member by member,
//! with bounded memory and without trusting the input.

use std::io::{self, Read, Seek};

use tar::{EntryType, Header};

use super::ShardError;

/// Size of a tar's blocks, bytes.
pub(super) const BLOCK: usize = 512;
/// Largest extension header (long names) that is read, bytes.
const MAX_EXTENSION: u64 = 1 << 20;

type Block = [u8; BLOCK];

/// The header of a member as it is written: without time, user or machine.
pub(super) fn header(path: &str, bytes: u64) -> io::Result<Header> {
    let mut header = Header::new_ustar();
    header.set_path(path)?;
    header.set_size(bytes);
    header.set_mode(0o644);
    header.set_uid(0);
    header.set_gid(0);
    header.set_mtime(0);
    header.set_entry_type(EntryType::Regular);
    header.set_cksum();
    Ok(header)
}

/// One file in a tar.
pub(super) struct Member {
    /// Offset of its header, bytes.
    pub(super) offset: u64,
    /// Its name. A label only: it may be absolute or contain `..`.
    pub(super) path: String,
    pub(super) data: Vec<u8>,
    /// True if the header is byte for byte what [`header`] gives, and the padding after the data is
    /// zero.
    pub(super) canonical: bool,
}

/// Where a file stands in a tar.
pub(super) struct MemberSpan {
    /// Its name, as in [`Member`].
    pub(super) path: String,
    /// Where the first of its headers starts.
    pub(super) start: u64,
    /// Where the padding after its data ends.
    pub(super) end: u64,
}

/// Reads the regular files of a tar as a stream. Folders, links and the like are skipped; long names
/// of GNU tar and of pax are supported.
pub(super) struct TarReader<R> {
    source: R,
    /// Bytes read from the source.
    offset: u64,
    /// The header at which [`Self::resume`] stopped.
    found: Option<Block>,
    limit: u64,
    ended: bool,
}

/// The header of a file whose data come next.
struct Head {
    /// Where the first of its headers starts: its own, or an extension header before it.
    first: u64,
    /// Where its own header starts.
    offset: u64,
    block: Block,
    /// Length of the data.
    bytes: u64,
    named: Extensions,
}

impl<R: Read> TarReader<R> {
    /// Reads `source`; a member of more than `limit` bytes is an error.
    pub(super) fn new(source: R, limit: u64) -> Self {
        Self {
            source,
            offset: 0,
            found: None,
            limit,
            ended: false,
        }
    }

    /// The source, positioned after what was read.
    pub(super) fn into_inner(self) -> R {
        self.source
    }

    /// The next file; `None` after the two empty blocks that end a tar.
    pub(super) fn next(&mut self) -> Result<Option<Member>, ShardError> {
        match self.next_head()? {
            Some(head) => self.member(head).map(Some),
            None => Ok(None),
        }
    }

    /// Goes to the data of the next file.
    fn next_head(&mut self) -> Result<Option<Head>, ShardError> {
        let mut named = Extensions::default();
        let mut first = None;
        while !self.ended {
            let start = self.offset
                - if self.found.is_some() {
                    BLOCK as u64
                } else {
                    0
                };
            let block = self.header_block()?;
            if is_zero(&block) {
                self.end(start)?;
                continue;
            }
            let header = valid_header(&block).ok_or_else(|| no_header(start))?;
            let claimed = header.entry_size().map_err(|_| no_header(start))?;
            let bytes = named.size.unwrap_or(claimed);
            match header.entry_type() {
                EntryType::Regular | EntryType::Continuous => {
                    return Ok(Some(Head {
                        first: first.unwrap_or(start),
                        offset: start,
                        block,
                        bytes,
                        named,
                    }));
                }
                EntryType::GNULongName | EntryType::XHeader => {
                    first.get_or_insert(start);
                    let path = String::from("an extension header");
                    let data = self.data(start, &path, claimed, MAX_EXTENSION)?.0;
                    named.add(header.entry_type(), &data);
                }
                EntryType::GNUSparse => return Err(no_header(start)),
                EntryType::GNULongLink | EntryType::XGlobalHeader => self.skip(claimed)?,
                _ => {
                    self.skip(bytes)?;
                    named = Extensions::default();
                    first = None;
                }
            }
        }
        Ok(None)
    }

    /// After an error in the middle of a tar: searches block by block for the next header. False if
    /// there is none.
    pub(super) fn resume(&mut self) -> Result<bool, ShardError> {
        self.skip_padding()?;
        loop {
            let block = match self.header_block() {
                Ok(block) => block,
                Err(ShardError::ShardTruncated(_)) => return Ok(false),
                Err(error) => return Err(error),
            };
            if valid_header(&block).is_some() {
                self.found = Some(block);
                return Ok(true);
            }
        }
    }

    fn end(&mut self, start: u64) -> Result<(), ShardError> {
        if is_zero(&self.header_block()?) {
            self.ended = true;
            Ok(())
        } else {
            Err(no_header(start))
        }
    }

    fn member(&mut self, head: Head) -> Result<Member, ShardError> {
        let Head {
            offset,
            block,
            bytes,
            ..
        } = head;
        let own = Header::from_byte_slice(&block);
        let extended = head.named.path.is_some() || head.named.size.is_some();
        let path = head.named.path_of(own, offset);
        let label = path.as_deref().unwrap_or("a member without a name");
        let (data, padding_is_zero) = self.data(offset, label, bytes, self.limit)?;
        let path = path?;
        let as_written =
            header(&path, bytes).is_ok_and(|written| written.as_bytes() == own.as_bytes());
        let canonical = padding_is_zero && as_written && !extended;
        Ok(Member {
            offset,
            path,
            data,
            canonical,
        })
    }

    /// The data of a member, and whether the padding after it is zero. Memory grows with the data
    /// that is there, not with the size that the header claims.
    fn data(
        &mut self,
        start: u64,
        path: &str,
        bytes: u64,
        limit: u64,
    ) -> Result<(Vec<u8>, bool), ShardError> {
        if bytes > limit {
            return Err(too_large(path, start, limit));
        }
        let data = self.read(bytes)?;
        Ok((data, self.skip_padding()?))
    }

    /// Skips to the next block; returns whether all skipped bytes are zero.
    fn skip_padding(&mut self) -> Result<bool, ShardError> {
        let padding = self.offset.next_multiple_of(BLOCK as u64) - self.offset;
        Ok(is_zero(&self.read(padding)?))
    }

    fn skip(&mut self, bytes: u64) -> Result<(), ShardError> {
        let skipped = io::copy(&mut (&mut self.source).take(bytes), &mut io::sink());
        let skipped = skipped.map_err(|source| self.unread(source))?;
        self.offset += skipped;
        if skipped < bytes {
            return Err(ShardError::ShardTruncated(self.offset));
        }
        self.skip_padding().map(|_| ())
    }

    fn header_block(&mut self) -> Result<Block, ShardError> {
        if let Some(block) = self.found.take() {
            return Ok(block);
        }
        let block = self.read(BLOCK as u64)?;
        Ok(block.try_into().unwrap_or([0; BLOCK]))
    }

    fn read(&mut self, bytes: u64) -> Result<Vec<u8>, ShardError> {
        let mut data = Vec::new();
        let read = (&mut self.source).take(bytes).read_to_end(&mut data);
        self.offset += data.len() as u64;
        read.map_err(|source| self.unread(source))?;
        if (data.len() as u64) < bytes {
            Err(ShardError::ShardTruncated(self.offset))
        } else {
            Ok(data)
        }
    }

    fn unread(&self, source: io::Error) -> ShardError {
        let offset = self.offset;
        ShardError::ShardRead { offset, source }
    }
}

impl<R: Read + Seek> TarReader<R> {
    /// The next file without its data, in a source of `length` bytes; `None` at the end.
    pub(super) fn next_span(&mut self, length: u64) -> Result<Option<MemberSpan>, ShardError> {
        let Some(head) = self.next_head()? else {
            return Ok(None);
        };
        let path = head
            .named
            .path_of(Header::from_byte_slice(&head.block), head.offset)?;
        if head.bytes > self.limit {
            return Err(too_large(&path, head.offset, self.limit));
        }
        let end = self.offset + head.bytes.next_multiple_of(BLOCK as u64);
        if end > length {
            return Err(ShardError::ShardTruncated(length));
        }
        self.jump(end)?;
        Ok(Some(MemberSpan {
            path,
            start: head.first,
            end,
        }))
    }

    fn jump(&mut self, to: u64) -> Result<(), ShardError> {
        let by = i64::try_from(to - self.offset).unwrap_or(i64::MAX);
        let jumped = self.source.seek_relative(by);
        jumped.map_err(|source| self.unread(source))?;
        self.offset = to;
        Ok(())
    }
}

fn damaged(offset: u64, what: String) -> ShardError {
    ShardError::ShardDamaged { offset, what }
}

fn no_header(offset: u64) -> ShardError {
    damaged(offset, "the block is not a tar header".to_owned())
}

/// That a member, or a sample, is too large to be held in memory.
pub(super) fn too_large(path: &str, offset: u64, limit: u64) -> ShardError {
    damaged(
        offset,
        format!("{path:?} claims more than the limit of {limit} bytes"),
    )
}

/// Path and size that extension headers give for the member that follows them.
#[derive(Default)]
struct Extensions {
    path: Option<Vec<u8>>,
    size: Option<u64>,
}

impl Extensions {
    /// The member's name: from the extensions, else from its own header.
    fn path_of(self, own: &Header, offset: u64) -> Result<String, ShardError> {
        let name = self.path.unwrap_or_else(|| own.path_bytes().into_owned());
        let not_text = |_| damaged(offset, "the name of its member is not UTF-8".to_owned());
        String::from_utf8(name).map_err(not_text)
    }

    fn add(&mut self, kind: EntryType, data: &[u8]) {
        if kind == EntryType::GNULongName {
            self.path = data.split(|&byte| byte == 0).next().map(<[u8]>::to_vec);
            return;
        }
        for (key, value) in pax_records(data) {
            match key {
                b"path" => self.path = Some(value.to_vec()),
                b"size" => {
                    self.size = std::str::from_utf8(value)
                        .ok()
                        .and_then(|text| text.parse().ok());
                }
                _ => {}
            }
        }
    }
}

/// The records `LENGTH KEY=VALUE\n` of a pax header, up to the first malformed one.
fn pax_records(mut data: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    std::iter::from_fn(move || {
        let space = data.iter().position(|&byte| byte == b' ')?;
        let length: usize = std::str::from_utf8(data.get(..space)?).ok()?.parse().ok()?;
        let record = data.get(space + 1..length)?.strip_suffix(b"\n")?;
        data = data.get(length..)?;
        let equals = record.iter().position(|&byte| byte == b'=')?;
        Some((record.get(..equals)?, record.get(equals + 1..)?))
    })
}

/// The block as a header, if its checksum is correct.
fn valid_header(block: &Block) -> Option<&Header> {
    if is_zero(block) {
        return None;
    }
    let header = Header::from_byte_slice(block);
    let mut summed = header.clone();
    summed.set_cksum();
    (header.cksum().ok()? == summed.cksum().ok()?).then_some(header)
}

fn is_zero(bytes: &[u8]) -> bool {
    bytes.iter().all(|&byte| byte == 0)
}

#[cfg(test)]
pub(super) use tests::tar_of;

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(bytes: &[u8]) -> Result<Vec<(String, Vec<u8>, bool)>, ShardError> {
        let mut reader = TarReader::new(bytes, 1 << 20);
        let mut members = Vec::new();
        while let Some(member) = reader.next()? {
            members.push((member.path, member.data, member.canonical));
        }
        Ok(members)
    }

    pub(in crate::shard) fn tar_of(members: &[(&str, &[u8])]) -> Vec<u8> {
        let mut builder = tar::Builder::new(Vec::new());
        for (path, data) in members {
            builder
                .append(&header(path, data.len() as u64).unwrap(), *data)
                .unwrap();
        }
        builder.into_inner().unwrap()
    }

    #[test]
    fn written_members_are_read_back_as_canonical() {
        let long = format!("{}/0000.mask.png", "x".repeat(150));
        let members: [(&str, &[u8]); 3] = [("s/0000.png", b"abc"), (&long, b""), ("b", &[9; 512])];
        let read = read_all(&tar_of(&members)).unwrap();
        for ((path, data, canonical), expected) in read.iter().zip(members) {
            assert_eq!(
                (path.as_str(), data.as_slice(), *canonical),
                (expected.0, expected.1, true)
            );
        }
        assert_eq!(read.len(), 3);
    }

    #[test]
    fn long_names_of_gnu_tar_are_read() {
        let long = format!("{}.png", "y".repeat(300));
        let mut builder = tar::Builder::new(Vec::new());
        let mut header = Header::new_gnu();
        header.set_size(2);
        header.set_mode(0o600);
        builder
            .append_data(&mut header, &long, b"hi".as_slice())
            .unwrap();
        let read = read_all(&builder.into_inner().unwrap()).unwrap();
        assert_eq!(read, [(long, b"hi".to_vec(), false)]);
    }

    #[test]
    fn names_in_pax_headers_are_read() {
        let long = format!("{}.png", "z".repeat(200));
        let mut builder = tar::Builder::new(Vec::new());
        let records = [("mtime", b"1.5".as_slice()), ("path", long.as_bytes())];
        builder.append_pax_extensions(records).unwrap();
        builder
            .append(&super::header("short", 2).unwrap(), b"hi".as_slice())
            .unwrap();
        let read = read_all(&builder.into_inner().unwrap()).unwrap();
        assert_eq!(read, [(long, b"hi".to_vec(), false)]);
    }

    #[test]
    fn a_tar_truncated_anywhere_is_an_error() {
        let tar = tar_of(&[("a.png", b"abc"), ("b.png", b"def")]);
        for end in 0..tar.len() {
            let error = read_all(&tar[..end]).unwrap_err();
            assert!(
                matches!(error, ShardError::ShardTruncated(_)),
                "{end}: {error}"
            );
        }
    }

    #[test]
    fn after_a_damaged_header_the_next_member_is_found() {
        let mut tar = tar_of(&[("a.png", b"abc"), ("b.png", b"def"), ("c.png", b"ghi")]);
        tar[1024] ^= 1;
        let mut reader = TarReader::new(tar.as_slice(), 100);
        assert_eq!(reader.next().unwrap().unwrap().path, "a.png");
        assert!(matches!(
            reader.next(),
            Err(ShardError::ShardDamaged { offset: 1024, .. })
        ));
        assert!(reader.resume().unwrap());
        let member = reader.next().unwrap().unwrap();
        assert_eq!((member.path.as_str(), member.offset), ("c.png", 2048));
        assert!(reader.next().unwrap().is_none());
    }

    #[test]
    fn a_size_above_the_limit_allocates_no_memory() {
        let block = header("a.png", u64::MAX >> 3).unwrap();
        let read = read_all(block.as_bytes());
        assert!(matches!(read, Err(ShardError::ShardDamaged { .. })));
        let block = header("a.png", 1 << 20).unwrap();
        assert!(matches!(
            read_all(block.as_bytes()),
            Err(ShardError::ShardTruncated(_))
        ));
    }
}
