//! Figures for Prometheus, in its text format 0.0.4.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::answer::Problem;
use super::server::Server;
use crate::state::{CameraState, Phase, RigState, TableState};

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
    let help = "1 for the phase that the capture is in";
    page.head("relit_phase", "gauge", help);
    for phase in PHASES {
        let name = serde_json::to_string(&phase).unwrap_or_default();
        let here = f64::from(u8::from(phase == state.phase));
        page.line("relit_phase", &format!("{{phase={name}}}"), here);
    }
    take(page, state);
    table(page, &state.table);
    camera(page, &state.camera);
}

fn take(page: &mut Page, state: &RigState) {
    let mut count = |name, help, value| page.gauge(name, help, Some(value as f64));
    let (frames, dropped) = ("Frames written", "Frames missing");
    count("relit_take_frames", frames, state.frames);
    count(
        "relit_take_frames_wanted",
        "Frames of a whole take",
        state.frames_wanted,
    );
    count("relit_take_frames_dropped", dropped, state.dropped);
    if let Some(last) = &state.last_take {
        count("relit_last_take_frames", frames, last.frames);
        count("relit_last_take_frames_dropped", dropped, last.dropped);
    }
    count(
        "relit_queue_objects",
        "Objects that wait",
        state.queue.len() as u64,
    );
    count(
        "relit_faults_shown",
        "Faults in the list",
        state.faults.len() as u64,
    );
    count(
        "relit_disk_free_bytes",
        "Room for sessions",
        state.free_bytes,
    );
    count(
        "relit_disk_needed_bytes",
        "Expected size of a take",
        state.needed_bytes,
    );
}

fn table(page: &mut Page, table: &TableState) {
    let mut gauge = |name, help, value| page.gauge(name, help, value);
    gauge(
        "relit_table_present",
        "1 where there is a table",
        yes(table.present),
    );
    gauge(
        "relit_table_homed",
        "1 where its zero is known",
        yes(table.homed),
    );
    gauge(
        "relit_table_faulty",
        "1 where something is wrong",
        yes(table.fault.is_some()),
    );
    gauge(
        "relit_table_angle_degrees",
        "From machine zero",
        table.angle_deg,
    );
    gauge(
        "relit_table_degrees_per_second",
        "Speed",
        table.degrees_per_second,
    );
    gauge("relit_table_battery_volts", "Battery", table.battery_v);
}

fn camera(page: &mut Page, camera: &CameraState) {
    let mut gauge = |name, help, value| page.gauge(name, help, value);
    gauge(
        "relit_camera_present",
        "1 where it can be reached",
        yes(camera.present),
    );
    gauge(
        "relit_camera_faulty",
        "1 where something is wrong",
        yes(camera.fault.is_some()),
    );
    gauge(
        "relit_camera_frames_per_second",
        "Over the last second",
        camera.fps,
    );
    gauge(
        "relit_camera_clipped_ratio",
        "Clipped pixels, 0 to 1",
        camera.clipped,
    );
    gauge(
        "relit_camera_focus",
        "Variance of the Laplacian",
        camera.focus,
    );
}

fn yes(is: bool) -> Option<f64> {
    Some(f64::from(u8::from(is)))
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
