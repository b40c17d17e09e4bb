//! The command line, and what it asks for.

use std::path::{Path, PathBuf};

use clap::builder::{NonEmptyStringValueParser, RangedU64ValueParser};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use relit_data::image_stats::{SATURATION_LEVEL, SPEC_NET_GATE};
use relit_data::shard::{Align, ArrayTask, ImageSize, Layout, MAX_TASKS};
use relit_extract::card::CardFacts;
use relit_extract::{ExtractOptions, MAX_MARGIN, MAX_SHIFT, MAX_SIDE};

const EXAMPLES: &str = "\
Examples:
  relit-extract sessions/20261120T093015Z-mug -o dataset
      one recorded session with the mask.png in its folder
  relit-extract sessions -o dataset --resume
      every session in a folder; those that are there already are skipped
  relit-extract clip.mp4 --mask mask.png -o dataset --size native
      a bare video, in its own pixels
  relit-extract verify dataset
      read everything back
  relit-extract stats dataset --html dataset/index.html
      the data set at a glance
  relit-extract card dataset --license CC-BY-4.0 --creator NAME --url URL --published 2026-11-23
      README, Croissant metadata and checksums for publishing it
  relit-extract sessions -o dataset --task-id 3 --task-count 10
      the fourth of ten parts; afterwards: relit-extract merge dataset

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost, \
or a mask is not that of its object.";

/// The parsed command line.
pub(crate) struct Arguments {
    pub(crate) json: bool,
    pub(crate) progress: bool,
    pub(crate) command: Command,
}

/// The commands of the program.
pub(crate) enum Command {
    Extract {
        inputs: Vec<PathBuf>,
        out: PathBuf,
        options: ExtractOptions,
    },
    Verify {
        out: PathBuf,
    },
    Merge {
        out: PathBuf,
    },
    Stats {
        out: PathBuf,
        html: Option<PathBuf>,
    },
    Card {
        out: PathBuf,
        facts: CardFacts,
    },
}

/// Turn recorded turns into masked frames with saturation statistics, in training shards.
#[derive(Parser)]
#[command(
    name = "relit-extract",
    version,
    after_help = EXAMPLES,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
struct CommandLine {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    extract: Option<ExtractArguments>,
}

#[derive(Subcommand)]
enum Verb {
    /// Read a data set back and check everything in it.
    #[command(after_help = "Example:\n  relit-extract verify dataset")]
    Verify {
        /// The data set's folder.
        #[arg(value_name = "OUT")]
        out: PathBuf,
        /// Print one JSON line per event on standard output.
        #[arg(long)]
        json: bool,
        /// With --json, print also how far the work has come.
        #[arg(long, requires = "json")]
        progress: bool,
    },
    /// Join what several tasks wrote into one data set.
    #[command(after_help = "Example:\n  relit-extract merge dataset")]
    Merge {
        /// The data set's folder, or a URL of one.
        #[arg(value_name = "OUT")]
        out: PathBuf,
        /// Print one JSON line per event on standard output.
        #[arg(long)]
        json: bool,
    },
    /// Describe a data set for those who publish it: README.md, Croissant metadata, checksums.
    #[command(
        after_help = "Example:\n  relit-extract card dataset --name mugs --license CC-BY-4.0 --creator 'A. Researcher' --url https://example.org/mugs --published 2026-11-23\n\nIt checks every file, and writes README.md, croissant.json and SHA256SUMS into the folder."
    )]
    Card {
        /// The data set's folder.
        #[arg(value_name = "OUT")]
        out: PathBuf,
        #[command(flatten)]
        facts: CardArguments,
        /// Print one JSON line per event on standard output.
        #[arg(long)]
        json: bool,
    },
    /// Show a data set at a glance: sessions with verdicts, saturation, shifts and what else was found.
    #[command(
        after_help = "Example:\n  relit-extract stats dataset --html dataset/index.html\n\nIt reads dataset.json and the tables, and no shards."
    )]
    Stats {
        /// The data set's folder, or a URL of one.
        #[arg(value_name = "OUT")]
        out: PathBuf,
        /// Write a page for a browser, too.
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
        /// Print one JSON line per event on standard output.
        #[arg(long)]
        json: bool,
    },
}

