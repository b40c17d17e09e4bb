//! The streaming part: the assigned frames are read in order, turned into samples on all threads,
//! and passed to the writer as they are finished. Every queue is bounded.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use image::imageops::replace;
use image::{DynamicImage, RgbImage, RgbaImage};
use rayon::ThreadPool;
use rayon::iter::{ParallelBridge, ParallelIterator};

use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, Measures, Measuring};
use relit_data::shard;
use relit_video::{DecodeFault, Pending, Reader, Video};

use super::crop::repeat_edge;
use super::interpolated_shifts::InterpolatedShift;
use super::plan::Assignments;
use super::scale::{APRON, Scaling};
use super::{
    AlignBuffers, AlignSample, Aligner, Alignment, CropView, ExtractError, ScaleBuffers, Scaler,
};

/// The processing of the frames of one video.
pub(super) struct Stage<'a> {
    pub(super) video: &'a Video,
    pub(super) crop: Rect,
    /// The smallest rectangle around the mask in the frame.
    pub(super) object: Rect,
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
    /// The shifts of frames that cannot be registered, as far as the frames around them tell.
    pub(super) interpolated: HashMap<u64, InterpolatedShift>,
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
    /// The uncertainty of the shift, pixels, if it was not measured but comes from the frames around.
    pub(super) interpolated: Option<f64>,
    pub(super) shift_applied: bool,
}

/// A crop whose object is brought back to its place.
#[derive(Clone, Copy)]
struct Moved<'v> {
    /// The crop, moved by whole pixels.
    crop: CropView<'v>,
    whole: [i32; 2],
    /// The rest of the way.
    part: [f64; 2],
}

/// What a thread keeps from frame to frame.
#[derive(Default)]
struct Buffers {
    region: RgbaImage,
    scale: ScaleBuffers,
    align: AlignBuffers,
    /// Whether the object of the last frame was moved.
    moved: bool,
}

/// What is done with a crop's rows as they come, while they are in the processor's cache: their brightness is noted,
/// and they are scaled where the mask lies, in the hope that the object turns out to be there.
struct Early<'s, 'b> {
    stage: &'s Stage<'s>,
    scale: &'b mut ScaleBuffers,
    align: &'b mut AlignBuffers,
    scaled: Option<(Scaling, Measuring<'s>)>,
    /// The object is likely to be elsewhere: scaling is left for later.
    expect_moved: bool,
}

impl Early<'_, '_> {
    /// Takes these rows of the part that is decoded.
    fn take(&mut self, part: &RgbaImage, rows: Range<u32>) {
        let stage = self.stage;
        let border = stage.border();
        let crop = CropView::within(part, border);
        if rows.start == 0 {
            let scaling = stage.scaler.begin(crop, self.scale).ok();
            let scaling = scaling.filter(|_| !self.expect_moved);
            self.scaled =
                scaling.map(|scaling| (scaling, stage.spans.measuring(stage.saturation_level)));
        }
        let (_, height) = crop.dimensions();
        let of_crop = |row: u32| row.saturating_sub(border).min(height);
        let rows = of_crop(rows.start)..of_crop(rows.end);
        if let Some((scaling, measuring)) = &mut self.scaled {
            let scaler = &stage.scaler;
            scaler.take_rows(scaling, crop, rows.end, self.scale, measuring);
        }
        if let Some(by) = &stage.align {
            by.aligner.take_rows(crop, rows, self.align);
        }
    }
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
        let inside = self.region().clipped_to(self.frame().0, self.frame().1);
        let inside = inside == Some(self.region());
        let mut early = Early {
            stage: self,
            scale: &mut buffers.scale,
            align: &mut buffers.align,
            scaled: None,
            expect_moved: buffers.moved,
        };
        let region = &mut buffers.region;
        let decoded = self.video.part_by_bands(
            pending,
            self.region(),
            self.needed(),
            region,
            |part, rows| {
                if inside {
                    early.take(part, rows);
                }
            },
        );
        match decoded {
            Ok(()) => {}
            // The other frames have the same pixel format.
            Err(fault @ DecodeFault::PixelFormat(_)) => {
                return Err(ExtractError::Refused(format!(
                    "frame {number}: {fault}; convert the video to another pixel format, for example with ffmpeg"
                )));
            }
            // So do all that follow it.
            Err(fault @ DecodeFault::Unread) => {
                return Err(ExtractError::Refused(format!(
                    "frame {number}: {fault}: is it being written, or is its disk gone? extract it again"
                )));
            }
            Err(fault) => return Ok(Err(LostFrame { number, fault })),
        }
        if !inside {
            repeat_edge(region, self.region(), self.frame());
            early.take(region, 0..region.height());
        }
        let scaled = early.scaled;
        let crop = CropView::within(region, self.border());
        let alignment = self.align.as_ref();
        let alignment = alignment.map(|by| by.aligner.measure_rows(&mut buffers.align));
        let (alignment, interpolated) = self.completed(number, alignment);
        let moved = alignment.and_then(|alignment| self.moved(crop, alignment));
        buffers.moved = moved.is_some();
        let (image, measures) = match (moved, scaled) {
            (None, Some((scaling, measuring))) => (scaling.into_image(), measuring.finish()),
            (None, None) => {
                let mut measuring = self.spans.measuring(self.saturation_level);
                let image = self
                    .scaler
                    .scale(crop, &mut buffers.scale, &mut measuring)?;
                (image, measuring.finish())
            }
            (Some(Moved { crop, whole, part }), _) => {
                let spans = self.seen(whole);
                let mut measuring = spans.measuring(self.saturation_level);
                let scale = &mut buffers.scale;
                let image = self.scaler.scale_moved(crop, part, scale, &mut measuring)?;
                (image, measuring.finish())
            }
        };
        Ok(Ok(ProcessedFrame {
            number,
            png: shard::encode_rgb(&image)?,
            image,
            measures,
            alignment,
            interpolated,
            shift_applied: moved.is_some(),
        }))
    }

