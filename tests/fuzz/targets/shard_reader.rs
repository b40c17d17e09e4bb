//! A shard: reading ends, and ends after the first error; keys, suffixes and data together are not
//! larger than the file, and neither is the memory for them; the members of a sample differ in their
//! suffixes; and the sizes of the reads do not matter.
//!
//! Hardly any mutation of a tar has correct checksums. So each input is read twice: as it is, and
//! with the checksum corrected in every block that could be a header.

#![no_main]

use std::collections::HashSet;
use std::io::{self, Read};

use libfuzzer_sys::fuzz_target;
use relit_data::shard::{ShardReader, ShardSample};

const BLOCK: usize = 512;
/// Where a header has its checksum.
const CHECKSUM: std::ops::Range<usize> = 148..156;

fuzz_target!(|bytes: &[u8]| {
    check(bytes);
    check(&mended(bytes));
});

fn check(shard: &[u8]) {
    let at_once = read(ShardReader::new(shard));
    assert_eq!(at_once, read(ShardReader::new(InPieces(shard))));

    let samples: Vec<_> = at_once.into_iter().filter_map(Result::ok).collect();
    let sum: usize = samples.iter().map(size).sum();
    assert!(sum <= shard.len(), "{sum} bytes out of {}", shard.len());
    for sample in &samples {
        let members = &sample.members;
        let suffixes: HashSet<_> = members.iter().map(|(suffix, _)| suffix).collect();
        assert!(!members.is_empty() && suffixes.len() == members.len());
        // A growing vector doubles.
        let spare = |data: &Vec<u8>| data.capacity() > 2 * data.len().max(BLOCK);
        assert!(!members.iter().any(|(_, data)| spare(data)));
    }
}

/// All of a shard, an error as its text. No item but the last is an error, and none comes after
/// the end.
fn read<R: Read>(mut reader: ShardReader<R>) -> Vec<Result<ShardSample, String>> {
    let items: Vec<_> = reader
        .by_ref()
        .map(|item| item.map_err(|error| error.to_string()))
        .collect();
    assert!(reader.next().is_none());
    let before_last = items.len().saturating_sub(1);
    assert!(items.iter().take(before_last).all(Result::is_ok));
    items
}

fn size(sample: &ShardSample) -> usize {
    let members = sample.members.iter();
    sample.key.len()
        + members
            .map(|(suffix, data)| suffix.len() + data.len())
            .sum::<usize>()
}

/// The same bytes, with the right checksum in every block that is not empty.
fn mended(shard: &[u8]) -> Vec<u8> {
    let mut shard = shard.to_vec();
    for block in shard.chunks_exact_mut(BLOCK) {
        if block.iter().all(|&byte| byte == 0) {
            continue;
        }
        block[CHECKSUM].fill(b' ');
        let sum: u32 = block.iter().copied().map(u32::from).sum();
        block[CHECKSUM].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    }
    shard
}

/// A source that gives a few bytes at a time, across the borders of blocks.
struct InPieces<'a>(&'a [u8]);

impl Read for InPieces<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let most = buffer.len().min(97);
        self.0.read(&mut buffer[..most])
    }
}
