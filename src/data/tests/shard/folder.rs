//! The layout `paper`: what it holds, and damage to it.

use std::fs;

use relit_data::shard::{
    Dataset, Layout, ShardError, decode_mask, decode_rgb, encode_mask, encode_rgb,
};

use crate::sample_set::{SAMPLES, SESSION, assert_names, dataset, mask, sample, verified};

const IMAGES: &str = "imgs/20261120T093015Z-mug";
const MASK: &str = "masks/20261120T093015Z-mug.png";
const MEAN: &str = "mean_img/20261120T093015Z-mug.png";

#[test]
fn the_folders_hold_images_mask_and_mean() {
    let dir = dataset(Layout::Paper);
    let read = |file: &str| fs::read(dir.path().join(file)).unwrap();
    let images: Vec<_> = (0..SAMPLES)
        .map(|index| decode_rgb(&read(&format!("{IMAGES}/{index}.png"))).unwrap())
        .collect();
    for (index, image) in (0..).zip(&images) {
        assert_eq!(*image, sample(SESSION, index).image);
    }
    assert_eq!(
        fs::read_dir(dir.path().join(IMAGES)).unwrap().count(),
        SAMPLES as usize
    );
    assert_eq!(decode_mask(&read(MASK)).unwrap(), mask());
    let mean = decode_rgb(&read(MEAN)).unwrap();
    for (at, &value) in mean.as_raw().iter().enumerate() {
        let sum: f64 = images
            .iter()
            .map(|image| f64::from(image.as_raw()[at]))
            .sum();
        assert_eq!(f64::from(value), (sum / f64::from(SAMPLES) + 0.5).floor());
    }
}

#[test]
fn damage_to_an_image_is_named() {
    let dir = dataset(Layout::Paper);
    let path = dir.path().join(IMAGES).join("6.png");
    let good = fs::read(&path).unwrap();
    let mut bytes = good.clone();
    bytes[60] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert_names(dir.path(), IMAGES, Some(6), "image");
    assert_names(dir.path(), IMAGES, None, "BLAKE3");
    fs::remove_file(&path).unwrap();
    assert_names(dir.path(), IMAGES, Some(6), "image");
    let dataset = Dataset::read(dir.path()).unwrap();
    assert!(matches!(
        dataset.check_integrity(dir.path(), SESSION),
        Err(ShardError::Io { .. })
    ));
    fs::write(&path, encode_rgb(&sample(SESSION, 7).image).unwrap()).unwrap();
    assert_names(dir.path(), IMAGES, Some(6), "image");
    assert!(matches!(
        dataset.check_integrity(dir.path(), SESSION),
        Err(ShardError::Changed { .. })
    ));
    fs::write(&path, good).unwrap();
    assert_eq!(verified(dir.path()).problems, []);
}

#[test]
fn damage_to_the_mask_is_named() {
    let dir = dataset(Layout::Paper);
    let mut other = mask();
    other.put_pixel(0, 0, image::Luma([255]));
    fs::write(dir.path().join(MASK), encode_mask(&other).unwrap()).unwrap();
    assert_names(dir.path(), MASK, None, "mask");
}

#[test]
fn damage_to_the_mean_is_named() {
    let dir = dataset(Layout::Paper);
    fs::write(
        dir.path().join(MEAN),
        encode_rgb(&sample(SESSION, 0).image).unwrap(),
    )
    .unwrap();
    assert_names(dir.path(), MEAN, None, "mean");
    fs::remove_file(dir.path().join(MEAN)).unwrap();
    assert_names(dir.path(), MEAN, None, "(os error 2)");
}

#[test]
fn unknown_files_in_the_folders_are_named() {
    let dir = dataset(Layout::Paper);
    for name in ["14.png", "06.png", "notes.txt"] {
        fs::write(dir.path().join(IMAGES).join(name), b"").unwrap();
        assert_names(dir.path(), IMAGES, None, name);
    }
    for name in ["imgs/another", "masks/another.png", "mean_img/another.png"] {
        fs::write(dir.path().join(name), b"").unwrap();
        assert_names(dir.path(), name, None, "dataset.json");
    }
}

#[test]
fn a_dangling_link_is_not_an_image() {
    let dir = dataset(Layout::Paper);
    let image = dir.path().join(IMAGES).join("3.png");
    fs::remove_file(&image).unwrap();
    std::os::unix::fs::symlink("nowhere", &image).unwrap();
    let report = verified(dir.path());
    assert_eq!(report.samples, u64::from(SAMPLES) - 1);
    assert!(!report.problems.is_empty());
}
