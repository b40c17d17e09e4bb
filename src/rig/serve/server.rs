//! What all requests share.

use std::future::Future;
use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::spawn_blocking;

use super::answer::Failure;
use super::gate::Door;
use super::library::Library;
use super::metrics::Counts;
use super::pictures::Pictures;
use super::watcher::Watcher;
use super::{Limits, Shutdown};
use crate::serve::rig::Rig;

/// Listings of the session folder at once.
const LISTINGS: usize = 2;
/// Pictures decoded at once.
const DECODES: usize = 2;
/// Commands on their way to the rig at once.
const COMMANDS: usize = 8;
/// Videos being downloaded at once.
const DOWNLOADS: usize = 4;

/// What all requests share.
pub(super) struct Server {
    pub(super) rig: Arc<dyn Rig>,
    pub(super) door: Door,
    pub(super) limits: Limits,
    pub(super) watcher: Watcher,
    pub(super) library: Library,
    pub(super) pictures: Pictures,
    pub(super) counts: Counts,
    pub(super) places: Places,
    pub(super) shutdown: Shutdown,
}

/// Places for what is bounded in number.
pub(super) struct Places {
    pub(super) connections: Arc<Semaphore>,
    pub(super) viewers: Arc<Semaphore>,
    pub(super) subscribers: Arc<Semaphore>,
    pub(super) downloads: Arc<Semaphore>,
    listings: Arc<Semaphore>,
    decodes: Arc<Semaphore>,
    commands: Arc<Semaphore>,
}

/// Work that blocks a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Work {
    /// Reading manifests and indexes.
    Listing,
    /// Decoding a picture.
    Decoding,
    /// Handing a command to the rig.
    Command,
}

impl Server {
    pub(super) fn new(rig: Arc<dyn Rig>, door: Door, limits: Limits, shutdown: Shutdown) -> Self {
        let places = |count| Arc::new(Semaphore::new(count));
        Self {
            watcher: Watcher::new(rig.monitor()),
            library: Library::new(rig.root().to_owned()),
            pictures: Pictures::new(),
            counts: Counts::default(),
            places: Places {
                connections: places(limits.connections),
                viewers: places(limits.viewers),
                subscribers: places(limits.subscribers),
                downloads: places(DOWNLOADS),
                listings: places(LISTINGS),
                decodes: places(DECODES),
                commands: places(COMMANDS),
            },
            rig,
            door,
            limits,
            shutdown,
        }
    }

    /// Does work that blocks, on a thread for it, once there is a place. Work that has begun is
    /// finished also where its client has gone, and keeps its place until then.
    pub(super) async fn block_on<T: Send + 'static>(
        self: &Arc<Self>,
        work: Work,
        job: impl FnOnce(&Self) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Failure> {
        let places = match work {
            Work::Listing => &self.places.listings,
            Work::Decoding => &self.places.decodes,
            Work::Command => &self.places.commands,
        };
        let place = places.clone().acquire_owned().await;
        let server = self.clone();
        let done = spawn_blocking(move || {
            let done = job(&server);
            drop(place);
            done
        });
        done.await
            .unwrap_or_else(|_| Err(Failure::broken("the request could not be worked on")))
    }

    /// Ends when the server is to end.
    pub(super) fn closing(&self) -> impl Future<Output = ()> + Send + use<> {
        let shutdown = self.shutdown.clone();
        async move { shutdown.requested().await }
    }
}

/// A place, or the refusal for a client that comes too late.
pub(super) fn place(places: &Arc<Semaphore>, what: &str) -> Result<OwnedSemaphorePermit, Failure> {
    let taken = || {
        Failure::busy(format!(
            "there are too many {what} already: close one and try again"
        ))
    };
    places.clone().try_acquire_owned().map_err(|_| taken())
}
