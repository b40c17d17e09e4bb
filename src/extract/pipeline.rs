//! The streaming part: the assigned frames are read in order, turned into samples on all threads,
//! and passed to the writer as they are finished. Every queue is bounded.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use image::imageops::replace;
use image::{DynamicImage, RgbImage, RgbaImage};
use rayon::ThreadPool;
use rayon::iter::{ParallelBridge, ParallelIterator};

use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, Measures};
use relit_data::shard;
use relit_video::{DecodeFault, Pending, Reader, Video};

use super::plan::Assignments;
use super::scale::APRON;
use super::{
    AlignBuffers, AlignSample, Aligner, Alignment, ExtractError, ScaleBuffers, Scaler, View,
};

/// The processing of the frames of one video.
pub(super) struct Stage<'a> {
    pub(super) video: &'a Video,
    pub(super) crop: Rect,
    /// The mask under the crop.
    pub(super) spans: MaskSpans,
    pub(super) scaler: Scaler,
    pub(super) saturation_level: u8,
    pub(super) align: Option<Align>,
}

/// How shifts are measured and corrected.
pub(super) struct Align {
    pub(super) aligner: Aligner,
    /// `None` if no shifts are corrected.
    pub(super) correction: Option<Correction>,
}

/// Which shifts are corrected, pixels.
pub(super) struct Correction {
    pub(super) above: f64,
    /// A turn with larger ones fails.
    pub(super) most: f64,
}

/// A frame as it is written to the data set.
pub(super) struct ProcessedFrame {
    pub(super) number: u64,
    pub(super) image: RgbImage,
    pub(super) png: Vec<u8>,
    pub(super) measures: Measures,
    /// `None` if it was not measured.
    pub(super) alignment: Option<Alignment>,
    pub(super) shift_applied: bool,
}

/// What a thread keeps from frame to frame.
#[derive(Default)]
struct Buffers {
    region: RgbaImage,
    scale: ScaleBuffers,
    align: AlignBuffers,
}

/// A frame that could not be decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LostFrame {
    pub(super) number: u64,
    pub(super) fault: DecodeFault,
}

/// The inner error is a frame that is lost, the outer one ends the extraction.
type Finished = Result<Result<ProcessedFrame, LostFrame>, ExtractError>;

