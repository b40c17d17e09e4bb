//! A turn in a shard.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;
use relit_data::shard::{SampleSpan, SampleSpans, ShardReader, ShardSample, decode_rgb};

use crate::parallel::caught;

use super::batch::{Frame, MaskBytes, TurnFrame, extent_of};
use crate::reader::{DamagedSample, ReadError};

/// Bytes that are read at a time while looking for samples: a header and what follows it closely.
const SCAN_BUFFER: usize = 1 << 10;
/// What ends a tar.
const END: [u8; 1024] = [0; 1024];
/// The parts of a sample.
const PARTS: [&str; 3] = ["png", "mask.png", "json"];

/// The places of the samples of a shard.
pub(super) struct ShardTurn {
    path: PathBuf,
    name: String,
    slots: Vec<Slot>,
}

/// Where a sample is.
enum Slot {
    At(Range<u64>),
    /// It is lost: why.
    Lost(String),
}

impl ShardTurn {
    /// Looks for the samples of a shard; `expected` is their number.
    pub(super) fn open(path: &Path, expected: Option<u32>) -> Result<Self, ReadError> {
        let file = File::open(path).map_err(ReadError::read(path))?;
        let spans = SampleSpans::new(BufReader::with_capacity(SCAN_BUFFER, file));
        let spans = spans.map_err(ReadError::dataset(path))?;
        let mut slots = Vec::new();
        for span in spans {
            match span {
                Ok(span) => add_span(&mut slots, span),
                Err(error) => add_loss(&mut slots, with_causes(&error)),
            }
        }
        add_missing(&mut slots, expected);
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Self {
            path: path.to_owned(),
            name: name.into_owned(),
            slots,
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn samples(&self) -> u32 {
        u32::try_from(self.slots.len()).unwrap_or(u32::MAX)
    }

    /// Why no sample was found, if none was: the file may not be a shard.
    pub(super) fn whole_loss(&self) -> Option<&str> {
        let mut losses = self.slots.iter().map(|slot| match slot {
            Slot::At(_) => None,
            Slot::Lost(why) => Some(why.as_str()),
        });
        let first = losses.next()??;
        losses.all(|loss| loss.is_some()).then_some(first)
    }

    /// Bytes of the samples that were found.
    pub(super) fn bytes(&self) -> u64 {
        let sizes = self.slots.iter().map(|slot| match slot {
            Slot::At(place) => place.end - place.start,
            Slot::Lost(_) => 0,
        });
        sizes.sum()
    }

    pub(super) fn frame(&self, position: u32) -> Result<Frame, DamagedSample> {
        let damage = |fault| DamagedSample {
            sample: format!("{}, sample {position}", self.path.display()),
            fault,
        };
        let bytes = match self.slots.get(position as usize) {
            Some(Slot::At(place)) => self.read(place).map_err(damage)?,
            Some(Slot::Lost(why)) => return Err(damage(ReadError::Other(why.clone()))),
            None => {
                let why = "the sample is missing".to_owned();
                return Err(damage(ReadError::Other(why)));
            }
        };
        let frame = caught(|| decode(&bytes)).map_err(ReadError::from);
        frame.flatten().map_err(damage)
    }

    fn read(&self, place: &Range<u64>) -> Result<Vec<u8>, ReadError> {
        let read = || {
            let mut file = File::open(&self.path)?;
            file.seek(SeekFrom::Start(place.start))?;
            let mut bytes = Vec::new();
            file.take(place.end - place.start).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        read().map_err(ReadError::read(&self.path))
    }
}

fn add_span(slots: &mut Vec<Slot>, span: SampleSpan) {
    let missing = PARTS
        .iter()
        .find(|part| !span.suffixes.iter().any(|suffix| suffix == *part));
    match missing {
        None => slots.push(Slot::At(span.bytes)),
        Some(part) => add_loss(slots, format!("{}: its {part} is missing", span.key)),
    }
}

/// A piece of damage may cost parts of the samples on both sides: it is one loss.
fn add_loss(slots: &mut Vec<Slot>, why: String) {
    match slots.last_mut() {
        Some(Slot::Lost(known)) => *known = format!("{known}; {why}"),
        _ => slots.push(Slot::Lost(why)),
    }
}

/// Adds a loss for each sample that should be there beyond those that were found.
fn add_missing(slots: &mut Vec<Slot>, expected: Option<u32>) {
    let expected = expected.map_or(0, |count| count as usize);
    let found = slots.len();
    for _ in found..expected {
        let why = format!("the data set lists {expected} samples; {found} were found");
        slots.push(Slot::Lost(why));
    }
}

fn decode(bytes: &[u8]) -> Result<Frame, ReadError> {
    let mut reader = ShardReader::new(bytes.chain(&END[..]));
    let sample = reader
        .next()
        .transpose()?
        .ok_or_else(|| ReadError::missing("png"))?;
    let image = decode_rgb(part(&sample, "png")?)?;
    let record = serde_json::from_slice(part(&sample, "json")?)
        .map_err(|fault| ReadError::Other(format!("its record does not parse: {fault}")))?;
    let mask = MaskBytes::Png(part(&sample, "mask.png")?.to_vec());
    Ok(Frame {
        extent: extent_of(image.width(), image.height()),
        pixels: image.into_raw(),
        mask,
        about: TurnFrame {
            key: sample.key,
            record: Some(record),
        },
    })
}

fn part<'a>(sample: &'a ShardSample, suffix: &str) -> Result<&'a [u8], ReadError> {
    sample
        .member(suffix)
        .ok_or_else(|| ReadError::missing(suffix))
}
