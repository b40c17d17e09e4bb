//! Data sets on disk as streams of arrays: what was written is given, and damage is told.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use image::{GrayImage, Luma, Rgb as Pixel, RgbImage};
use relight_core::image::{Extent, Planes};
use relight_core::reader::{
    Cursor, DamagedBatch, DrawPlan, Encoding, ReadError, Source, Stream, StreamedBatch, Streaming,
    TruthLayout, TruthSet, TurnBatch, Turns,
};
use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
use relit_data::shard::{
    Align, Dataset, ExtractionSettings, FrameRecord, ImageSize, Layout, Sample, ShardWriter,
};
use relit_data::spec_net_gate::SPEC_NET_GATE;

const WIDTH: u32 = 9;
const HEIGHT: u32 = 7;
const PIXELS: usize = (WIDTH * HEIGHT) as usize;

fn mask() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let inside = (1..8).contains(&x) && (1..6).contains(&y) && x + y > 3;
        Luma([if inside { 255 } else { 0 }])
    })
}

fn picture(index: u32) -> RgbImage {
    let mask = mask();
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| match mask.get_pixel(x, y).0[0] {
        0 => Pixel([0; 3]),
        _ => Pixel([(index * 3) as u8 + 9, (x * 20) as u8, (y * 30) as u8]),
    })
}

fn sample(session: &str, index: u32) -> Sample {
    let image = picture(index);
    let measures = MaskSpans::from_mask(&mask())
        .measure(&image, SATURATION_LEVEL)
        .unwrap();
    let whole = Rect::new(0, 0, WIDTH, HEIGHT);
    let record = FrameRecord {
        t_us: i64::from(index),
        ..FrameRecord::new(session, "mug", index, whole, &measures, SPEC_NET_GATE)
    };
    Sample::encode(record, image).unwrap()
}

/// Writes a session's shard, or folder of images.
fn write(out: &Path, layout: Layout, session: &str, samples: u32) {
    let mut writer = ShardWriter::create(out, layout, session, samples, &mask()).unwrap();
    for index in 0..samples {
        writer.push(sample(session, index)).unwrap();
    }
    writer.finish().unwrap();
}

fn open(path: &Path) -> Arc<Turns> {
    Arc::new(Turns::open(path, Encoding::Srgb).unwrap())
}

type Item = Result<StreamedBatch<TurnBatch>, DamagedBatch<StreamedBatch<TurnBatch>>>;

fn stream(turns: &Arc<Turns>, threads: usize, from: Cursor) -> Vec<Item> {
    let streaming = Streaming {
        plan: DrawPlan::from_turns(5),
        from,
        until_epoch: 1,
        threads: NonZeroUsize::new(threads).unwrap(),
        ahead: 1,
    };
    Stream::start(turns, streaming).unwrap().collect()
}

fn whole(items: Vec<Item>) -> Vec<StreamedBatch<TurnBatch>> {
    items.into_iter().map(|item| item.unwrap()).collect()
}

fn keys(drawn: &[StreamedBatch<TurnBatch>]) -> Vec<String> {
    let frames = drawn.iter().flat_map(|drawn| &drawn.batch.frames);
    frames.map(|frame| frame.key.clone()).collect()
}

/// The stream over `path`: keys of the frames that are given, and what is said of the others.
fn given_and_damaged(path: &Path) -> (Vec<String>, Vec<String>) {
    let (mut given, mut damaged) = (Vec::new(), Vec::new());
    for item in stream(&open(path), 2, Cursor::default()) {
        let drawn = item.unwrap_or_else(|batch| {
            let told = batch.damage.iter().map(|one| with_causes(one));
            damaged.extend(told);
            batch.rest
        });
        assert_eq!(
            drawn.batch.images.len(),
            drawn.batch.frames.len() * PIXELS * 3
        );
        assert_eq!(drawn.batch.masks.len(), drawn.batch.frames.len() * PIXELS);
        given.extend(keys(&[drawn]));
    }
    (given, damaged)
}

