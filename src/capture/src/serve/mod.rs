//! The rig over HTTP: a page for the phone beside the turntable, and the same as JSON for scripts.
//!
//! It stands on [`Rig`]: it hands commands on, shows what the [`Monitor`](crate::state::Monitor)
//! holds and reads what lies in the session folder. It knows nothing of cameras, tables or how a
//! capture goes. The capture is never held up by it: its threads give way to all others of the process,
//! and whatever a client can ask for is bounded in number, size and time.
//!
//! Who may do what: without a token only programs on this machine get in, and no web page but this
//! one. Everywhere else a token of 128 random bits is demanded; the page's own files alone go
//! without, as they hold nothing of the rig.

mod api;
mod cache;
mod editor;
mod files;
mod library;
mod options;
mod page;
mod permits;
mod pictures;
mod preview;
mod processing;
mod routes;
mod sessions;
mod trash;

#[cfg(test)]
mod tests;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use relit_web::PageServer;

pub use self::options::{ClientLimits, ServeOptions};
use crate::command::Rig;
pub use relit_web::{Announcement, ListenAddress, Shutdown, Token};

/// Threads for files, decoding and commands: more than all that may use them at once, so that a
/// command to stop never waits for a thread.
const BLOCKING_THREADS: usize = 24;

/// The rig could not be served: the address is taken, not this machine's, or not allowed, or the system lacks threads.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve at {address}: {source}; {}", remedy(source))]
pub struct ServeError {
    address: SocketAddr,
    source: io::Error,
}

fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::AddrInUse
        | io::ErrorKind::AddrNotAvailable
        | io::ErrorKind::PermissionDenied => {
            "give another address or port, or end the program that has it"
        }
        _ => "end other programs, or start the machine again",
    }
}

/// Whether the address can be listened on, as things are.
///
/// # Errors
/// [`ServeError`].
pub fn check_address(address: SocketAddr) -> Result<(), ServeError> {
    let listened = TcpListener::bind(address).map(drop);
    listened.map_err(|source| ServeError { address, source })
}

/// Serves the rig until `shutdown` is cancelled; it ends within a few seconds then. `announce` is called
/// once, when clients can connect.
///
/// # Errors
/// [`ServeError`] where it cannot begin; later troubles concern single clients only.
pub fn serve(
    rig: Arc<dyn Rig>,
    options: ServeOptions,
    shutdown: &Shutdown,
    announce: impl FnOnce(&Announcement),
) -> Result<(), ServeError> {
    let address = options.address;
    let server = PageServer {
        address,
        token: options.token,
        names: options.names,
        open_paths: page::paths(),
        limits: options.limits.connections,
        threads: |runtime| {
            runtime.max_blocking_threads(BLOCKING_THREADS);
            runtime.on_thread_start(give_way);
        },
    };
    let router = |policy| {
        let (rig, shutdown) = (rig.clone(), shutdown.clone());
        let app = routes::App::new(rig, policy, options.limits, shutdown, options.processing);
        routes::router(&app)
    };
    let served = server.serve(router, announce, shutdown);
    served.map_err(|source| ServeError { address, source })
}

/// Lets every other thread of the process go first. Linux keeps this value for each thread; where the
/// system refuses, the thread stays as it is.
fn give_way() {
    let _ = rustix::process::setpriority_process(None, 10);
}
