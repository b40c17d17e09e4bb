//! Writing data sets and reading them back.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;
use std::sync::Mutex;

use image::{GrayImage, Luma};
use proptest::prelude::*;
use relit_data::shard::{
    Dataset, FrameRecord, Layout, OutputFolder, ShardError, ShardReader, ShardWriter, decode_mask,
    decode_rgb, order, read_table, sample_key, verify,
};

use crate::sample_set::{
    SAMPLES, SESSION, assert_intact, dataset, mask, sample, verified, write, write_with,
};

/// All files below a folder with their bytes.
pub(crate) fn files(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![out.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(out).unwrap().to_str().unwrap().to_owned();
                found.insert(name, fs::read(path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_shard_holds_every_sample_in_the_order_that_spreads_angles() {
    let dir = dataset(Layout::Webdataset);
    let tar = File::open(dir.path().join(format!("{SESSION}.tar"))).unwrap();
    let samples: Vec<_> = ShardReader::new(BufReader::new(tar))
        .map(Result::unwrap)
        .collect();
    let keys: Vec<_> = samples.iter().map(|s| s.key.clone()).collect();
    let expected: Vec<_> = order(SAMPLES)
        .iter()
        .map(|&k| sample_key(SESSION, k))
        .collect();
    assert_eq!(keys, expected);
    for (read, index) in samples.iter().zip(order(SAMPLES)) {
        let written = sample(SESSION, index);
        assert_eq!(
            decode_rgb(read.member("png").unwrap()).unwrap(),
            written.image
        );
        assert_eq!(
            decode_mask(read.member("mask.png").unwrap()).unwrap(),
            mask()
        );
        let record: FrameRecord = serde_json::from_slice(read.member("json").unwrap()).unwrap();
        assert_eq!(record, written.record);
        assert_eq!(read.members.len(), 3);
    }
}

#[test]
fn what_was_written_is_intact() {
    for layout in Layout::ALL {
        let dir = dataset(layout);
        let progress = Mutex::new(Vec::new());
        let report = verify(dir.path(), &|done, of| {
            progress.lock().unwrap().push((done, of))
        })
        .unwrap();
        assert_eq!(report.problems, []);
        let samples = u64::from(SAMPLES);
        assert_eq!(
            (report.sessions, report.shards, report.samples),
            (1, 1, samples)
        );
        assert_eq!(progress.lock().unwrap().last(), Some(&(samples, samples)));
        let dataset = Dataset::read(dir.path()).unwrap();
        dataset.check_integrity(dir.path(), SESSION).unwrap();
        let unknown = dataset.check_integrity(dir.path(), "another");
        assert!(matches!(unknown, Err(ShardError::Changed { file, .. }) if file == "another"));
        let rows = read_table(dir.path(), &dataset.sessions[0].table).unwrap();
        let records: Vec<_> = (0..SAMPLES).map(|k| sample(SESSION, k).record).collect();
        assert_eq!(
            rows.into_iter().map(|row| row.record).collect::<Vec<_>>(),
            records
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn the_bytes_are_the_same_whatever_order_the_samples_come_in(
        indices in Just((0..SAMPLES).collect::<Vec<_>>()).prop_shuffle(),
        layout in prop::sample::select(Layout::ALL.to_vec()),
    ) {
        let shuffled = tempfile::tempdir().unwrap();
        write_with(shuffled.path(), layout, SESSION, &indices, |_| {});
        prop_assert_eq!(files(shuffled.path()), files(dataset(layout).path()));
    }
}

#[test]
fn a_writer_that_is_dropped_leaves_nothing_behind() {
    for layout in Layout::ALL {
        let dir = tempfile::tempdir().unwrap();
        let mut writer =
            ShardWriter::create(dir.path(), layout, SESSION, SAMPLES, &mask()).unwrap();
        writer.push(sample(SESSION, 3)).unwrap();
        drop(writer);
        assert!(files(dir.path()).is_empty(), "{layout}");
    }
}

#[test]
fn an_incomplete_session_is_refused_with_the_first_missing_sample() {
    for layout in Layout::ALL {
        let dir = tempfile::tempdir().unwrap();
        let mut writer =
            ShardWriter::create(dir.path(), layout, SESSION, SAMPLES, &mask()).unwrap();
        for index in [0, 1, 3] {
            writer.push(sample(SESSION, index)).unwrap();
        }
        let error = writer.finish().unwrap_err();
        assert!(matches!(error, ShardError::Refused(_)), "{error:?}");
        let text = error.to_string();
        assert!(
            text.contains("11 samples") && text.contains("sample 2"),
            "{text}"
        );
        assert!(files(dir.path()).is_empty());
    }
}

#[test]
fn what_a_killed_writer_left_behind_is_removed_by_the_next() {
    for layout in Layout::ALL {
        let dir = tempfile::tempdir().unwrap();
        let mut killed =
            ShardWriter::create(dir.path(), layout, SESSION, SAMPLES, &mask()).unwrap();
        killed.push(sample(SESSION, 3)).unwrap();
        std::mem::forget(killed);
        let busy = ShardWriter::create(dir.path(), layout, SESSION, SAMPLES, &mask());
        assert!(matches!(busy, Err(ShardError::Busy(_))));
        write(dir.path(), layout);
        assert_intact(dir.path());
    }
}

#[test]
fn samples_that_do_not_fit_are_refused_and_do_no_harm() {
    let dir = tempfile::tempdir().unwrap();
    let mut writer =
        ShardWriter::create(dir.path(), Layout::Webdataset, SESSION, SAMPLES, &mask()).unwrap();
    writer.push(sample(SESSION, 0)).unwrap();
    let mut refused = |change: fn(&mut relit_data::shard::Sample)| {
        let mut sample = sample(SESSION, 1);
        change(&mut sample);
        let error = writer.push(sample).unwrap_err();
        assert!(matches!(error, ShardError::Refused(_)), "{error:?}");
        error.to_string()
    };
    assert!(refused(|s| s.record.index = 0).contains("sample 0"));
    assert!(refused(|s| s.record.index = 14).contains("13"));
    assert!(refused(|s| s.record.session = "b".into()).contains("\"b\""));
    assert!(refused(|s| s.record.size = [1, 1]).contains("1x1"));
    let small = refused(|s| s.image = image::RgbImage::new(3, 3));
    assert!(small.contains("3x3"));
    let unknown = refused(|s| s.record.sharpness = f64::NAN);
    assert!(unknown.contains("sharpness") && unknown.contains("sample 1"));
    for index in 1..SAMPLES {
        writer.push(sample(SESSION, index)).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn sessions_that_cannot_be_written_are_refused_at_the_start() {
    let dir = tempfile::tempdir().unwrap();
    let create = |session: &str, samples, mask: &GrayImage| {
        ShardWriter::create(dir.path(), Layout::Webdataset, session, samples, mask)
            .err()
            .unwrap()
    };
    assert!(matches!(create("../a", 1, &mask()), ShardError::Refused(_)));
    for samples in [0, u32::MAX] {
        let error = create("a", samples, &mask());
        assert!(matches!(error, ShardError::Refused(_)), "{error:?}");
    }
    let grey = GrayImage::from_pixel(4, 4, Luma([7]));
    let error = create("a", 1, &grey);
    assert!(matches!(error, ShardError::Image(_)), "{error:?}");
    assert!(error.to_string().contains("(0, 0)"));
    let empty = create("a", 1, &GrayImage::new(0, 0));
    assert!(matches!(empty, ShardError::Image(_)), "{empty:?}");
}

#[test]
fn a_session_replaces_an_older_one_and_leaves_others_alone() {
    for layout in Layout::ALL {
        let dir = dataset(layout);
        let before = files(dir.path());
        let indices: Vec<u32> = (0..SAMPLES).collect();
        write_with(dir.path(), layout, "another", &indices, |_| {});
        assert_eq!(verified(dir.path()).sessions, 2);
        write_with(dir.path(), layout, SESSION, &indices, |s| {
            s.record.t_us += 7
        });
        assert_intact(dir.path());
        assert_ne!(
            files(dir.path())[&format!("{SESSION}.parquet")],
            before[&format!("{SESSION}.parquet")]
        );
        write(dir.path(), layout);
        for (name, bytes) in before.iter().filter(|(name, _)| *name != Dataset::FILE) {
            assert_eq!(&files(dir.path())[name], bytes, "{name}");
        }
    }
}

#[test]
fn a_folder_can_be_locked_again_after_a_writer_is_done() {
    let dir = dataset(Layout::Paper);
    let held = OutputFolder::lock(dir.path()).unwrap();
    assert!(matches!(
        OutputFolder::lock(held.path()),
        Err(ShardError::Locked(_))
    ));
}
