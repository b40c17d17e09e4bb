//! The streaming part: wanted frames are read in order, turned into samples on all threads, and
//! handed to the writer as they come. Every queue is bounded.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use fast_image_resize::Resizer;
use image::RgbImage;
use rayon::ThreadPool;
use rayon::iter::{ParallelBridge, ParallelIterator};

use super::plan::Uses;
use super::{Error, Scaler};
use relit_data::geometry::Rect;
use relit_data::shard::{self, MaskSpans, Measures};
use relit_video::{DecodeFault, Pending, Reader, Video};

/// What is done with every frame of one video.
pub(super) struct Stage<'a> {
    pub(super) video: &'a Video,
    pub(super) crop: Rect,
    /// The mask under the crop.
    pub(super) spans: MaskSpans,
    pub(super) scaler: Scaler,
    pub(super) saturation_level: u8,
}

/// A frame as it goes into the data set.
pub(super) struct Processed {
    pub(super) number: u64,
    pub(super) image: RgbImage,
    pub(super) png: Vec<u8>,
    pub(super) measures: Measures,
}

/// A frame that could not be decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Lost {
    pub(super) number: u64,
    pub(super) fault: DecodeFault,
}

type Finished = Result<Result<Processed, Lost>, Error>;

impl Stage<'_> {
    /// Reads the frames that `uses` names and hands each to `accept`, in no order; answers the
    /// lost ones, in order.
    pub(super) fn run(
        &self,
        uses: &Uses,
        pool: &ThreadPool,
        mut accept: impl FnMut(Processed) -> Result<(), Error>,
    ) -> Result<Vec<Lost>, Error> {
        let wanted: Vec<u64> = uses.keys().copied().collect();
        let threads = pool.current_num_threads();
        let reader = self.video.read(&wanted, threads)?;
        let (sender, receiver) = sync_channel(2 * threads);
        thread::scope(|scope| {
            scope.spawn(|| pool.install(|| self.work(reader, sender)));
            collect(receiver, &mut accept)
        })
    }

    /// Works until the frames end or nobody takes the results.
    fn work(&self, reader: Reader<'_>, sender: SyncSender<Finished>) {
        // An error means that the receiver has gone after an error of its own.
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
            // Of a format that cannot be converted no other frame can be either.
            Err(fault @ DecodeFault::PixelFormat(_)) => return Err(Error::Frame { number, fault }),
            Err(fault) => return Ok(Err(Lost { number, fault })),
        };
        let measures = self.spans.measure(&crop, self.saturation_level)?;
        let image = self.scaler.scale(&crop, resizer)?;
        let png = shard::encode_rgb(&image)?;
        Ok(Ok(Processed {
            number,
            image,
            png,
            measures,
        }))
    }
}

fn collect(
    receiver: Receiver<Finished>,
    accept: &mut impl FnMut(Processed) -> Result<(), Error>,
) -> Result<Vec<Lost>, Error> {
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
