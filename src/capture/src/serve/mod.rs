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
mod results;
mod routes;
mod sessions;
mod trash;

#[cfg(test)]
mod tests;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use tokio::time::{MissedTickBehavior, interval};

pub use self::options::{ClientLimits, Heartbeat, ServeOptions};
use crate::command::Rig;
pub use relit_web::{Announcement, ListenAddress, Shutdown, Token};

/// Threads that carry requests; files and decoding have their own.
const THREADS: usize = 2;
/// Threads for files, decoding and commands: more than all that may use them at once, so that a
/// command to stop never waits for a thread.
const BLOCKING_THREADS: usize = 24;

/// Why the rig could not be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address is taken, not this machine's, or not allowed.
    #[error(
        "cannot listen on {address}: {source}; give another address or port, or end the program that has it"
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's answer.
        source: io::Error,
    },
    /// The system lacks something; what, and what to do.
    #[error("{0}: {1}")]
    System(&'static str, io::Error),
}

/// Whether the address can be listened on, as things are.
///
/// # Errors
/// [`ServeError::Listen`].
pub fn check_address(address: SocketAddr) -> Result<(), ServeError> {
    let listened = TcpListener::bind(address).map(drop);
    listened.map_err(|source| ServeError::Listen { address, source })
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
    let asked = options.address;
    let failed = |source| ServeError::Listen {
        address: asked,
        source,
    };
    let listener = TcpListener::bind(asked).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let token = match options.token {
        Some(token) => Some(token),
        None if address.ip().is_loopback() => None,
        None => Some(Token::random().map_err(|error| {
            ServeError::System(
                "no random numbers for a token could be had: give a token with --token-file",
                error,
            )
        })?),
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(THREADS)
        .max_blocking_threads(BLOCKING_THREADS)
        .thread_name("relit-http")
        .on_thread_start(give_way)
        .enable_io()
        .enable_time()
        .build()
        .map_err(|error| {
            let what = "the threads of the HTTP server could not be started: close other programs";
            ServeError::System(what, error)
        })?;
    let announcement = Announcement::new(address, &options.names, token.as_ref());
    let policy = relit_web::AccessPolicy::new(address.port(), token, options.names, page::paths());
    let app = routes::App::new(
        rig,
        policy,
        options.limits,
        shutdown.clone(),
        options.processing,
    );
    let served = runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener).map_err(failed)?;
        announce(&announcement);
        if let Some(heartbeat) = options.heartbeat {
            tokio::spawn(beat(heartbeat, app.rig.clone()));
        }
        let (limits, connections) = (app.limits.connections, &app.permits.connections);
        relit_web::run(
            listener,
            routes::router(&app),
            limits,
            connections,
            shutdown,
        )
        .await;
        Ok(())
    });
    runtime.shutdown_timeout(relit_web::GRACE);
    served
}

/// Beats for as long as server and rig run: that this continues means that threads run and the monitor's
/// locks come free.
async fn beat(heartbeat: Heartbeat, rig: Arc<dyn Rig>) {
    let mut ticks = interval(heartbeat.period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        let _readable = rig.monitor().state();
        if !rig.is_running() {
            return;
        }
        (heartbeat.beat)();
    }
}

/// Lets every other thread of the process go first. Linux keeps this value for each thread; where the
/// system refuses, the thread stays as it is.
fn give_way() {
    let _ = rustix::process::setpriority_process(None, 10);
}