#[derive(Args)]
struct CardArguments {
    /// The data set's name [default: that of its folder].
    #[arg(long)]
    name: Option<String>,
    /// Its licence: an SPDX identifier, or a URL.
    #[arg(long, value_name = "SPDX", value_parser = license)]
    license: String,
    /// Who made it; may be given several times.
    #[arg(long, value_name = "NAME", required = true, value_parser = NonEmptyStringValueParser::new())]
    creator: Vec<String>,
    /// Where it is published.
    #[arg(long, value_parser = address)]
    url: String,
    /// What it is, in a sentence or two.
    #[arg(
        long,
        default_value = "Turns of objects on a turntable: masked frames whose light changes."
    )]
    description: String,
    /// When it is published, YYYY-MM-DD.
    #[arg(long, value_name = "DATE", value_parser = date)]
    published: String,
    /// Its version.
    #[arg(long, value_name = "X.Y.Z", default_value = "1.0.0", value_parser = release)]
    release: String,
    /// How to cite it.
    #[arg(long, value_name = "TEXT")]
    cite: Option<String>,
}

#[derive(Args)]
struct ExtractArguments {
    /// A session folder, a folder of sessions, a video file, or a URL of one: s3://BUCKET/PATH, gs://, az://, file://.
    #[arg(value_name = "INPUT", required = true)]
    inputs: Vec<PathBuf>,
    /// The data set's folder, or a URL of one; created if it does not exist.
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
    /// The mask for all inputs [default: each session folder's mask.png].
    #[arg(long, value_name = "PNG")]
    mask: Option<PathBuf>,
    /// Samples per session, evenly spread over one turn.
    #[arg(long, value_name = "N", default_value_t = 1500, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Side of images and masks in pixels, or "native" for the source's own pixels.
    #[arg(long, value_name = "PIXELS", default_value = "256", value_parser = size)]
    size: ImageSize,
    /// Margin around the object, as a fraction of its longer side.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.05, value_parser = margin)]
    margin: f64,
    /// A channel is saturated from this 8-bit value on.
    #[arg(long, value_name = "0-255", default_value_t = SATURATION_LEVEL)]
    saturation_level: u8,
    /// Spec-Net should run above this fraction of saturated pixels.
    #[arg(long, value_name = "FRACTION", default_value_t = SPEC_NET_GATE, value_parser = fraction)]
    gate: f64,
    /// How samples are stored.
    #[arg(long, value_enum, default_value_t = LayoutName::Webdataset)]
    layout: LayoutName,
    /// What to do about shifts of the object against its mask, from vibration or drift.
    #[arg(long, value_enum, default_value_t = AlignName::Correct)]
    align: AlignName,
    /// Shifts up to this many source pixels are not corrected.
    #[arg(long, value_name = "PIXELS", default_value_t = 0.1, value_parser = tolerance)]
    align_tolerance: f64,
    /// Refuse a turn in which the object moves by more source pixels than this.
    #[arg(long, value_name = "PIXELS", default_value_t = 8.0, value_parser = max_shift)]
    max_shift: f64,
    /// Refuse recordings in which a frame would be used twice or something is lost.
    #[arg(long)]
    strict: bool,
    /// Extract also recordings that cover part of a turn: the samples that are there, and no others.
    #[arg(long)]
    partial: bool,
    /// Skip sessions that the data set already holds, intact and from the same video and mask.
    #[arg(long)]
    resume: bool,
    /// Replace sessions of the same name that were made from another video.
    #[arg(long)]
    replace: bool,
    /// Extract one part of the recordings: the number of this task, from 0 [default: that of a Slurm array
    /// job or a Kubernetes indexed job, where this is one].
    #[arg(long, value_name = "I")]
    task_id: Option<u32>,
    /// Number of tasks that share the recordings.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_TASKS)))]
    task_count: Option<u32>,
    /// Folder on the local disk through which recordings and data sets of object stores pass [default: the
    /// system's folder for temporary files].
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Number of worker threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,
    /// Print one JSON line per event on standard output.
    #[arg(long)]
    json: bool,
    /// With --json, print also how far the work has come.
    #[arg(long, requires = "json")]
    progress: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum LayoutName {
    /// One tar per session, as WebDataset reads it.
    Webdataset,
    /// Folders of images, as in the released data set.
    Relit,
}

#[derive(Clone, Copy, ValueEnum)]
enum AlignName {
    /// Measured, and corrected above the tolerance.
    Correct,
    /// Measured only.
    Measure,
    /// Neither measured nor corrected.
    Off,
}

impl From<AlignName> for Align {
    fn from(name: AlignName) -> Self {
        match name {
            AlignName::Correct => Self::Correct,
            AlignName::Measure => Self::Measure,
            AlignName::Off => Self::Off,
        }
    }
}

impl From<LayoutName> for Layout {
    fn from(name: LayoutName) -> Self {
        match name {
            LayoutName::Webdataset => Self::Webdataset,
            LayoutName::Relit => Self::Relit,
        }
    }
}

/// The command line as its manual shows it.
pub(crate) fn command() -> clap::Command {
    CommandLine::command()
}

/// Parses the command line; ends the program with exit code 2 if it is wrong.
pub(crate) fn parse() -> Arguments {
    let line = CommandLine::parse();
    match (line.verb, line.extract) {
        (
            Some(Verb::Verify {
                out,
                json,
                progress,
            }),
            _,
        ) => Arguments {
            json,
            progress,
            command: Command::Verify { out },
        },
        (Some(Verb::Merge { out, json }), _) => Arguments {
            json,
            progress: false,
            command: Command::Merge { out },
        },
        (Some(Verb::Stats { out, html, json }), _) => Arguments {
            json,
            progress: false,
            command: Command::Stats { out, html },
        },
        (Some(Verb::Card { out, facts, json }), _) => Arguments {
            json,
            progress: false,
            command: Command::Card {
                facts: facts.of(&out),
                out,
            },
        },
        (None, Some(extract)) => match task(&extract, &|name| std::env::var(name).ok()) {
            Ok(task) => extract.with(task),
            Err(wrong) => CommandLine::command()
                .error(ErrorKind::ValueValidation, wrong)
                .exit(),
        },
        (None, None) => CommandLine::command()
            .error(
                ErrorKind::MissingRequiredArgument,
                "INPUT and --out are required",
            )
            .exit(),
    }
}

/// The task that is asked for on the command line, else by the scheduler that started the program.
fn task(
    line: &ExtractArguments,
    variable: &dyn Fn(&str) -> Option<String>,
) -> Result<Option<ArrayTask>, String> {
    let number = |name: &str| -> Result<Option<u32>, String> {
        let text = variable(name).filter(|text| !text.is_empty());
        text.map(|text| {
            text.parse()
                .map_err(|_| format!("{name} is {text:?}, no number"))
        })
        .transpose()
    };
    let count = |from: Option<u32>| line.task_count.or(from);
    let (index, count) = if let Some(index) = line.task_id {
        (index, count(None))
    } else if let Some(index) = number("SLURM_ARRAY_TASK_ID")? {
        // An array may start at any number.
        let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
        let count = count(number("SLURM_ARRAY_TASK_COUNT")?);
        (index.saturating_sub(first), count)
    } else if let Some(index) = number("JOB_COMPLETION_INDEX")? {
        (index, count(None))
    } else if line.task_count.is_some() {
        return Err("--task-count needs --task-id: the number of this task, from 0".to_owned());
    } else {
        return Ok(None);
    };
    let count = count.ok_or("give --task-count, the number of tasks")?;
    let task = ArrayTask::new(index, count);
    task.map(Some)
        .ok_or_else(|| format!("there is no task {index} of {count}: they count from 0"))
}

impl CardArguments {
    fn of(self, out: &Path) -> CardFacts {
        let folder = || {
            let whole = out.canonicalize().unwrap_or_else(|_| out.to_owned());
            let name = whole.file_name().unwrap_or(whole.as_os_str());
            name.to_string_lossy().into_owned()
        };
        CardFacts {
            name: self.name.unwrap_or_else(folder),
            license: self.license,
            creators: self.creator,
            url: self.url,
            description: self.description,
            published: self.published,
            version: self.release,
            cite: self.cite,
        }
    }
}

/// A date as Croissant writes it.
fn date(text: &str) -> Result<String, String> {
    let parts: Vec<&str> = text.split('-').collect();
    let is_number = |part: &str, digits: usize| {
        part.len() == digits && part.bytes().all(|b| b.is_ascii_digit())
    };
    match parts[..] {
        [year, month, day]
            if is_number(year, 4)
                && is_number(month, 2)
                && is_number(day, 2)
                && ("01"..="12").contains(&month)
                && ("01"..="31").contains(&day) =>
        {
            Ok(text.to_owned())
        }
        _ => Err("give YYYY-MM-DD".to_owned()),
    }
}

fn address(text: &str) -> Result<String, String> {
    match text.split_once("://") {
        Some(("http" | "https", place)) if !place.is_empty() && !text.contains(' ') => {
            Ok(text.to_owned())
        }
        _ => Err("give an address that begins with https:// or http://".to_owned()),
    }
}

fn license(text: &str) -> Result<String, String> {
    let is_identifier = |b: u8| b.is_ascii_alphanumeric() || b"-.+".contains(&b);
    if !text.is_empty() && text.bytes().all(is_identifier) {
        return Ok(text.to_owned());
    }
    address(text).map_err(|_| "give an identifier of SPDX, as CC-BY-4.0, or an address".to_owned())
}

fn release(text: &str) -> Result<String, String> {
    let parts: Vec<&str> = text.split('.').collect();
    let is_number = |part: &&str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    if parts.len() == 3 && parts.iter().all(is_number) {
        Ok(text.to_owned())
    } else {
        Err("give three numbers, as 1.0.0".to_owned())
    }
}

impl ExtractArguments {
    fn with(self, task: Option<ArrayTask>) -> Arguments {
        let line = self;
        let defaults = ExtractOptions::default();
        let options = ExtractOptions {
            frames: line.frames,
            size: line.size,
            margin: line.margin,
            saturation_level: line.saturation_level,
            gate: line.gate,
            layout: line.layout.into(),
            align: line.align.into(),
            align_tolerance: line.align_tolerance,
            max_shift: line.max_shift,
            mask: line.mask,
            strict: line.strict,
            partial: line.partial,
            resume: line.resume,
            replace: line.replace,
            task,
            cache: line.cache,
            threads: line.threads.unwrap_or(defaults.threads),
        };
        let command = Command::Extract {
            inputs: line.inputs,
            out: line.out,
            options,
        };
        Arguments {
            json: line.json,
            progress: line.progress,
            command,
        }
    }
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

fn pixels(text: &str, least: f64) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (least..=MAX_SHIFT).contains(&value) => Ok(value),
        _ => Err(format!("give {least} to {MAX_SHIFT} pixels")),
    }
}

