//! Training on frames with labels.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use relight_core::reader::{TruthLayout, TruthSet};
use relight_synth::{Folders, Library, Recipe, write_samples};
use relight_train::{
    Composition, DataSettings, DrawnSample, PaperInputs, PaperPhase, PaperSettings, PaperTask,
    PrecisionChoice, Resources, Run, RunSettings, Symmetry, TABLE, TrainError, TrainObserver,
    TruthArrays, TruthBatch, TurnSettings,
};
use tch::{Device, Kind, Tensor};

/// Samples by a plain camera, so that files of 8 bits in sRGB say what they show.
fn recipe(size: u32) -> Recipe {
    Recipe {
        size,
        views: 1,
        lightings: 1,
        random_camera: false,
        ..Recipe::default()
    }
}

fn labels(size: u32, count: u64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let library = Library::read(&Folders::default()).unwrap();
    write_samples(&recipe(size), &library, count, folder.path(), &|| {}).unwrap();
    folder
}

fn settings(steps: u64) -> PaperSettings {
    PaperSettings {
        run: RunSettings {
            steps,
            batch: 4,
            learning_rate: 1e-4,
            precision: PrecisionChoice::Single,
            log_every: 1,
            validate_every: 3,
            ..RunSettings::default()
        },
        data: DataSettings {
            size: 32,
            views: 1,
            lightings: 2,
            shuffle_buffer: 8,
            reuse: 2.0,
            validation: 2,
            ..DataSettings::default()
        },
        turns: TurnSettings {
            labelled: 3,
            ..TurnSettings::default()
        },
        ..PaperSettings::default()
    }
}

fn task(phase: PaperPhase, labels: &Path) -> Result<PaperTask, TrainError> {
    let inputs = PaperInputs {
        labels: Some(labels.to_owned()),
        ..PaperInputs::default()
    };
    let resources = Resources {
        device: Device::Cpu,
        workers: 1,
        stop: Arc::default(),
    };
    PaperTask::new(phase, settings(3), resources, &inputs)
}

/// Stops a run after so many steps, and keeps what was damaged.
struct Watch<'a> {
    until: u64,
    stop: &'a AtomicBool,
    damage: Vec<String>,
}

impl TrainObserver for Watch<'_> {
    fn step(&mut self, step: u64, _: &BTreeMap<String, f64>) {
        if step >= self.until {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn damaged(&mut self, _: u64, what: &str) {
        self.damage.push(what.to_owned());
    }

    fn validated(&mut self, _: u64, _: &BTreeMap<String, f64>) {}

    fn saved(&mut self, _: u64, _: &Path) {}
}

/// Makes steps of a run, and returns what was damaged.
fn train(
    task: &mut PaperTask,
    folder: &Path,
    (resume, until): (bool, u64),
) -> Result<Vec<String>, TrainError> {
    tch::set_num_threads(1);
    let stop = AtomicBool::new(false);
    let mut watch = Watch {
        until,
        stop: &stop,
        damage: Vec::new(),
    };
    Run::open(task, &settings(3).run, folder, resume)?.finish(&stop, &mut watch)?;
    Ok(watch.damage)
}

fn table(folder: &Path) -> String {
    fs::read_to_string(folder.join(TABLE)).unwrap()
}

#[test]
fn labels_that_are_read_say_what_the_samples_say_that_they_were_written_of() {
    let folder = labels(64, 2);
    let composition = Composition {
        recipe: recipe(64),
        library: Library::read(&Folders::default()).unwrap(),
        plain_share: 1.0,
    };
    let set = TruthSet::open(folder.path(), TruthLayout::Synth).unwrap();
    for number in 0..2 {
        let arrays = [
            TruthArrays::of_truth(&set.load(number).unwrap()).unwrap(),
            composition.samples_of(number as u64).remove(0),
        ];
        let [read, composed] = arrays.each_ref().map(|arrays| {
            let sample = DrawnSample {
                arrays,
                symmetry: Symmetry::NONE,
            };
            TruthBatch::new(&[sample], Kind::Float, Device::Cpu).unwrap()
        });
        let apart = |a: &Tensor, b: &Tensor| (a - b).abs().max().double_value(&[]);
        // 8 bits, of which the normals' are 0.004 of their range and albedo and light are encoded as sRGB.
        assert_eq!(read.mask, composed.mask);
        assert!(apart(&read.input, &composed.input) < 1e-3);
        assert!(
            apart(
                &(&read.picture * &read.mask),
                &(&composed.picture * &composed.mask)
            ) < 1e-3
        );
        assert!(apart(&read.albedo, &composed.albedo) < 0.01);
        assert!(apart(&read.normals, &composed.normals) < 0.01);
        assert!(apart(&read.shading, &composed.shading) < 0.03);
    }
}

#[test]
fn labels_teach_beside_composed_samples_and_a_run_goes_on_with_them() {
    let folder = labels(64, 2);
    for phase in [PaperPhase::Normal, PaperPhase::Spec] {
        let (whole, parted) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let task = || task(phase, folder.path()).unwrap();
        assert!(
            train(&mut task(), whole.path(), (false, u64::MAX))
                .unwrap()
                .is_empty()
        );
        train(&mut task(), parted.path(), (false, 1)).unwrap();
        train(&mut task(), parted.path(), (true, u64::MAX)).unwrap();
        assert!(table(whole.path()).contains("3,loss/labels,"), "{phase:?}");
        assert_eq!(table(parted.path()), table(whole.path()), "{phase:?}");
    }
}

#[test]
fn a_run_does_not_go_on_with_other_labels() {
    let (folder, other) = (labels(32, 2), labels(32, 3));
    let run = tempfile::tempdir().unwrap();
    let task = |labels: &Path| task(PaperPhase::Normal, labels).unwrap();
    train(&mut task(folder.path()), run.path(), (false, 1)).unwrap();
    assert!(train(&mut task(other.path()), run.path(), (true, u64::MAX)).is_err());
}

#[test]
fn labels_that_cannot_be_used_are_told_at_once_and_damaged_ones_are_left_out() {
    let folder = labels(48, 1);
    let error = task(PaperPhase::Normal, folder.path())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("48 x 48") && error.contains("--size"),
        "{error}"
    );
    let empty = tempfile::tempdir().unwrap();
    assert!(task(PaperPhase::Normal, empty.path()).is_err());

    let folder = labels(32, 2);
    let inputs = PaperInputs {
        labels: Some(folder.path().to_owned()),
        ..PaperInputs::default()
    };
    let resources = Resources {
        device: Device::Cpu,
        workers: 1,
        stop: Arc::default(),
    };
    let error = PaperTask::new(PaperPhase::Specular, settings(1), resources, &inputs).unwrap_err();
    assert!(error.to_string().contains("--turns"), "{error}");

    fs::write(folder.path().join("000001/normal.png"), b"none").unwrap();
    let run = tempfile::tempdir().unwrap();
    let mut task = task(PaperPhase::Normal, folder.path()).unwrap();
    let damage = train(&mut task, run.path(), (false, u64::MAX)).unwrap();
    assert!(
        !damage.is_empty() && damage[0].contains("000001"),
        "{damage:?}"
    );
    assert!(table(run.path()).contains("3,loss/supervised,"));
}
