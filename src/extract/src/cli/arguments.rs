//! The command line, and what it asks for.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, RangedU64ValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use relit_console::ConsoleOptions;
use relit_data::image_stats::SATURATION_LEVEL;
use relit_data::shard::{Align, ArrayTask, ImageSize, Layout, MAX_TASKS};
use relit_data::spec_net_gate::SPEC_NET_GATE;
use relit_extract::{ExtractOptions, MAX_MARGIN, MAX_SHIFT, MAX_SIDE};
use serde::de::DeserializeOwned;

const EXAMPLES: &str = "\
Examples:
  relit-extract sessions/20261120T093015Z-mug -o dataset
      one recorded session with the mask.png in its folder
  relit-extract sessions -o dataset --resume
      every session in a folder; those that are there already are skipped
  relit-extract clip.mp4 --mask mask.png -o dataset --size native
      a bare video, in its own pixels
  relit-extract videos --mask masks -o dataset
      every clip in a folder, each with the mask of its name: masks/clip.png for videos/clip.mp4
  relit-extract verify dataset
      read everything back
  relit-extract stats dataset
      the data set at a glance
  relit-extract sessions -o dataset --task 3/10
      the fourth of ten parts; afterwards: relit-extract merge dataset

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost, \
a mask does not fit, or a session is broken.";

/// Turn recorded turns into masked frames with saturation statistics, in training shards.
#[derive(Parser)]
#[command(
    name = "relit-extract",
    version,
    after_help = EXAMPLES,
    subcommand_negates_reqs = true
)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,
    #[command(flatten)]
    pub(crate) extract: Option<ExtractArguments>,
    #[command(flatten)]
    pub(crate) console: ConsoleOptions,
}

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Read a data set back and check everything in it.
    #[command(after_help = "Example:\n  relit-extract verify dataset")]
    Verify {
        /// The data set's folder.
        out: PathBuf,
    },
    /// Join what several tasks wrote into one data set, or finished data sets into a new one.
    #[command(
        after_help = "Examples:\n  relit-extract merge dataset\n      what several tasks wrote there\n  relit-extract merge monday tuesday -o week\n      finished data sets, whose files are copied"
    )]
    Merge {
        /// The data set's folder, or a URL of one; with --output the folders of several.
        #[arg(value_name = "OUT", required = true)]
        out: Vec<PathBuf>,
        /// The folder of the new data set.
        #[arg(short, long, value_name = "OUT")]
        output: Option<PathBuf>,
    },
    /// Write a data set in the other layout, from its own files.
    #[command(
        after_help = "Example:\n  relit-extract convert dataset -o for-the-paper --layout paper"
    )]
    Convert {
        /// The data set's folder.
        out: PathBuf,
        /// The folder of the new data set.
        #[arg(short, long, value_name = "OTHER")]
        output: PathBuf,
        /// The new layout.
        #[arg(long, value_parser = named::<Layout>(["webdataset", "paper"]))]
        layout: Layout,
    },
    /// Remove sessions from a data set, with their files.
    #[command(
        after_help = "Example:\n  relit-extract remove dataset 20261120T093015Z-mug\n\nIf tasks wrote the data set, remove the recording too, and run the tasks again before the next merge."
    )]
    Remove {
        /// The data set's folder.
        out: PathBuf,
        /// The sessions' names, as `stats` prints them.
        #[arg(value_name = "SESSION", required = true)]
        sessions: Vec<String>,
    },
    /// Summarise a data set: each session's verdict, saturation, shifts and reasons.
    #[command(
        after_help = "Example:\n  relit-extract stats dataset\n\nIt reads dataset.json alone."
    )]
    Stats {
        /// The data set's folder, or a URL of one.
        out: PathBuf,
    },
}

