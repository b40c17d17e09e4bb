//! `relit-capture simulate`: a turntable without hardware, at a port that any program can open.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use relit_data::clock::Clock;
use relit_turntable::simulator::{Simulator, SimulatorError, SimulatorOptions};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::turntable_arguments::SimulateArguments;
use relit_console::{Console, Event, Outcome};

/// Interval at which the end conditions are checked.
const LOOK: Duration = Duration::from_millis(50);

pub(crate) fn run(console: Console, asked: &SimulateArguments) -> Result<Outcome, SimulatorError> {
    let options = SimulatorOptions {
        clock: match asked.speed {
            1.0 => Clock::monotonic(),
            factor => Clock::paced(factor),
        },
        faults: asked.fault.clone().unwrap_or_default(),
        ..SimulatorOptions::default()
    };
    let simulator = Simulator::start(&options, asked.link.as_deref())?;
    let port = asked.link.as_deref().unwrap_or(simulator.path());
    console.print(
        &format!(
            "a simulated turntable is at {}; end it with Ctrl-C",
            port.display()
        ),
        &Event::Ready {
            port: port.to_string_lossy().into_owned(),
            speed: asked.speed,
        },
    );
    wait(console);
    drop(simulator);
    console.print("the simulated turntable has ended", &Event::Ended);
    Ok(Outcome::Success)
}

/// Waits until a signal arrives.
fn wait(console: Console) {
    let ended = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        if let Err(error) = signal_hook::flag::register(signal, Arc::clone(&ended)) {
            console.warn(&format!(
                "signal {signal} ends the simulator and leaves its link: {error}"
            ));
        }
    }
    while !ended.load(Ordering::Relaxed) {
        thread::sleep(LOOK);
    }
}
