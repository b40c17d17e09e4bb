//! Training held against inference, and the optimiser against itself.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use relight_core::image::{Extent, Planes};
use relight_photo::decompose::NetworkInput;
use relight_photo::nets::paper::{light_net, normal_net, spec_net};
use relight_photo::nets::{Graph, Inference, Weights, decomposer, decomposer_with_light};
use relight_synth::{Folders, Library, Recipe, SequenceRecipe, write_sequences};
use relight_train::{
    Adam, Checkpoint, ComputePrecision, DataSettings, DecomposeSettings, DecomposeTask, MetricsLog,
    Model, PaperInputs, PaperLossCoefficients, PaperPhase, PaperSettings, PaperTask, Photographs,
    PredictedTensors, ProcessGroup, Resources, Run, RunOutcome, RunSettings, StepLosses, TABLE,
    TrainError, TrainEvent, Trainable, TrainingTask, TurnNetworkSettings, TurnNetworkTask,
    Validation, read_settings,
};
use tch::{Device, Kind, Tensor};

const SIDE: i64 = 64;

fn input(channels: usize) -> Tensor {
    tch::manual_seed(5);
    Tensor::randn([1, channels as i64, SIDE, SIDE], (Kind::Float, Device::Cpu))
}

fn model(graph: Graph, precision: ComputePrecision) -> Model {
    let weights = Weights::initial(&graph, 3);
    Model::new(graph, &weights, Device::Cpu, precision).unwrap()
}

#[test]
fn what_is_trained_answers_as_what_is_shipped() {
    for graph in [decomposer_with_light(), normal_net(), light_net()] {
        let weights = Weights::initial(&graph, 3);
        let picture = input(graph.input_channels());
        let flat = Vec::<f32>::try_from(picture.flatten(0, -1)).unwrap();
        let side = SIDE as usize;
        let shipped = Inference::new(&graph, &weights, (side, side)).unwrap();
        let shipped = shipped.run(&flat).unwrap();
        let model = Model::new(graph, &weights, Device::Cpu, ComputePrecision::Single).unwrap();
        let trained = model.forward(&picture).unwrap();
        assert_eq!(trained.len(), shipped.len());
        for (trained, shipped) in trained.iter().zip(&shipped) {
            let trained = Vec::<f32>::try_from(trained.flatten(0, -1)).unwrap();
            assert_eq!(trained.len(), shipped.values().len());
            let sizes = trained.iter().map(|value| value.abs());
            let largest = sizes.fold(1.0_f32, f32::max);
            for (a, b) in trained.iter().zip(shipped.values()) {
                assert!(
                    (a - b).abs() < 1e-4 * largest,
                    "{}: {a} {b}",
                    model.graph().name()
                );
            }
        }
        assert_eq!(model.weights().unwrap(), weights);
    }
}

/// Steps towards a constant output; the losses.
fn descend(model: &Model, adam: &mut Adam, steps: usize) -> Vec<f64> {
    let picture = input(model.graph().input_channels());
    (0..steps)
        .map(|_| {
            let output = &model.forward(&picture).unwrap()[0];
            let loss = (output - 0.5).square().mean(None);
            loss.backward();
            adam.step(model.parameters(), 1e-3).unwrap();
            loss.double_value(&[])
        })
        .collect()
}

#[test]
fn steps_lower_the_loss_in_both_precisions() {
    for precision in [ComputePrecision::Single, ComputePrecision::Mixed] {
        let model = model(decomposer(), precision);
        let mut adam = Adam::new(&RunSettings::default(), model.parameters()).unwrap();
        let losses = descend(&model, &mut adam, 6);
        assert!(losses[5] < 0.8 * losses[0], "{losses:?}");
    }
}

