//! Damage to shards, tables and descriptions is found and reported.

use std::fs;
use std::path::{Path, PathBuf};

use image::Rgb;
use proptest::prelude::*;
use relit_data::shard::{Dataset, Layout, Sample, ShardError, ShardReader, encode_rgb, order};

use crate::sample_set::{
    SAMPLES, SESSION, assert_intact, assert_names, dataset, settings, texts, verified, write_with,
};

const TAR: &str = "20261120T093015Z-mug.tar";
const TABLE: &str = "20261120T093015Z-mug.parquet";

fn tar_path(out: &Path) -> PathBuf {
    out.join(TAR)
}

/// The members of a tar as raw bytes (header, data, padding), and the end blocks.
fn members(tar: &[u8]) -> (Vec<Vec<u8>>, Vec<u8>) {
    let mut archive = tar::Archive::new(tar);
    let mut starts = Vec::new();
    let mut end = 0;
    for entry in archive.entries().unwrap() {
        let entry = entry.unwrap();
        starts.push(entry.raw_header_position() as usize);
        end = (entry.raw_file_position() + entry.size()).next_multiple_of(512) as usize;
    }
    starts.push(end);
    let members = starts
        .windows(2)
        .map(|w| tar[w[0]..w[1]].to_vec())
        .collect();
    (members, tar[end..].to_vec())
}

/// Rewrites the tar of a fresh data set.
fn with_members(change: impl FnOnce(&mut Vec<Vec<u8>>)) -> tempfile::TempDir {
    let dir = dataset(Layout::Webdataset);
    let (mut parts, end) = members(&fs::read(tar_path(dir.path())).unwrap());
    assert_eq!(parts.len(), 3 * SAMPLES as usize);
    change(&mut parts);
    parts.push(end);
    fs::write(tar_path(dir.path()), parts.concat()).unwrap();
    dir
}

/// The sample at a position in the tar.
fn at(position: usize) -> Option<u32> {
    Some(order(SAMPLES)[position])
}

#[test]
fn the_same_members_in_the_same_order_are_intact() {
    assert_intact(with_members(|_| {}).path());
}

#[test]
fn a_missing_member_is_named() {
    let dir = with_members(|parts| drop(parts.remove(3 * 4 + 1)));
    assert_names(dir.path(), TAR, at(4), "mask.png");
    assert_names(dir.path(), TAR, None, "bytes");
}

#[test]
fn a_missing_sample_is_named() {
    let dir = with_members(|parts| drop(parts.drain(6..9)));
    assert_names(dir.path(), TAR, at(2), "sample");
}

#[test]
fn a_doubled_member_is_named() {
    let dir = with_members(|parts| parts.insert(10, parts[9].clone()));
    assert_names(dir.path(), TAR, at(3), "png");
}

#[test]
fn swapped_samples_are_named() {
    let dir = with_members(|parts| {
        for part in 0..3 {
            parts.swap(3 + part, 27 + part);
        }
    });
    assert_names(dir.path(), TAR, at(1), "");
    assert_names(dir.path(), TAR, at(9), "");
    assert_names(dir.path(), TAR, None, "BLAKE3");
    assert_eq!(verified(dir.path()).problems.len(), 3);
}

#[test]
fn swapped_contents_are_named() {
    let mut swapped = None;
    let dir = with_members(|parts| {
        // Records of equal length are swapped under their old names.
        let record = |position: usize| 3 * position + 2;
        let size = |position: usize| &parts[record(position)][124..136];
        let positions = SAMPLES as usize;
        let (a, b) = (0..positions)
            .flat_map(|a| (a + 1..positions).map(move |b| (a, b)))
            .find(|&(a, b)| size(a) == size(b))
            .unwrap();
        swapped = Some((a, b));
        let (a, b) = (record(a), record(b));
        let (first, second) = (parts[a].clone(), parts[b].clone());
        parts[a] = [&first[..512], &second[512..]].concat();
        parts[b] = [&second[..512], &first[512..]].concat();
    });
    let (a, b) = swapped.unwrap();
    for position in [a, b] {
        assert_names(dir.path(), TAR, at(position), "record");
    }
    assert_eq!(verified(dir.path()).problems.len(), 3);
}

