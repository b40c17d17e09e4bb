//! The rig itself: its state, once and as events, and commands to it.

use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::sse::{Event, KeepAlive, Sse};
use futures_util::{Stream, StreamExt};
use tokio::time::timeout;
use tokio_stream::wrappers::WatchStream;

use super::permits::{Permits, Work, permit};
use crate::command::{Command, CommandError, Rig};
use crate::state::{Monitor, RigState};
use relit_web::Shutdown;
use relit_web::{Failure, JsonBody};

/// Shortest time between two states that a subscriber gets: ten a second.
const PERIOD: Duration = Duration::from_millis(100);
/// A subscriber hears something at least so often: silence means a lost connection.
const BEAT: Duration = Duration::from_secs(2);
/// Time in which the rig has to take or refuse a command.
const COMMAND: Duration = Duration::from_secs(15);

/// The rig's state
///
/// Phase, progress, table, camera, disk space, faults and the last take.
pub(super) async fn state(State(monitor): State<Monitor>) -> Json<RigState> {
    Json(monitor.state())
}

/// The rig's state on every change
///
/// Server-sent events. `state` holds the whole state as JSON and comes at once, then on change, at most
/// ten times a second; who reads slowly gets fewer, never old ones. `beat` comes where nothing changed
/// for two seconds.
pub(super) async fn events(
    State(monitor): State<Monitor>,
    State(permits): State<Arc<Permits>>,
    State(shutdown): State<Shutdown>,
) -> Result<Sse<impl Stream<Item = Result<Event, axum::Error>>>, Failure> {
    let permit = permit(&permits.subscribers, "pages that watch the rig")?;
    let versions = WatchStream::new(monitor.versions());
    let events = tokio_stream::StreamExt::throttle(versions, PERIOD).map(move |_| {
        let _held = &permit;
        Event::default().event("state").json_data(monitor.state())
    });
    let beat = KeepAlive::new().interval(BEAT);
    let beat = beat.event(Event::default().event("beat").data(""));
    Ok(Sse::new(events.take_until(shutdown.cancelled_owned())).keep_alive(beat))
}

/// Give the rig a command
///
/// Answers once the rig has taken or refused it; the result shows in the state. Of several starts at
/// once, one is taken.
pub(super) async fn command(
    State(rig): State<Arc<dyn Rig>>,
    State(monitor): State<Monitor>,
    State(permits): State<Arc<Permits>>,
    JsonBody(command): JsonBody<Command>,
) -> Result<(StatusCode, Json<RigState>), Failure> {
    let given = permits.run(Work::Command, move || Ok(rig.command(command)?));
    let answered = timeout(COMMAND, given).await;
    answered.map_err(|_| {
        let error = "the rig did not answer: check it, and its state, before you try again";
        Failure::new(StatusCode::GATEWAY_TIMEOUT, error)
    })??;
    Ok((StatusCode::ACCEPTED, Json(monitor.state())))
}

impl From<CommandError> for Failure {
    fn from(refused: CommandError) -> Self {
        let (status, error) = match refused {
            CommandError::Busy(error) => (StatusCode::CONFLICT, error),
            CommandError::Invalid(error) => (StatusCode::UNPROCESSABLE_ENTITY, error),
            CommandError::Unavailable(error) => (StatusCode::SERVICE_UNAVAILABLE, error),
        };
        Self::new(status, error)
    }
}
