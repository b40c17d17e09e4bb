//! What the program takes from its surroundings: signals and environment variables.

use std::env;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use relit::capture::serve::ServiceManager;
use signal_hook::consts::{SIGINT, SIGTERM};

/// How late a signal is seen.
const GLANCE: Duration = Duration::from_millis(50);

/// The folder for locks and sockets: one for the whole machine, so that a service and a person who
/// logs in find each other.
pub(crate) fn runtime_folder() -> PathBuf {
    let locks = Path::new("/run/lock");
    if locks.is_dir() {
        locks.to_owned()
    } else {
        env::temp_dir()
    }
}

/// The service manager that started the program, where one did and wants to be told.
pub(crate) fn service_manager() -> Option<ServiceManager> {
    let socket = env::var("NOTIFY_SOCKET").ok()?;
    let watchdog = env::var("WATCHDOG_USEC")
        .ok()
        .and_then(|us| us.parse().ok());
    Some(ServiceManager {
        socket,
        watchdog: watchdog.map(Duration::from_micros),
    })
}

/// Calls `end` when the program is told to end. A second signal of the kind ends it at once.
pub(crate) fn at_end(end: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    let told = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT] {
        signal_hook::flag::register_conditional_shutdown(signal, 1, Arc::clone(&told))?;
        signal_hook::flag::register(signal, Arc::clone(&told))?;
    }
    thread::Builder::new()
        .name("relit-signals".to_owned())
        .spawn(move || {
            while !told.load(Ordering::Relaxed) {
                thread::sleep(GLANCE);
            }
            end();
        })?;
    Ok(())
}
