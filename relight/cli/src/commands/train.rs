//! `relight train`.

use std::env;
use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::builder::RangedU64ValueParser;
use clap::{Args, Subcommand};
use relight_photo::nets::{NetError, Weights};
use relight_train::{
    DecomposeSettings, DecomposeTask, Launch, PaperInputs, PaperPhase, PaperSettings, PaperTask,
    ProcessGroup, Resources, Run, RunOutcome, TrainError, TrainEvent, TrainingTask,
    TurnNetworkSettings, TurnNetworkTask, cuda_device, keep_memory, read_settings,
};
use relit_console::{Console, Outcome, ProgressBar};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level;
use tch::Device;

use crate::commands::CommandResult;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight train decompose -o run
      the network of relight decompose, on samples that are made during training
  relight train decompose --settings relight/cli/weights/decompose.toml -o run
      one run from scratch, on the library of 'make training-data'; the built-in weights were trained by
      another recipe (relight/cli/weights/README.md)
  relight train decompose --settings my.toml -o run --resume
      continue a run that was stopped, with the same losses
  relight train normal -o normal
  relight train light --turns shards --normal-net normal/normal-net.safetensors -o light
  relight train joint --turns shards --light-net light/light-net.safetensors \
      --weights normal/normal-net.safetensors -o joint
      the paper's phases: a warm-up, and two rounds on turns
  relight train turn -o turn
      the network of relight turn
  torchrun --no-python --nproc-per-node 4 relight train decompose --threads 2 -o run
      four processes on one machine, each with its part of every batch; also with RANK, WORLD_SIZE, MASTER_ADDR,
      MASTER_PORT and LOCAL_RANK, as Slurm scripts and Kubernetes operators set them

The folder of a run contains checkpoint.safetensors, losses.csv and, at the end, the averaged weights. Ctrl-C ends a run with a checkpoint (exit code 3).";

/// Signals within this time count as one: `timeout` sends two.
const TOGETHER: Duration = Duration::from_secs(1);
/// The exit code of a run that a second signal ends without a checkpoint, as the shell has it for SIGINT.
const ENDED_BY_SIGNAL: i32 = 130;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    task: TaskName,
}

#[derive(Subcommand)]
enum TaskName {
    /// The network of `relight decompose`: albedo, shading, normals and highlight of a photograph.
    Decompose(RunArguments),
    /// Spec-Net: highlights, on composed samples and by chromaticity on turns.
    Spec(PaperArguments),
    /// Normal-Net's warm-up, on composed samples.
    Normal(PaperArguments),
    /// Light-Net from scratch, on turns; Normal-Net is fixed.
    Light(PaperArguments),
    /// Normal-Net, on turns; Light-Net is fixed.
    Joint(PaperArguments),
    /// The net for specular reflectance and smoothness, on the highlights of turns.
    Specular(PaperArguments),
    /// The network of `relight turn`: normals from the harmonics of a turn in unknown light.
    Turn(RunArguments),
}

#[derive(Args)]
struct PaperArguments {
    #[command(flatten)]
    run: RunArguments,
    /// Turns: a shard, or a folder that relit-extract has written.
    #[arg(long, value_name = "SHARDS", help_heading = "Turns and networks")]
    turns: Option<PathBuf>,
    /// Turns to validate on, by how near to rank one their reflectance is.
    #[arg(long, value_name = "SHARDS", help_heading = "Turns and networks")]
    validation_turns: Option<PathBuf>,
    /// The weights of Spec-Net, for light, joint and specular.
    #[arg(long, value_name = "FILE", help_heading = "Turns and networks")]
    spec_net: Option<PathBuf>,
    /// The weights of Normal-Net, for light and specular.
    #[arg(long, value_name = "FILE", help_heading = "Turns and networks")]
    normal_net: Option<PathBuf>,
    /// The weights of Light-Net, for joint and specular.
    #[arg(long, value_name = "FILE", help_heading = "Turns and networks")]
    light_net: Option<PathBuf>,
}

#[derive(Args)]
struct RunArguments {
    /// The folder of the run; created if missing.
    #[arg(
        short,
        long,
        value_name = "RUN",
        required_unless_present = "print_settings"
    )]
    output: Option<PathBuf>,
    /// Settings file (TOML); missing keys have their defaults.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Resume the run in the folder, or start one if it has none.
    #[arg(long)]
    resume: bool,
    /// Start from these weights.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Threads of the network [default: one per core].
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,
    /// Data-loader workers: threads that compose samples.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    workers: usize,
    /// Device of the network: cpu, cuda:N, or cuda (of several processes on a machine, one GPU each).
    #[arg(long, value_name = "DEVICE", default_value = "cpu", value_parser = device)]
    device: DeviceName,
    /// Print the settings with all defaults, and exit.
    #[arg(long)]
    print_settings: bool,
}