#[test]
fn a_shard_is_given_as_it_was_written() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Webdataset, "turn", 30);
    let turns = open(&dir.path().join("turn.tar"));
    assert_eq!(turns.turns(), [30]);
    assert_eq!(turns.names().collect::<Vec<_>>(), ["turn"]);
    let drawn = whole(stream(&turns, 1, Cursor::default()));
    let mut seen = keys(&drawn);
    seen.sort();
    let all: Vec<String> = (0..30).map(|index| format!("turn/{index:04}")).collect();
    assert_eq!(seen, all);
    for StreamedBatch { batch, .. } in &drawn {
        assert_eq!(batch.extent, Extent::new(9, 7));
        for (at, frame) in batch.frames.iter().enumerate() {
            let record = frame.record.as_ref().unwrap();
            let picture = picture(record.index);
            for (pixel, (expected, level)) in picture.pixels().zip(mask().pixels()).enumerate() {
                for channel in 0..3 {
                    let value = batch.images[(at * 3 + channel) * PIXELS + pixel];
                    assert_eq!(value, f32::from(expected.0[channel]) / 255.0);
                }
                let inside = batch.masks[at * PIXELS + pixel];
                assert_eq!(inside, f32::from(level.0[0]) / 255.0);
            }
        }
    }
}

#[test]
fn values_can_be_had_in_proportion_to_light() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Webdataset, "turn", 12);
    let turns = Turns::open(dir.path(), Encoding::Linear).unwrap();
    let drawn = whole(stream(&Arc::new(turns), 1, Cursor::default()));
    // The green of the pixels in column 5 is 100 of 255.
    let green = drawn[0].batch.images[PIXELS + 3 * 9 + 5];
    assert!((green - 0.127_438).abs() < 1e-6, "{green}");
}

#[test]
fn a_stream_can_be_taken_up_at_any_sample() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Webdataset, "a", 30);
    write(dir.path(), Layout::Webdataset, "b", 17);
    let turns = open(dir.path());
    let all = keys(&whole(stream(&turns, 2, Cursor::default())));
    for sample in 0..=47 {
        let rest = whole(stream(&turns, 3, Cursor { epoch: 0, sample }));
        assert_eq!(keys(&rest), all[sample as usize..]);
    }
}

#[test]
fn memory_that_is_given_back_leaves_no_trace() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Webdataset, "a", 30);
    write(dir.path(), Layout::Webdataset, "b", 17);
    let turns = open(dir.path());
    let expected = whole(stream(&turns, 1, Cursor::default()));
    let streaming = Streaming {
        plan: DrawPlan::from_turns(5),
        from: Cursor::default(),
        until_epoch: 1,
        threads: NonZeroUsize::MIN,
        ahead: 1,
    };
    let mut stream = Stream::start(&turns, streaming).unwrap();
    for expected in expected {
        let drawn = stream.next().unwrap().unwrap();
        assert_eq!(drawn, expected);
        stream.recycle(drawn.batch);
    }
    assert!(stream.next().is_none());
}

#[test]
fn folders_in_the_layout_of_the_released_data_give_what_shards_give() {
    let dir = tempfile::tempdir().unwrap();
    let (shards, folders) = (dir.path().join("shards"), dir.path().join("folders"));
    for (out, layout) in [(&shards, Layout::Webdataset), (&folders, Layout::Paper)] {
        fs::create_dir(out).unwrap();
        write(out, layout, "turn", 30);
    }
    let from = |path| whole(stream(&open(path), 2, Cursor::default()));
    for (shard, folder) in from(&shards).into_iter().zip(from(&folders)) {
        assert_eq!(shard.batch.images, folder.batch.images);
        assert_eq!(shard.batch.masks, folder.batch.masks);
        assert_eq!(keys(&[shard]), keys(&[folder]));
    }
}

#[test]
fn images_in_folders_are_cut_out_by_their_mask() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("imgs/v")).unwrap();
    fs::create_dir_all(dir.path().join("masks")).unwrap();
    let white = RgbImage::from_pixel(WIDTH, HEIGHT, Pixel([255; 3]));
    white.save(dir.path().join("imgs/v/0.jpg")).unwrap();
    mask().save(dir.path().join("masks/v.png")).unwrap();
    let drawn = whole(stream(&open(dir.path()), 1, Cursor::default()));
    let batch = &drawn[0].batch;
    assert_eq!(batch.images[..PIXELS], batch.masks);
    assert_eq!(batch.frames[0].record, None);
}

