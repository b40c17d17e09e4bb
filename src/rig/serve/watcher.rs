//! The one pair of eyes on the rig's monitor: all clients see what it saw last.
//!
//! However many clients there are and whatever they ask, the capture meets one reader at its locks, at a
//! steady pace.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval};

use super::server::Server;
use super::service::ServiceManager;
use crate::state::{Monitor, PreviewFrame, RigState};

/// Time between looks at the picture.
const PICTURES: Duration = Duration::from_millis(33);
/// Time between looks at the state.
pub(super) const STATES: Duration = Duration::from_millis(100);

/// A state as it was seen, and its JSON.
#[derive(Debug)]
pub(super) struct Seen {
    pub(super) state: RigState,
    pub(super) json: String,
}

/// What was seen last.
#[derive(Debug)]
pub(super) struct Watcher {
    monitor: Monitor,
    seen: watch::Sender<Arc<Seen>>,
    picture: watch::Sender<Option<PreviewFrame>>,
}

impl Watcher {
    pub(super) fn new(monitor: &Monitor) -> Self {
        Self {
            monitor: monitor.clone(),
            seen: watch::Sender::new(Arc::new(Seen::of(monitor.state()))),
            picture: watch::Sender::new(monitor.preview()),
        }
    }

    pub(super) fn seen(&self) -> Arc<Seen> {
        self.seen.borrow().clone()
    }

    pub(super) fn picture(&self) -> Option<PreviewFrame> {
        self.picture.borrow().clone()
    }

    pub(super) fn states(&self) -> watch::Receiver<Arc<Seen>> {
        self.seen.subscribe()
    }

    pub(super) fn pictures(&self) -> watch::Receiver<Option<PreviewFrame>> {
        self.picture.subscribe()
    }

    /// Looks at the state now, and tells it if it is new.
    pub(super) fn look(&self) {
        let state = self.monitor.state();
        if self.seen.borrow().state.version != state.version {
            self.seen.send_replace(Arc::new(Seen::of(state)));
        }
    }

    fn look_at_picture(&self) {
        let picture = self.monitor.preview();
        let number = |picture: &Option<PreviewFrame>| picture.as_ref().map(|frame| frame.number);
        if number(&self.picture.borrow()) != number(&picture) {
            self.picture.send_replace(picture);
        }
    }
}

impl Seen {
    fn of(state: RigState) -> Self {
        // Plain structs of numbers and text: nothing in them that JSON lacks.
        let json = serde_json::to_string(&state).unwrap_or_default();
        Self { state, json }
    }
}

/// Looks for as long as the server runs. The service manager is told that the service lives from here:
/// that this task goes on means that threads run and the monitor's locks come free.
pub(super) async fn run(server: Arc<Server>, service: Option<ServiceManager>) {
    let alive = service.and_then(|manager| Some((manager.watchdog? / 3, manager)));
    let mut ticks = interval(PICTURES);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut state_due, mut alive_due) = (Instant::now(), Instant::now());
    loop {
        let now = ticks.tick().await;
        server.watcher.look_at_picture();
        if now >= state_due {
            server.watcher.look();
            state_due = now + STATES;
        }
        if let Some((period, manager)) = &alive
            && now >= alive_due
        {
            manager.tell_alive();
            alive_due = now + *period;
        }
    }
}