    /// A frame's alignment with the shift that the frames around it tell, if it has none, and its uncertainty then.
    fn completed(
        &self,
        number: u64,
        alignment: Option<Alignment>,
    ) -> (Option<Alignment>, Option<f64>) {
        let lacks = alignment.filter(|alignment| alignment.shift.is_none());
        let around = self
            .align
            .as_ref()
            .and_then(|by| by.interpolated.get(&number));
        match (lacks, around) {
            (Some(alignment), Some(found)) => {
                let shift = Some(found.shift);
                (
                    Some(Alignment { shift, ..alignment }),
                    Some(found.uncertainty),
                )
            }
            _ => (alignment, None),
        }
    }

    /// The crop where its object went; `None` if it is not corrected.
    fn moved<'v>(&self, crop: CropView<'v>, alignment: Alignment) -> Option<Moved<'v>> {
        let correction = self.align.as_ref()?.correction.as_ref()?;
        let [dx, dy] = alignment.shift?;
        if dx.hypot(dy) <= correction.above {
            return None;
        }
        let whole = [dx, dy].map(|part| part.round() as i32);
        Some(Moved {
            // None beyond the largest shift, with which the turn fails.
            crop: crop.moved(whole, APRON)?,
            whole,
            part: [dx - f64::from(whole[0]), dy - f64::from(whole[1])],
        })
    }

    /// The part of the mask under which the frame shows the object, after this move of both: without what lies
    /// beyond the frame.
    fn seen(&self, [dx, dy]: [i32; 2]) -> Cow<'_, MaskSpans> {
        let (width, height) = self.frame();
        let moved = |rect: Rect| {
            let (x, y) = (rect.x.saturating_add(dx), rect.y.saturating_add(dy));
            Rect::new(x, y, rect.w, rect.h)
        };
        let (object, crop) = (moved(self.object), moved(self.crop));
        if object.clipped_to(width, height) == Some(object) {
            return Cow::Borrowed(&self.spans);
        }
        let seen = crop.clipped_to(width, height);
        let seen = seen.unwrap_or(Rect::new(crop.x, crop.y, 0, 0));
        let (left, top) = (crop.x.abs_diff(seen.x), crop.y.abs_diff(seen.y));
        Cow::Owned(self.spans.within(left..left + seen.w, top..top + seen.h))
    }

    /// The frame's width and height, pixels.
    fn frame(&self) -> (u32, u32) {
        let facts = self.video.facts();
        (facts.width, facts.height)
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

    /// What of that counts: all of it where the object is looked for, else what lies under the mask.
    fn needed(&self) -> Rect {
        match &self.align {
            Some(_) => self.region(),
            None => self.object,
        }
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
            repeat_edge(crop, self.crop, self.frame());
            Some((number, AlignSample::from_crop(CropView::whole(crop))))
        };
        let mut samples: Vec<(u64, AlignSample)> = pool.install(|| {
            let samples = reader.par_bridge().map_init(RgbaImage::default, sample);
            samples.flatten().collect()
        });
        samples.sort_by_key(|(number, _)| *number);
        Ok(samples)
    }

    /// The crop of one frame, found by the file's index; `None` if it cannot be decoded.
    pub(super) fn sample_by_index(&self, frame: u64) -> Option<(u64, AlignSample)> {
        let whole = self.video.frame(frame).ok()?;
        let mut crop = RgbaImage::new(self.crop.w, self.crop.h);
        let (left, top) = (-i64::from(self.crop.x), -i64::from(self.crop.y));
        replace(
            &mut crop,
            &DynamicImage::from(whole).into_rgba8(),
            left,
            top,
        );
        repeat_edge(&mut crop, self.crop, self.frame());
        Some((frame, AlignSample::from_crop(CropView::whole(&crop))))
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
