//! From a recording and its mask to a training shard: select -> decode -> crop -> measure ->
//! scale -> encode -> write, as one streaming pipeline whose memory does not grow with the video.
//!
//! [`extract`] works through any number of recordings into one data set; a bad one does not stop
//! the others. The parts stand alone: [`Selection`] chooses the frames of a turn,
//! [`square_around`] makes the crop, [`Scaler`] scales without bleeding.
//!
//! This room knows every other of the library and prints nothing: what happens is told to an
//! [`Observer`].

mod crop;
mod job;
mod made;
mod object;
mod pipeline;
mod plan;
mod scale;
mod select;
mod timeline;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use rayon::{ThreadPool, ThreadPoolBuilder};

pub use crop::{bounding_box, cut, square_around};
pub use scale::Scaler;
pub use select::{Basis, Candidate, Selection, TimeGap, Turn, runs_back_at, time_gaps};

use relit_data::geometry::Rect;
use relit_data::report;
use relit_data::session::{self, recordings};
use relit_data::shard::{self, Align, Dataset, Layout, OutputFolder, SessionEntry, Settings, Size};
use relit_video as video;

/// Largest side of a scaled image, pixels.
pub const MAX_SIDE: u32 = 8192;
/// Largest margin, as a fraction of the object's longer side.
pub const MAX_MARGIN: f64 = 4.0;

/// How to extract.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Samples a session, 1 and above; 1500 is one frame each of the rig's turn.
    pub frames: u32,
    /// Size of images and masks: a square of 1..=[`MAX_SIDE`] pixels, or the source's pixels.
    pub size: Size,
    /// Margin around the object on each side, as a fraction of its longer side,
    /// 0..=[`MAX_MARGIN`].
    pub margin: f64,
    /// The 8-bit value from which a channel is saturated.
    pub saturation_level: u8,
    /// The saturated fraction above which `spec_net` is set, 0..=1 (the paper: 5 %, section on
    /// Spec-Net).
    pub gate: f64,
    /// How the data set lies on disk.
    pub layout: Layout,
    /// The mask for all recordings; `None`: each session folder's own `mask.png`.
    pub mask: Option<PathBuf>,
    /// Refuse recordings of which a frame would be used twice or something is lost.
    pub strict: bool,
    /// Skip what the data set already vouches for.
    pub resume: bool,
    /// Replace sessions of the same name that were made of another video.
    pub replace: bool,
    /// Threads that work side by side, 1 and above.
    pub threads: usize,
}

impl Options {
    /// The settings as the data set records them.
    fn settings(&self) -> Settings {
        Settings {
            frames: self.frames,
            size: self.size,
            margin: self.margin,
            saturation_level: self.saturation_level,
            gate: self.gate,
            align: Align::Off,
            layout: self.layout,
            scaling: match self.size {
                Size::Pixels(_) => scale::METHOD,
                Size::Native(_) => scale::NO_METHOD,
            }
            .to_owned(),
        }
    }

    fn check(&self) -> Result<(), Error> {
        let wrong = |name, value: f64, allowed| {
            Err(Error::Option {
                name,
                value,
                allowed,
            })
        };
        if self.frames == 0 {
            return wrong("frames", 0.0, "at least 1");
        }
        if let Size::Pixels(side) = self.size
            && !(1..=MAX_SIDE).contains(&side)
        {
            return wrong("size", f64::from(side), "1 to 8192 pixels, or native");
        }
        if !(0.0..=MAX_MARGIN).contains(&self.margin) {
            return wrong("margin", self.margin, "0 to 4");
        }
        if !(0.0..=1.0).contains(&self.gate) {
            return wrong("gate", self.gate, "0 to 1");
        }
        if self.threads == 0 {
            return wrong("threads", 0.0, "at least 1");
        }
        Ok(())
    }
}

/// Is told what happens, from several threads.
pub trait Observer: Sync {
    /// Work on a recording begins; `samples` are to come.
    fn begun(&self, recording: &Path, samples: u32);
    /// One more sample is written.
    fn advanced(&self);
    /// A recording is done with.
    fn ended(&self, recording: &Path, outcome: &Outcome);
}

/// How it went with one recording.
#[derive(Debug)]
pub enum Outcome {
    /// It is in the data set; the entry's warnings tell what to know.
    Extracted(Box<SessionEntry>),
    /// It was there already, whole and with the same settings, video, index and mask.
    Skipped(Box<SessionEntry>),
    /// It is not in the data set.
    Failed(Error),
}

