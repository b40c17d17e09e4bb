//! Recording one turn: a thread that has the camera, a bounded queue, and a thread that writes.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::film::{Film, Filmed};
use super::sink::{Sink, Sunk};
use super::take::{End, Report, Verdict};
use super::window::Chosen;
use super::{Error, Preview, Window};
use crate::camera::{Camera, GrantedMode};
use relit_data::session::{Fault, Manifest, SessionWriter};
use relit_video::{PixelFormat, StreamFormat};

/// Name of the video in a session folder.
const VIDEO_FILE: &str = "video.mkv";
/// Most bytes that may wait for the disk.
const QUEUE_BYTES: usize = 192 << 20;
/// Fewest and most frames that may wait for the disk.
const QUEUE_FRAMES: (usize, usize) = (8, 256);

/// What is to be recorded, and where.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The folder of sessions.
    pub root: PathBuf,
    /// What is known of the session at its start. Format, size, rate and video are filled in.
    pub manifest: Manifest,
    /// What the camera delivers since it was started.
    pub mode: GrantedMode,
    /// Frames a second; where the camera said none, as asked for.
    pub fps: f64,
    /// When the turn is, where that is known before: see [`Recorder::announce`].
    pub window: Option<Window>,
    /// Dropped or damaged frames up to which a take counts.
    pub max_dropped: u64,
    /// What to do with a frame for which the disk has no time.
    pub when_full: WhenFull,
    /// Without a frame for so long the camera counts as failed.
    pub stall: Duration,
}

/// What to do with a frame for which the disk has no time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhenFull {
    /// Drop it and say so: a camera does not wait.
    Drop,
    /// Let the camera wait, for a minute at most: a replay as fast as it is read does.
    Wait,
}

/// How far a recording has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The turn has not begun, or was not announced.
    Waiting,
    /// Frames of the turn are being recorded.
    Recording,
    /// Nothing more is recorded: [`Recorder::wait`] comes back soon.
    Ended,
}

/// Figures of a recording under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// How far it is.
    pub stage: Stage,
    /// Frames in the video.
    pub frames: u64,
    /// Bytes of video.
    pub bytes: u64,
    /// Frames that came while the disk was too slow to take them.
    pub overrun: u64,
}

/// What the threads and the owner share.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub(super) preview: Preview,
    announced: Mutex<Option<Window>>,
    stop: AtomicBool,
    stage: AtomicU8,
    frames: AtomicU64,
    bytes: AtomicU64,
    overrun: AtomicU64,
}

impl Shared {
    pub(super) fn wrote(&self, frames: u64, bytes: u64) {
        self.frames.store(frames, Ordering::Relaxed);
        self.bytes.store(bytes, Ordering::Relaxed);
    }

    pub(super) fn overran(&self) {
        self.overrun.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn enter(&self, stage: Stage) {
        self.stage.store(stage as u8, Ordering::Relaxed);
    }

    pub(super) fn stop_asked(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The window, once it is announced.
    pub(super) fn window(&self) -> Option<Window> {
        *self
            .announced
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// A recording under way. Dropped, it is asked to stop, and its session is left to be salvaged.
#[derive(Debug)]
pub struct Recorder {
    shared: Arc<Shared>,
    folder: PathBuf,
    threads: Option<(JoinHandle<Filmed>, JoinHandle<Sunk>)>,
    max_dropped: u64,
}

impl Recorder {
    /// Makes the session's folder and begins to take frames of a camera that was started.
    ///
    /// # Errors
    /// [`Error::Format`], [`Error::Rate`], [`Error::Thread`], or what making the session's folder
    /// and video answers.
    pub fn start(camera: Box<dyn Camera>, plan: Plan) -> Result<Self, Error> {
        if !(plan.fps.is_finite() && plan.fps > 0.0) {
            return Err(Error::Rate(plan.fps));
        }
        let format = plan
            .mode
            .fourcc
            .pixel_format()
            .ok_or(Error::Format(plan.mode.fourcc))?;
        let stream = StreamFormat {
            format,
            width: plan.mode.width,
            height: plan.mode.height,
            fps: plan.fps,
        };
        let mut manifest = plan.manifest;
        fill_in(&mut manifest, &stream, &plan.mode);
        let session = SessionWriter::create(&plan.root, manifest)?;
        let folder = session.folder().to_owned();
        let sink = Sink::new(stream, session)?;
        let shared = Arc::new(Shared {
            announced: Mutex::new(plan.window),
            ..Shared::default()
        });
        let (sender, queue) = sync_channel(queue_places(&stream));
        let film = Film::new(camera, &stream, plan.stall, plan.when_full);
        let threads = spawn(film, sink, sender, queue, &shared)?;
        Ok(Self {
            shared,
            folder,
            threads: Some(threads),
            max_dropped: plan.max_dropped,
        })
    }

    /// Says when the turn is. It may have begun up to four seconds ago: so long frames are kept. Only
    /// the first window counts.
    pub fn announce(&self, window: Window) {
        let announced = &self.shared.announced;
        let mut announced = announced.lock().unwrap_or_else(PoisonError::into_inner);
        announced.get_or_insert(window);
    }

    /// Asks the recording to stop, and comes back at once.
    pub fn stop(&self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }

    /// The session folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The newest frame, for viewers.
    #[must_use]
    pub fn preview(&self) -> &Preview {
        &self.shared.preview
    }

    /// How far it has come.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let number = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let stage = match self.shared.stage.load(Ordering::Relaxed) {
            0 => Stage::Waiting,
            1 => Stage::Recording,
            _ => Stage::Ended,
        };
        Progress {
            stage,
            frames: number(&self.shared.frames),
            bytes: number(&self.shared.bytes),
            overrun: number(&self.shared.overrun),
        }
    }

    /// Waits until the turn is over, something ends the recording, or it is stopped; gives the
    /// camera back, still started.
    ///
    /// # Errors
    /// [`Error::Broken`].
    pub fn wait(mut self) -> Result<(Box<dyn Camera>, Ended), Error> {
        let (film, sink) = self.threads.take().ok_or(Error::Broken("recorder"))?;
        let filmed = film.join().map_err(|_| Error::Broken("camera's thread"))?;
        let sunk = sink.join().map_err(|_| Error::Broken("writer's thread"))?;
        let ended = Ended {
            end: filmed.end,
            verdict: Verdict {
                max_dropped: self.max_dropped,
                count: filmed.count,
                damaged: filmed.damaged,
                overrun: filmed.overrun,
                empty: filmed.empty,
            },
            sunk,
        };
        Ok((filmed.camera, ended))
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.stop();
    }
}

/// A recording to which nothing is added any more, and whose session is not closed yet.
pub struct Ended {
    end: End,
    verdict: Verdict,
    sunk: Sunk,
}

impl std::fmt::Debug for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Ended({:?}, {} frames)",
            self.end,
            self.sunk.places.len()
        )
    }
}

