//! The thread that owns the library's camera.
//!
//! The library waits for a frame without a time limit, and parts of it panic when a device is
//! unplugged. So its camera is owned by a separate thread, which executes jobs and, while it streams,
//! reads frames in between. Callers wait with a time limit; a thread that hangs in the library is
//! abandoned.

use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel,
};
use std::thread;
use std::time::Duration;

use ::nokhwa::utils::{CameraFormat, FrameFormat, RequestedFormat, RequestedFormatType};
use ::nokhwa::{Camera as Library, NokhwaError};

use super::fourcc;
use crate::{CameraError, Fourcc, Frame};
use relit_data::clock::Clock;
use relit_data::session::FrameClock;
use relit_data::still::jpeg;

/// Longest wait for a job.
const ANSWERING: Duration = Duration::from_secs(10);
/// Longest wait for the library to close a camera.
const CLOSING: Duration = Duration::from_secs(2);

/// A frame, or why there is none.
pub(super) type FrameResult = Result<Frame, NokhwaError>;

type Job = Box<dyn FnOnce(&mut WorkerThread) + Send>;

/// The caller's side.
pub(super) struct WorkerHandle {
    device: String,
    jobs: Option<SyncSender<Job>>,
    /// Is closed when the thread has closed the camera.
    ended: Receiver<()>,
}

/// The thread's side.
pub(super) struct WorkerThread {
    pub(super) library: Library,
    stream: Option<Stream>,
}

struct Stream {
    frames: SyncSender<FrameResult>,
    format: CameraFormat,
    fourcc: Fourcc,
}

impl WorkerHandle {
    /// Starts the thread, which opens the camera.
    pub(super) fn start(
        device: String,
        open: impl FnOnce() -> Result<Library, NokhwaError> + Send + 'static,
    ) -> Result<Self, CameraError> {
        let (jobs, queue) = sync_channel(1);
        let (opened, answer) = sync_channel(1);
        let (running, ended) = sync_channel::<()>(0);
        let work = move || {
            // Dropped last, when the camera is closed.
            let _running = running;
            match open() {
                Ok(library) => {
                    let _ = opened.send(Ok(()));
                    let stream = None;
                    WorkerThread { library, stream }.run(&queue);
                }
                // The receiver is gone if opening took too long.
                Err(error) => drop(opened.send(Err(error))),
            }
        };
        let doing = "it was opened";
        let spawned = thread::Builder::new().name("nokhwa".to_owned()).spawn(work);
        spawned.map_err(|error| failed(&device, doing, error))?;
        let worker = Self {
            device,
            jobs: Some(jobs),
            ended,
        };
        worker.wait(doing, &answer)?;
        Ok(worker)
    }

    /// Executes a job on the thread, and waits for its result.
    pub(super) fn ask<T: Send + 'static>(
        &self,
        doing: &'static str,
        work: impl FnOnce(&mut WorkerThread) -> Result<T, NokhwaError> + Send + 'static,
    ) -> Result<T, CameraError> {
        let (reply, answer) = sync_channel(1);
        let job: Job = Box::new(move |owner| drop(reply.send(work(owner))));
        let sent = self.jobs.as_ref().map(|jobs| jobs.try_send(job));
        match sent {
            Some(Ok(())) => self.wait(doing, &answer),
            // The job before this one never ended.
            Some(Err(TrySendError::Full(_))) => Err(failed(&self.device, doing, "it hangs")),
            Some(Err(TrySendError::Disconnected(_))) | None => Err(self.gone()),
        }
    }

    fn wait<T>(
        &self,
        doing: &'static str,
        answer: &Receiver<Result<T, NokhwaError>>,
    ) -> Result<T, CameraError> {
        match answer.recv_timeout(ANSWERING) {
            Ok(answer) => answer.map_err(|error| self.failed(doing, error)),
            Err(RecvTimeoutError::Timeout) => {
                let waited = format!("it did not answer for {} s", ANSWERING.as_secs());
                Err(failed(&self.device, doing, waited))
            }
            Err(RecvTimeoutError::Disconnected) => Err(self.gone()),
        }
    }

    /// The error of a thread that is over: the library panicked, as it does when a device goes away.
    pub(super) fn gone(&self) -> CameraError {
        CameraError::Unplugged {
            device: self.device.clone(),
            source: None,
        }
    }

    pub(super) fn failed(&self, doing: &'static str, error: NokhwaError) -> CameraError {
        failed(&self.device, doing, error)
    }
}

impl Drop for WorkerHandle {
    fn drop(&mut self) {
        self.jobs = None;
        let _ = self.ended.recv_timeout(CLOSING);
    }
}

fn failed(
    device: &str,
    doing: &'static str,
    source: impl Into<Box<dyn std::error::Error + Send + Sync>>,
) -> CameraError {
    CameraError::Refused {
        device: device.to_owned(),
        doing,
        source: source.into(),
    }
}

impl WorkerThread {
    /// Executes jobs, and reads frames in between, until the caller's side is dropped.
    fn run(mut self, queue: &Receiver<Job>) {
        loop {
            let job = match &self.stream {
                Some(_) => queue.try_recv(),
                None => queue.recv().map_err(|_| TryRecvError::Disconnected),
            };
            match job {
                Ok(job) => job(&mut self),
                Err(TryRecvError::Empty) => self.take_frame(),
                Err(TryRecvError::Disconnected) => return,
            }
        }
    }

    /// Starts the stream; its frames go to `frames`.
    pub(super) fn start(
        &mut self,
        wanted: CameraFormat,
        frames: SyncSender<FrameResult>,
    ) -> Result<CameraFormat, NokhwaError> {
        let formats = [wanted.format()];
        let exact = RequestedFormatType::Exact(wanted);
        let request = RequestedFormat::with_formats(exact, &formats);
        self.library.set_camera_requset(request)?;
        self.library.open_stream()?;
        let format = self.library.camera_format();
        let fourcc = fourcc(format.format()).ok_or_else(|| {
            NokhwaError::OpenStreamError(format!("it gives {} frames", format.format()))
        })?;
        self.stream = Some(Stream {
            frames,
            format,
            fourcc,
        });
        Ok(format)
    }

    pub(super) fn stop(&mut self) -> Result<(), NokhwaError> {
        match self.stream.take() {
            Some(_) => self.library.stop_stream(),
            None => Ok(()),
        }
    }

    /// Reads the next frame. It is dropped if the queue is full: waiting for a place would delay the
    /// next frames' time stamps.
    fn take_frame(&mut self) {
        let Some(stream) = &self.stream else {
            return;
        };
        let frame = self.library.frame().map(|buffer| {
            let t_us = Clock::monotonic().now_us();
            stream.frame(buffer.buffer(), t_us)
        });
        let broken = frame.is_err();
        let sent = stream.frames.try_send(frame);
        if broken || matches!(sent, Err(TrySendError::Disconnected(_))) {
            // An error of stopping shows again at the next start.
            let _ = self.stop();
        }
    }
}

impl Stream {
    fn frame(&self, data: &[u8], t_us: i64) -> Frame {
        // With V4L2, the library returns the whole buffer: after a JPEG follow older data.
        let used = match self.format.format() {
            FrameFormat::MJPEG => jpeg::length(data).unwrap_or(data.len()),
            _ => data.len(),
        };
        Frame {
            fourcc: self.fourcc,
            width: self.format.width(),
            height: self.format.height(),
            data: data[..used].to_vec(),
            sequence: None,
            t_us,
            clock: FrameClock::Host,
            flagged: false,
        }
    }
}
