//! A small turn, read back and held against its truth.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;

use image::RgbImage;
use rayon::ThreadPoolBuilder;
use relit_data::shard::{FrameRecord, ShardReader, decode_rgb, verify};

use super::*;
use crate::library::Folders;
use crate::lighting::LightKind;
use crate::samples::camera::CameraModel;
use crate::samples::recipe::Recipe;
use crate::write_samples;

fn turns(seed: u64) -> SequenceRecipe {
    SequenceRecipe {
        recipe: Recipe {
            seed,
            size: 40,
            ..Recipe::default()
        },
        frames: 30,
    }
}

fn library() -> Library {
    Library::read(&Folders::default()).unwrap()
}

fn images(out: &Path, session: &str) -> BTreeMap<u32, RgbImage> {
    let file = BufReader::new(File::open(out.join(format!("{session}.tar"))).unwrap());
    let indexed = ShardReader::new(file).map(|sample| {
        let sample = sample.unwrap();
        let image = decode_rgb(sample.member("png").unwrap()).unwrap();
        let record: FrameRecord = serde_json::from_slice(sample.member("json").unwrap()).unwrap();
        (record.index, image)
    });
    indexed.collect()
}

fn sixteen(path: &Path) -> image::ImageBuffer<image::Rgb<u16>, Vec<u16>> {
    image::open(path).unwrap().into_rgb16()
}

#[test]
fn a_turn_passes_verification_and_is_what_its_truth_says() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let library = library();
    let written = write_sequences(&turns(1), &library, 2, out, &|| {}).unwrap();
    assert_eq!((written.new, written.kept), (2, 0));
    let verdict = verify(out, &|_, _| {}).unwrap();
    assert_eq!(verdict.problems, []);
    assert_eq!((verdict.sessions, verdict.samples), (2, 60));
    for session in ["synth-1-0000", "synth-1-0001"] {
        let truth = out.join("truth").join(session);
        let albedo = sixteen(&truth.join("albedo.png"));
        let lines = fs::read_to_string(truth.join("frames.jsonl")).unwrap();
        for (image, line) in images(out, session).values().zip(lines.lines()) {
            let frame: FrameTruth = serde_json::from_str(line).unwrap();
            let map = |kind: &str| sixteen(&truth.join(format!("{kind}/{:04}.png", frame.index)));
            let (shading, highlight) = (map("shading"), map("highlight"));
            for (x, y, pixel) in image.enumerate_pixels() {
                for channel in 0..3 {
                    let at = |map: &image::ImageBuffer<image::Rgb<u16>, Vec<u16>>, white: f32| {
                        f32::from(map.get_pixel(x, y).0[channel]) / 65_535.0 * white
                    };
                    let light = at(&albedo, 1.0) * at(&shading, frame.white.shading)
                        + at(&highlight, frame.white.highlight);
                    let value = CameraModel::plain().response.encode(light) * 255.0;
                    let error = value - f32::from(pixel.0[channel]);
                    assert!(
                        error.abs() <= 1.0,
                        "{session} {} ({x}, {y}): {error}",
                        frame.index
                    );
                }
            }
        }
    }
}

#[test]
fn the_light_turns_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    write_sequences(&turns(2), &library(), 1, folder.path(), &|| {}).unwrap();
    let images = images(folder.path(), "synth-2-0000");
    let distance = |a: u32, b: u32| {
        let pairs = images[&a].as_raw().iter().zip(images[&b].as_raw());
        pairs.map(|(&a, &b)| u64::from(a.abs_diff(b))).sum::<u64>()
    };
    assert!(distance(0, 1) > 0);
    assert!(distance(0, 15) > 2 * distance(0, 1));
    assert!(distance(0, 29) < 2 * distance(0, 1) + 1000);
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let bytes = [1, 2].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let library = library();
        pool.install(|| write_sequences(&turns(3), &library, 1, folder.path(), &|| {}))
            .unwrap();
        let truth = folder.path().join("truth/synth-3-0000");
        let files = [
            "turn.json",
            "light.txt",
            "frames.jsonl",
            "albedo.png",
            "shading/0007.png",
            "highlight/0029.png",
        ];
        let mut all: Vec<Vec<u8>> = files
            .map(|file| fs::read(truth.join(file)).unwrap())
            .to_vec();
        for file in ["dataset.json", "synth-3-0000.tar", "synth-3-0000.parquet"] {
            all.push(fs::read(folder.path().join(file)).unwrap());
        }
        all
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn turns_that_are_whole_are_kept_and_others_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let library = library();
    write_sequences(&turns(4), &library, 1, folder.path(), &|| {}).unwrap();
    let again = write_sequences(&turns(4), &library, 2, folder.path(), &|| {}).unwrap();
    assert_eq!((again.new, again.kept), (1, 1));
    let other = SequenceRecipe {
        frames: 12,
        ..turns(4)
    };
    let error = write_sequences(&other, &library, 1, folder.path(), &|| {}).unwrap_err();
    assert!(matches!(error, SynthError::Unusable { .. }), "{error:?}");
    let samples = tempfile::tempdir().unwrap();
    write_samples(&turns(4).recipe, &library, 1, samples.path(), &|| {}).unwrap();
    let error = write_sequences(&turns(4), &library, 1, samples.path(), &|| {}).unwrap_err();
    assert!(matches!(error, SynthError::Unusable { .. }), "{error:?}");
    let mut other = turns(4);
    other.recipe.light = LightKind::Sh;
    let error = write_sequences(&other, &library, 1, folder.path(), &|| {}).unwrap_err();
    assert!(matches!(error, SynthError::Unusable { .. }), "{error:?}");
}

#[test]
fn some_frames_of_glossy_turns_are_saturated() {
    let folder = tempfile::tempdir().unwrap();
    write_sequences(&turns(5), &library(), 6, folder.path(), &|| {}).unwrap();
    let dataset = Dataset::read(folder.path()).unwrap();
    let saturated: u32 = dataset
        .sessions
        .iter()
        .map(|session| session.spec_net)
        .sum();
    assert!(saturated > 0);
}
