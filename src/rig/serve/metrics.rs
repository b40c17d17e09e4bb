//! Figures for Prometheus, in its text format 0.0.4.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::options::ClientLimits;
use super::permits::Permits;
use super::snapshots::Snapshots;
use crate::state::{Phase, RigState};
use relit_web::Problem;

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

/// Responses, counted by the first digit of their status, 2 to 5.
#[derive(Debug, Default)]
pub(super) struct Responses([AtomicU64; 4]);

/// Counts the response to a request.
pub(super) async fn count(
    State(responses): State<Arc<Responses>>,
    request: Request,
    next: Next,
) -> Response {
    let response = next.run(request).await;
    let class = usize::from(response.status().as_u16() / 100).saturating_sub(2);
    if let Some(count) = responses.0.get(class) {
        count.fetch_add(1, Ordering::Relaxed);
    }
    response
}

/// Figures for Prometheus
#[utoipa::path(
    get, path = "/metrics", tag = "metrics",
    responses(
        (status = 200, body = String, content_type = "text/plain"),
        (status = 401, body = Problem),
    )
)]
pub(super) async fn metrics(
    State(snapshots): State<Snapshots>,
    State(limits): State<ClientLimits>,
    State(permits): State<Arc<Permits>>,
    State(responses): State<Arc<Responses>>,
) -> Response {
    let snapshot = snapshots.newest();
    let mut page = Page::default();
    page.head(
        "relit_phase",
        "gauge",
        "1 for the phase that the capture is in",
    );
    for phase in PHASES {
        let name = serde_json::to_string(&phase).unwrap_or_default();
        let labels = format!("{{phase={name}}}");
        page.line("relit_phase", &labels, flag(phase == snapshot.state.phase));
    }
    page.gauges(&gauges(&snapshot.state));
    page.head("relit_http_responses_total", "counter", "Answers by class");
    for (count, class) in responses.0.iter().zip(2..) {
        let labels = format!("{{class=\"{class}xx\"}}");
        let count = count.load(Ordering::Relaxed) as f64;
        page.line("relit_http_responses_total", &labels, count);
    }
    let clients = |most: usize, permits: &tokio::sync::Semaphore| {
        Some(most.saturating_sub(permits.available_permits()) as f64)
    };
    let connections = clients(limits.connections, &permits.connections);
    let viewers = clients(limits.viewers, &permits.viewers);
    let subscribers = clients(limits.subscribers, &permits.subscribers);
    page.gauges(&[
        ("relit_http_connections", "Clients now", connections),
        ("relit_http_viewers", "Clients now", viewers),
        ("relit_http_subscribers", "Clients now", subscribers),
    ]);
    let kind = "text/plain; version=0.0.4; charset=utf-8";
    ([(header::CONTENT_TYPE, kind)], page.0).into_response()
}

/// Name, meaning and value; a value that is not known is left out.
type Gauge = (&'static str, &'static str, Option<f64>);

#[rustfmt::skip]
fn gauges(state: &RigState) -> [Gauge; 20] {
    let whole = |value: u64| Some(value as f64);
    let yes = |is: bool| Some(flag(is));
    let (table, camera) = (&state.table, &state.camera);
    let last = state.last_take.as_ref();
    let frames = "Frames written";
    let missing = "Frames missing";
    let faulty = "1 where something is wrong";
    [
        ("relit_take_frames", frames, whole(state.frames)),
        ("relit_take_frames_wanted", "Frames of a whole take", whole(state.frames_wanted)),
        ("relit_take_frames_dropped", missing, whole(state.dropped)),
        ("relit_last_take_frames", frames, last.map(|take| take.frames as f64)),
        ("relit_last_take_frames_dropped", missing, last.map(|take| take.dropped as f64)),
        ("relit_queue_objects", "Objects that wait", whole(state.queue.len() as u64)),
        ("relit_faults_shown", "Faults in the list", whole(state.faults.len() as u64)),
        ("relit_disk_free_bytes", "Space for sessions", whole(state.free_bytes)),
        ("relit_disk_needed_bytes", "Expected size of a take", whole(state.needed_bytes)),
        ("relit_table_present", "1 where there is a table", yes(table.present)),
        ("relit_table_homed", "1 where its zero is known", yes(table.homed)),
        ("relit_table_faulty", faulty, yes(table.fault.is_some())),
        ("relit_table_angle_degrees", "From machine zero", table.angle_deg),
        ("relit_table_degrees_per_second", "Speed", table.degrees_per_second),
        ("relit_table_battery_volts", "Battery", table.battery_v),
        ("relit_camera_present", "1 where it can be reached", yes(camera.present)),
        ("relit_camera_faulty", faulty, yes(camera.fault.is_some())),
        ("relit_camera_frames_per_second", "Over the last second", camera.fps),
        ("relit_camera_clipped_ratio", "Clipped pixels, 0 to 1", camera.clipped),
        ("relit_camera_focus", "Variance of the Laplacian", camera.focus),
    ]
}

fn flag(is: bool) -> f64 {
    f64::from(u8::from(is))
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

    fn gauges(&mut self, gauges: &[Gauge]) {
        for (name, help, value) in gauges {
            if let Some(value) = value {
                self.head(name, "gauge", help);
                self.line(name, "", *value);
            }
        }
    }
}
