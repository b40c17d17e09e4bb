//! How much of everything may go on at once.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::spawn_blocking;

use super::options::ClientLimits;
use relit_web::Failure;

/// Listings of the session folder at once.
const LISTINGS: usize = 2;
/// Pictures decoded at once.
const DECODES: usize = 2;
/// Commands on their way to the rig at once.
const COMMANDS: usize = 8;
/// Videos being downloaded at once.
const DOWNLOADS: usize = 4;

/// Permits for what is bounded in number.
#[derive(Debug)]
pub(super) struct Permits {
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

impl Permits {
    pub(super) fn new(limits: &ClientLimits) -> Self {
        let permits = |count| Arc::new(Semaphore::new(count));
        Self {
            viewers: permits(limits.viewers),
            subscribers: permits(limits.subscribers),
            downloads: permits(DOWNLOADS),
            listings: permits(LISTINGS),
            decodes: permits(DECODES),
            commands: permits(COMMANDS),
        }
    }

    /// Does work that blocks, on a thread for it, once there is a permit. Work that has begun is
    /// finished also where its client has gone, and keeps its permit until then.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        work: Work,
        job: impl FnOnce() -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Failure> {
        let permits = match work {
            Work::Listing => &self.listings,
            Work::Decoding => &self.decodes,
            Work::Command => &self.commands,
        };
        let permit = permits.clone().acquire_owned().await;
        let done = spawn_blocking(move || {
            let _permit = permit;
            job()
        });
        done.await
            .unwrap_or_else(|_| Err(Failure::internal("the request could not be processed")))
    }
}

/// A permit, or the refusal for a client that comes too late.
pub(super) fn permit(
    permits: &Arc<Semaphore>,
    what: &str,
) -> Result<OwnedSemaphorePermit, Failure> {
    permits.clone().try_acquire_owned().map_err(|_| {
        Failure::unavailable(format!(
            "there are too many {what} already: close one and try again"
        ))
    })
}
