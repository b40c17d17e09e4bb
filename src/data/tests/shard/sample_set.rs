//! A small data set for the tests.

use std::path::Path;

use image::{GrayImage, Luma, Rgb, RgbImage};
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
use relit_data::shard::{
    Align, Dataset, Digest, ExtractionSettings, FrameRecord, ImageSize, Layout, MaskInfo,
    OutputFolder, Sample, SamplingBasis, SessionEntry, SessionQuality, ShardWriter, SourceVideo,
    VerifyProblem, VerifyReport, verify,
};
use relit_data::spec_net_gate::SPEC_NET_GATE;

pub(crate) const SESSION: &str = "20261120T093015Z-mug";
pub(crate) const SAMPLES: u32 = 14;
const WIDTH: u32 = 20;
const HEIGHT: u32 = 16;

pub(crate) fn mask() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let inside = (2..18).contains(&x) && (2..14).contains(&y) && x + y > 6;
        Luma([if inside { 255 } else { 0 }])
    })
}

/// An image that changes with its index, 0 outside the mask; later ones have more highlights.
fn image(index: u32) -> RgbImage {
    let mask = mask();
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        if mask.get_pixel(x, y).0[0] == 0 {
            return Rgb([0; 3]);
        }
        if x > 8 && y == 8 && x < 8 + index {
            return Rgb([255, 251, 250]);
        }
        Rgb([
            (x * 11 + index) as u8,
            (y * 13) as u8,
            ((x * y) % 200) as u8 + 20,
        ])
    })
}

pub(crate) fn record(session: &str, index: u32, image: &RgbImage) -> FrameRecord {
    let measures = MaskSpans::from_mask(&mask())
        .measure(image, SATURATION_LEVEL)
        .unwrap();
    let duplicate = index == 5;
    let crop = Rect::new(-2, 5, WIDTH, HEIGHT);
    FrameRecord {
        source_frame: u64::from(index) * 3 - if duplicate { 3 } else { 0 },
        t_us: 1_000_000 + i64::from(index) * 33_333,
        angle_deg: (index != 2).then_some(f64::from(index) * 0.24),
        duplicate,
        ..FrameRecord::new(session, "mug", index, crop, &measures, SPEC_NET_GATE)
    }
}

pub(crate) fn sample(session: &str, index: u32) -> Sample {
    let image = image(index);
    Sample::encode(record(session, index, &image), image).unwrap()
}

pub(crate) fn settings(layout: Layout) -> ExtractionSettings {
    ExtractionSettings {
        frames: SAMPLES,
        size: ImageSize::NATIVE,
        margin: 0.05,
        saturation_level: SATURATION_LEVEL,
        gate: SPEC_NET_GATE,
        align: Align::Off,
        align_tolerance: None,
        layout,
        scaling: "none".to_owned(),
    }
}

pub(crate) fn entry(
    id: &str,
    files: &relit_data::shard::ShardFiles,
    all: &[Sample],
) -> SessionEntry {
    let count = |flag: fn(&FrameRecord) -> bool| {
        all.iter().filter(|sample| flag(&sample.record)).count() as u32
    };
    let mut records: Vec<FrameRecord> = all.iter().map(|s| s.record.clone()).collect();
    records.sort_by_key(|record| record.index);
    let blake3 = Digest::hash(b"input");
    SessionEntry {
        id: id.to_owned(),
        object: "mug".to_owned(),
        input: SourceVideo {
            video: "video.mkv".to_owned(),
            codec: "mjpeg".to_owned(),
            frames: 50,
            bytes: 5,
            blake3,
            colour_conversion: None,
            index_blake3: Some(blake3),
        },
        mask: MaskInfo {
            blake3,
            px: mask().as_raw().iter().filter(|&&level| level != 0).count() as u64,
            bounding_box: Rect::new(0, 0, 1, 1),
        },
        selection: SamplingBasis::Angle,
        samples: SAMPLES,
        covered_deg: None,
        rig: None,
        duplicates: count(|r| r.duplicate),
        spec_net: count(|r| r.spec_net),
        lossy: false,
        quality: SessionQuality::from_records(&records, false, None),
        warnings: Vec::new(),
        table: files.table.clone(),
        report: None,
    }
}

/// Writes the session `id`, its samples in the given order, after a change to each of them.
pub(crate) fn write_with(
    out: &Path,
    layout: Layout,
    id: &str,
    indices: &[u32],
    change: impl Fn(&mut Sample),
) {
    let _lock = OutputFolder::lock(out).unwrap();
    let mut writer = ShardWriter::create(out, layout, id, SAMPLES, &mask()).unwrap();
    let mut all = Vec::new();
    for &index in indices {
        let mut sample = sample(id, index);
        change(&mut sample);
        all.push(sample.clone());
        writer.push(sample).unwrap();
    }
    let files = writer.finish().unwrap();
    let mut dataset = Dataset::read(out).unwrap_or_else(|_| Dataset::new(settings(layout)));
    dataset.replace(entry(id, &files, &all), files.shards);
    dataset.write(out).unwrap();
}

/// Writes the session [`SESSION`] in index order.
pub(crate) fn write(out: &Path, layout: Layout) {
    let indices: Vec<u32> = (0..SAMPLES).collect();
    write_with(out, layout, SESSION, &indices, |_| {});
}

/// A data set of one session in its own folder.
pub(crate) fn dataset(layout: Layout) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), layout);
    dir
}

pub(crate) fn verified(out: &Path) -> VerifyReport {
    verify(out, &|_, _| {}).unwrap()
}

/// Asserts that the data set has no problems.
#[track_caller]
pub(crate) fn assert_intact(out: &Path) {
    assert_eq!(texts(&verified(out).problems), Vec::<String>::new());
}

/// Asserts that a problem with this file and sample contains this text.
#[track_caller]
pub(crate) fn assert_names(out: &Path, file: &str, sample: Option<u32>, named: &str) {
    let problems = verified(out).problems;
    let key = sample.map(|index| relit_data::shard::sample_key(SESSION, index));
    let is_among = problems
        .iter()
        .any(|p| p.file == file && p.sample == key && p.what.contains(named));
    assert!(
        is_among,
        "{file} {key:?} {named:?} is not among {:#?}",
        texts(&problems)
    );
}

pub(crate) fn texts(problems: &[VerifyProblem]) -> Vec<String> {
    problems.iter().map(ToString::to_string).collect()
}
