//! The streaming part: the assigned frames are read in order, turned into samples on all threads,
//! and passed to the writer as they are finished. Every queue is bounded.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use fast_image_resize::Resizer;
use image::RgbImage;
use image::imageops::crop_imm;
use rayon::ThreadPool;
use rayon::iter::{ParallelBridge, ParallelIterator};

use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, Measures};
use relit_data::shard::{self, ShardError};
use relit_video::{DecodeFault, Pending, Picture, Reader, Video};

use super::plan::Assignments;
use super::scale::APRON;
use super::{AlignBuffers, AlignSample, Aligner, Alignment, ExtractError, Scaler};

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
    /// Shifts above this are corrected, pixels; `None` if none are.
    pub(super) correct_above: Option<f64>,
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

/// A frame's pixels under the crop, and its image.
struct Seen {
    crop: RgbImage,
    image: RgbImage,
    alignment: Option<Alignment>,
    shift_applied: bool,
}

/// What a thread keeps from frame to frame.
#[derive(Default)]
struct Buffers {
    resizer: Resizer,
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
        let seen = match self.video.picture(pending) {
            Ok(picture) => self.see(&picture, buffers)?,
            Err(fault) => Err(fault),
        };
        let seen = match seen {
            Ok(seen) => seen,
            // The other frames have the same pixel format.
            Err(fault @ DecodeFault::PixelFormat(_)) => {
                return Err(ExtractError::Frame { number, fault });
            }
            Err(fault) => return Ok(Err(LostFrame { number, fault })),
        };
        let measures = self.spans.measure(&seen.crop, self.saturation_level);
        let measures = measures.map_err(ShardError::from)?;
        let png = shard::encode_rgb(&seen.image)?;
        Ok(Ok(ProcessedFrame {
            number,
            image: seen.image,
            png,
            measures,
            alignment: seen.alignment,
            shift_applied: seen.shift_applied,
        }))
    }

    /// The picture under the crop, or where the object moved to.
    fn see(
        &self,
        picture: &Picture,
        buffers: &mut Buffers,
    ) -> Result<Result<Seen, DecodeFault>, ExtractError> {
        let crop = match picture.rgb(self.crop) {
            Ok(crop) => crop,
            Err(fault) => return Ok(Err(fault)),
        };
        let alignment = self.align.as_ref().map(|align| {
            let sample = AlignSample::of(&crop);
            align.aligner.measure(&sample, &mut buffers.align)
        });
        let limit = self.align.as_ref().and_then(|align| align.correct_above);
        let shift = alignment.and_then(|alignment| alignment.shift);
        let shift = shift.filter(|[dx, dy]| limit.is_some_and(|limit| dx.hypot(*dy) > limit));
        let Some(shift) = shift else {
            let image = self.scaler.scale(&crop, &mut buffers.resizer)?;
            return Ok(Ok(Seen {
                crop,
                image,
                alignment,
                shift_applied: false,
            }));
        };
        let whole = shift.map(f64::round);
        let around = match picture.rgb(grown(self.crop, whole.map(|part| part as i32))) {
            Ok(around) => around,
            Err(fault) => return Ok(Err(fault)),
        };
        let part = [shift[0] - whole[0], shift[1] - whole[1]];
        let image = self
            .scaler
            .scale_moved(&around, part, &mut buffers.resizer)?;
        let (width, height) = crop.dimensions();
        Ok(Ok(Seen {
            crop: crop_imm(&around, APRON, APRON, width, height).to_image(),
            image,
            alignment,
            shift_applied: true,
        }))
    }

    /// The crops of some frames, in which shifts are learnt, in order; frames that cannot be decoded are
    /// left out.
    pub(super) fn align_samples(
        &self,
        frames: &[u64],
        pool: &ThreadPool,
    ) -> Result<Vec<(u64, AlignSample)>, ExtractError> {
        let reader = self.video.read(frames, pool.current_num_threads())?;
        let sample = |pending: Pending| {
            let number = pending.number();
            let picture = self.video.picture(pending).ok()?;
            Some((number, AlignSample::of(&picture.rgb(self.crop).ok()?)))
        };
        let mut samples: Vec<(u64, AlignSample)> =
            pool.install(|| reader.par_bridge().filter_map(sample).collect());
        samples.sort_by_key(|(number, _)| *number);
        Ok(samples)
    }
}

/// The crop moved by whole pixels, with its apron.
fn grown(crop: Rect, [dx, dy]: [i32; 2]) -> Rect {
    let apron = APRON as i32;
    Rect::new(
        crop.x.saturating_add(dx - apron),
        crop.y.saturating_add(dy - apron),
        crop.w + 2 * APRON,
        crop.h + 2 * APRON,
    )
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
