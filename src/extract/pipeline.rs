//! The streaming part: the assigned frames are read in order, turned into samples on all threads,
//! and passed to the writer as they are finished. Every queue is bounded.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use fast_image_resize::Resizer;
use image::RgbImage;
use rayon::ThreadPool;
use rayon::iter::{ParallelBridge, ParallelIterator};

use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, Measures};
use relit_data::shard::{self, ShardError};
use relit_video::{DecodeFault, Pending, Reader, Video};

use super::plan::Assignments;
use super::{ExtractError, Scaler};

/// The processing of the frames of one video.
pub(super) struct Stage<'a> {
    pub(super) video: &'a Video,
    pub(super) crop: Rect,
    /// The mask under the crop.
    pub(super) spans: MaskSpans,
    pub(super) scaler: Scaler,
    pub(super) saturation_level: u8,
}

/// A frame as it is written to the data set.
pub(super) struct ProcessedFrame {
    pub(super) number: u64,
    pub(super) image: RgbImage,
    pub(super) png: Vec<u8>,
    pub(super) measures: Measures,
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
            .try_for_each_init(Resizer::new, |resizer, pending| {
                sender.send(self.process(pending, resizer)).map_err(drop)
            });
    }

    fn process(&self, pending: Pending, resizer: &mut Resizer) -> Finished {
        let number = pending.number();
        let crop = self
            .video
            .picture(pending)
            .and_then(|picture| picture.rgb(self.crop));
        let crop = match crop {
            Ok(crop) => crop,
            // The other frames have the same pixel format.
            Err(fault @ DecodeFault::PixelFormat(_)) => {
                return Err(ExtractError::Frame { number, fault });
            }
            Err(fault) => return Ok(Err(LostFrame { number, fault })),
        };
        let measures = self.spans.measure(&crop, self.saturation_level);
        let measures = measures.map_err(ShardError::from)?;
        let image = self.scaler.scale(&crop, resizer)?;
        let png = shard::encode_rgb(&image)?;
        Ok(Ok(ProcessedFrame {
            number,
            image,
            png,
            measures,
        }))
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
