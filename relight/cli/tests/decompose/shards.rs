//! Frames of shards, and folders of photographs and shards.

use std::fs;
use std::path::{Path, PathBuf};

use image::{Rgb as Pixel, RgbImage};
use relight_photo::decompose::{MaskSource, SpecularGate};
use relight_photo::files::{PhotoInput, PhotoReading};
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
use relit_data::shard::{FrameRecord, Layout, Sample, ShardWriter};
use relit_data::spec_net_gate::SPEC_NET_GATE;

use crate::support::{Folder, HEIGHT, WIDTH, decomposed, is_inside, mask, object};

pub(crate) const SESSION: &str = "20261120T093015Z-mug";

/// A shard of three frames, and its path.
pub(crate) fn write_shard(folder: &Path) -> PathBuf {
    let mut writer = ShardWriter::create(folder, Layout::Webdataset, SESSION, 3, &mask()).unwrap();
    for (index, saturated) in [(0, 0.01), (1, 0.2), (2, 0.0)] {
        writer.push(sample(index, saturated)).unwrap();
    }
    writer.finish().unwrap();
    folder.join(format!("{SESSION}.tar"))
}

fn sample(index: u32, saturated: f64) -> Sample {
    let image = RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        if is_inside(x, y) {
            *object(0).get_pixel(x, y)
        } else {
            Pixel([0; 3])
        }
    });
    let mut measures = MaskSpans::from_mask(&mask())
        .measure(&image, SATURATION_LEVEL)
        .unwrap();
    measures.saturated_px = (saturated * measures.mask_px as f64) as u64;
    let whole = Rect::new(0, 0, WIDTH, HEIGHT);
    let record = FrameRecord::new(SESSION, "mug", index, whole, &measures, SPEC_NET_GATE);
    Sample::encode(record, image).unwrap()
}

#[test]
fn frames_of_a_shard_have_its_mask_and_the_saturation_that_was_counted_on_the_video() {
    let folder = Folder::new();
    let name = SESSION;
    let shard = write_shard(folder.0.path());
    let inputs = PhotoInput::find(std::slice::from_ref(&shard), None)
        .unwrap()
        .inputs;
    assert_eq!(inputs.len(), 3);
    assert_eq!(PhotoInput::find(&[shard], Some(2)).unwrap().inputs.len(), 2);
    let photos = inputs
        .iter()
        .map(|input| input.load(&PhotoReading::default()).unwrap());
    let mut found: Vec<(String, bool)> = photos
        .map(|photo| {
            assert_eq!(photo.mask_source, MaskSource::Shard);
            let glossy = decomposed(&photo, SpecularGate::Auto).0.is_glossy;
            (photo.name, glossy)
        })
        .collect();
    found.sort();
    let expected = [("0000", false), ("0001", true), ("0002", false)];
    let expected = expected.map(|(index, glossy)| (format!("{name}/{index}"), glossy));
    assert_eq!(found, expected);
}

#[test]
fn shards_whose_frames_have_the_same_names_are_refused_together() {
    let folder = Folder::new();
    let [first, second] = ["first", "second"].map(|name| {
        fs::create_dir(folder.path(name)).unwrap();
        write_shard(&folder.path(name))
    });
    let find = |paths: &[&Path]| {
        let paths: Vec<PathBuf> = paths.iter().map(|path| path.to_path_buf()).collect();
        PhotoInput::find(&paths, None).map(|found| found.inputs.len())
    };
    assert_eq!(find(&[&first]).unwrap(), 3);
    let renamed = folder.path("second/other.tar");
    fs::rename(&second, &renamed).unwrap();
    let text = find(&[&first, &renamed]).unwrap_err().to_string();
    for part in ["first/", "second/other.tar", SESSION] {
        assert!(text.contains(part), "{text}");
    }
    let photo = folder.path(&format!("{SESSION}.png"));
    object(0).save(&photo).unwrap();
    assert!(find(&[&photo, &first]).is_err());
}

#[test]
fn a_folder_of_photographs_and_shards_gives_both() {
    let folder = Folder::new();
    write_shard(folder.0.path());
    folder.save("cup.png", |path| object(0).save(path).unwrap());
    let found = PhotoInput::find(&[folder.0.path().to_owned()], Some(2))
        .unwrap()
        .inputs;
    let names = found
        .iter()
        .map(|input| input.load(&PhotoReading::default()).unwrap().name);
    let mut names: Vec<String> = names.collect();
    names.sort();
    assert_eq!(names.len(), 3);
    assert_eq!(names[2], "cup");
    assert!(names[..2].iter().all(|name| name.starts_with(SESSION)));
}
