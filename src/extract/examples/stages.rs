//! What each stage of an extraction costs on one thread: `stages VIDEO MASK [FRAMES [SIDE]]`, processor
//! milliseconds a frame and seconds a session.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error as StdError;
use std::path::Path;
use std::time::Duration;

use image::{GrayImage, RgbaImage};
use rayon::ThreadPoolBuilder;
use relit_data::image_stats::MaskSpans;
use relit_data::mask::bounding_box;
use relit_data::shard::{Digest, encode_rgb};
use relit_extract::mask_warnings;
use relit_extract::{
    AlignBuffers, AlignSample, Aligner, CropView, ScaleBuffers, Scaler, cut, square_around,
};
use relit_video::Video;
use rustix::time::{ClockId, clock_gettime};

/// Frames from which shifts are learnt.
const LEARNT: usize = 36;

/// An error of any kind.
type Error = Box<dyn StdError + Send + Sync>;

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("give a video")?;
    let mask = arguments.next().ok_or("give a mask")?;
    let frames: u64 = arguments.next().as_deref().unwrap_or("150").parse()?;
    let side: u32 = arguments.next().as_deref().unwrap_or("256").parse()?;
    let mask = image::open(&mask)?.into_luma8();
    // So that nothing runs on other threads, where it would not be measured.
    let pool = ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| measure(Path::new(&path), &mask, frames, side))
}

/// Processor time of this thread.
fn now() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(
        time.tv_sec.unsigned_abs(),
        time.tv_nsec.unsigned_abs() as u32,
    )
}

/// Runs a stage and adds its time.
fn timed<T>(total: &mut Duration, stage: impl FnOnce() -> T) -> T {
    let start = now();
    let result = stage();
    *total += now() - start;
    result
}

fn measure(path: &Path, mask: &GrayImage, frames: u64, side: u32) -> Result<(), Error> {
    let [mut opened, mut hashed, mut looked, mut learnt] = [Duration::ZERO; 4];
    let video = timed(&mut opened, || Video::open(path))?;
    timed(&mut hashed, || Digest::hash_file(path))?;
    timed(&mut looked, || mask_warnings(&video, mask, None))?;
    let object = bounding_box(mask).ok_or("the mask is empty")?;
    let crop = square_around(object, 0.05, (video.facts().width, video.facts().height));
    let crop_mask = cut(mask, crop);
    let spans = MaskSpans::from_mask(&crop_mask);
    let scaler = Scaler::new(crop_mask.clone(), Some(side))?;

    let count = video.frames().len() as u64;
    let spread: Vec<u64> = (0..LEARNT as u64)
        .map(|k| k * count / LEARNT as u64)
        .collect();
    let mut part = RgbaImage::default();
    let mut samples = Vec::new();
    for pending in video.read(&spread, 1)? {
        video.part(pending, crop, &mut part)?;
        samples.push(AlignSample::from_crop(CropView::whole(&part)));
    }
    let aligner = timed(&mut learnt, || Aligner::learn(&samples, 0, &crop_mask, 8.0));
    let aligner = aligner.ok_or("the object has too little structure")?;

    let [mut read, mut decoded, mut aligned, mut scaled, mut encoded] = [Duration::ZERO; 5];
    let (mut scaling, mut aligning) = (ScaleBuffers::default(), AlignBuffers::default());
    let wanted: Vec<u64> = (0..frames.min(count)).collect();
    let mut reader = video.read(&wanted, 1)?;
    while let Some(pending) = timed(&mut read, || reader.next()) {
        timed(&mut decoded, || video.part(pending, crop, &mut part))?;
        let view = CropView::whole(&part);
        let _ = timed(&mut aligned, || {
            aligner.take_rows(view, 0..view.dimensions().1, &mut aligning);
            aligner.measure_rows(&mut aligning)
        });
        let mut measuring = spans.measuring(250);
        let image = timed(&mut scaled, || {
            scaler.scale(view, &mut scaling, &mut measuring)
        })?;
        timed(&mut encoded, || encode_rgb(&image))?;
    }
    println!("crop {} x {}, {} frames", crop.w, crop.h, wanted.len());
    let stages = [
        ("reading", read),
        ("decoding the crop", decoded),
        ("measuring the shift", aligned),
        ("statistics, masking, scaling", scaled),
        ("PNG", encoded),
    ];
    let all: Duration = stages.iter().map(|(_, time)| time).sum();
    for (name, time) in stages.into_iter().chain([("a frame", all)]) {
        let ms = 1000.0 * time.as_secs_f64() / wanted.len().max(1) as f64;
        let share = 100.0 * time.as_secs_f64() / all.as_secs_f64();
        println!("  {name:30} {ms:7.2} ms {share:5.0} %");
    }
    for (name, time) in [
        ("finding the frames", opened),
        ("hashing the file", hashed),
        ("the look at the mask", looked),
        ("learning the object", learnt),
    ] {
        println!("  once: {name:24} {:7.2} s", time.as_secs_f64());
    }
    Ok(())
}
