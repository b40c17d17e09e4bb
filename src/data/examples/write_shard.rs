//! A data set of one small session: `write_shard OUT`.
//!
//! A disc in front of black, lit from a side that turns. `verify_dataset OUT` checks what is written.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::path::PathBuf;

use image::{GrayImage, Luma, Rgb, RgbImage};
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
use relit_data::shard::{
    Align, Dataset, Digest, ExtractionSettings, FrameRecord, ImageSize, Layout, MaskInfo,
    OutputFolder, Sample, SamplingBasis, SessionEntry, SessionQuality, ShardFiles, ShardWriter,
    SourceVideo,
};
use relit_data::spec_net_gate::SPEC_NET_GATE;

const SESSION: &str = "20261120T093015Z-disc";
const OBJECT: &str = "disc";
const SAMPLES: u32 = 24;
const SIDE: u32 = 64;
/// Time and angle from one frame to the next.
const STEP_US: i64 = 33_333;
const STEP_DEG: f64 = 360.0 / SAMPLES as f64;

fn main() -> Result<(), Box<dyn Error>> {
    let out: PathBuf = std::env::args_os().nth(1).ok_or("give a folder")?.into();
    // No other process may write into the folder at the same time.
    let folder = OutputFolder::lock(&out)?;
    let settings = settings();
    let mask = mask();
    let spans = MaskSpans::from_mask(&mask);
    let mut writer = ShardWriter::create(folder.path(), settings.layout, SESSION, SAMPLES, &mask)?;
    let mut records = Vec::new();
    for index in 0..SAMPLES {
        let sample = sample(index, &mask, &spans)?;
        records.push(sample.record.clone());
        writer.push(sample)?;
    }
    let files = writer.finish()?;

    // What is not in dataset.json is not part of the data set.
    let mut dataset = Dataset::new(settings);
    dataset.replace(entry(&files, &mask, &records)?, files.shards);
    dataset.write(folder.path())?;
    println!("{SAMPLES} samples are in {}", out.display());
    Ok(())
}

fn settings() -> ExtractionSettings {
    ExtractionSettings {
        frames: SAMPLES,
        size: ImageSize::NATIVE,
        margin: 0.0,
        saturation_level: SATURATION_LEVEL,
        gate: SPEC_NET_GATE,
        align: Align::Off,
        align_tolerance: None,
        layout: Layout::Webdataset,
        scaling: "none".to_owned(),
    }
}

fn mask() -> GrayImage {
    let centre = f64::from(SIDE) / 2.0;
    GrayImage::from_fn(SIDE, SIDE, |x, y| {
        let far = (f64::from(x) + 0.5 - centre).hypot(f64::from(y) + 0.5 - centre);
        Luma([if far < 0.4 * f64::from(SIDE) { 255 } else { 0 }])
    })
}

fn sample(index: u32, mask: &GrayImage, spans: &MaskSpans) -> Result<Sample, Box<dyn Error>> {
    let angle_deg = STEP_DEG * f64::from(index);
    let light = angle_deg.to_radians().cos();
    let image = RgbImage::from_fn(SIDE, SIDE, |x, y| {
        // Exactly 0 outside the mask.
        if mask.get_pixel(x, y).0[0] == 0 {
            return Rgb([0; 3]);
        }
        let across = 2.0 * f64::from(x) / f64::from(SIDE) - 1.0;
        Rgb([200.0, 180.0, 150.0].map(|colour| (colour * (1.0 + 0.25 * light * across)) as u8))
    });
    let measures = spans.measure(&image, SATURATION_LEVEL)?;
    let whole = Rect::new(0, 0, SIDE, SIDE);
    let record = FrameRecord {
        t_us: STEP_US * i64::from(index),
        angle_deg: Some(angle_deg),
        ..FrameRecord::new(SESSION, OBJECT, index, whole, &measures, SPEC_NET_GATE)
    };
    Ok(Sample::encode(record, image)?)
}

fn entry(
    files: &ShardFiles,
    mask: &GrayImage,
    records: &[FrameRecord],
) -> Result<SessionEntry, Box<dyn Error>> {
    let stored_mask = relit_data::shard::encode_mask(mask)?;
    Ok(SessionEntry {
        id: SESSION.to_owned(),
        object: OBJECT.to_owned(),
        // There was no video: an extraction names the one that it read.
        input: SourceVideo {
            video: "none.mkv".to_owned(),
            codec: "none".to_owned(),
            frames: u64::from(SAMPLES),
            bytes: 0,
            blake3: Digest::hash(b""),
            colour_conversion: None,
            index_blake3: None,
        },
        mask: MaskInfo {
            blake3: Digest::hash(&stored_mask),
            px: MaskSpans::from_mask(mask).pixels(),
            bounding_box: Rect::new(0, 0, SIDE, SIDE),
        },
        selection: SamplingBasis::Angle,
        samples: SAMPLES,
        covered_deg: None,
        rig: None,
        duplicates: 0,
        spec_net: records.iter().filter(|record| record.spec_net).count() as u32,
        lossy: false,
        quality: SessionQuality::from_records(records, false, None),
        warnings: Vec::new(),
        table: files.table.clone(),
        report: None,
    })
}