#[test]
fn a_sample_that_does_not_decode_is_told_and_the_others_are_given() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Webdataset, "turn", 30);
    let path = dir.path().join("turn.tar");
    let mut bytes = fs::read(&path).unwrap();
    // In the data of the first image, behind its header of 512 bytes.
    bytes[512 + 60] ^= 0x10;
    fs::write(&path, bytes).unwrap();
    let (given, damaged) = given_and_damaged(&path);
    assert_eq!((given.len(), damaged.len()), (29, 1), "{damaged:?}");
    assert!(
        damaged[0].contains("turn.tar") && damaged[0].contains("sample 0"),
        "{damaged:?}"
    );
}

#[test]
fn samples_that_a_cut_or_a_damaged_header_took_are_told() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Webdataset, "turn", 30);
    let path = dir.path().join("turn.tar");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let (given, damaged) = given_and_damaged(&path);
    assert!((13..17).contains(&given.len()), "{}", given.len());
    assert!(damaged[0].contains("byte "), "{damaged:?}");

    let mut spoiled = bytes;
    spoiled[0] ^= 1;
    fs::write(&path, spoiled).unwrap();
    let (given, damaged) = given_and_damaged(&path);
    assert_eq!((given.len(), damaged.len()), (29, 1), "{damaged:?}");
    assert!(damaged[0].contains("header"), "{damaged:?}");
}

#[test]
fn a_file_that_is_no_shard_is_an_error_that_says_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let photo = folder.path().join("photo.png");
    picture(0).save(&photo).unwrap();
    let error = Turns::open(&photo, Encoding::Linear).err().unwrap();
    let text = error.to_string();
    assert!(text.contains("photo.png"), "{text}");
}

#[test]
fn samples_that_the_description_tells_of_and_no_shard_holds_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let mut writer =
        ShardWriter::create(dir.path(), Layout::Webdataset, "turn", 20, &mask()).unwrap();
    for index in 0..20 {
        writer.push(sample("turn", index)).unwrap();
    }
    let mut dataset = Dataset::new(ExtractionSettings {
        frames: 20,
        size: ImageSize::NATIVE,
        margin: 0.0,
        saturation_level: SATURATION_LEVEL,
        gate: SPEC_NET_GATE,
        align: Align::Off,
        align_tolerance: None,
        layout: Layout::Webdataset,
        scaling: "none".to_owned(),
    });
    dataset.shards = writer.finish().unwrap().shards;
    dataset.write(dir.path()).unwrap();
    let (given, damaged) = given_and_damaged(dir.path());
    assert_eq!((given.len(), damaged.len()), (20, 0));

    let path = dir.path().join("turn.tar");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let (given, damaged) = given_and_damaged(dir.path());
    assert_eq!(given.len() + damaged.len(), 20);
    assert!(damaged.iter().any(|told| told.contains("20 samples")));

    fs::remove_file(&path).unwrap();
    assert!(matches!(
        Turns::open(dir.path(), Encoding::Srgb).err(),
        Some(ReadError::Read { .. })
    ));
}

#[test]
fn a_frame_that_is_missing_in_a_folder_is_told() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), Layout::Paper, "turn", 12);
    fs::remove_file(dir.path().join("imgs/turn/4.png")).unwrap();
    let (given, damaged) = given_and_damaged(dir.path());
    assert_eq!((given.len(), damaged.len()), (11, 1));
    assert!(damaged[0].contains("frame 4"), "{damaged:?}");
    fs::remove_file(dir.path().join("masks/turn.png")).unwrap();
    let (given, damaged) = given_and_damaged(dir.path());
    assert_eq!((given.len(), damaged.len()), (0, 12));
    assert!(damaged[0].contains("mask"), "{damaged:?}");
}

#[test]
fn a_folder_without_samples_is_an_error_that_says_what_was_expected() {
    let dir = tempfile::tempdir().unwrap();
    let Err(error) = Turns::open(dir.path(), Encoding::Srgb) else {
        panic!("opened")
    };
    assert!(error.to_string().contains("*.tar"), "{error}");
    let Err(error) = TruthSet::open(dir.path(), TruthLayout::Mit) else {
        panic!("opened")
    };
    assert!(error.to_string().contains("expected"), "{error}");
}

/// Writes an image of one colour.
fn plain(path: &Path, colour: [u8; 3]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    RgbImage::from_pixel(WIDTH, HEIGHT, Pixel(colour))
        .save(path)
        .unwrap();
}

fn first_pixel(planes: &Planes<3>) -> [f32; 3] {
    planes.pixel(4, 3)
}