impl Ended {
    /// Why it ended.
    #[must_use]
    pub fn end(&self) -> &End {
        &self.end
    }

    /// Says that something else than the recorder ended the take, which is bad then, for this
    /// reason.
    #[must_use]
    pub fn because_of(mut self, reason: String) -> Self {
        self.end = End::Elsewhere(reason);
        self
    }

    /// Closes the session: gives each frame the angle that `angle` (degrees) answers for its time
    /// stamp (microseconds), judges the take, and writes the manifest. `moved`: what changed on the
    /// camera since the start, a sentence each.
    ///
    /// # Errors
    /// What closing the session answers; its status stays "recording" then, and it can be salvaged.
    pub fn finish(
        self,
        angle: &dyn Fn(i64) -> Option<f64>,
        moved: &[String],
    ) -> Result<Report, Error> {
        self.verdict.close(self.end, self.sunk, angle, moved)
    }
}

fn spawn(
    film: Film,
    sink: Sink,
    sender: SyncSender<Chosen>,
    queue: Receiver<Chosen>,
    shared: &Arc<Shared>,
) -> Result<(JoinHandle<Filmed>, JoinHandle<Sunk>), Error> {
    let refused = |what| move |source| Error::Thread { what, source };
    let of_sink = Arc::clone(shared);
    let writer = thread::Builder::new()
        .name("relit-writer".to_owned())
        .spawn(move || sink.run(&queue, &of_sink))
        .map_err(refused("disk"))?;
    let of_film = Arc::clone(shared);
    let camera = thread::Builder::new()
        .name("relit-camera".to_owned())
        .spawn(move || film.run(&sender, &of_film))
        .map_err(refused("camera"))?;
    Ok((camera, writer))
}

/// How many frames may wait for the disk, by the largest that they can reasonably be.
fn queue_places(stream: &StreamFormat) -> usize {
    let pixels = stream.width as usize * stream.height as usize;
    let uncompressed = stream.format.frame_bytes(stream.width, stream.height);
    let frame = uncompressed.unwrap_or(pixels);
    let (fewest, most) = QUEUE_FRAMES;
    (QUEUE_BYTES / frame.max(1)).clamp(fewest, most)
}

/// What the stream makes known of the session.
fn fill_in(manifest: &mut Manifest, stream: &StreamFormat, mode: &GrantedMode) {
    manifest.camera.fourcc = mode.fourcc.to_string();
    manifest.camera.width = stream.width;
    manifest.camera.height = stream.height;
    manifest.camera.fps = stream.fps;
    manifest.video.file = VIDEO_FILE.to_owned();
    manifest.video.codec = stream.format.codec().to_owned();
    if let PixelFormat::Bayer(colours) = stream.format {
        manifest.faults.push(Fault {
            t_us: 0,
            what: format!("the sensor's mosaic ({colours}) is kept as a grey picture"),
        });
    }
}
