//! Where the samples of a shard stand, found without reading their data. Knows nothing of sessions
//! and records: whoever reads at random draws from these places.

use std::io::{Read, Seek};
use std::ops::Range;

use super::ShardError;
use super::reader::{MAX_BYTES, split};
use super::tar_reader::{MemberSpan, TarReader};

/// Where a sample stands in a shard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SampleSpan {
    /// The sample's key, as in [`ShardSample`](super::ShardSample).
    pub key: String,
    /// What follows the key in its members' names, in the order of the tar.
    pub suffixes: Vec<String>,
    /// The bytes of the shard that hold its members with their headers and padding. They are the
    /// body of a tar: a [`ShardReader`](super::ShardReader) reads them, followed by 1024 zero bytes.
    pub bytes: Range<u64>,
}

/// An iterator over the places of a shard's samples. It reads headers and jumps over data, so that
/// a shard of 1500 samples costs a few thousand small reads.
///
/// Unlike [`ShardReader`](super::ShardReader) it continues behind damage: an error stands for what
/// was lost there, and the samples on both sides of it may lack members. Data are not looked at:
/// whoever reads a sample finds out whether they are whole.
///
/// ```
/// use relit_data::shard::{SampleSpans, ShardReader};
/// # use std::io::Cursor;
/// # let mut tar = tar::Builder::new(Vec::new());
/// # for name in ["mug/0000.png", "mug/0000.json", "mug/0631.png"] {
/// #     let mut header = tar::Header::new_ustar();
/// #     header.set_size(4);
/// #     tar.append_data(&mut header, name, &b"data"[..])?;
/// # }
/// # let shard = tar.into_inner()?;
/// let spans: Vec<_> = SampleSpans::new(Cursor::new(&shard))?.collect::<Result<_, _>>()?;
/// assert_eq!(spans[1].key, "mug/0631");
///
/// let bytes = &shard[spans[1].bytes.start as usize..spans[1].bytes.end as usize];
/// let mut samples = ShardReader::new([bytes, &[0; 1024]].concat().as_slice())
///     .collect::<Result<Vec<_>, _>>()?;
/// assert_eq!(samples.remove(0).member("png"), Some(&b"data"[..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SampleSpans<R> {
    tar: TarReader<R>,
    length: u64,
    /// The sample whose members are being gathered.
    pending: Option<SampleSpan>,
    /// An error that waits until the sample before it was given.
    failed: Option<ShardError>,
    ended: bool,
}

impl<R: Read + Seek> SampleSpans<R> {
    /// Looks through the tar in `source`, from its start; best buffered with a few hundred bytes.
    ///
    /// # Errors
    /// [`ShardError::ShardRead`] if the source cannot be measured.
    pub fn new(mut source: R) -> Result<Self, ShardError> {
        let unread = |source| ShardError::ShardRead { offset: 0, source };
        let length = source.seek(std::io::SeekFrom::End(0)).map_err(unread)?;
        source.rewind().map_err(unread)?;
        Ok(Self {
            tar: TarReader::new(source, MAX_BYTES),
            length,
            pending: None,
            failed: None,
            ended: false,
        })
    }

    /// The next member that belongs to a sample, with its key and suffix.
    fn next_member(&mut self) -> Result<Option<(String, String, MemberSpan)>, ShardError> {
        while let Some(span) = self.tar.next_span(self.length)? {
            if let Some((key, suffix)) = split(&span.path) {
                return Ok(Some((key, suffix, span)));
            }
        }
        Ok(None)
    }

    /// Takes up a member; the sample before it, if the member begins another.
    fn take(&mut self, key: String, suffix: String, span: &MemberSpan) -> Option<SampleSpan> {
        if let Some(pending) = self.pending.as_mut().filter(|pending| pending.key == key) {
            pending.suffixes.push(suffix);
            pending.bytes.end = span.end;
            return None;
        }
        self.pending.replace(SampleSpan {
            key,
            suffixes: vec![suffix],
            bytes: span.start..span.end,
        })
    }

    /// Goes on behind damage, or ends if it was the last.
    fn pass_over(&mut self, error: ShardError) {
        self.ended = error.ends_the_shard() || !self.tar.resume().unwrap_or(false);
        self.failed = Some(error);
    }
}

