//! Frames of a turn with their mask, as methods of photometric stereo read them.
//!
//! The folder holds `L (001).png` and so on, 8-bit sRGB, and `mask.png`: the layout of methods of universal photometric
//! stereo. With a lamp it holds `lights.lp` too: the number of frames, then a line a frame with its file's name and the
//! direction that the light comes from, x to the right, y up, z to the viewer, as RTI builders read it.

use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use relight_core::files::{FolderFault, ResultFolder, write_png};
use relight_core::image::{Depth, Planes};
use relight_reader::{Cursor, Draw, DrawPlan, Encoding, Rank, Stream, Streaming, TurnBatch, Turns};
use relit_data::durable::write_whole;

use crate::error::ExportError;
use crate::lamp::TurnLamp;

const MASK: &str = "mask.png";
const LAMPS: &str = "lights.lp";

const RESULTS: ResultFolder = ResultFolder {
    marker: MASK,
    holds: |name| name == MASK || name == LAMPS || is_frame(name),
};

fn is_frame(name: &str) -> bool {
    let number = name
        .strip_prefix("L (")
        .and_then(|n| n.strip_suffix(").png"));
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}

impl From<FolderFault> for ExportError {
    fn from(fault: FolderFault) -> Self {
        match fault {
            FolderFault::Foreign(path, name) => Self::Foreign { path, name },
            FolderFault::NoFolder(path) => Self::Write {
                path,
                source: std::io::ErrorKind::NotADirectory.into(),
            },
            FolderFault::Read(path, source) | FolderFault::Write(path, source) => {
                Self::Write { path, source }
            }
        }
    }
}

/// Writes the first `count` frames of the one turn in `input`, which cover it evenly, into the folder `out`: how many.
/// `out` appears when it is whole, in place of an earlier export.
///
/// # Errors
/// Where the input holds no turn or several, a frame is damaged or has no angle while a lamp is asked for, or a file
/// cannot be written.
pub fn write_frames(
    input: &Path,
    out: &Path,
    count: u32,
    lamp: Option<&TurnLamp>,
) -> Result<usize, ExportError> {
    let turns = Arc::new(Turns::open(input, Encoding::Srgb)?);
    let found = turns.names().count();
    if found != 1 {
        return Err(ExportError::Turns {
            path: input.to_owned(),
            turns: found,
        });
    }
    let batch = first_frames(&turns, count)?;
    RESULTS.write(out, |folder| write_batch(&batch, folder, lamp))?;
    Ok(batch.frames.len())
}

/// The first frames of the turn: any neighbours in a shard cover the whole turn.
fn first_frames(turns: &Arc<Turns>, count: u32) -> Result<TurnBatch, ExportError> {
    let streaming = Streaming {
        plan: DrawPlan {
            batch: count.max(1),
            draw: Draw::Neighbours,
            seed: None,
            rank: Rank::ONLY,
        },
        from: Cursor::default(),
        until_epoch: 1,
        threads: NonZeroUsize::MIN,
        ahead: 1,
    };
    match Stream::start(turns, streaming)?.next() {
        Some(Ok(drawn)) => Ok(drawn.batch),
        Some(Err(damaged)) => match damaged.damage.into_iter().next() {
            Some(sample) => Err(ExportError::Damaged(sample)),
            None => Ok(damaged.rest.batch),
        },
        None => Err(ExportError::Empty),
    }
}

fn write_batch(
    batch: &TurnBatch,
    folder: &Path,
    lamp: Option<&TurnLamp>,
) -> Result<(), ExportError> {
    let extent = batch.extent;
    let pixels = extent.pixels();
    let mut lines = format!("{}\n", batch.frames.len());
    for (number, frame) in batch.frames.iter().enumerate() {
        let values = &batch.images[3 * pixels * number..3 * pixels * (number + 1)];
        let plane = |channel: usize| values[channel * pixels..(channel + 1) * pixels].to_vec();
        let picture = Planes::from_planes(extent, [plane(0), plane(1), plane(2)])?;
        let name = format!("L ({:03}).png", number + 1);
        write_png(&folder.join(&name), &picture, Depth::Eight)?;
        if let Some(lamp) = lamp {
            let angle = frame.record.as_ref().and_then(|record| record.angle_deg);
            let angle = angle.ok_or_else(|| ExportError::NoAngle {
                key: frame.key.clone(),
            })?;
            let [x, y, z] = lamp.at(angle.to_radians()).components();
            // Writing to a string cannot fail.
            let _ = writeln!(lines, "{name} {x:.6} {y:.6} {z:.6}");
        }
    }
    let mask = batch.masks[..pixels].to_vec();
    let mask = Planes::from_planes(extent, [mask.clone(), mask.clone(), mask])?;
    write_png(&folder.join(MASK), &mask, Depth::Eight)?;
    if lamp.is_some() {
        let path = folder.join(LAMPS);
        write_whole(&path, lines.as_bytes())
            .map_err(|source| ExportError::Write { path, source })?;
    }
    Ok(())
}