#[test]
fn an_unknown_member_is_named() {
    let dir = with_members(|parts| {
        let mut header = tar::Header::new_ustar();
        header.set_path("intruder.png").unwrap();
        header.set_size(0);
        header.set_cksum();
        parts.insert(3, header.as_bytes().to_vec());
    });
    assert_names(dir.path(), TAR, None, "\"intruder.png\"");
}

#[test]
fn a_damaged_header_is_named_and_the_rest_is_read() {
    let dir = with_members(|parts| parts[3 * 5][20] ^= 1);
    assert_names(dir.path(), TAR, at(5), "header");
    assert_names(dir.path(), TAR, at(5), "png");
    assert_eq!(verified(dir.path()).problems.len(), 3);
}

#[test]
fn damaged_padding_is_named() {
    let dir = with_members(|parts| *parts[3 * 5 + 2].last_mut().unwrap() = 1);
    assert_names(dir.path(), TAR, at(5), "json");
}

#[test]
fn a_damaged_image_mask_and_record_are_named() {
    for (part, named) in [(0, "image"), (1, "mask"), (2, "record")] {
        let dir = with_members(|parts| parts[3 * 7 + part][512 + 40] ^= 4);
        assert_names(dir.path(), TAR, at(7), named);
        assert_names(dir.path(), TAR, None, "BLAKE3");
    }
}

#[test]
fn a_tar_truncated_anywhere_is_found() {
    let dir = dataset(Layout::Webdataset);
    let whole = fs::read(tar_path(dir.path())).unwrap();
    for end in [
        0,
        1,
        511,
        512,
        700,
        whole.len() / 2,
        whole.len() - 1024,
        whole.len() - 1,
    ] {
        fs::write(tar_path(dir.path()), &whole[..end]).unwrap();
        assert_names(dir.path(), TAR, None, "bytes");
        let shard = fs::File::open(tar_path(dir.path())).unwrap();
        let mut faults = ShardReader::new(shard).filter_map(Result::err);
        assert!(
            matches!(faults.next(), Some(ShardError::ShardTruncated(_))),
            "{end}"
        );
    }
    fs::write(tar_path(dir.path()), &whole[..whole.len() / 2]).unwrap();
    assert_names(dir.path(), TAR, at(SAMPLES as usize - 1), "sample");
}

#[test]
fn bytes_after_the_end_are_found() {
    let dir = dataset(Layout::Webdataset);
    let mut tar = fs::read(tar_path(dir.path())).unwrap();
    tar.push(0);
    fs::write(tar_path(dir.path()), tar).unwrap();
    assert_names(dir.path(), TAR, None, "1 bytes");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn a_flipped_byte_is_found_and_its_sample_named(
        offset in any::<prop::sample::Index>(),
        flip in 1_u8..,
    ) {
        let dir = dataset(Layout::Webdataset);
        let mut tar = fs::read(tar_path(dir.path())).unwrap();
        let (parts, _) = members(&tar);
        let offset = offset.index(tar.len());
        tar[offset] ^= flip;
        fs::write(tar_path(dir.path()), &tar).unwrap();
        let ends = parts.iter().scan(0, |end, part| { *end += part.len(); Some(*end) });
        let member = ends.filter(|&end| end <= offset).count();
        let problems = verified(dir.path()).problems;
        prop_assert!(problems.iter().all(|p| p.file == TAR));
        if member < parts.len() {
            let key = at(member / 3).map(|index| relit_data::shard::sample_key(SESSION, index));
            prop_assert!(problems.iter().any(|p| p.sample == key), "{:#?}", texts(&problems));
        }
        prop_assert!(problems.iter().any(|p| p.what.contains("BLAKE3")));
    }
}

#[test]
fn a_damaged_table_is_found_and_does_not_hide_damage_in_the_shard() {
    let dir = with_members(|parts| parts[3 * 7][512 + 40] ^= 4);
    let table = dir.path().join(TABLE);
    let mut bytes = fs::read(&table).unwrap();
    bytes[100] ^= 1;
    fs::write(&table, bytes).unwrap();
    assert_names(dir.path(), TABLE, None, "BLAKE3");
    assert_names(dir.path(), TAR, at(7), "image");
    fs::remove_file(table).unwrap();
    assert_names(dir.path(), TABLE, None, "(os error 2)");
}