#[test]
fn a_gradient_that_is_no_number_changes_nothing() {
    let model = model(decomposer(), ComputePrecision::Single);
    let mut adam = Adam::new(&RunSettings::default(), model.parameters()).unwrap();
    let before = model.weights().unwrap();
    let picture = input(model.graph().input_channels());
    let loss = model.forward(&picture).unwrap()[0].sum(None) * f64::INFINITY;
    loss.backward();
    let error = adam.step(model.parameters(), 1e-3).unwrap_err();
    assert!(matches!(error, TrainError::Refused(_)), "{error:?}");
    assert_eq!(model.weights().unwrap(), before);
    assert_eq!(adam.steps(), 0);
}

#[test]
fn a_run_that_was_saved_goes_on_to_the_same_losses() {
    tch::set_num_threads(1);
    let first = model(light_net(), ComputePrecision::Single);
    let mut adam = Adam::new(&RunSettings::default(), first.parameters()).unwrap();
    descend(&first, &mut adam, 3);
    let (weights, memory) = (first.weights().unwrap(), adam.memory().unwrap());
    let undisturbed = descend(&first, &mut adam, 3);

    let graph = light_net();
    let second = Model::new(graph, &weights, Device::Cpu, ComputePrecision::Single).unwrap();
    let mut adam = Adam::new(&RunSettings::default(), second.parameters()).unwrap();
    adam.load_state(&memory).unwrap();
    assert_eq!(descend(&second, &mut adam, 3), undisturbed);
}

#[test]
fn the_memory_of_another_network_is_refused() {
    let light = model(light_net(), ComputePrecision::Single);
    let memory = Adam::new(&RunSettings::default(), light.parameters())
        .unwrap()
        .memory()
        .unwrap();
    let other = model(decomposer(), ComputePrecision::Single);
    let mut adam = Adam::new(&RunSettings::default(), other.parameters()).unwrap();
    assert!(adam.load_state(&memory).is_err());
}

/// Small settings: a run of seconds.
fn small_run(steps: u64) -> RunSettings {
    RunSettings {
        steps,
        batch: 4,
        log_every: 1,
        validate_every: 3,
        ..RunSettings::default()
    }
}

fn small_data() -> DataSettings {
    DataSettings {
        size: 32,
        views: 8,
        rays: 16,
        validation: 2,
        ..DataSettings::default()
    }
}

fn decompose_task(steps: u64) -> (DecomposeTask, RunSettings) {
    let settings = DecomposeSettings {
        run: small_run(steps),
        data: small_data(),
    };
    let run = settings.run.clone();
    (
        DecomposeTask::new(settings, resources(), None).unwrap(),
        run,
    )
}

fn resources() -> Resources {
    Resources {
        device: Device::Cpu,
        workers: 2,
        stop: Arc::default(),
    }
}

/// The table of a run's settings.
fn table_of(run: &RunSettings) -> toml::Table {
    let run = toml::Value::try_from(run).unwrap();
    toml::Table::from_iter([("run".to_owned(), run)])
}

fn make_run(
    task: &mut dyn TrainingTask,
    settings: &RunSettings,
    folder: &Path,
    (resume, until): (bool, u64),
) -> Result<RunOutcome, TrainError> {
    let stop = AtomicBool::new(false);
    let mut stop_after = |step, event: TrainEvent<'_>| {
        if matches!(event, TrainEvent::Step(_)) {
            stop.store(step >= until, Ordering::Relaxed);
        }
    };
    let run = Run::open(task, &table_of(settings), folder, resume, None)?;
    run.finish(&stop, &mut stop_after)
}

/// The lines of a run's table, without the header.
fn table(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join(TABLE)).unwrap();
    text.lines().skip(1).map(str::to_owned).collect()
}

#[test]
fn a_run_that_was_stopped_goes_on_to_the_same_losses_and_weights() {
    tch::set_num_threads(1);
    let (whole, parted) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (mut task, settings) = decompose_task(4);
    let undisturbed = make_run(&mut task, &settings, whole.path(), (false, u64::MAX)).unwrap();
    assert!(!undisturbed.stopped);

    let (mut task, settings) = decompose_task(4);
    let stopped = make_run(&mut task, &settings, parted.path(), (false, 2)).unwrap();
    assert!(stopped.stopped);
    let (mut task, settings) = decompose_task(4);
    make_run(&mut task, &settings, parted.path(), (true, u64::MAX)).unwrap();

    assert_eq!(table(parted.path()), table(whole.path()));
    let weights = |folder: &Path| Weights::read(&folder.join("decomposer.safetensors")).unwrap();
    assert_eq!(weights(parted.path()), weights(whole.path()));
}