impl Stage<'_> {
    /// Reads the assigned frames and passes each to `accept`, in no particular order; returns the
    /// lost ones, in order.
    pub(super) fn run(
        &self,
        assignments: &Assignments,
        pool: &ThreadPool,
        mut accept: impl FnMut(ProcessedFrame) -> Result<(), ExtractError>,
    ) -> Result<Vec<LostFrame>, ExtractError> {
        let wanted: Vec<u64> = assignments.keys().copied().collect();
        let threads = pool.current_num_threads();
        let reader = self.video.read(&wanted, threads)?;
        let (sender, receiver) = sync_channel(2 * threads);
        thread::scope(|scope| {
            scope.spawn(|| pool.install(|| self.work(reader, sender)));
            collect(receiver, &mut accept)
        })
    }

    /// Processes frames until they end or the receiver is gone.
    fn work(&self, reader: Reader<'_>, sender: SyncSender<Finished>) {
        // An error means that the receiver has stopped after an error of its own.
        let _ = reader
            .par_bridge()
            .try_for_each_init(Buffers::default, |buffers, pending| {
                sender.send(self.process(pending, buffers)).map_err(drop)
            });
    }

    fn process(&self, pending: Pending, buffers: &mut Buffers) -> Finished {
        let number = pending.number();
        match self.video.part(pending, self.region(), &mut buffers.region) {
            Ok(()) => {}
            // The other frames have the same pixel format.
            Err(fault @ DecodeFault::PixelFormat(_)) => {
                return Err(ExtractError::Frame { number, fault });
            }
            Err(fault) => return Ok(Err(LostFrame { number, fault })),
        }
        let Buffers {
            region,
            scale,
            align,
        } = buffers;
        let crop = View::within(region, self.border());
        let alignment = self.align.as_ref().map(|by| {
            let sample = AlignSample::of(crop);
            by.aligner.measure(&sample, align)
        });
        let moved = alignment.and_then(|alignment| self.moved(crop, alignment));
        let mut measuring = self.spans.measuring(self.saturation_level);
        let image = match moved {
            None => self.scaler.scale(crop, scale, &mut measuring)?,
            Some((crop, part)) => self.scaler.scale_moved(crop, part, scale, &mut measuring)?,
        };
        Ok(Ok(ProcessedFrame {
            number,
            png: shard::encode_rgb(&image)?,
            image,
            measures: measuring.finish(),
            alignment,
            shift_applied: moved.is_some(),
        }))
    }

    /// Where the crop's object went in whole pixels, and the rest of the way; `None` if it is not corrected.
    fn moved<'v>(&self, crop: View<'v>, alignment: Alignment) -> Option<(View<'v>, [f64; 2])> {
        let align = self.align.as_ref()?;
        let correction = align.correction.as_ref()?;
        let shift = align.aligner.to_correct(&alignment, correction.above)?;
        let whole = shift.map(f64::round);
        // None beyond the largest shift, with which the turn fails.
        let crop = crop.moved(whole.map(|part| part as i32), APRON)?;
        Some((crop, [shift[0] - whole[0], shift[1] - whole[1]]))
    }

    /// Pixels that are decoded around the crop, for objects that moved.
    fn border(&self) -> u32 {
        let correction = self
            .align
            .as_ref()
            .and_then(|align| align.correction.as_ref());
        correction.map_or(0, |correction| correction.most.ceil() as u32 + APRON)
    }

    /// The part of a frame that is decoded.
    fn region(&self) -> Rect {
        let border = self.border();
        Rect::new(
            self.crop.x.saturating_sub_unsigned(border),
            self.crop.y.saturating_sub_unsigned(border),
            self.crop.w + 2 * border,
            self.crop.h + 2 * border,
        )
    }

    /// The crops of some frames, in which shifts are learnt, in order; frames that cannot be decoded are
    /// left out.
    pub(super) fn align_samples(
        &self,
        frames: &[u64],
        pool: &ThreadPool,
    ) -> Result<Vec<(u64, AlignSample)>, ExtractError> {
        let reader = self.video.read(frames, pool.current_num_threads())?;
        let sample = |crop: &mut RgbaImage, pending: Pending| {
            let number = pending.number();
            self.video.part(pending, self.crop, crop).ok()?;
            Some((number, AlignSample::of(View::whole(crop))))
        };
        let mut samples: Vec<(u64, AlignSample)> = pool.install(|| {
            let samples = reader.par_bridge().map_init(RgbaImage::default, sample);
            samples.flatten().collect()
        });
        samples.sort_by_key(|(number, _)| *number);
        Ok(samples)
    }

    /// The crop of one frame, found by the file's index; `None` if it cannot be decoded.
    pub(super) fn sought_sample(&self, frame: u64) -> Option<(u64, AlignSample)> {
        let whole = self.video.frame(frame).ok()?;
        let mut crop = RgbaImage::new(self.crop.w, self.crop.h);
        let (left, top) = (-i64::from(self.crop.x), -i64::from(self.crop.y));
        replace(
            &mut crop,
            &DynamicImage::from(whole).into_rgba8(),
            left,
            top,
        );
        Some((frame, AlignSample::of(View::whole(&crop))))
    }
}

fn collect(
    receiver: Receiver<Finished>,
    accept: &mut impl FnMut(ProcessedFrame) -> Result<(), ExtractError>,
) -> Result<Vec<LostFrame>, ExtractError> {
    let mut lost = Vec::new();
    for finished in receiver {
        match finished? {
            Ok(processed) => accept(processed)?,
            Err(frame) => lost.push(frame),
        }
    }
    lost.sort_by_key(|frame| frame.number);
    Ok(lost)
}
