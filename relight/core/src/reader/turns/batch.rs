//! Frames of a turn, gathered into arrays.

use relit_data::shard::FrameRecord;

use crate::image::{ColourSpace, Extent, Srgb, check_extent};
use crate::reader::{DamagedSample, ReadError};

/// What the values of a batch are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// The file's 8-bit values divided by 255, as the paper's networks are fed.
    Srgb,
    /// In proportion to light.
    Linear,
}

impl Encoding {
    /// The value of each of the 256 levels.
    fn levels(self) -> [f32; 256] {
        std::array::from_fn(|level| {
            let value = level as f32 / 255.0;
            match self {
                Self::Srgb => value,
                Self::Linear => Srgb::to_linear(value),
            }
        })
    }
}

/// The record of one frame of a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnFrame {
    /// `<turn>/<index>`, the sample's key in a shard.
    pub key: String,
    /// Its record; none in a folder of images.
    pub record: Option<FrameRecord>,
}

/// Frames as arrays, ready to be copied into tensors.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnBatch {
    /// Width and height of all images; 0 x 0 for a batch without frames.
    pub extent: Extent,
    /// The record of each frame.
    pub frames: Vec<TurnFrame>,
    /// frames x 3 x rows x columns, 0..=1, exactly 0 outside the mask.
    pub images: Vec<f32>,
    /// frames x 1 x rows x columns, 0 or 1.
    pub masks: Vec<f32>,
}

/// A frame as it was decoded.
pub(super) struct Frame {
    pub(super) about: TurnFrame,
    pub(super) extent: Extent,
    /// Red, green and blue of each pixel.
    pub(super) pixels: Vec<u8>,
    /// Of each pixel, at least 128 where the object is.
    pub(super) mask: MaskBytes,
}

/// A mask, decoded or still to be: the frames of a turn share one, and it is decoded once a batch.
pub(super) enum MaskBytes {
    /// The bytes of a PNG.
    Png(Vec<u8>),
    /// One level a pixel.
    Levels(std::sync::Arc<Vec<u8>>),
}

/// Gathers frames into a batch.
pub(super) struct BatchBuilder {
    levels: [f32; 256],
    expected: usize,
    batch: TurnBatch,
    /// The mask of the frame before.
    last_mask: Option<MaskBytes>,
}

impl BatchBuilder {
    /// A batch of `expected` frames in the memory of `spare`.
    pub(super) fn new(encoding: Encoding, expected: usize, spare: Option<TurnBatch>) -> Self {
        let (mut frames, mut images, mut masks) = match spare {
            Some(spare) => (spare.frames, spare.images, spare.masks),
            None => (Vec::new(), Vec::new(), Vec::new()),
        };
        frames.clear();
        images.clear();
        masks.clear();
        Self {
            levels: encoding.levels(),
            expected,
            batch: TurnBatch {
                extent: Extent::new(0, 0),
                frames,
                images,
                masks,
            },
            last_mask: None,
        }
    }

    /// Takes a frame up.
    pub(super) fn push(&mut self, frame: Frame) -> Result<(), DamagedSample> {
        let sample = frame.about.key.clone();
        self.add(frame)
            .map_err(|fault| DamagedSample { sample, fault })
    }

    pub(super) fn finish(self) -> TurnBatch {
        self.batch
    }

    fn add(&mut self, frame: Frame) -> Result<(), ReadError> {
        if self.batch.frames.is_empty() {
            self.batch.extent = frame.extent;
            let pixels = self.expected * frame.extent.pixels();
            self.batch.images.reserve_exact(3 * pixels);
            self.batch.masks.reserve_exact(pixels);
        }
        check_extent("image", frame.extent, self.batch.extent)?;
        self.add_mask(frame.mask)?;
        self.add_image(&frame.pixels);
        self.batch.frames.push(frame.about);
        Ok(())
    }

    fn add_mask(&mut self, mask: MaskBytes) -> Result<(), ReadError> {
        let pixels = self.batch.extent.pixels();
        if self.last_mask.as_ref() == Some(&mask) && self.batch.masks.len() >= pixels {
            let last = self.batch.masks.len() - pixels..;
            self.batch.masks.extend_from_within(last);
            return Ok(());
        }
        let one_or_zero = |&level: &u8| f32::from(u8::from(level >= 128));
        match &mask {
            MaskBytes::Levels(levels) => self.batch.masks.extend(levels.iter().map(one_or_zero)),
            MaskBytes::Png(png) => {
                let levels = relit_data::shard::decode_mask(png)?;
                let extent = extent_of(levels.width(), levels.height());
                check_extent("mask", extent, self.batch.extent)?;
                self.batch.masks.extend(levels.iter().map(one_or_zero));
            }
        }
        self.last_mask = Some(mask);
        Ok(())
    }

    /// Adds the three planes of interleaved pixels, times the mask that was added last.
    fn add_image(&mut self, pixels: &[u8]) {
        let count = self.batch.extent.pixels();
        let mask = &self.batch.masks[self.batch.masks.len() - count..];
        let (pixels, _) = pixels.as_chunks::<3>();
        for channel in 0..3 {
            let value = |(pixel, inside): (&[u8; 3], &f32)| {
                self.levels[usize::from(pixel[channel])] * inside
            };
            self.batch.images.extend(pixels.iter().zip(mask).map(value));
        }
    }
}

impl PartialEq for MaskBytes {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Png(a), Self::Png(b)) => a == b,
            (Self::Levels(a), Self::Levels(b)) => std::sync::Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

pub(super) fn extent_of(width: u32, height: u32) -> Extent {
    Extent::new(width as usize, height as usize)
}
