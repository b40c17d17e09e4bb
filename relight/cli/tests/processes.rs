//! Training by several processes, which find each other as a launcher's processes do.
#![cfg(feature = "train")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use relight_synth::{Folders, Library, Recipe, SequenceRecipe, write_sequences};
use relight_train::{Checkpoint, TABLE};
use relit_test_support::is_named;
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

/// Settings of a run of seconds; four processes can share each step.
fn settings(steps: u64, precision: &str) -> String {
    format!(
        "[run]\nsteps = {steps}\nbatch = 4\nprecision = \"{precision}\"\nlog_every = 1\nvalidate_every = 1000000\n\
         [data]\nsize = 32\nviews = 8\nrays = 16\nvalidation = 1\n"
    )
}

/// The command of a process without a launcher.
fn train(task: &str, settings: &Path, folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_relight"));
    command
        .args(["train", task, "--threads", "1", "--resume", "--settings"])
        .arg(settings)
        .arg("-o")
        .arg(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    for variable in [
        "RANK",
        "WORLD_SIZE",
        "LOCAL_RANK",
        "MASTER_ADDR",
        "MASTER_PORT",
    ] {
        command.env_remove(variable);
    }
    command
}

/// Processes that end with the test.
struct Processes(Vec<Child>);

impl Processes {
    /// Starts the command `command` gives for each process, as one of so many.
    fn launch(count: usize, command: impl Fn(usize) -> Command) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = port.local_addr().unwrap().port().to_string();
        let launched = (0..count).map(|rank| {
            let mut command = command(rank);
            command
                .env("RANK", rank.to_string())
                .env("WORLD_SIZE", count.to_string())
                .env("LOCAL_RANK", rank.to_string())
                .env("MASTER_ADDR", "127.0.0.1")
                .env("MASTER_PORT", &port);
            command.spawn().unwrap()
        });
        Self(launched.collect())
    }

    fn outputs(mut self) -> Vec<Output> {
        let all = self.0.drain(..);
        all.map(|process| process.wait_with_output().unwrap())
            .collect()
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for process in &mut self.0 {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn assert_done(outputs: &[Output]) {
    for output in outputs {
        assert!(output.status.success(), "{}", stderr(output));
    }
}

/// A run in a new folder, by one process or by several.
fn run(processes: usize, command: impl Fn(&Path) -> Command) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    if processes == 1 {
        assert_done(&[command(folder.path()).output().unwrap()]);
    } else {
        let launched = Processes::launch(processes, |_| command(folder.path()));
        assert_done(&launched.outputs());
    }
    folder
}

fn table(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join(TABLE)).unwrap_or_default();
    text.lines().skip(1).map(str::to_owned).collect()
}

fn checkpoint(folder: &Path) -> Checkpoint {
    Checkpoint::read(folder)
        .unwrap()
        .expect("the run was saved")
}

/// Waits until process 0 has made a step.
fn wait_for_a_step(folder: &Path, processes: &mut Processes) {
    // A validation stands before the first step.
    while table(folder).iter().all(|line| line.starts_with("0,")) {
        for process in &mut processes.0 {
            assert!(process.try_wait().unwrap().is_none(), "a process has ended");
        }
        sleep(Duration::from_millis(20));
    }
}

/// Whether two runs came to the same state and losses. Both have computed with 64 bits, and differ by the order in
/// which batches were summed, 1e-16 of the sums; with 32 bits Adam makes whole steps of what rounding leaves of
/// gradients that are 0. Checkpoints keep 32 bits, so that equal numbers can differ by 6e-8 of themselves. Averages of
/// squares fall short of what 32 bits hold well: they are left out.
fn assert_same(a: &Path, b: &Path, net: &str) {
    let (first, second) = (checkpoint(a), checkpoint(b));
    assert_eq!((first.step, &first.cursor), (second.step, &second.cursor));
    let mut compared = 0;
    let mut moved = 0.0_f32;
    for part in ["model.", "average.", "first."] {
        let prefix = format!("{net}.{part}");
        let (first, second) = (first.state.under(&prefix), second.state.under(&prefix));
        for (name, tensor) in first.iter() {
            let other = second.get(name).unwrap();
            let largest = tensor
                .values()
                .iter()
                .fold(0.0_f32, |most, v| most.max(v.abs()));
            for (a, b) in tensor.values().iter().zip(other.values()) {
                // Steps of Adam are 1e-5 long here, also along gradients that nearly cancel: a millionth of a step may differ.
                assert!(
                    (a - b).abs() <= 2e-7 * largest + 1e-10,
                    "{part}{name}: {a} {b}, the largest {largest}"
                );
                compared += 1;
            }
            moved = moved.max(if part == "first." { largest } else { 0.0 });
        }
    }
    assert!(compared > 1_000_000 && moved > 1e-4, "{compared} {moved}");
    let (first, second) = (table(a), table(b));
    assert_eq!(first.len(), second.len());
    for (a, b) in first.iter().zip(&second) {
        let ((a, a_value), (b, b_value)) = (value_of(a), value_of(b));
        assert_eq!(a, b);
        let same = (a_value - b_value).abs() <= 1e-6 * a_value.abs();
        assert!(same, "{a}: {a_value} {b_value}");
    }
}

fn value_of(line: &str) -> (&str, f64) {
    let (name, value) = line.rsplit_once(',').unwrap();
    (name, value.parse().unwrap())
}

#[test]
fn two_and_four_processes_reach_the_weights_of_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("settings.toml");
    fs::write(&file, settings(3, "double")).unwrap();
    let run = |processes| run(processes, |folder| train("decompose", &file, folder));
    let alone = run(1);
    for processes in [2, 4] {
        let together = run(processes);
        assert_same(alone.path(), together.path(), "decomposer");
        assert!(together.path().join("decomposer.safetensors").is_file());
    }
}

