//! Batches of real turns on tensors: frames of one object under different light.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use tch::{Device, Kind, Tensor};

use crate::error::TrainError;
use relight_core::image::{ColourSpace, Srgb};
use relight_core::reader::{
    Cursor, DrawPlan, Encoding, Rank, Source, Stream, Streaming, TurnBatch, TurnFrame, Turns,
};
use relit_data::image_stats::SATURATED_VALUE;
use relit_data::spec_net_gate::{self, SPEC_NET_GATE};

/// Batches that are decoded ahead of the network.
const AHEAD: usize = 3;

/// Reads a data set again and again, in an order that a seed shuffles.
pub(crate) struct TurnReader {
    turns: Arc<Turns>,
    stream: Stream<Turns>,
    plan: DrawPlan,
    cursor: Cursor,
    /// The epoch of the last group with readable frames.
    readable: u64,
}

impl std::fmt::Debug for TurnReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TurnReader")
            .field("plan", &self.plan)
            .field("cursor", &self.cursor)
            .finish_non_exhaustive()
    }
}

/// Frames of one turn on a device.
#[derive(Debug)]
pub(crate) struct TurnTensors {
    /// `frames x 3 x height x width`, linear, 0..=1, 0 outside the mask.
    pub picture: Tensor,
    /// `frames x 1 x height x width`, 0 or 1.
    pub mask: Tensor,
    /// Which frames the gate of saturation opens Spec-Net for.
    pub spec_net: Vec<bool>,
}

/// The readable frames of a group.
#[derive(Debug)]
pub(crate) struct TurnGroup {
    /// Its frames; `None` if fewer than two can be read.
    pub frames: Option<TurnTensors>,
    /// Its damage.
    pub damage: Option<String>,
}

impl TurnReader {
    /// Opens a data set: batches of 12 neighbours in an order that `seed` shuffles.
    ///
    /// # Errors
    /// [`TrainError::Data`].
    pub(crate) fn open(path: &Path, seed: u64) -> Result<Self, TrainError> {
        let turns = Arc::new(Turns::open(path, Encoding::Linear)?);
        let (plan, cursor) = (DrawPlan::from_turns(seed), Cursor::default());
        Ok(Self {
            stream: start(&turns, plan, cursor)?,
            turns,
            plan,
            cursor,
            readable: cursor.epoch,
        })
    }

    /// Keeps one group of so many; other processes read the others from the same cursor.
    ///
    /// # Errors
    /// [`TrainError::Data`].
    pub(crate) fn set_rank(&mut self, rank: Rank) -> Result<(), TrainError> {
        self.plan.rank = rank;
        self.go_to(self.cursor)
    }

    /// Text that tells data sets apart: of each turn its name, the number of its samples, and the bytes that they are stored
    /// in.
    pub(crate) fn identity(&self) -> String {
        let turns = self
            .turns
            .names()
            .zip(self.turns.turns())
            .zip(self.turns.bytes());
        turns
            .map(|((name, samples), bytes)| format!("{name}: {samples} samples, {bytes} bytes\n"))
            .collect()
    }

    /// Where the next batch stands.
    pub(crate) fn cursor(&self) -> Cursor {
        self.cursor
    }

    /// Goes on from a cursor.
    ///
    /// # Errors
    /// [`TrainError::Data`].
    pub(crate) fn go_to(&mut self, cursor: Cursor) -> Result<(), TrainError> {
        self.stream = start(&self.turns, self.plan, cursor)?;
        self.cursor = cursor;
        self.readable = cursor.epoch;
        Ok(())
    }

    /// The next group of this process, in 32 or 64 bits.
    ///
    /// # Errors
    /// [`TrainError::Torch`]; [`TrainError::Refused`] if a whole epoch has no group with two frames.
    pub(crate) fn next_group(
        &mut self,
        kind: Kind,
        device: Device,
    ) -> Result<TurnGroup, TrainError> {
        let (drawn, damage) = match self.stream.next() {
            Some(Ok(drawn)) => (drawn, None),
            Some(Err(damaged)) => {
                let damage = relit_data::causes::with_causes(&damaged);
                (damaged.rest, Some(damage))
            }
            None => return Err(no_frames()),
        };
        self.cursor = drawn.next;
        let frames = if drawn.batch.frames.len() >= 2 {
            self.readable = self.cursor.epoch;
            Some(tensors(&drawn.batch, kind, device))
        } else {
            None
        };
        self.stream.recycle(drawn.batch);
        if self.cursor.epoch > self.readable + 1 {
            return Err(no_frames());
        }
        Ok(TurnGroup { frames, damage })
    }
}

/// A data set has no two readable frames of one turn.
pub(crate) fn no_frames() -> TrainError {
    TrainError::Refused("the turns have no batch of two frames that can be read".to_owned())
}

fn start(turns: &Arc<Turns>, plan: DrawPlan, from: Cursor) -> Result<Stream<Turns>, TrainError> {
    let streaming = Streaming {
        plan,
        from,
        until_epoch: u64::MAX,
        threads: NonZeroUsize::MIN,
        ahead: AHEAD,
    };
    Ok(Stream::start(turns, streaming)?)
}

fn tensors(batch: &TurnBatch, kind: Kind, device: Device) -> TurnTensors {
    let (frames, extent) = (batch.frames.len(), batch.extent);
    let shape = |channels: usize| [frames, channels, extent.height, extent.width].map(|n| n as i64);
    let tensor = |values: &[f32], channels: usize| {
        Tensor::from_slice(values)
            .reshape(shape(channels))
            .to_device(device)
            .to_kind(kind)
    };
    let opens = |(at, frame): (usize, &TurnFrame)| match &frame.record {
        Some(record) => record.spec_net,
        None => is_saturated(batch, at),
    };
    TurnTensors {
        picture: tensor(&batch.images, 3),
        mask: tensor(&batch.masks, 1),
        spec_net: batch.frames.iter().enumerate().map(opens).collect(),
    }
}

/// Whether the gate opens for a frame that has no record, as in the layout of the paper's released data set: by the
/// saturated part of the existing pixels.
fn is_saturated(batch: &TurnBatch, frame: usize) -> bool {
    let pixels = batch.extent.pixels();
    let level = Srgb::to_linear(SATURATED_VALUE);
    let picture = &batch.images[3 * pixels * frame..3 * pixels * (frame + 1)];
    let mask = &batch.masks[pixels * frame..pixels * (frame + 1)];
    let inside = || (0..pixels).filter(|&at| mask[at] >= 0.5);
    let is_white = |at: &usize| (0..3).all(|channel| picture[channel * pixels + at] >= level);
    let saturated = inside().filter(is_white).count() as f64 / inside().count() as f64;
    spec_net_gate::opens(saturated, SPEC_NET_GATE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    #[test]
    fn a_frame_without_a_record_opens_the_gate_where_it_is_saturated() {
        let extent = Extent::new(10, 10);
        let frame = |white: usize| TurnBatch {
            extent,
            images: (0..300)
                .map(|at| if at % 100 < white { 1.0 } else { 0.5 })
                .collect(),
            masks: vec![1.0; 100],
            frames: Vec::new(),
        };
        assert!(is_saturated(&frame(6), 0));
        assert!(!is_saturated(&frame(5), 0));
        let outside = TurnBatch {
            masks: vec![0.0; 100],
            ..frame(50)
        };
        assert!(!is_saturated(&outside, 0));
    }
}