/// How it went with all recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Recordings extracted.
    pub extracted: usize,
    /// Of those and the skipped ones, how many have lost something.
    pub lossy: usize,
    /// Recordings that were there already.
    pub skipped: usize,
    /// Recordings that failed.
    pub failed: usize,
}

/// Extracts every recording that `inputs` stand for (session folders, folders of sessions, video
/// files) into the data set in the folder `out`, which is made where it is missing.
///
/// # Errors
/// [`Error`] where nothing can be done at all: an option out of range, a data set with other
/// settings in `out`, or no room. What goes wrong with one input or recording is told to
/// `observer` and counted.
pub fn extract(
    inputs: &[PathBuf],
    out: &Path,
    options: &Options,
    observer: &dyn Observer,
) -> Result<Tally, Error> {
    options.check()?;
    if out.join(session::MANIFEST_FILE).exists() {
        return Err(Error::IntoSession(out.to_owned()));
    }
    let folder = OutputFolder::lock(out)?;
    let dataset = open_dataset(out, options.settings())?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()?;
    let mut run = Run {
        folder,
        dataset,
        options,
        pool,
        names: HashSet::new(),
        observer,
    };
    let mut tally = Tally::default();
    for input in inputs {
        match recordings(input) {
            Ok(found) => found
                .iter()
                .for_each(|recording| run.extract(recording, &mut tally)),
            Err(error) => run.end(input, Err(error.into()), &mut tally),
        }
    }
    Ok(tally)
}

/// One call's work on one data set.
struct Run<'a> {
    folder: OutputFolder,
    dataset: Dataset,
    options: &'a Options,
    pool: ThreadPool,
    /// Of the recordings so far.
    names: HashSet<String>,
    observer: &'a dyn Observer,
}

impl Run<'_> {
    fn extract(&mut self, recording: &Path, tally: &mut Tally) {
        let outcome = self.one(recording);
        self.end(recording, outcome, tally);
    }

    fn end(&self, recording: &Path, outcome: Result<Outcome, Error>, tally: &mut Tally) {
        let outcome = outcome.unwrap_or_else(Outcome::Failed);
        match &outcome {
            Outcome::Extracted(entry) => {
                tally.extracted += 1;
                tally.lossy += usize::from(entry.lossy);
            }
            Outcome::Skipped(entry) => {
                tally.skipped += 1;
                tally.lossy += usize::from(entry.lossy);
            }
            Outcome::Failed(_) => tally.failed += 1,
        }
        self.observer.ended(recording, &outcome);
    }

    fn one(&mut self, path: &Path) -> Result<Outcome, Error> {
        let Self {
            folder, options, ..
        } = self;
        let job = job::Job::open(path, options)?;
        if !self.names.insert(job.id().to_owned()) {
            return Err(Error::SameName(job.id().to_owned()));
        }
        if options.resume
            && let Some(entry) = job.vouched(&self.dataset, folder.path(), options)
        {
            return Ok(Outcome::Skipped(Box::new(entry.clone())));
        }
        if !options.replace && job.would_replace_another(&self.dataset) {
            let (out, id) = (folder.path().to_owned(), job.id().to_owned());
            return Err(Error::NameTaken { out, id });
        }
        self.observer.begun(path, options.frames);
        let (entry, shards) = job.run(folder, options, &self.pool, self.observer)?;
        // A data set that could not be written is not the one that goes on.
        let mut dataset = self.dataset.clone();
        dataset.replace(entry.clone(), shards);
        dataset.write(folder.path())?;
        self.dataset = dataset;
        Ok(Outcome::Extracted(Box::new(entry)))
    }
}

/// The data set in `out`, or a new one.
fn open_dataset(out: &Path, settings: Settings) -> Result<Dataset, Error> {
    let there = match Dataset::read(out) {
        Ok(there) => there,
        Err(shard::Error::NoDataset { .. }) => return Ok(Dataset::new(settings)),
        Err(error) => return Err(error.into()),
    };
    if there.settings == settings {
        return Ok(there);
    }
    let texts = [&there.settings, &settings].map(|s| serde_json::to_value(s).unwrap_or_default());
    let differ = texts[0]
        .as_object()
        .into_iter()
        .flatten()
        .filter_map(|(name, old)| {
            let new = &texts[1][name];
            (old != new).then(|| format!("{name} {old} there, {new} now"))
        });
    Err(Error::OtherSettings {
        out: out.to_owned(),
        differ: differ.collect::<Vec<_>>().join("; "),
    })
}