fn near(found: [f32; 3], expected: [f32; 3]) -> bool {
    found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 0.01)
}

/// A normal that points right and up, as a colour with each axis 0.6, 0.36 and 0.714 in a channel.
const RIGHT: u8 = 204;
const UP: u8 = 173;
const DOWN: u8 = 82;
const VIEWER: u8 = 219;

#[test]
fn mit_intrinsic_images_are_read_linear_and_with_y_up() {
    let dir = tempfile::tempdir().unwrap();
    let cup = dir.path().join("cup");
    for (file, level) in [("original", 90), ("diffuse", 80), ("reflectance", 160)] {
        plain(&cup.join(format!("{file}.png")), [level, 40, 20]);
    }
    plain(&cup.join("shading.png"), [127; 3]);
    plain(&cup.join("specular.png"), [10; 3]);
    mask().save(cup.join("mask.png")).unwrap();
    let set = TruthSet::open(dir.path(), TruthLayout::Mit).unwrap();
    let sample = set.load(0).unwrap();
    assert_eq!((sample.name.as_str(), sample.normals), ("cup", None));
    assert_eq!(sample.mask.plane(0).iter().sum::<f32>(), 32.0);
    let albedo = sample.albedo.unwrap();
    assert!(near(first_pixel(albedo.planes()), [0.627, 0.157, 0.078]));

    plain(&cup.join("normal.png"), [RIGHT, UP, VIEWER]);
    mask().save(cup.join("normal_valid.png")).unwrap();
    let normals = set.load(0).unwrap().normals.unwrap();
    assert!(near(first_pixel(normals.planes()), [0.6, 0.36, 0.714]));
    assert_eq!(normals.planes().pixel(0, 0), [0.0; 3]);

    fs::remove_file(cup.join("shading.png")).unwrap();
    let error = set.load(0).unwrap_err();
    let text = with_causes(&error);
    assert!(
        text.contains("cup") && text.contains("shading.png"),
        "{text}"
    );
}

#[test]
fn the_files_of_janner_et_al_hold_y_down_in_red_and_x_in_green() {
    let dir = tempfile::tempdir().unwrap();
    for number in [2, 10] {
        for file in ["composite", "albedo", "shading", "specular"] {
            plain(
                &dir.path().join(format!("car_val/{number}_{file}.png")),
                [99; 3],
            );
        }
        let normals = dir.path().join(format!("car_val/{number}_normals.png"));
        plain(&normals, [DOWN, RIGHT, VIEWER]);
        let file = dir.path().join(format!("car_val/{number}_mask.png"));
        mask().save(file).unwrap();
    }
    let set = TruthSet::open(dir.path(), TruthLayout::Janner).unwrap();
    let names: Vec<_> = set.names().collect();
    assert_eq!(names, ["car_val/2", "car_val/10"]);
    let normals = set.load(1).unwrap().normals.unwrap();
    assert!(near(first_pixel(normals.planes()), [0.6, 0.36, 0.714]));
    let alone = TruthSet::open(&dir.path().join("car_val"), TruthLayout::Janner).unwrap();
    assert_eq!(alone.names().collect::<Vec<_>>(), ["2", "10"]);
}

#[test]
fn a_part_of_another_size_is_damage() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["original", "diffuse", "reflectance", "shading", "specular"] {
        plain(&dir.path().join(format!("cup/{file}.png")), [9; 3]);
    }
    GrayImage::new(4, 4)
        .save(dir.path().join("cup/mask.png"))
        .unwrap();
    let set = TruthSet::open(dir.path(), TruthLayout::Mit).unwrap();
    let text = with_causes(&set.load(0).unwrap_err());
    assert!(text.contains("9 x 7") && text.contains("4 x 4"), "{text}");
}

#[test]
fn a_set_is_thinned_evenly() {
    let dir = tempfile::tempdir().unwrap();
    for number in 0..100 {
        let path = dir.path().join(format!("{number}_mask.png"));
        mask().save(path).unwrap();
    }
    let set = TruthSet::open(dir.path(), TruthLayout::Janner)
        .unwrap()
        .spread(10);
    let names: Vec<_> = set.names().map(str::to_owned).collect();
    let expected: Vec<_> = (0..10).map(|n| (n * 10 + 9).to_string()).collect();
    assert_eq!(names, expected);
}