impl<R: Read + Seek> Iterator for SampleSpans<R> {
    type Item = Result<SampleSpan, ShardError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(error) = self.failed.take() {
                return Some(Err(error));
            }
            if self.ended {
                return self.pending.take().map(Ok);
            }
            let whole = match self.next_member() {
                Ok(Some((key, suffix, span))) => self.take(key, suffix, &span),
                Ok(None) => {
                    self.ended = true;
                    None
                }
                Err(error) => {
                    self.pass_over(error);
                    self.pending.take()
                }
            };
            if let Some(sample) = whole {
                return Some(Ok(sample));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tar_reader::tar_of;
    use super::*;
    use crate::shard::ShardReader;
    use proptest::prelude::*;
    use std::io::Cursor;

    fn spans(tar: &[u8]) -> Vec<Result<SampleSpan, ShardError>> {
        SampleSpans::new(Cursor::new(tar)).unwrap().collect()
    }

    fn keys(tar: &[u8]) -> Vec<Option<String>> {
        let key = |span: Result<SampleSpan, _>| span.ok().map(|span| span.key);
        spans(tar).into_iter().map(key).collect()
    }

    #[test]
    fn what_stands_at_a_place_is_what_the_reader_gives() {
        let long = format!("{}/0002.png", "y".repeat(140));
        let tar = tar_of(&[
            ("README", b"no sample"),
            ("a/0001.png", &[7; 700]),
            ("a/0001.json", b"{}"),
            (&long, b"2"),
        ]);
        let read: Vec<_> = ShardReader::new(tar.as_slice())
            .collect::<Result<_, _>>()
            .unwrap();
        for (span, sample) in spans(&tar).into_iter().zip(&read) {
            let span = span.unwrap();
            let body = &tar[span.bytes.start as usize..span.bytes.end as usize];
            let alone = [body, &[0; 1024]].concat();
            let mut alone = ShardReader::new(alone.as_slice());
            assert_eq!(alone.next().unwrap().unwrap(), *sample);
            assert!(alone.next().is_none());
            assert_eq!(span.key, sample.key);
        }
        assert_eq!(keys(&tar).len(), read.len());
    }

    #[test]
    fn a_place_begins_with_the_extension_header_of_a_long_name() {
        let long = format!("{}.png", "z".repeat(300));
        let mut builder = tar::Builder::new(Vec::new());
        for path in ["first.png", long.as_str()] {
            let mut header = tar::Header::new_gnu();
            header.set_size(2);
            builder
                .append_data(&mut header, path, b"hi".as_slice())
                .unwrap();
        }
        let tar = builder.into_inner().unwrap();
        let span = spans(&tar).remove(1).unwrap();
        assert_eq!(span.bytes.start, 1024);
        let body = &tar[span.bytes.start as usize..span.bytes.end as usize];
        let alone = [body, &[0; 1024]].concat();
        let read = ShardReader::new(alone.as_slice()).next().unwrap().unwrap();
        assert_eq!(read.member("png"), Some(b"hi".as_slice()));
    }

    #[test]
    fn the_samples_on_both_sides_of_a_damaged_header_are_found() {
        let members: [(&str, &[u8]); 4] = [
            ("a.png", b"1"),
            ("b.png", b"2"),
            ("c.png", b"3"),
            ("d.png", b"4"),
        ];
        let mut tar = tar_of(&members);
        tar[1024] ^= 1;
        let some = |key: &str| Some(key.to_owned());
        assert_eq!(keys(&tar), [some("a"), None, some("c"), some("d")]);
    }

    #[test]
    fn a_shard_that_was_cut_off_ends_with_an_error() {
        let tar = tar_of(&[("a.png", &[1; 600]), ("b.png", &[2; 600])]);
        for cut in 1536..3072 {
            let spans = spans(&tar[..cut]);
            assert_eq!(spans.len(), 2, "{cut}");
            assert!(matches!(spans[1], Err(ShardError::ShardTruncated(_))));
        }
    }

    #[test]
    fn a_member_that_claims_more_than_there_is_takes_no_memory() {
        let block = super::super::tar_reader::header("a.png", u64::MAX >> 3).unwrap();
        assert!(matches!(
            spans(block.as_bytes())[..],
            [Err(ShardError::ShardDamaged { .. })]
        ));
    }

    proptest! {
        #[test]
        fn damage_never_panics_and_never_ends_without_an_end(
            flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        ) {
            let mut tar = tar_of(&[("s/0.png", &[1; 700]), ("s/0.json", b"{}"), ("t.png", b"")]);
            for (at, value) in flips {
                let at = at.index(tar.len());
                tar[at] = value;
            }
            prop_assert!(spans(&tar).len() < 20);
        }
    }
}
