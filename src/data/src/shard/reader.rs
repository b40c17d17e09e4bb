//! Reading any WebDataset shard as a stream of samples. Knows nothing of sessions and records: a
//! sample is a key and the members that share it.

use std::io::Read;

use super::ShardError;
use super::tar_reader::{Member, TarReader, too_large};

/// Largest total size of the members of a sample, bytes.
pub(super) const MAX_BYTES: u64 = 256 << 20;
/// Largest number of members of a sample.
const MAX_MEMBERS: usize = 64;

/// One sample of a shard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShardSample {
    /// The members' common path up to the first dot of its last part:
    /// `20261120T093015Z-mug/0007`. A label only: it may be absolute or contain `..`.
    pub key: String,
    /// For each member, in the order of the tar, its name after the key and the dot (`png`,
    /// `mask.png`, `json`) and its bytes.
    pub members: Vec<(String, Vec<u8>)>,
}

impl ShardSample {
    /// The bytes of the member with this suffix.
    pub fn member(&self, suffix: &str) -> Option<&[u8]> {
        self.members
            .iter()
            .find(|(name, _)| name == suffix)
            .map(|(_, data)| data.as_slice())
    }
}

/// An iterator over the samples of a shard, by the rule of WebDataset: adjacent members with the
/// same key are one sample. Names without a dot are skipped. At most one sample is in memory, of at
/// most 256 MiB and 64 members.
///
/// A shard that is damaged or truncated gives one error ([`ShardError::ShardTruncated`],
/// [`ShardError::ShardDamaged`], [`ShardError::Refused`], [`ShardError::ShardRead`]) and then ends; the sample that is
/// affected is not returned.
pub struct ShardReader<R> {
    tar: TarReader<R>,
    /// The first member of the next sample.
    ahead: Option<(String, String, Vec<u8>)>,
    ended: bool,
}

impl<R: Read> ShardReader<R> {
    /// Reads a tar from `source`, which should be buffered.
    pub fn new(source: R) -> Self {
        Self {
            tar: TarReader::new(source, MAX_BYTES),
            ahead: None,
            ended: false,
        }
    }

    fn next_sample(&mut self) -> Result<Option<ShardSample>, ShardError> {
        let first = match self.ahead.take() {
            Some(first) => Some(first),
            None => self.next_member()?,
        };
        let Some((key, suffix, data)) = first else {
            return Ok(None);
        };
        let mut bytes = data.len() as u64;
        let mut sample = ShardSample {
            key,
            members: vec![(suffix, data)],
        };
        while let Some((key, suffix, data)) = self.next_member()? {
            if key != sample.key {
                self.ahead = Some((key, suffix, data));
                break;
            }
            bytes += data.len() as u64;
            sample.add(suffix, data, bytes)?;
        }
        Ok(Some(sample))
    }

    fn next_member(&mut self) -> Result<Option<(String, String, Vec<u8>)>, ShardError> {
        while let Some(Member { path, data, .. }) = self.tar.next()? {
            if let Some((key, suffix)) = split(&path) {
                return Ok(Some((key, suffix, data)));
            }
        }
        Ok(None)
    }
}

impl ShardSample {
    fn add(&mut self, suffix: String, data: Vec<u8>, bytes: u64) -> Result<(), ShardError> {
        let path = || format!("{}.{suffix}", self.key);
        if bytes > MAX_BYTES {
            return Err(too_large(&path(), bytes, MAX_BYTES));
        }
        if self.member(&suffix).is_some() || self.members.len() == MAX_MEMBERS {
            return Err(ShardError::Refused(format!(
                "sample {:?} has {:?} twice, or has more than {MAX_MEMBERS} members: pack the shard again, each member once",
                self.key,
                path()
            )));
        }
        self.members.push((suffix, data));
        Ok(())
    }
}

impl<R: Read> Iterator for ShardReader<R> {
    type Item = Result<ShardSample, ShardError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let sample = self.next_sample().transpose();
        self.ended = !matches!(sample, Some(Ok(_)));
        sample
    }
}

/// Key and suffix of a member's name; none if its last part has no dot or starts with one.
pub(super) fn split(path: &str) -> Option<(String, String)> {
    let base = path.rfind('/').map_or(0, |slash| slash + 1);
    let dot = base + path.get(base..)?.find('.')?;
    if dot == base {
        return None;
    }
    Some((path.get(..dot)?.to_owned(), path.get(dot + 1..)?.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::super::tar_reader::tar_of;
    use super::*;
    use proptest::prelude::*;

    fn read(bytes: &[u8]) -> Vec<Result<ShardSample, ShardError>> {
        ShardReader::new(bytes).collect()
    }

    #[test]
    fn adjacent_members_with_one_key_are_one_sample() {
        let tar = tar_of(&[
            ("README", b"no sample"),
            ("a.b/0001.png", b"1"),
            ("a.b/0001.mask.png", b"2"),
            (".hidden", b"no sample"),
            ("a.b/0002.png", b"3"),
        ]);
        let samples: Vec<_> = read(&tar).into_iter().map(Result::unwrap).collect();
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].key, "a.b/0001");
        assert_eq!(samples[0].member("mask.png"), Some(b"2".as_slice()));
        assert_eq!(samples[1].members, [("png".to_owned(), b"3".to_vec())]);
    }

    #[test]
    fn a_doubled_member_is_an_error_and_ends_the_shard() {
        let results = read(&tar_of(&[
            ("a.png", b"1"),
            ("a.png", b"2"),
            ("b.png", b"3"),
        ]));
        assert_eq!(results.len(), 1);
        assert!(matches!(results[0], Err(ShardError::Refused(_))));
    }

    #[test]
    fn the_samples_before_a_truncation_are_returned() {
        let tar = tar_of(&[("a.png", b"1"), ("b.png", b"2"), ("c.png", b"3")]);
        let results = read(&tar[..tar.len() - 1500]);
        let keys: Vec<_> = results
            .iter()
            .map(|r| r.as_ref().map(|s| s.key.clone()).ok())
            .collect();
        assert_eq!(keys, [Some("a".to_owned()), None]);
    }

    proptest! {
        #[test]
        fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..3000)) {
            let _ = read(&bytes);
        }

        #[test]
        fn a_damaged_shard_never_panics(
            flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        ) {
            let mut tar = tar_of(&[("s/0.png", &[1; 700]), ("s/0.json", b"{}"), ("t.png", b"")]);
            for (at, value) in flips {
                let at = at.index(tar.len());
                tar[at] = value;
            }
            let _ = read(&tar);
        }
    }
}