fn turn_task(steps: u64, workers: usize) -> (TurnNetworkTask, RunSettings) {
    let settings = TurnNetworkSettings {
        run: small_run(steps),
        data: DataSettings {
            size: 32,
            views: 5,
            first_views: Some(4),
            new_views: 1,
            rays: 16,
            validation: 2,
            ..DataSettings::default()
        },
    };
    let run = settings.run.clone();
    let resources = Resources {
        workers,
        ..resources()
    };
    let task = TurnNetworkTask::new(settings, resources, None).unwrap();
    (task, run)
}

#[test]
fn a_run_of_the_network_of_turns_goes_on_to_the_same_weights_on_any_number_of_threads() {
    tch::set_num_threads(1);
    let [whole, parted] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let (mut task, settings) = turn_task(4, 1);
    make_run(&mut task, &settings, whole.path(), (false, u64::MAX)).unwrap();
    for (resume, until) in [(false, 2), (true, u64::MAX)] {
        let (mut task, settings) = turn_task(4, 3);
        make_run(&mut task, &settings, parted.path(), (resume, until)).unwrap();
    }
    assert_eq!(table(parted.path()), table(whole.path()));
    let weights = |folder: &Path| Weights::read(&folder.join("turn-net.safetensors")).unwrap();
    assert_eq!(weights(parted.path()), weights(whole.path()));
}

#[test]
fn a_folder_with_a_run_is_not_overwritten_and_another_runs_checkpoint_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (mut task, settings) = decompose_task(1);
    make_run(&mut task, &settings, folder.path(), (false, u64::MAX)).unwrap();
    let again = make_run(&mut task, &settings, folder.path(), (false, u64::MAX));
    let again = again.unwrap_err();
    assert!(matches!(again, TrainError::Refused(_)), "{again:?}");
    let (mut other, settings) = decompose_task(2);
    let error = make_run(&mut other, &settings, folder.path(), (true, u64::MAX)).unwrap_err();
    assert!(error.to_string().contains("run.steps"), "{error}");
}

#[test]
fn photographs_are_the_same_on_any_number_of_threads() {
    let batches = |workers: usize| {
        let resources = Resources {
            workers,
            ..resources()
        };
        let mut photographs = Photographs::new(&small_data(), &small_run(9), resources).unwrap();
        (0..4)
            .map(|step| photographs.batch(step).unwrap())
            .collect::<Vec<_>>()
    };
    for (one, other) in batches(1).iter().zip(&batches(3)) {
        assert_eq!(one.input, other.input);
        assert_eq!(one.normals, other.normals);
        assert_eq!(one.light, other.light);
    }
}

#[test]
fn photographs_of_a_later_step_are_those_that_come_after_the_steps_before() {
    let photographs = || Photographs::new(&small_data(), &small_run(9), resources()).unwrap();
    let (mut through, mut later) = (photographs(), photographs());
    let mut reached = through.batch(0).unwrap();
    for step in 1..=12 {
        reached = through.batch(step).unwrap();
    }
    assert_eq!(reached.input, later.batch(12).unwrap().input);
}

