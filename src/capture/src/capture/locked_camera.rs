//! A camera that streams in its mode with its settings locked: only the light may change during a
//! turn.

use std::time::Duration;

use super::error::CaptureError;
use super::settings::Settings;
use super::stop::StopRequest;
use crate::state::Check;
use relit_camera::manual_controls::{ControlDrift, ManualPlan};
use relit_camera::{Camera, CameraError, CameraMode, Control, Fourcc};
use relit_data::session::FrameClock;
use relit_video::StreamFormat;

/// How long the first frame may take.
const FIRST_FRAME: Duration = Duration::from_secs(5);
/// Without a frame for so long a camera counts as failed.
pub(super) const NEXT_FRAME: Duration = Duration::from_secs(2);
/// Frames read before settings are locked: as many as an automatic needs to find its values.
const WARM_UP: usize = 30;
/// Frames until new settings have effect.
const SETTLING: usize = 10;
/// Bytes of a frame's line in the index.
const INDEX_LINE: f64 = 90.0;
/// Bytes of the manifest and of the video's own tables.
const OVERHEAD: f64 = 1e6;

/// What a camera was set to, and delivers.
pub(super) struct LockedCamera {
    /// What it delivers: at the rate that was granted, or asked for where the camera does not say.
    pub(super) stream: StreamFormat,
    /// The same by its four-character code.
    pub(super) fourcc: Fourcc,
    /// The settings that lock it.
    pub(super) plan: ManualPlan,
    /// All controls, as read back.
    pub(super) controls: Vec<Control>,
    /// What stamps its frames.
    pub(super) clock: FrameClock,
    /// Mean size of a frame, bytes.
    pub(super) frame_bytes: f64,
    /// What was found.
    pub(super) checks: Vec<Check>,
}

impl LockedCamera {
    /// Starts the camera in the preferred mode, reads its first frames, and locks its settings.
    pub(super) fn lock(
        camera: &mut dyn Camera,
        settings: &Settings,
        stop: &StopRequest,
    ) -> Result<Self, CaptureError> {
        let request = settings.mode.choose(&camera.modes()?)?;
        let mode = camera.start(&request)?;
        let mut checks = vec![mode_check(&request, &mode)?];
        let frame_bytes = warm_up(camera, stop)?;
        let plan = ManualPlan::new(&camera.controls()?, &settings.wanted);
        let not_held = plan.without(&settings.wanted);
        if !not_held.is_empty() {
            return Err(CaptureError::Refused(format!(
                "the camera cannot be set to {}: leave that out, or set it at the camera",
                not_held.join(", ")
            )));
        }
        require_kept(plan.apply(camera)?)?;
        let mut clock = FrameClock::default();
        for _ in 0..SETTLING {
            stop.check()?;
            clock = camera.next_frame(NEXT_FRAME)?.clock;
        }
        let controls = camera.controls()?;
        require_kept(plan.check(&controls))?;
        checks.extend(settings_check(&plan));
        let warning = plan.warning();
        checks.extend(warning.map(|warning| Check::noted("camera settings", warning)));
        let device = camera.info().address.to_string();
        let fourcc = mode.fourcc;
        let format = fourcc.pixel_format();
        let stream = StreamFormat {
            format: format.ok_or_else(|| CameraError::format(device, fourcc))?,
            width: mode.width,
            height: mode.height,
            fps: mode.rate.per_second(),
        };
        Ok(Self {
            stream,
            fourcc,
            plan,
            controls,
            clock,
            frame_bytes,
            checks,
        })
    }

    /// Bytes that so many frames are expected to take on disk.
    pub(super) fn bytes_for(&self, frames: u64) -> u64 {
        let each = self.frame_bytes + INDEX_LINE;
        (frames as f64 * each + OVERHEAD).ceil() as u64
    }
}

fn require_kept(moved: Vec<ControlDrift>) -> Result<(), CaptureError> {
    if moved.is_empty() {
        Ok(())
    } else {
        let moved: Vec<String> = moved.iter().map(ControlDrift::to_string).collect();
        Err(CaptureError::Refused(format!(
            "the camera does not keep its settings: {}; close other programs that use it, or give values that it takes",
            moved.join(", ")
        )))
    }
}

fn mode_check(request: &CameraMode, mode: &CameraMode) -> Result<Check, CaptureError> {
    let differences = mode.differences(request);
    if !differences.is_empty() {
        return Err(CaptureError::Refused(format!(
            "the camera grants {}: ask for a mode that `relit-capture devices` lists",
            differences.join(", ")
        )));
    }
    Ok(Check::passed("camera mode", mode.to_string()))
}

/// Reads the first frames, while automatics find their values; returns the mean size of those that
/// are whole.
fn warm_up(camera: &mut dyn Camera, stop: &StopRequest) -> Result<f64, CaptureError> {
    let mut sizes = Vec::new();
    let mut last_fault = None;
    for n in 0..WARM_UP {
        stop.check()?;
        let frame = camera.next_frame(if n == 0 { FIRST_FRAME } else { NEXT_FRAME })?;
        match frame.fault() {
            // The first frames after a start may be cut: that is no fault of the camera.
            Some(fault) => last_fault = Some(fault),
            None => sizes.push(frame.data.len() as f64),
        }
    }
    match last_fault.filter(|_| sizes.is_empty()) {
        Some(fault) => Err(CaptureError::Refused(format!(
            "the camera's first {WARM_UP} frames were damaged ({fault}): check its cable, or ask for another mode"
        ))),
        None => Ok(sizes.iter().sum::<f64>() / sizes.len() as f64),
    }
}

/// The controls that are held; `None` if there are none: the plan says what is not held.
fn settings_check(plan: &ManualPlan) -> Option<Check> {
    let steps = plan.steps.iter();
    let held: Vec<String> = steps
        .map(|step| format!("{} {}", step.name, step.value))
        .collect();
    (!held.is_empty()).then(|| Check::passed("camera settings", held.join(", ")))
}
