//! The rig's state as clients see it: one task reads it from the monitor, however many ask.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::sleep;

use crate::state::{Monitor, RigState};

/// Shortest time between two snapshots: ten a second.
pub(super) const PERIOD: Duration = Duration::from_millis(100);

/// A state, and its JSON.
#[derive(Debug)]
pub(super) struct Snapshot {
    pub(super) state: RigState,
    pub(super) json: String,
}

impl Snapshot {
    fn of(state: RigState) -> Arc<Self> {
        // Plain structs of numbers and text: nothing in them that JSON lacks.
        let json = serde_json::to_string(&state).unwrap_or_default();
        Arc::new(Self { state, json })
    }
}

/// The newest snapshot, for any number of clients.
#[derive(Debug, Clone)]
pub(super) struct Snapshots {
    monitor: Monitor,
    newest: Arc<watch::Sender<Arc<Snapshot>>>,
}

impl Snapshots {
    pub(super) fn new(monitor: &Monitor) -> Self {
        Self {
            monitor: monitor.clone(),
            newest: Arc::new(watch::Sender::new(Snapshot::of(monitor.state()))),
        }
    }

    pub(super) fn newest(&self) -> Arc<Snapshot> {
        self.newest.borrow().clone()
    }

    pub(super) fn subscribe(&self) -> watch::Receiver<Arc<Snapshot>> {
        self.newest.subscribe()
    }

    /// Takes a snapshot now, if the state is new.
    pub(super) fn refresh(&self) {
        let state = self.monitor.state();
        if self.newest.borrow().state.version != state.version {
            self.newest.send_replace(Snapshot::of(state));
        }
    }

    /// Takes a snapshot after every change, for as long as the server runs.
    pub(super) async fn follow(self) {
        let mut versions = self.monitor.versions();
        // The state may have changed since the first snapshot.
        versions.mark_changed();
        // The monitor lives as long as this does: waiting cannot fail.
        while versions.changed().await.is_ok() {
            self.refresh();
            sleep(PERIOD).await;
        }
    }
}