#[test]
fn a_photograph_is_albedo_times_shading_and_highlight_where_it_is_not_clipped() {
    let data = DataSettings {
        size: 64,
        ..small_data()
    };
    let mut photographs = Photographs::new(&data, &small_run(9), resources()).unwrap();
    let mut apart = Vec::new();
    for step in 0..6 {
        let batch = photographs.batch(step).unwrap();
        let made = batch.albedo.mean_dim([1_i64].as_slice(), true, Kind::Float);
        let diffuse =
            (&batch.picture - &batch.highlight).mean_dim([1_i64].as_slice(), true, Kind::Float);
        // The shading is right up to a factor of each picture.
        let both = &made * &batch.shading * &batch.mask;
        let over = |of: &Tensor| of.sum_dim_intlist([1_i64, 2, 3].as_slice(), true, Kind::Float);
        let factor = over(&(&both * &diffuse)) / over(&(&both * &both)).clamp_min(1e-9);
        let off = over(&(both * factor - &diffuse).square()) / over(&diffuse.square());
        apart.extend(Vec::<f32>::try_from(off.flatten(0, -1).sqrt()).unwrap());
    }
    apart.sort_by(f32::total_cmp);
    assert!(apart[apart.len() / 2] < 0.15, "{apart:?}");
}

#[test]
fn answers_mean_the_same_on_tensors_as_one_by_one() {
    let side = SIDE as usize;
    let picture = Planes::from_fn(Extent::new(side, side), |x, y| {
        [x, y, x + y].map(|v| (v as f32 / 90.0).powi(2))
    });
    let mask = Planes::from_fn(Extent::new(side, side), |x, _| [f32::from(u8::from(x > 9))]);
    let encoded = NetworkInput::new(&picture, &mask);
    tch::manual_seed(4);
    let answer = Tensor::randn([1, 9, SIDE, SIDE], (Kind::Float, Device::Cpu)) * 2.0;
    let flat = Vec::<f32>::try_from(answer.flatten(0, -1)).unwrap();
    let plain = encoded.decode(&flat);
    let input = Tensor::from_slice(encoded.values()).view([1, 7, SIDE, SIDE]);
    let tensors = PredictedTensors::new(&input, &answer);
    let inside = input.narrow(1, 3, 1);
    let largest = |tensor: &Tensor, planes: Vec<&[f32]>, scale: f64| {
        let values = Vec::<f32>::try_from((tensor * &inside * scale).flatten(0, -1)).unwrap();
        let plain = planes.concat();
        let pairs = values.iter().zip(&plain);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(
        largest(
            &tensors.normals,
            plain.normals.planes().planes().to_vec(),
            1.0
        ) < 1e-5
    );
    assert!(largest(&tensors.albedo, plain.albedo.planes().to_vec(), 1.0) < 1e-5);
    assert!(largest(&tensors.shading, plain.shading.planes().to_vec(), 1.0) < 1e-4);
    let white = f64::from(encoded.white());
    assert!(largest(&tensors.highlight, plain.highlight.planes().to_vec(), white) < 1e-5);
}

fn turns() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let recipe = SequenceRecipe {
        recipe: Recipe {
            size: 32,
            ..Recipe::default()
        },
        frames: 24,
    };
    let library = Library::read(&Folders::default()).unwrap();
    write_sequences(&recipe, &library, 2, folder.path(), &|| {}).unwrap();
    folder
}

fn paper_settings(steps: u64) -> PaperSettings {
    PaperSettings {
        run: RunSettings {
            learning_rate: 1e-4,
            ..small_run(steps)
        },
        data: small_data(),
        ..PaperSettings::default()
    }
}

#[test]
fn every_phase_of_the_paper_makes_its_steps_and_goes_on_where_it_was_stopped() {
    tch::set_num_threads(1);
    let turns = turns();
    let inputs = PaperInputs {
        turns: Some(turns.path().to_owned()),
        spec: Some(Weights::initial(&spec_net(), 1)),
        normal: Some(Weights::initial(&normal_net(), 2)),
        light: Some(Weights::initial(&light_net(), 3)),
        ..PaperInputs::default()
    };
    for phase in [
        PaperPhase::Spec,
        PaperPhase::Normal,
        PaperPhase::Light,
        PaperPhase::Joint,
        PaperPhase::Specular,
    ] {
        let inputs = PaperInputs {
            turns: inputs.turns.clone().filter(|_| phase.uses_turns()),
            ..inputs.clone()
        };
        let task = || PaperTask::new(phase, paper_settings(3), resources(), &inputs).unwrap();
        let run = paper_settings(3).run;
        let (whole, parted) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let outcome = make_run(&mut task(), &run, whole.path(), (false, u64::MAX)).unwrap();
        assert!(outcome.steps == 3 && outcome.weights.is_some(), "{phase:?}");
        make_run(&mut task(), &run, parted.path(), (false, 1)).unwrap();
        make_run(&mut task(), &run, parted.path(), (true, u64::MAX)).unwrap();
        assert_eq!(table(parted.path()), table(whole.path()), "{phase:?}");
    }
}