/// Why a recording, or all of them, could not be extracted.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An option is out of range.
    #[error("{name} is {value}: give {allowed}")]
    Option {
        /// The option.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The data set that stands there was made otherwise.
    #[error(
        "{out} holds a data set with other settings ({differ}): give the same ones, or another folder"
    )]
    OtherSettings {
        /// The output folder.
        out: PathBuf,
        /// The settings that differ.
        differ: String,
    },
    /// Two recordings of one name.
    #[error(
        "another recording of this call is named {0} too: extract them into different folders, or rename one"
    )]
    SameName(String),
    /// No mask.
    #[error("{0} has no mask: make one with relit-mask, or name one with --mask")]
    NoMask(PathBuf),
    /// The mask that was named is not there.
    #[error("there is no mask {0}: make one with relit-mask, or correct the name given to --mask")]
    MaskNotThere(PathBuf),
    /// The frame index and the video do not belong together.
    #[error(
        "frames.jsonl has {lines} lines and the video has {frames} frames, and their time stamps do not match: give the video file itself to go on without angles"
    )]
    IndexMismatch {
        /// Lines of the index.
        lines: u64,
        /// Frames of the video.
        frames: u64,
    },
    /// The mask cannot be read.
    #[error("the mask {path} cannot be read as an image ({source}): give a PNG")]
    Mask {
        /// The mask's path.
        path: PathBuf,
        /// The decoder's word.
        source: image::ImageError,
    },
    /// The mask is of another size than the frames.
    #[error(
        "the mask {path} is {} x {} pixels and the frames are {} x {}: make the mask on a frame of this video",
        mask.0, mask.1, frame.0, frame.1
    )]
    MaskSize {
        /// The mask's path.
        path: PathBuf,
        /// The mask's width and height.
        mask: (u32, u32),
        /// The frames' width and height.
        frame: (u32, u32),
    },
    /// Nothing in the mask.
    #[error(
        "the mask {0} is empty: not one of its pixels is 128 or brighter and opaque; make it again with relit-mask, or paint the object white"
    )]
    EmptyMask(PathBuf),
    /// The object vanishes when scaled.
    #[error(
        "the object is too small: at {side} pixels no pixel of the output would be its own; give a larger --size or a smaller --margin"
    )]
    ObjectTooSmall {
        /// The output's side, pixels.
        side: u32,
    },
    /// The crop does not fit into memory.
    #[error("a crop of {} x {} pixels is larger than can be worked on: give a smaller --margin", .0.w, .0.h)]
    CropTooLarge(Rect),
    /// Scaling failed.
    #[error("a frame could not be scaled: {0}")]
    Scaling(String),
    /// No frame can be decoded.
    #[error("no frame of the video can be decoded: record it again, or give another file")]
    NoFrameLeft,
    /// One frame is no turn.
    #[error("the video has one usable frame only: this is no turn; give a recording of one")]
    OneFrame,
    /// Another video of this name is in the data set.
    #[error(
        "{out} holds a session {id} of another video: extract into another folder, rename the input, or give --replace"
    )]
    NameTaken {
        /// The output folder.
        out: PathBuf,
        /// The session's id.
        id: String,
    },
    /// The output folder is a session's.
    #[error("{0} is a session's folder: give another one for the data set")]
    IntoSession(PathBuf),
    /// The table did not turn.
    #[error(
        "the table turned by {degrees:.2} degrees only: this is no turn; to spread the frames over time, give the video file itself"
    )]
    TableStands {
        /// Angle from the first frame to the last, degrees.
        degrees: f64,
    },
    /// With `strict`: something is not as it should be.
    #[error("refused by --strict: {0}")]
    Strict(String),
    /// The recording cannot be used.
    #[error(transparent)]
    Session(#[from] session::Error),
    /// The video cannot be used.
    #[error(transparent)]
    Video(#[from] video::VideoError),
    /// A frame cannot be converted.
    #[error(
        "frame {number}: {fault}; convert the video to another pixel format, for example with ffmpeg"
    )]
    Frame {
        /// The frame.
        number: u64,
        /// What is wrong with it.
        fault: video::DecodeFault,
    },
    /// The data set cannot be written.
    #[error(transparent)]
    Shard(#[from] shard::Error),
    /// The report cannot be made.
    #[error(transparent)]
    Report(#[from] report::Error),
    /// The threads cannot be started.
    #[error("the worker threads could not be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The video cannot be read for its hash.
    #[error("{path} could not be read: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
}
