//! Batches of real turns on tensors: frames of one object under different light.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use tch::{Device, Tensor};

use super::error::TrainError;
use crate::data::{DrawPlan, Encoding, Place, Stream, Streaming, TurnBatch, Turns};

/// Batches that are decoded ahead of the network.
const AHEAD: usize = 3;

/// Reads a data set again and again, in an order that a seed shuffles.
pub struct TurnReader {
    turns: Arc<Turns>,
    stream: Stream<Turns>,
    plan: DrawPlan,
    place: Place,
}

impl std::fmt::Debug for TurnReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TurnReader")
            .field("plan", &self.plan)
            .field("place", &self.place)
            .finish_non_exhaustive()
    }
}

/// Frames of one turn on a device.
#[derive(Debug)]
pub struct TurnTensors {
    /// `frames x 3 x height x width`, linear, 0..=1, 0 outside the mask.
    pub picture: Tensor,
    /// `frames x 1 x height x width`, 0 or 1.
    pub mask: Tensor,
    /// Which frames the gate of saturation opens Spec-Net for.
    pub spec_net: Vec<bool>,
    /// What was damaged in this batch and is not in it.
    pub damage: Option<String>,
}

impl TurnReader {
    /// Opens a data set: batches of 12 neighbours in an order that `seed` shuffles.
    ///
    /// # Errors
    /// [`TrainError::Data`].
    pub fn open(path: &Path, seed: u64) -> Result<Self, TrainError> {
        let turns = Arc::new(Turns::open(path, Encoding::Linear)?);
        let (plan, place) = (DrawPlan::of_turns(seed), Place::default());
        Ok(Self {
            stream: start(&turns, plan, place)?,
            turns,
            plan,
            place,
        })
    }

    /// Where the next batch stands.
    #[must_use]
    pub fn place(&self) -> Place {
        self.place
    }

    /// Goes on from a place.
    ///
    /// # Errors
    /// [`TrainError::Data`].
    pub fn go_to(&mut self, place: Place) -> Result<(), TrainError> {
        self.stream = start(&self.turns, self.plan, place)?;
        self.place = place;
        Ok(())
    }

    /// The next batch that has at least two frames.
    ///
    /// # Errors
    /// [`TrainError::Torch`]; [`TrainError::NoFrames`] where a whole epoch has no such batch.
    pub fn next_batch(&mut self, device: Device) -> Result<TurnTensors, TrainError> {
        let begun = self.place.epoch;
        let mut damage = Vec::new();
        while self.place.epoch <= begun + 1 {
            let drawn = match self.stream.next() {
                Some(Ok(drawn)) => drawn,
                Some(Err(damaged)) => {
                    damage.push(relit_data::causes::with_causes(&damaged));
                    damaged.rest
                }
                None => return Err(TrainError::NoFrames),
            };
            self.place = drawn.next;
            if drawn.batch.frames.len() >= 2 {
                let tensors = tensors(&drawn.batch, device, &damage)?;
                self.stream.give_back(drawn.batch);
                return Ok(tensors);
            }
        }
        Err(TrainError::NoFrames)
    }
}

fn start(turns: &Arc<Turns>, plan: DrawPlan, from: Place) -> Result<Stream<Turns>, TrainError> {
    let streaming = Streaming {
        plan,
        from,
        until_epoch: u64::MAX,
        threads: NonZeroUsize::MIN,
        ahead: AHEAD,
    };
    Ok(Stream::start(turns, streaming)?)
}

fn tensors(
    batch: &TurnBatch,
    device: Device,
    damage: &[String],
) -> Result<TurnTensors, TrainError> {
    let (frames, extent) = (batch.frames.len(), batch.extent);
    let shape = |channels: usize| [frames, channels, extent.height, extent.width].map(|n| n as i64);
    let tensor = |values: &[f32], channels: usize| {
        Tensor::f_from_slice(values)?
            .f_reshape(shape(channels))?
            .f_to_device(device)
    };
    let opens = |frame: &crate::data::TurnFrame| frame.record.as_ref().is_none_or(|r| r.spec_net);
    Ok(TurnTensors {
        picture: tensor(&batch.images, 3)?,
        mask: tensor(&batch.masks, 1)?,
        spec_net: batch.frames.iter().map(opens).collect(),
        damage: (!damage.is_empty()).then(|| damage.join("; ")),
    })
}