#[test]
fn turns_that_are_held_out_are_judged_at_the_start_and_at_the_end() {
    tch::set_num_threads(1);
    let turns = turns();
    let inputs = PaperInputs {
        turns: Some(turns.path().to_owned()),
        validation_turns: Some(turns.path().to_owned()),
        normal: Some(Weights::initial(&normal_net(), 2)),
        ..PaperInputs::default()
    };
    let settings = PaperSettings {
        run: RunSettings {
            learning_rate: 2e-5,
            ema_decay: 0.0,
            ..paper_settings(12).run
        },
        loss: PaperLossCoefficients {
            supervised: 0.0,
            ..PaperLossCoefficients::default()
        },
        ..paper_settings(12)
    };
    let run = settings.run.clone();
    let mut task = PaperTask::new(PaperPhase::Light, settings, resources(), &inputs).unwrap();
    let folder = tempfile::tempdir().unwrap();
    make_run(&mut task, &run, folder.path(), (false, u64::MAX)).unwrap();
    let read = |step: &str, name: &str| -> f64 {
        let start = format!("{step},validation/{name},");
        let table = table(folder.path());
        let line = table.iter().find_map(|line| line.strip_prefix(&start));
        line.unwrap_or_else(|| panic!("{start}")).parse().unwrap()
    };
    assert_eq!(
        read("0", "pictures_residual"),
        read("12", "pictures_residual")
    );
    let (before, after) = (read("0", "residual"), read("12", "residual"));
    // Twelve steps from random weights need not lower it; that steps lower the loss is another test's.
    assert!(
        before > 0.0 && after > 0.0 && after != before,
        "{before} to {after}"
    );
    assert!(read("12", "shading") > 0.0);
}

#[test]
fn a_phase_says_what_it_needs() {
    for (phase, option) in [
        (PaperPhase::Light, "--turns"),
        (PaperPhase::Joint, "--turns"),
        (PaperPhase::Specular, "--turns"),
    ] {
        let inputs = PaperInputs::default();
        let error = PaperTask::new(phase, paper_settings(1), resources(), &inputs).unwrap_err();
        assert!(error.to_string().contains(option), "{error}");
    }
    let turns = turns();
    let inputs = PaperInputs {
        turns: Some(turns.path().to_owned()),
        ..PaperInputs::default()
    };
    for (phase, option) in [
        (PaperPhase::Light, "--normal"),
        (PaperPhase::Joint, "--light"),
    ] {
        let error = PaperTask::new(phase, paper_settings(1), resources(), &inputs).unwrap_err();
        assert!(error.to_string().contains(option), "{error}");
    }
}

#[test]
fn a_damaged_sample_of_a_turn_is_told_and_the_run_goes_on() {
    let turns = turns();
    let shard = fs::read_dir(turns.path())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .find(|path| path.extension().is_some_and(|e| e == "tar"))
        .unwrap();
    let mut bytes = fs::read(&shard).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3000].fill(0x5a);
    fs::write(&shard, bytes).unwrap();
    let inputs = PaperInputs {
        turns: Some(turns.path().to_owned()),
        ..PaperInputs::default()
    };
    let mut task =
        PaperTask::new(PaperPhase::Spec, paper_settings(6), resources(), &inputs).unwrap();
    let (folder, run) = (tempfile::tempdir().unwrap(), paper_settings(6).run);
    let (stop, mut damage) = (AtomicBool::new(false), Vec::new());
    let mut observer = |_, event: TrainEvent<'_>| {
        if let TrainEvent::Damaged(what) = event {
            damage.push(what.to_owned());
        }
    };
    let outcome = Run::open(&mut task, &table_of(&run), folder.path(), false, None)
        .unwrap()
        .finish(&stop, &mut observer)
        .unwrap();
    assert_eq!(outcome.steps, 6);
    assert!(!damage.is_empty());
    assert!(outcome.damaged);
}