#[derive(Args)]
pub(crate) struct ExtractArguments {
    /// A session folder, a folder of sessions or of videos, a video file, or a URL of one: s3://BUCKET/PATH, gs://, az://, file://.
    #[arg(value_name = "INPUT", required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// The data set's folder, or a URL of one; created if it does not exist.
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// The mask for all inputs, or a folder of masks: clip.png for clip.mp4 [default: each session folder's mask.png].
    #[arg(long, value_name = "PNG|DIR")]
    mask: Option<PathBuf>,
    /// Samples per session, evenly spread over one turn.
    #[arg(long, value_name = "N", default_value_t = 1500, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Side of the output in pixels, or "native" for the source's.
    #[arg(long, value_name = "PIXELS", default_value = "256", value_parser = size)]
    size: ImageSize,
    /// Margin around the object, as a fraction of its longer side.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.05, value_parser = within(0.0, MAX_MARGIN))]
    margin: f64,
    /// A channel is saturated from this 8-bit value on.
    #[arg(long, value_name = "0-255", default_value_t = SATURATION_LEVEL)]
    saturation_level: u8,
    /// Spec-Net should run above this fraction of saturated pixels.
    #[arg(long, value_name = "FRACTION", default_value_t = SPEC_NET_GATE, value_parser = within(0.0, 1.0))]
    spec_net_above: f64,
    /// One WebDataset tar per session, or folders of images as in the released data set.
    #[arg(long, default_value = "webdataset", value_parser = named::<Layout>(["webdataset", "paper"]))]
    layout: Layout,
    /// Measure how far the object shifts against its mask, and correct shifts above the tolerance.
    #[arg(long, default_value = "correct", value_parser = named::<Align>(["correct", "measure", "off"]))]
    align: Align,
    /// Shifts up to this many source pixels are not corrected.
    #[arg(long, value_name = "PIXELS", default_value_t = 0.1, value_parser = within(0.0, MAX_SHIFT))]
    align_tolerance: f64,
    /// Refuse a turn in which the object moves by more source pixels than this.
    #[arg(long, value_name = "PIXELS", default_value_t = 8.0, value_parser = within(1.0, MAX_SHIFT))]
    max_shift: f64,
    /// Also extract recordings of part of a turn, with fewer samples.
    #[arg(long)]
    partial: bool,
    /// Skip sessions that the data set already holds, intact and from the same video and mask.
    #[arg(long)]
    resume: bool,
    /// Replace sessions of the same name that were made from another video.
    #[arg(long)]
    replace: bool,
    /// Extract the part of task I of N, counted from 0 [default: from a Slurm array job, if any].
    #[arg(long, value_name = "I/N", value_parser = array_task)]
    task: Option<ArrayTask>,
    /// Number of worker threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,
}

/// The task that is requested on the command line, else by the scheduler that started the program.
fn task(
    line: &ExtractArguments,
    variable: &dyn Fn(&str) -> Option<String>,
) -> Result<Option<ArrayTask>, String> {
    if line.task.is_some() {
        return Ok(line.task);
    }
    let number = |name: &str| -> Result<Option<u32>, String> {
        let text = variable(name).filter(|text| !text.is_empty());
        text.map(|text| {
            text.parse()
                .map_err(|_| format!("{name} is {text:?}, not a number"))
        })
        .transpose()
    };
    if let Some(index) = number("JOB_COMPLETION_INDEX")? {
        // Kubernetes does not say how many there are, and each of them would extract everything.
        return Err(format!(
            "this is number {index} of an indexed job: give --task $(JOB_COMPLETION_INDEX)/N, or --task 0/1 for all recordings"
        ));
    }
    let Some(index) = number("SLURM_ARRAY_TASK_ID")? else {
        return Ok(None);
    };
    // An array may start at any number.
    let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
    let count = number("SLURM_ARRAY_TASK_COUNT")?;
    let count = count.ok_or("SLURM_ARRAY_TASK_COUNT is not set: give --task I/N")?;
    new_task(index.saturating_sub(first), count).map(Some)
}

fn array_task(text: &str) -> Result<ArrayTask, String> {
    let numbers = text.split_once('/');
    let numbers =
        numbers.and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
    let (index, count) = numbers.ok_or("write 3/40: task 3 of 40, counted from 0")?;
    new_task(index, count)
}