#[test]
fn unlisted_files_are_named() {
    let dir = dataset(Layout::Webdataset);
    fs::create_dir(dir.path().join("imgs")).unwrap();
    let unknown = "dataset.json";
    let left = "";
    for (name, named) in [
        ("b.tar", unknown),
        ("b.parquet", unknown),
        ("x.png", unknown),
        ("imgs/y", unknown),
        (".b.spool", left),
        (".b.tar.7.0.partial", left),
    ] {
        fs::write(dir.path().join(name), b"").unwrap();
        assert_names(dir.path(), name, None, named);
    }
    fs::write(dir.path().join("notes.txt"), b"").unwrap();
    assert_eq!(verified(dir.path()).problems.len(), 6);
}

#[test]
fn a_missing_shard_is_named() {
    let dir = dataset(Layout::Webdataset);
    fs::remove_file(tar_path(dir.path())).unwrap();
    assert_names(dir.path(), TAR, None, "(os error 2)");
}

#[test]
fn a_description_that_contradicts_itself_is_found() {
    let dir = dataset(Layout::Webdataset);
    let good = Dataset::read(dir.path()).unwrap();
    let names = |change: fn(&mut Dataset), named: &str| {
        let mut dataset = good.clone();
        change(&mut dataset);
        dataset.write(dir.path()).unwrap();
        assert_names(dir.path(), Dataset::FILE, None, named);
    };
    names(|d| d.shards.clear(), "0 shards");
    names(|d| d.sessions.clear(), SESSION);
    names(|d| d.shards[0].samples = 3, "3");
    names(|d| d.sessions[0].samples = u32::MAX, "14");
    names(|d| d.settings.frames = 15, "15");
    names(|d| d.shards.push(d.shards[0].clone()), "2 shards");
    names(|d| d.sessions.push(d.sessions[0].clone()), "2 ");
    names(|d| d.shards[0].file = "other.tar".into(), "\"other.tar\"");
    good.write(dir.path()).unwrap();
    assert_intact(dir.path());
}

/// A data set whose samples were wrong when they were written.
fn written_wrong(change: impl Fn(&mut Sample)) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let indices: Vec<u32> = (0..SAMPLES).collect();
    write_with(
        dir.path(),
        Layout::Webdataset,
        SESSION,
        &indices,
        |sample| {
            if sample.record.index == 9 {
                change(sample);
            }
        },
    );
    dir
}

#[test]
fn a_record_that_contradicts_itself_is_named() {
    let names = |change: fn(&mut Sample), named: &str| {
        assert_names(written_wrong(change).path(), TABLE, Some(9), named);
    };
    names(|s| s.record.duplicate = true, "duplicate");
    names(|s| s.record.source_frame = 3, "duplicate");
    names(
        |s| s.record.saturated_fraction += 1e-9,
        "saturated_fraction",
    );
    names(|s| s.record.spec_net = !s.record.spec_net, "spec_net");
    names(|s| s.record.saturated_any_px = 0, "saturated_any_px");
    names(|s| s.record.mask_px = 1, "saturated");
    names(|s| s.record.object = "cup".into(), "\"cup\"");
    names(|s| s.record.crop.w += 1, "size");
}

#[test]
fn figures_that_the_pixels_do_not_give_are_named() {
    let names = |change: fn(&mut Sample), named: &str| {
        assert_names(written_wrong(change).path(), TAR, Some(9), named);
    };
    names(|s| s.record.mask_px += 1, "mask_px");
    names(|s| s.record.saturated_px += 1, "saturated_px");
    names(|s| s.record.saturated_any_px += 1, "saturated_any_px");
    names(|s| s.record.mean_rgb[1] += 1e-9, "mean_rgb");
    names(|s| s.record.sharpness *= 2.0, "sharpness");
}

#[test]
fn light_outside_the_mask_is_named_with_its_pixel() {
    let dir = written_wrong(|sample| {
        sample.image.put_pixel(1, 3, Rgb([0, 1, 0]));
        sample.png = encode_rgb(&sample.image).unwrap();
    });
    assert_names(dir.path(), TAR, Some(9), "(1, 3)");
}

#[test]
fn settings_of_another_size_are_found() {
    let dir = dataset(Layout::Webdataset);
    let mut description = Dataset::read(dir.path()).unwrap();
    description.settings = relit_data::shard::ExtractionSettings {
        size: relit_data::shard::ImageSize::Pixels(256),
        ..settings(Layout::Webdataset)
    };
    description.write(dir.path()).unwrap();
    assert_names(dir.path(), TABLE, Some(0), "[256, 256]");
}