#[derive(Clone, Copy)]
enum DeviceName {
    Cpu,
    /// The one of the process's number on its machine.
    Cuda,
    CudaNumber(usize),
}

fn device(text: &str) -> Result<DeviceName, String> {
    match text {
        "cpu" => return Ok(DeviceName::Cpu),
        "cuda" => return Ok(DeviceName::Cuda),
        _ => {}
    }
    let number = text.strip_prefix("cuda:").and_then(|n| n.parse().ok());
    let number = number.ok_or_else(|| "cpu, cuda or cuda:N".to_owned())?;
    Ok(DeviceName::CudaNumber(number))
}

impl DeviceName {
    fn device(self, launch: Option<&Launch>) -> Result<Device, TrainError> {
        match self {
            Self::Cpu => Ok(Device::Cpu),
            Self::Cuda => cuda_device(launch.and_then(|launch| launch.local).unwrap_or(0)),
            Self::CudaNumber(number) => cuda_device(number),
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    match &arguments.task {
        TaskName::Decompose(arguments) => decompose(arguments, console),
        TaskName::Spec(arguments) => paper(PaperPhase::Spec, arguments, console),
        TaskName::Normal(arguments) => paper(PaperPhase::Normal, arguments, console),
        TaskName::Light(arguments) => paper(PaperPhase::Light, arguments, console),
        TaskName::Joint(arguments) => paper(PaperPhase::Joint, arguments, console),
        TaskName::Specular(arguments) => paper(PaperPhase::Specular, arguments, console),
        TaskName::Turn(arguments) => turn(arguments, console),
    }
}

fn decompose(arguments: &RunArguments, console: Console) -> CommandResult {
    let settings: DecomposeSettings = arguments.settings()?;
    train(settings, arguments, console, |settings, resources| {
        let weights = read_weights(arguments.weights.as_deref())?;
        Ok(DecomposeTask::new(settings, resources, weights.as_ref())?)
    })
}

fn turn(arguments: &RunArguments, console: Console) -> CommandResult {
    let settings: TurnNetworkSettings = arguments.settings()?;
    train(settings, arguments, console, |settings, resources| {
        let weights = read_weights(arguments.weights.as_deref())?;
        Ok(TurnNetworkTask::new(settings, resources, weights.as_ref())?)
    })
}

fn paper(phase: PaperPhase, arguments: &PaperArguments, console: Console) -> CommandResult {
    let own = &arguments.run;
    let settings = PaperSettings::from_phase(phase, own.settings.as_deref())?;
    train(settings, own, console, |settings, resources| {
        let inputs = PaperInputs {
            turns: arguments.turns.clone(),
            validation_turns: arguments.validation_turns.clone(),
            weights: read_weights(own.weights.as_deref())?,
            spec: read_weights(arguments.spec_net.as_deref())?,
            normal: read_weights(arguments.normal_net.as_deref())?,
            light: read_weights(arguments.light_net.as_deref())?,
        };
        Ok(PaperTask::new(phase, settings, resources, &inputs)?)
    })
}

impl RunArguments {
    fn settings<S: Default + Serialize + DeserializeOwned>(&self) -> Result<S, TrainError> {
        let file = self.settings.as_deref();
        file.map_or_else(|| Ok(S::default()), read_settings)
    }

    fn folder(&self) -> Result<&Path, &'static str> {
        self.output
            .as_deref()
            .ok_or("give the folder of the run with --output")
    }

    /// Meets the other processes that a launcher has started, if it has; sets the number of the network's threads. What
    /// this process has, and the group of all.
    fn join(&self, console: Console) -> Result<(Resources, Option<ProcessGroup>), Box<dyn Error>> {
        keep_memory();
        let launch = Launch::from_variables(|name| env::var(name).ok())?;
        if let Some(threads) = self.threads {
            tch::set_num_threads(threads as i32);
        }
        let device = self.device.device(launch.as_ref())?;
        if let Some(launch) = &launch {
            tell_of_waiting(launch, console);
        }
        let group = launch.as_ref().map(ProcessGroup::join).transpose()?;
        let resources = Resources {
            device,
            workers: self.workers,
            // While processes wait for each other, signals end them: there is nothing to save.
            stop: stop_at_signals(group.is_some())?,
        };
        Ok((resources, group))
    }
}

/// Process 0 reports whom it waits for: a process that was not started would block it silently.
fn tell_of_waiting(launch: &Launch, console: Console) {
    if launch.rank.index() > 0 {
        return;
    }
    let (others, place) = (
        launch.rank.world_size() - 1,
        format!("{}:{}", launch.address, launch.port),
    );
    let text = format!("process 0 waits at {place} for the {others} others, five minutes at most");
    let event = json!({ "event": "waiting", "others": others, "place": place });
    console.print(&text, &event);
}

fn read_weights(path: Option<&Path>) -> Result<Option<Weights>, NetError> {
    path.map(Weights::read).transpose()
}

/// Runs a task and reports the outcome; or prints the settings.
fn train<S: Serialize, T: TrainingTask>(
    settings: S,
    arguments: &RunArguments,
    console: Console,
    task: impl FnOnce(S, Resources) -> Result<T, Box<dyn Error>>,
) -> CommandResult {
    if arguments.print_settings {
        let event = json!({ "event": "settings", "settings": settings });
        console.print(toml::to_string(&settings)?.trim_end(), &event);
        return Ok(Outcome::Success);
    }
    let (resources, group) = arguments.join(console)?;
    let stop = Arc::clone(&resources.stop);
    let table = toml::Table::try_from(&settings)?;
    let mut task = task(settings, resources)?;
    let process = group.as_ref().map_or(0, |group| group.rank().index());
    let folder = arguments.folder()?;
    let run = Run::open(&mut task, &table, folder, arguments.resume, group)?;
    let bar = (process == 0).then(|| console.progress(run.steps(), "train"));
    if let Some(bar) = &bar {
        bar.set_position(run.steps_made());
        bar.reset_eta();
    }
    let outcome = run.finish(&stop, &mut |step, event| {
        show((step, event), bar.as_ref(), process, console);
    })?;
    if let Some(bar) = bar {
        bar.finish_and_clear();
        report(&outcome, console);
    }
    let is_incomplete = outcome.stopped || outcome.damaged;
    Ok(if is_incomplete {
        Outcome::Partial
    } else {
        Outcome::Success
    })
}

/// The flag that Ctrl-C and SIGTERM set. Where no launcher has started the program, another signal a second or more later ends it
/// at once; launchers repeat signals themselves.
fn stop_at_signals(is_launched: bool) -> io::Result<Arc<AtomicBool>> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    thread::Builder::new()
        .name("relight-signals".to_owned())
        .spawn(move || {
            let mut stopped: Option<Instant> = None;
            for _ in signals.forever() {
                flag.store(true, Ordering::Relaxed);
                let first = *stopped.get_or_insert_with(Instant::now);
                if !is_launched && first.elapsed() >= TOGETHER {
                    low_level::exit(ENDED_BY_SIGNAL);
                }
            }
        })?;
    Ok(stop)
}