#[test]
fn groups_of_frames_are_divided_and_none_is_split() {
    let data = tempfile::tempdir().unwrap();
    let recipe = SequenceRecipe {
        recipe: Recipe {
            size: 32,
            ..Recipe::default()
        },
        frames: 30,
    };
    let library = Library::read(&Folders::default()).unwrap();
    // Nine groups an epoch, the last of each turn short: steps of four go over its end.
    write_sequences(&recipe, &library, 3, data.path(), &|| {}).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("settings.toml");
    let text = format!("{}[turns]\ngroups = 4\n", settings(4, "double"));
    fs::write(&file, text).unwrap();
    let run = |processes| {
        run(processes, |folder| {
            let mut command = train("spec", &file, folder);
            command.arg("--turns").arg(data.path());
            command
        })
    };
    let (alone, together) = (run(1), run(2));
    assert_same(alone.path(), together.path(), "spec-net");
    let lines = table(alone.path()).join("\n");
    assert!(lines.contains("loss/turns"), "{lines}");
}

#[test]
fn a_process_that_is_lost_ends_the_run_of_the_others_with_a_checkpoint() {
    for lost in [2, 0] {
        let (folder, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let file = scratch.path().join("settings.toml");
        fs::write(&file, settings(1_000_000, "single")).unwrap();
        let command = || train("decompose", &file, folder.path());
        let mut processes = Processes::launch(4, |_| command());
        wait_for_a_step(folder.path(), &mut processes);
        processes.0[lost].kill().unwrap();
        let outputs = processes.outputs();
        for (rank, output) in outputs.iter().enumerate().filter(|(rank, _)| *rank != lost) {
            let text = stderr(output);
            assert_eq!(output.status.code(), Some(1), "{rank}: {text}");
            assert!(text.contains("checkpoint.safetensors"), "{rank}: {text}");
        }
        assert!(
            checkpoint(folder.path()).step > 0,
            "process {lost} was lost"
        );
    }
}

#[test]
fn all_processes_stop_together_and_go_on_to_the_same_losses() {
    let (parted, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let file = scratch.path().join("settings.toml");
    fs::write(&file, settings(6, "single")).unwrap();
    let whole = run(2, |folder| train("decompose", &file, folder));

    let command = || train("decompose", &file, parted.path());
    let mut processes = Processes::launch(2, |_| command());
    wait_for_a_step(parted.path(), &mut processes);
    let second = Pid::from_raw(processes.0[1].id() as i32).unwrap();
    kill_process(second, Signal::TERM).unwrap();
    let codes: Vec<_> = processes
        .outputs()
        .iter()
        .map(|o| o.status.code())
        .collect();
    // On a machine that was busy elsewhere the run may have come to its end before.
    assert!(codes == [Some(3); 2] || codes == [Some(0); 2], "{codes:?}");
    assert_done(&Processes::launch(2, |_| command()).outputs());

    assert_eq!(table(parted.path()), table(whole.path()));
    assert_eq!(checkpoint(parted.path()), checkpoint(whole.path()));
}

#[test]
fn signals_that_a_launcher_repeats_cost_no_checkpoint() {
    let (folder, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let file = scratch.path().join("settings.toml");
    fs::write(&file, settings(1_000_000, "single")).unwrap();
    let command = || train("decompose", &file, folder.path());
    let mut processes = Processes::launch(2, |_| command());
    wait_for_a_step(folder.path(), &mut processes);
    let all: Vec<Pid> = processes
        .0
        .iter()
        .map(|process| Pid::from_raw(process.id() as i32).unwrap())
        .collect();
    // As Ctrl-C under torchrun: by the terminal, and by torchrun.
    for signal in [Signal::INT, Signal::TERM] {
        for &process in &all {
            kill_process(process, signal).unwrap();
        }
        sleep(Duration::from_millis(50));
    }
    // As srun --kill-on-bad-exit: whoever ends first ends the others.
    let has_ended = |process: &mut Child| process.try_wait().unwrap().is_some();
    while !processes.0.iter_mut().any(has_ended) {
        sleep(Duration::from_millis(1));
    }
    for process in &mut processes.0 {
        let _ = process.kill();
    }
    assert!(checkpoint(folder.path()).step > 0);
    assert!(folder.path().join("decomposer.safetensors").is_file());
}

#[test]
fn two_signals_at_once_cost_no_checkpoint() {
    let (folder, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let file = scratch.path().join("settings.toml");
    fs::write(&file, settings(1_000_000, "single")).unwrap();
    let mut processes = Processes(vec![
        train("decompose", &file, folder.path()).spawn().unwrap(),
    ]);
    wait_for_a_step(folder.path(), &mut processes);
    let process = Pid::from_raw(processes.0[0].id() as i32).unwrap();
    // As `timeout` does: to the program, and to its process group.
    for _ in 0..2 {
        kill_process(process, Signal::INT).unwrap();
        sleep(Duration::from_millis(50));
    }
    let code = processes.0[0].wait().unwrap().code();
    assert_eq!(code, Some(3));
    assert!(checkpoint(folder.path()).step > 0);
    assert!(folder.path().join("decomposer.safetensors").is_file());
}

#[test]
fn processes_that_were_started_with_other_settings_say_so() {
    let (folder, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let files = ["one.toml", "other.toml"].map(|name| scratch.path().join(name));
    fs::write(&files[0], settings(3, "single")).unwrap();
    fs::write(&files[1], settings(4, "single")).unwrap();
    let processes = Processes::launch(2, |rank| train("decompose", &files[rank], folder.path()));
    for output in processes.outputs() {
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(
            is_named(&text, &["settings", "process 0", "process 1"]),
            "{text}"
        );
    }
    assert!(table(folder.path()).is_empty());
}

#[test]
fn a_batch_that_the_processes_cannot_divide_is_told() {
    let (folder, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let file = scratch.path().join("settings.toml");
    fs::write(&file, settings(3, "single")).unwrap();
    let command = || train("decompose", &file, folder.path());
    for output in Processes::launch(3, |_| command()).outputs() {
        let text = stderr(&output);
        assert!(
            is_named(&text, &["run.batch", "4", "3 processes"]),
            "{text}"
        );
    }
}

#[test]
fn an_incomplete_environment_is_told() {
    let (folder, scratch) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let file = scratch.path().join("settings.toml");
    fs::write(&file, settings(3, "single")).unwrap();
    let mut command = train("decompose", &file, folder.path());
    let output = command.env("RANK", "1").output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(is_named(&text, &["RANK", "WORLD_SIZE"]), "{text}");
}
