//! Figures for Prometheus, in its text format 0.0.4.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::answer::Problem;
use super::server::Server;
use crate::capture::state::{Phase, RigState};

const PHASES: [Phase; 9] = [
    Phase::Idle,
    Phase::Preflight,
    Phase::Metering,
    Phase::MovingBack,
    Phase::Starting,
    Phase::Recording,
    Phase::Unwinding,
    Phase::Checking,
    Phase::WaitingForObject,
];

/// Answers counted by the first digit of their status, 2 to 5.
#[derive(Debug, Default)]
pub(super) struct Counts {
    answers: [AtomicU64; 4],
}

impl Counts {
    pub(super) fn answered(&self, status: StatusCode) {
        let class = usize::from(status.as_u16() / 100).saturating_sub(2);
        if let Some(count) = self.answers.get(class) {
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Figures for Prometheus
#[utoipa::path(
    get, path = "/metrics", tag = "metrics",
    responses(
        (status = 200, body = String, content_type = "text/plain"),
        (status = 401, body = Problem),
    )
)]
pub(super) async fn metrics(State(server): State<Arc<Server>>) -> Response {
    let mut page = Page::default();
    rig(&mut page, &server.watcher.seen().state);
    page.head("relit_http_responses_total", "counter", "Answers by class");
    for (count, class) in server.counts.answers.iter().zip(2..) {
        let label = format!("{{class=\"{class}xx\"}}");
        page.line("relit_http_responses_total", &label, load(count));
    }
    let (limits, places) = (&server.limits, &server.places);
    for (name, most, places) in [
        ("connections", limits.connections, &places.connections),
        ("viewers", limits.viewers, &places.viewers),
        ("subscribers", limits.subscribers, &places.subscribers),
    ] {
        let taken = most.saturating_sub(places.available_permits());
        let name = format!("relit_http_{name}");
        page.gauge(&name, "Clients now", Some(taken as f64));
    }
    let kind = "text/plain; version=0.0.4; charset=utf-8";
    ([(header::CONTENT_TYPE, kind)], page.0).into_response()
}

fn rig(page: &mut Page, state: &RigState) {
    page.head(
        "relit_phase",
        "gauge",
        "1 for the phase that the capture is in",
    );
    for phase in PHASES {
        let name = serde_json::to_string(&phase).unwrap_or_default();
        let here = f64::from(u8::from(phase == state.phase));
        page.line("relit_phase", &format!("{{phase={name}}}"), here);
    }
    let yes = |is: bool| Some(f64::from(u8::from(is)));
    let (table, camera) = (&state.table, &state.camera);
    let last = state.last_take.as_ref();
    for (name, help, value) in [
        (
            "take_frames",
            "Frames written of the present take",
            Some(state.frames as f64),
        ),
        (
            "take_frames_wanted",
            "Frames that the present take shall have",
            Some(state.frames_wanted as f64),
        ),
        (
            "take_frames_dropped",
            "Frames missing of the present take so far",
            Some(state.dropped as f64),
        ),
        (
            "last_take_frames",
            "Frames of the last take",
            last.map(|take| take.frames as f64),
        ),
        (
            "last_take_frames_dropped",
            "Frames missing of the last take",
            last.map(|take| take.dropped as f64),
        ),
        (
            "queue_objects",
            "Objects that wait",
            Some(state.queue.len() as f64),
        ),
        (
            "faults_shown",
            "Faults in the list on the page",
            Some(state.faults.len() as f64),
        ),
        (
            "disk_free_bytes",
            "Bytes free where sessions are written",
            Some(state.free_bytes as f64),
        ),
        (
            "disk_needed_bytes",
            "Bytes that a take is expected to need",
            Some(state.needed_bytes as f64),
        ),
        (
            "table_present",
            "1 where there is a table",
            yes(table.present),
        ),
        (
            "table_homed",
            "1 where the table's zero is known",
            yes(table.homed),
        ),
        (
            "table_faulty",
            "1 where something is wrong with the table",
            yes(table.fault.is_some()),
        ),
        (
            "table_angle_degrees",
            "Angle from machine zero",
            table.angle_deg,
        ),
        (
            "table_degrees_per_second",
            "Speed of the table",
            table.degrees_per_second,
        ),
        (
            "table_battery_volts",
            "Battery of the table",
            table.battery_v,
        ),
        (
            "camera_present",
            "1 where the camera can be reached",
            yes(camera.present),
        ),
        (
            "camera_faulty",
            "1 where something is wrong with the camera",
            yes(camera.fault.is_some()),
        ),
        (
            "camera_frames_per_second",
            "Frames over the last second",
            camera.fps,
        ),
        (
            "camera_clipped_ratio",
            "Pixels of the newest frame that are clipped, 0 to 1",
            camera.clipped,
        ),
        (
            "camera_focus",
            "Variance of the Laplacian in the middle of the newest frame",
            camera.focus,
        ),
    ] {
        page.gauge(&format!("relit_{name}"), help, value);
    }
}

fn load(count: &AtomicU64) -> f64 {
    count.load(Ordering::Relaxed) as f64
}

#[derive(Default)]
struct Page(String);

impl Page {
    fn head(&mut self, name: &str, kind: &str, help: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "# HELP {name} {help}.\n# TYPE {name} {kind}");
    }

    fn line(&mut self, name: &str, labels: &str, value: f64) {
        let _ = writeln!(self.0, "{name}{labels} {value}");
    }

    /// A figure that is not known is left out.
    fn gauge(&mut self, name: &str, help: &str, value: Option<f64>) {
        if let Some(value) = value {
            self.head(name, "gauge", help);
            self.line(name, "", value);
        }
    }
}