fn report(outcome: &RunOutcome, console: Console) {
    let files: Vec<String> = outcome
        .weights
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    let end = if outcome.stopped {
        "stopped; continue with --resume"
    } else {
        "done"
    };
    console.print(
        &format!("{} steps, {end}: {}", outcome.steps, files.join(", ")),
        &json!({
            "event": "trained", "steps": outcome.steps, "stopped": outcome.stopped,
            "validation": outcome.figures, "weights": files,
        }),
    );
}

/// Shows an event of a run on the terminal. Processes other than the first have no bar, and report only what they alone know.
fn show(
    (step, event): (u64, TrainEvent<'_>),
    bar: Option<&ProgressBar>,
    process: u32,
    console: Console,
) {
    let Some(bar) = bar else {
        if let TrainEvent::Damaged(what) = event {
            let event =
                json!({ "event": "damaged", "step": step, "process": process, "message": what });
            let line = format!("step {step}, process {process}: left out: {what}");
            console.warn_with(&line, &event);
        }
        return;
    };
    match event {
        TrainEvent::Step(losses) => {
            if let Some(loss) = losses.get("loss") {
                bar.set_message(format!("train, loss {loss:.3}"));
            }
            bar.set_position(step);
        }
        TrainEvent::Damaged(what) => {
            let event = json!({ "event": "damaged", "step": step, "message": what });
            let line = format!("step {step}: left out: {what}");
            bar.suspend(|| console.warn_with(&line, &event));
        }
        TrainEvent::Validated(figures) if !figures.is_empty() => {
            let text: Vec<String> = figures
                .iter()
                .map(|(name, value)| format!("{name} {value:.4}"))
                .collect();
            let event = json!({ "event": "validated", "step": step, "figures": figures });
            let line = format!("step {step}: {}", text.join(", "));
            bar.suspend(|| console.print(&line, &event));
        }
        TrainEvent::Saved(path) if console.is_json() => {
            let path = path.display().to_string();
            console.print("", &json!({ "event": "saved", "step": step, "path": path }));
        }
        TrainEvent::Validated(_) | TrainEvent::Saved(_) => {}
    }
}