/// A network of which every second step has nothing to learn from, as where the gate of saturation is closed.
struct EverySecondStep {
    trainable: Trainable,
}

impl EverySecondStep {
    fn new() -> Self {
        let run = RunSettings {
            ema_decay: 0.9,
            ..RunSettings::default()
        };
        let graph = light_net();
        let weights = Weights::initial(&graph, 5);
        Self {
            trainable: Trainable::new(graph, Some(&weights), &run, Device::Cpu).unwrap(),
        }
    }
}

impl TrainingTask for EverySecondStep {
    fn name(&self) -> &'static str {
        "every second step"
    }
    fn inputs(&self) -> Result<String, TrainError> {
        Ok(String::new())
    }
    fn join(&mut self, _: &ProcessGroup) -> Result<(), TrainError> {
        Ok(())
    }
    fn trainable(&mut self) -> &mut Trainable {
        &mut self.trainable
    }
    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError> {
        let mut losses = StepLosses::default();
        if step.is_multiple_of(2) {
            let input = Tensor::full(
                [1, 3, SIDE, SIDE],
                0.1 * step as f64,
                (Kind::Float, Device::Cpu),
            );
            let answer = &self.trainable.model.forward(&input)?[0];
            losses.terms.add("square", 1.0, answer.square().mean(None));
        }
        Ok(losses)
    }
    fn validate(&mut self) -> Result<Validation, TrainError> {
        Ok(Validation::default())
    }
}

#[test]
fn a_run_goes_on_to_the_same_losses_after_steps_that_taught_nothing() {
    tch::set_num_threads(1);
    let run = small_run(9);
    let (whole, parted) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let make = |folder: &tempfile::TempDir, resume, until| {
        make_run(
            &mut EverySecondStep::new(),
            &run,
            folder.path(),
            (resume, until),
        )
        .unwrap()
    };
    make(&whole, false, u64::MAX);
    make(&parted, false, 5);
    make(&parted, true, u64::MAX);
    assert_eq!(table(parted.path()), table(whole.path()));
    let saved = |folder: &tempfile::TempDir| Checkpoint::read(folder.path()).unwrap().unwrap();
    assert_eq!(saved(&parted), saved(&whole));
}

#[test]
fn a_run_does_not_go_on_with_other_turns_or_another_network_beside_it() {
    tch::set_num_threads(1);
    let (turns, others) = (turns(), turns());
    let shards = fs::read_dir(others.path())
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let shard = shards
        .into_iter()
        .find(|path| path.extension().is_some_and(|e| e == "tar"));
    // The same number of samples, of one turn twice.
    let shard = shard.unwrap();
    let twice = fs::read_dir(others.path())
        .unwrap()
        .map(|entry| entry.unwrap().path());
    for path in twice.filter(|path| path.extension().is_some_and(|e| e == "tar") && *path != shard)
    {
        fs::copy(&shard, path).unwrap();
    }
    let task = |turns: &tempfile::TempDir, seed| {
        let inputs = PaperInputs {
            turns: Some(turns.path().to_owned()),
            normal: Some(Weights::initial(&normal_net(), seed)),
            ..PaperInputs::default()
        };
        PaperTask::new(PaperPhase::Light, paper_settings(2), resources(), &inputs).unwrap()
    };
    let (folder, run) = (tempfile::tempdir().unwrap(), paper_settings(2).run);
    make_run(&mut task(&turns, 1), &run, folder.path(), (false, 1)).unwrap();
    for mut other in [task(&others, 1), task(&turns, 2)] {
        let error = make_run(&mut other, &run, folder.path(), (true, u64::MAX)).unwrap_err();
        assert!(matches!(error, TrainError::Refused(_)), "{error:?}");
        assert!(error.to_string().contains("turns"), "{error}");
    }
    make_run(&mut task(&turns, 1), &run, folder.path(), (true, u64::MAX)).unwrap();
}

