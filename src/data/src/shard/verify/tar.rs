//! Checks the layout `webdataset`: a tar with the session's samples, each once, complete and at its
//! position.

use std::fs::File;
use std::io::BufReader;
use std::sync::Arc;

use rayon::prelude::*;

use super::sample::{SessionMask, check_image, check_record};
use super::session::{SessionCheck, ShardContents};
use crate::causes::with_causes;
use crate::image_stats::MaskSpans;
use crate::shard::ShardError;
use crate::shard::digest::{Digest, Hashing};
use crate::shard::file::compare;
use crate::shard::names::{Part, parse_member};
use crate::shard::order::order;
use crate::shard::record::FrameRecord;
use crate::shard::tar_reader::{Member, TarReader};

/// Largest member that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// A batch that is checked in parallel ends at so many samples or bytes.
const BATCH_SAMPLES: usize = 64;
const BATCH_BYTES: usize = 64 << 20;

type Source = Hashing<BufReader<File>>;

pub(super) fn check(check: &mut SessionCheck<'_>) -> ShardContents {
    let path = check.out.join(&check.shard.file);
    let samples = check.session.samples as usize;
    match File::open(&path).map_err(ShardError::io("open", &path)) {
        Ok(file) => {
            let source = Hashing::new(BufReader::with_capacity(1 << 18, file));
            TarCheck::new(check, TarReader::new(source, MAX_BYTES)).run()
        }
        Err(error) => {
            check.note(None, with_causes(&error));
            ShardContents {
                samples: 0,
                records: vec![None; samples],
            }
        }
    }
}

/// Adjacent members of one sample.
struct SampleMembers {
    index: u32,
    image: Option<Vec<u8>>,
    json: Option<Vec<u8>>,
    mask: Option<Arc<MaskSpans>>,
}

/// The result of checking the members of one sample.
struct CheckedMembers {
    index: u32,
    problems: Vec<String>,
    record: Option<FrameRecord>,
}

/// The check of a tar, member by member.
struct TarCheck<'a, 'b> {
    check: &'a mut SessionCheck<'b>,
    tar: TarReader<Source>,
    order: Vec<u32>,
    /// Position of each sample in the order, by index.
    rank: Vec<u32>,
    /// Which parts were found, by index.
    seen: Vec<[bool; 3]>,
    /// The expected positions of the members, in the order in which they were found.
    positions: Vec<u32>,
    mask: SessionMask,
    batch: Vec<SampleMembers>,
    batch_bytes: usize,
    records: Vec<Option<FrameRecord>>,
}

impl<'a, 'b> TarCheck<'a, 'b> {
    fn new(check: &'a mut SessionCheck<'b>, tar: TarReader<Source>) -> Self {
        let samples = check.session.samples;
        let order = order(samples);
        let mut rank = vec![0; samples as usize];
        for (position, &index) in (0..).zip(&order) {
            if let Some(slot) = rank.get_mut(index as usize) {
                *slot = position;
            }
        }
        Self {
            check,
            tar,
            order,
            rank,
            seen: vec![[false; 3]; samples as usize],
            positions: Vec::new(),
            mask: SessionMask::default(),
            batch: Vec::new(),
            batch_bytes: 0,
            records: vec![None; samples as usize],
        }
    }

    fn run(mut self) -> ShardContents {
        loop {
            match self.tar.next() {
                Ok(Some(member)) => self.add(member),
                Ok(None) => break,
                Err(error) => {
                    let index = self.expected();
                    self.check.note(index, with_causes(&error));
                    if error.ends_the_shard() || !self.resume() {
                        break;
                    }
                }
            }
        }
        self.check_batch();
        self.note_missing();
        self.note_displaced();
        self.finish()
    }

    /// Continues after damage; false if nothing follows.
    fn resume(&mut self) -> bool {
        self.tar.resume().unwrap_or_else(|error| {
            self.check.note(None, with_causes(&error));
            false
        })
    }

    /// The sample to which the next member should belong; none after the last.
    fn expected(&self) -> Option<u32> {
        let next = self.positions.last().map_or(0, |position| position + 1);
        self.order.get(next as usize / Part::ALL.len()).copied()
    }

