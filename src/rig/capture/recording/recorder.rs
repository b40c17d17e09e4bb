//! Recording one turn: a thread that reads the camera, a bounded queue, and a thread that writes.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use super::camera_thread::CameraThread;
use super::error::RecordingError;
use super::outcome::{CameraOutcome, WriterOutcome};
use super::progress::{Progress, Shared};
use super::verdict::Recorded;
use super::window::Window;
use super::writer_thread::WriterThread;
use crate::camera::{Camera, GrantedMode};
use crate::clock::{Clock, JoinHandle};
use crate::preview::Preview;
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
    /// Frames a second; where the camera does not say, as asked for.
    pub fps: f64,
    /// When the turn is, where that is known in advance: see [`Recorder::announce`].
    pub window: Option<Window>,
    /// Dropped or damaged frames up to which a take is accepted.
    pub max_dropped: u64,
    /// How long a frame may wait for a place in the queue before it is dropped. A camera does not
    /// wait: zero. A replay does.
    pub queue_wait: Duration,
    /// Without a frame for so long, by the clock, the camera counts as failed.
    pub stall: Duration,
    /// The clock that the camera's frames are stamped with.
    pub clock: Clock,
    /// Where every frame is shown.
    pub preview: Option<Preview>,
}

type CameraHandle = JoinHandle<(Box<dyn Camera>, CameraOutcome)>;
type WriterHandle = thread::JoinHandle<WriterOutcome>;

/// A recording under way. Dropped, it is asked to stop, and its session is left to be salvaged.
pub struct Recorder {
    shared: Arc<Shared>,
    folder: PathBuf,
    threads: Option<(CameraHandle, WriterHandle)>,
    max_dropped: u64,
}

impl Recorder {
    /// Makes the session's folder and begins to take frames of a camera that was started.
    ///
    /// # Errors
    /// [`RecordingError::Format`], [`RecordingError::Rate`], [`RecordingError::Thread`], or what
    /// making the session's folder and video answers.
    pub fn start(camera: Box<dyn Camera>, plan: Plan) -> Result<Self, RecordingError> {
        if !(plan.fps.is_finite() && plan.fps > 0.0) {
            return Err(RecordingError::Rate(plan.fps));
        }
        let fourcc = plan.mode.fourcc;
        let format = fourcc.pixel_format();
        let stream = StreamFormat {
            format: format.ok_or(RecordingError::Format(fourcc))?,
            width: plan.mode.width,
            height: plan.mode.height,
            fps: plan.fps,
        };
        let mut manifest = plan.manifest;
        fill_in(&mut manifest, &stream, &plan.mode);
        let session = SessionWriter::create(&plan.root, manifest)?;
        let folder = session.folder().to_owned();
        let shared = Arc::new(Shared::new(&plan.clock, plan.preview, plan.window));
        let (sender, queue) = crossbeam_channel::bounded(queue_places(&stream));
        let writer = WriterThread::new(stream, session, queue, Arc::clone(&shared))?;
        let (stall, wait) = (plan.stall, plan.queue_wait);
        let camera = CameraThread::new(camera, &stream, stall, wait, sender, Arc::clone(&shared));
        // The disk goes by real time: only the camera's thread takes part in the clock.
        let refused = |what| move |source| RecordingError::Thread { what, source };
        let thread = thread::Builder::new().name("relit-writer".to_owned());
        let writer = thread.spawn(move || writer.run());
        let writer = writer.map_err(refused("writer"))?;
        let camera = plan.clock.spawn("relit-camera", move || camera.run());
        let camera = camera.map_err(refused("camera"))?;
        Ok(Self {
            shared,
            folder,
            threads: Some((camera, writer)),
            max_dropped: plan.max_dropped,
        })
    }

    /// Sets when the turn is. It may have begun up to four seconds ago: so long frames are kept.
    /// Only the first window counts.
    pub fn announce(&self, window: Window) {
        self.shared.control.lock().window.get_or_insert(window);
    }

    /// Asks the recording to stop, and returns at once.
    pub fn stop(&self) {
        self.shared.control.lock().stop = true;
    }

    /// The session folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Waits until nothing more is recorded, or `timeout` is over; true where it has ended.
    #[must_use]
    pub fn wait_ended(&self, timeout: Duration) -> bool {
        let control = &self.shared.control;
        let ended = control.wait_for(timeout, |control| control.progress.ended.then_some(()));
        ended.is_some()
    }

    /// How far it has come.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.shared.control.lock().progress
    }

    /// Waits until the turn is over, something ends the recording, or it is stopped; gives the
    /// camera back, still started.
    ///
    /// # Errors
    /// [`RecordingError::Panicked`].
    pub fn wait(mut self) -> Result<(Box<dyn Camera>, Recorded), RecordingError> {
        let panicked = RecordingError::Panicked;
        let (camera, writer) = self.threads.take().ok_or(panicked("recorder"))?;
        let (camera, filmed) = camera.join().map_err(|_| panicked("camera"))?;
        let written = writer.join().map_err(|_| panicked("writer"))?;
        Ok((camera, Recorded::new(filmed, written, self.max_dropped)))
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.stop();
    }
}

/// How many frames may wait for the disk, by the largest that they can reasonably be.
fn queue_places(stream: &StreamFormat) -> usize {
    let pixels = stream.width as usize * stream.height as usize;
    let uncompressed = stream.format.frame_bytes(stream.width, stream.height);
    let (fewest, most) = QUEUE_FRAMES;
    (QUEUE_BYTES / uncompressed.unwrap_or(pixels).max(1)).clamp(fewest, most)
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
