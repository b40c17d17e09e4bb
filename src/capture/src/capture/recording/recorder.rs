//! Recording one turn: a thread that reads the camera, a bounded queue, and a thread that writes.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crossbeam_channel::Sender;

use super::camera_thread::CameraThread;
use super::environment_light::EnvironmentLight;
use super::error::RecordingError;
use super::outcome::{CameraOutcome, WriterOutcome};
use super::progress::{Progress, Shared, State, Window};
use super::trimmer::{KeyFrameCheck, Trimmer};
use super::verdict::FinishedRecording;
use super::writer_thread::{JournalLine, WriterThread};
use crate::preview::Preview;
use relit_camera::Camera;
use relit_data::clock::{Clock, JoinHandle};
use relit_data::session::{Fault, Manifest, SessionWriter};
use relit_data::turn_motion::{JournaledReport, JournaledTurn};
use relit_video::{Muxer, PixelFormat, StreamFormat, is_key};

/// Name of the video in a session folder.
const VIDEO_FILE: &str = "video.mkv";
/// Most bytes that may wait for the disk.
const QUEUE_BYTES: usize = 192 << 20;
/// Lines of the journal that may wait for the disk: minutes of reports.
const JOURNAL_LINES: usize = 4096;
/// Fewest and most frames that may wait for the disk.
const QUEUE_FRAMES: (usize, usize) = (8, 256);

/// What is to be recorded, and where.
#[derive(Debug, Clone)]
pub struct RecordingPlan {
    /// The folder of sessions.
    pub root: PathBuf,
    /// What is known of the session at its start. The video's file and codec are filled in.
    pub manifest: Manifest,
    /// What the camera delivers since it was started.
    pub stream: StreamFormat,
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

/// A recording under way. Dropped, it is asked to stop, and its session is left to be recovered.
pub struct Recorder {
    shared: Arc<Shared>,
    journal: Sender<JournalLine>,
    threads: Option<(CameraHandle, WriterHandle)>,
    max_dropped: u64,
}

impl Recorder {
    /// Makes the session's folder and begins to take frames of a camera that was started.
    ///
    /// # Errors
    /// [`RecordingError::System`], or what making the session's folder and video answers.
    pub fn start(camera: Box<dyn Camera>, plan: RecordingPlan) -> Result<Self, RecordingError> {
        let (clock, stream) = (plan.clock, plan.stream);
        let session = SessionWriter::create(&plan.root, with_video(plan.manifest, &stream))?;
        let shared = Arc::new(Shared::new(&clock, State::default()));
        let (sender, queue) = crossbeam_channel::bounded(queue_places(&stream));
        let (journal, journal_queue) = crossbeam_channel::bounded(JOURNAL_LINES);
        let writer = WriterThread {
            stream,
            journal: journal_queue,
            muxer: Muxer::create(&session.video_path(), stream)?,
            session,
            delivered: Vec::new(),
            findings: Vec::new(),
            queue,
            light: EnvironmentLight::new(stream),
            shared: Arc::clone(&shared),
        };
        let is_key = (stream.format == PixelFormat::H264).then_some(is_key as KeyFrameCheck);
        let camera = CameraThread {
            camera,
            preview: plan.preview,
            stall: plan.stall,
            queue_wait: plan.queue_wait,
            queue: sender,
            shared: Arc::clone(&shared),
            trimmer: Trimmer::new(stream.fps, is_key),
            findings: Vec::new(),
        };
        // The disk goes by real time: only the camera's thread takes part in the clock.
        let refused = |what| {
            move |source| RecordingError::System {
                what: format!("a thread for the {what} could not be started: close other programs"),
                source,
            }
        };
        let thread = thread::Builder::new().name("relit-writer".to_owned());
        let writer = thread.spawn(move || writer.run());
        let writer = writer.map_err(refused("writer"))?;
        let camera = clock.spawn("relit-camera", move || camera.run());
        let camera = camera.map_err(refused("camera"))?;
        Ok(Self {
            shared,
            journal,
            threads: Some((camera, writer)),
            max_dropped: plan.max_dropped,
        })
    }

    /// Sets when the turn is. It may have begun up to four seconds ago: so long frames are kept.
    /// Only the first window counts.
    pub fn announce(&self, window: Window) {
        self.shared.lock().window.get_or_insert(window);
    }

    /// Writes the turn into the session's journal, from which an interrupted session gets its angles.
    pub fn begin_journal(&self, turn: JournaledTurn) {
        self.note(JournalLine::Turn(turn));
    }

    /// Adds a report of the table to the journal.
    pub fn add_report(&self, report: JournaledReport) {
        self.note(JournalLine::Report(report));
    }

    fn note(&self, line: JournalLine) {
        // The angles follow from the other reports where the disk is that late.
        let _ = self.journal.try_send(line);
    }

    /// Asks the recording to stop, and returns at once.
    pub fn stop(&self) {
        self.shared.lock().stop = true;
    }

    /// Waits until nothing more is recorded, or `timeout` is over; true where it has ended.
    pub fn wait_ended(&self, timeout: Duration) -> bool {
        let ended = |state: &mut State| state.progress.ended.then_some(());
        self.shared.wait_for(timeout, ended).is_some()
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        self.shared.lock().progress
    }

    /// Waits until the turn is over, something ends the recording, or it is stopped; gives the
    /// camera back, still started.
    ///
    /// # Errors
    /// [`RecordingError::Panicked`].
    pub fn wait(mut self) -> Result<(Box<dyn Camera>, FinishedRecording), RecordingError> {
        let panicked = RecordingError::Panicked;
        let (camera, writer) = self.threads.take().ok_or(panicked("recorder"))?;
        let (camera, delivered) = camera.join().map_err(|_| panicked("camera"))?;
        let written = writer.join().map_err(|_| panicked("writer"))?;
        let recorded = FinishedRecording {
            camera: delivered,
            writer: written,
            max_dropped: self.max_dropped,
            note: None,
        };
        Ok((camera, recorded))
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

/// The manifest with what the stream makes known of the video.
fn with_video(mut manifest: Manifest, stream: &StreamFormat) -> Manifest {
    manifest.video.file = VIDEO_FILE.to_owned();
    manifest.video.codec = stream.format.codec().to_owned();
    if let PixelFormat::Bayer(colours) = stream.format {
        let what = format!("the sensor's mosaic ({colours}) is kept as a grey picture");
        manifest.faults.push(Fault { t_us: 0, what });
    }
    manifest
}
