//! The rig itself: its state, once and as events, and commands to it.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::{Stream, StreamExt};
use tokio::time::timeout;
use tokio_stream::wrappers::WatchStream;

use super::permits::{Permits, Work, permit};
use super::snapshots::{PERIOD, Snapshots};
use crate::command::{Command, Refused, Rig};
use relit_web::Shutdown;
use relit_web::{Failure, JsonBody};

/// A subscriber hears something at least so often: silence means a lost connection.
const BEAT: Duration = Duration::from_secs(2);
/// Time in which the rig has to take or refuse a command.
const COMMAND: Duration = Duration::from_secs(15);

/// The rig's state
///
/// Phase, progress, table, camera, disk space, queue, faults and the last take.
pub(super) async fn state(State(snapshots): State<Snapshots>) -> Response {
    newest(&snapshots)
}

fn newest(snapshots: &Snapshots) -> Response {
    let json = snapshots.newest().json.clone();
    ([(header::CONTENT_TYPE, "application/json")], json).into_response()
}

/// The rig's state on every change
///
/// Server-sent events. `state` holds the whole state as JSON and comes at once, then on change, at most
/// ten times a second; who reads slowly gets fewer, never old ones. `beat` comes where nothing changed
/// for two seconds.
pub(super) async fn events(
    State(snapshots): State<Snapshots>,
    State(permits): State<Arc<Permits>>,
    State(shutdown): State<Shutdown>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Failure> {
    let permit = permit(&permits.subscribers, "pages that watch the rig")?;
    let events = WatchStream::new(snapshots.subscribe());
    let events = tokio_stream::StreamExt::throttle(events, PERIOD).map(move |snapshot| {
        let _held = &permit;
        Ok(Event::default().event("state").data(&snapshot.json))
    });
    let beat = KeepAlive::new().interval(BEAT);
    let beat = beat.event(Event::default().event("beat").data(""));
    Ok(Sse::new(events.take_until(shutdown.cancelled_owned())).keep_alive(beat))
}

/// Give the rig a command
///
/// Answers once the rig has taken or refused it; what comes of it shows in the state. Of several starts at
/// once, one is taken.
pub(super) async fn command(
    State(rig): State<Arc<dyn Rig>>,
    State(snapshots): State<Snapshots>,
    State(permits): State<Arc<Permits>>,
    JsonBody(command): JsonBody<Command>,
) -> Result<Response, Failure> {
    let given = permits.run(Work::Command, move || Ok(rig.command(command)?));
    let answered = timeout(COMMAND, given).await;
    answered.map_err(|_| {
        let error = "the rig did not answer: check it, and its state, before you try again";
        Failure::new(StatusCode::GATEWAY_TIMEOUT, error)
    })??;
    snapshots.refresh();
    Ok((StatusCode::ACCEPTED, newest(&snapshots)).into_response())
}

impl From<Refused> for Failure {
    fn from(refused: Refused) -> Self {
        let (status, error) = match refused {
            Refused::Busy(error) => (StatusCode::CONFLICT, error),
            Refused::Invalid(error) => (StatusCode::UNPROCESSABLE_ENTITY, error),
            Refused::Unavailable(error) => (StatusCode::SERVICE_UNAVAILABLE, error),
        };
        Self::new(status, error)
    }
}
