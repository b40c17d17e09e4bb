//! What the program takes from its surroundings: signals and environment variables.

use std::env;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use relit_capture::processing::ProcessingPrograms;
use sd_notify::NotifyState;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

/// Signals within this time count as one: `timeout` and a closing terminal send several.
const TOGETHER: Duration = Duration::from_secs(1);

/// Says something to the service manager that started the program, where one did.
pub(crate) fn notify_service(states: &[NotifyState<'_>]) {
    // A manager that cannot be reached hears nothing, and does what it is there for.
    let _ = sd_notify::notify(states);
}

/// The programs that make masks and data sets: beside this one, or where the shell finds them.
pub(crate) fn programs() -> ProcessingPrograms {
    let own = env::current_exe().ok();
    let beside = own.as_deref().and_then(Path::parent).map(Path::to_owned);
    let path = env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = beside.into_iter().chain(env::split_paths(&path)).collect();
    let find = |name: &str| {
        let mut places = folders.iter().map(|folder| folder.join(name));
        places.find(|place| place.is_file())
    };
    let launcher = find("nice").map_or(Vec::new(), |nice| {
        vec![nice.into(), "-n".into(), "19".into()]
    });
    ProcessingPrograms {
        mask: find("relit-mask"),
        extract: find("relit-extract"),
        launcher,
    }
}

/// Calls `end` when a signal asks the program to end, as a closed terminal does. Another signal
/// a second or more later ends it at once; those that come together count as one.
pub(crate) fn at_end(end: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    let mut signals = Signals::new([SIGTERM, SIGINT, SIGHUP])?;
    thread::Builder::new()
        .name("relit-signals".to_owned())
        .spawn(move || {
            let mut end = Some(end);
            let mut ended: Option<Instant> = None;
            for signal in signals.forever() {
                if let Some(end) = end.take() {
                    ended = Some(Instant::now());
                    thread::spawn(end);
                } else if ended.is_some_and(|at| at.elapsed() >= TOGETHER) {
                    // What cannot be done by the signal's default is left to the end under way.
                    let _ended = emulate_default_handler(signal);
                }
            }
        })?;
    Ok(())
}