    fn add(&mut self, member: Member) {
        let Some((index, part)) = parse_member(&self.check.session.id, &member.path)
            .filter(|(index, _)| *index < self.check.session.samples)
        else {
            let what = format!(
                "{:?} at byte {} does not belong here",
                member.path, member.offset
            );
            return self.check.note(None, what);
        };
        let slot = index as usize;
        if !member.canonical {
            let what = format!("header or padding of its {} is damaged", part.suffix());
            self.check.note(Some(index), what);
        }
        let seen = self
            .seen
            .get_mut(slot)
            .and_then(|parts| parts.get_mut(part as usize));
        if seen.is_none_or(|seen| std::mem::replace(seen, true)) {
            let what = format!("its {} is in the shard twice", part.suffix());
            return self.check.note(Some(index), what);
        }
        let rank = self.rank.get(slot).copied().unwrap_or_default();
        self.positions
            .push(rank * Part::ALL.len() as u32 + part as u32);
        self.add_to_batch(index, part, member.data);
    }

    fn add_to_batch(&mut self, index: u32, part: Part, data: Vec<u8>) {
        if self.batch.last().is_none_or(|last| last.index != index) {
            if self.batch.len() >= BATCH_SAMPLES || self.batch_bytes >= BATCH_BYTES {
                self.check_batch();
            }
            self.batch.push(SampleMembers {
                index,
                image: None,
                json: None,
                mask: None,
            });
        }
        if part == Part::Mask {
            let expected = self.check.row(index).map(|row| row.mask_blake3);
            for what in self.mask.check(&data, expected.as_ref()) {
                self.check.note(Some(index), what);
            }
        }
        let mask = self.mask.get();
        let Some(sample) = self.batch.last_mut() else {
            return;
        };
        sample.mask = mask;
        if part != Part::Mask {
            self.batch_bytes += data.len();
        }
        match part {
            Part::Image => sample.image = Some(data),
            Part::Record => sample.json = Some(data),
            Part::Mask => {}
        }
    }

    fn check_batch(&mut self) {
        let check = &*self.check;
        let checked: Vec<CheckedMembers> = self
            .batch
            .par_iter()
            .map(|sample| check_members(check, sample))
            .collect();
        for CheckedMembers {
            index,
            problems,
            record,
        } in checked
        {
            for what in problems {
                self.check.note(Some(index), what);
            }
            if let (Some(slot), Some(record)) = (self.records.get_mut(index as usize), record) {
                *slot = Some(record);
            }
        }
        self.check.progress.add(self.batch.len());
        self.batch.clear();
        self.batch_bytes = 0;
    }

    fn note_missing(&mut self) {
        for (index, parts) in (0..).zip(&self.seen) {
            if parts.iter().all(|&seen| !seen) {
                self.check
                    .note(Some(index), "the sample is missing".to_owned());
                continue;
            }
            for (part, _) in Part::ALL.iter().zip(parts).filter(|(_, seen)| !**seen) {
                self.check
                    .note(Some(index), format!("its {} is missing", part.suffix()));
            }
        }
    }

    fn note_displaced(&mut self) {
        let sample_at = |position: u32| self.order.get(position as usize / Part::ALL.len());
        let mut ascending = self.positions.clone();
        ascending.sort_unstable();
        let places = self.positions.iter().zip(&ascending);
        let mut samples: Vec<u32> = places
            .filter(|(found, expected)| found != expected)
            .filter_map(|(&position, _)| sample_at(position).copied())
            .collect();
        samples.sort_unstable();
        samples.dedup();
        for index in samples {
            let what = "it, or one of its members, is not where it was written";
            self.check.note(Some(index), what.to_owned());
        }
    }

    /// Reads the rest and compares length and digest of the file.
    fn finish(self) -> ShardContents {
        let Self {
            check,
            tar,
            seen,
            records,
            ..
        } = self;
        let mut source = tar.into_inner();
        match source.drain() {
            Ok(0) => {}
            Ok(bytes) => check.note(None, format!("{bytes} bytes follow the end of the tar")),
            Err(error) => check.note(None, format!("it could not be read to its end: {error}")),
        }
        let shard = check.shard;
        if let Err(error) = compare(&shard.file, (shard.bytes, shard.blake3), source.digest()) {
            check.note(None, with_causes(&error));
        }
        let complete = seen
            .iter()
            .filter(|parts| parts.iter().all(|&seen| seen))
            .count();
        ShardContents {
            samples: complete as u64,
            records,
        }
    }
}

fn check_members(check: &SessionCheck<'_>, sample: &SampleMembers) -> CheckedMembers {
    let row = check.row(sample.index);
    let (mut problems, record) = match &sample.json {
        Some(json) => check_record(json, row),
        None => (Vec::new(), None),
    };
    if let Some(png) = &sample.image {
        let known = row.map(|row| &row.record).or(record.as_ref());
        let digest = Digest::hash(png);
        let mask = sample.mask.as_deref();
        problems.extend(check_image(check.settings, png, &digest, row, known, mask).0);
    }
    CheckedMembers {
        index: sample.index,
        problems,
        record,
    }
}