#[test]
fn a_run_that_is_asked_to_stop_while_its_first_views_are_cast_stops_then() {
    let settings = DecomposeSettings {
        run: small_run(4),
        data: DataSettings {
            views: 500,
            rays: 4096,
            ..small_data()
        },
    };
    let (resources, folder) = (resources(), tempfile::tempdir().unwrap());
    let stop = Arc::clone(&resources.stop);
    let mut task = DecomposeTask::new(settings.clone(), resources, None).unwrap();
    let asked = Arc::clone(&stop);
    let later = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(200));
        asked.store(true, Ordering::Relaxed);
    });
    let run = Run::open(
        &mut task,
        &table_of(&settings.run),
        folder.path(),
        false,
        None,
    )
    .unwrap();
    let outcome = run.finish(&stop, &mut |_, _| {}).unwrap();
    later.join().unwrap();
    assert_eq!((outcome.steps, outcome.stopped), (0, true));
    assert!(Checkpoint::path(folder.path()).is_file());
}

#[test]
fn a_run_that_is_asked_to_stop_while_its_validation_is_cast_keeps_a_checkpoint() {
    let settings = TurnNetworkSettings {
        run: small_run(4),
        data: DataSettings {
            size: 32,
            views: 4,
            first_views: Some(4),
            rays: 4096,
            validation: 500,
            ..DataSettings::default()
        },
    };
    let (resources, folder) = (resources(), tempfile::tempdir().unwrap());
    let stop = Arc::clone(&resources.stop);
    stop.store(true, Ordering::Relaxed);
    let mut task = TurnNetworkTask::new(settings.clone(), resources, None).unwrap();
    let run = Run::open(
        &mut task,
        &table_of(&settings.run),
        folder.path(),
        false,
        None,
    )
    .unwrap();
    let outcome = run.finish(&stop, &mut |_, _| {}).unwrap();
    assert_eq!((outcome.steps, outcome.stopped), (0, true));
    assert!(Checkpoint::path(folder.path()).is_file());
}

#[test]
fn a_run_that_another_program_makes_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (mut task, settings) = decompose_task(1);
    let open = MetricsLog::open(folder.path(), 0).unwrap();
    let error = make_run(&mut task, &settings, folder.path(), (false, u64::MAX)).unwrap_err();
    assert!(matches!(error, TrainError::Refused(_)), "{error:?}");
    drop(open);
    make_run(&mut task, &settings, folder.path(), (false, u64::MAX)).unwrap();
}

#[test]
fn turns_are_refused_where_they_teach_nothing() {
    let turns = PaperInputs {
        turns: Some("turns".into()),
        ..PaperInputs::default()
    };
    let (settings, resources) = (PaperSettings::default(), resources());
    let task = PaperTask::new(PaperPhase::Normal, settings, resources, &turns);
    let error = task.unwrap_err().to_string();
    assert!(error.contains("--turns"), "{error}");
}

#[test]
fn the_settings_that_come_with_relight_can_be_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cli/weights");
    let paper: PaperSettings = read_settings(&folder.join("paper.toml")).unwrap();
    paper.check().unwrap();
    assert_eq!((paper.run.learning_rate, paper.run.batch), (1e-6, 12));
    let decompose: DecomposeSettings = read_settings(&folder.join("decompose.toml")).unwrap();
    decompose.check().unwrap();
    let turn: TurnNetworkSettings = read_settings(&folder.join("turn.toml")).unwrap();
    turn.check().unwrap();
}