fn tolerance(text: &str) -> Result<f64, String> {
    pixels(text, 0.0)
}

fn max_shift(text: &str) -> Result<f64, String> {
    pixels(text, 1.0)
}

fn within(text: &str, most: f64) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=most).contains(&value) => Ok(value),
        _ => Err(format!("give a fraction from 0 to {most}, such as 0.05")),
    }
}

fn margin(text: &str) -> Result<f64, String> {
    within(text, MAX_MARGIN)
}

fn fraction(text: &str) -> Result<f64, String> {
    within(text, 1.0)
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
        let index = [("JOB_COMPLETION_INDEX", "2")];
        assert_eq!(asked("", &[]), Ok(None));
        assert_eq!(asked("", &slurm), Ok(ArrayTask::new(3, 8)));
        assert_eq!(
            asked("--task-id 0 --task-count 2", &slurm),
            Ok(ArrayTask::new(0, 2))
        );
        assert_eq!(asked("--task-count 3", &index), Ok(ArrayTask::new(2, 3)));
    }

    #[test]
    fn half_a_task_and_one_beyond_the_last_are_refused() {
        for (line, variables) in [
            ("--task-id 1", &[][..]),
            ("--task-count 2", &[]),
            ("--task-id 2 --task-count 2", &[]),
            ("", &[("JOB_COMPLETION_INDEX", "2")]),
            ("", &[("SLURM_ARRAY_TASK_ID", "x")]),
        ] {
            assert!(asked(line, variables).is_err(), "{line} {variables:?}");
        }
    }
}