fn new_task(index: u32, count: u32) -> Result<ArrayTask, String> {
    ArrayTask::new(index, count).ok_or_else(|| {
        format!("task {index} of {count} does not exist: tasks count from 0, and are at most {MAX_TASKS}")
    })
}

impl ExtractArguments {
    /// The options, with the task of the scheduler that started the program where the command line names none.
    pub(crate) fn options(&self) -> Result<ExtractOptions, String> {
        Ok(ExtractOptions {
            frames: self.frames,
            size: self.size,
            margin: self.margin,
            saturation_level: self.saturation_level,
            gate: self.spec_net_above,
            layout: self.layout,
            align: self.align,
            align_tolerance: self.align_tolerance,
            max_shift: self.max_shift,
            mask: self.mask.clone(),
            partial: self.partial,
            resume: self.resume,
            replace: self.replace,
            task: task(self, &|name| std::env::var(name).ok())?,
            threads: self
                .threads
                .unwrap_or_else(|| ExtractOptions::default().threads),
        })
    }
}

/// Takes one of these names of a value, which are those that `dataset.json` has.
fn named<T: DeserializeOwned + Clone + Send + Sync + 'static>(
    names: impl Into<PossibleValuesParser>,
) -> impl TypedValueParser<Value = T> {
    let names: PossibleValuesParser = names.into();
    names.try_map(|name| serde_json::from_value(name.into()))
}

fn size(text: &str) -> Result<ImageSize, String> {
    if text == "native" {
        return Ok(ImageSize::NATIVE);
    }
    match text.parse() {
        Ok(side) if (1..=MAX_SIDE).contains(&side) => Ok(ImageSize::Pixels(side)),
        _ => Err(format!("give 1 to {MAX_SIDE} pixels, or native")),
    }
}

/// Takes a number of this range.
fn within(least: f64, most: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| match text.parse() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("give a number from {least} to {most}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(line: &str, variables: &[(&str, &str)]) -> Result<Option<ArrayTask>, String> {
        let words = "relit-extract in -o out"
            .split(' ')
            .chain(line.split_whitespace());
        let line = CommandLine::try_parse_from(words).map_err(|error| error.to_string())?;
        let variable = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        match line.extract {
            Some(extract) => task(&extract, &variable),
            None => Err("no arguments".to_owned()),
        }
    }

    #[test]
    fn the_task_is_that_of_the_command_line_or_of_the_scheduler() {
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "4"),
            ("SLURM_ARRAY_TASK_MIN", "1"),
            ("SLURM_ARRAY_TASK_COUNT", "8"),
        ];
        assert_eq!(asked("", &[]), Ok(None));
        assert_eq!(asked("", &slurm), Ok(ArrayTask::new(3, 8)));
        assert_eq!(asked("--task 0/2", &slurm), Ok(ArrayTask::new(0, 2)));
        assert_eq!(asked("--task 39/40", &[]), Ok(ArrayTask::new(39, 40)));
    }

    #[test]
    fn half_a_task_and_one_beyond_the_last_are_refused() {
        for (line, variables) in [
            ("--task 1", &[][..]),
            ("--task 1/", &[]),
            ("--task /2", &[]),
            ("--task 2/2", &[]),
            ("--task 0/0", &[]),
            ("", &[("SLURM_ARRAY_TASK_ID", "0")]),
            ("", &[("SLURM_ARRAY_TASK_ID", "x")]),
            ("", &[("JOB_COMPLETION_INDEX", "2")]),
        ] {
            assert!(asked(line, variables).is_err(), "{line} {variables:?}");
        }
    }

    #[test]
    fn json_is_taken_before_and_after_a_verb() {
        for line in [
            "relit-extract --json verify out",
            "relit-extract verify out --json",
            "relit-extract --json in -o out",
            "relit-extract verify out --json --progress",
        ] {
            let line = CommandLine::try_parse_from(line.split(' ')).unwrap();
            assert!(line.console.json);
        }
        let alone = CommandLine::try_parse_from("relit-extract verify out --progress".split(' '));
        assert!(alone.is_err());
    }
}
