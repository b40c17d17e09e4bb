//! `relit-capture turntable`: the table's status, or one motion.

use std::path::Path;
use std::sync::Arc;

use relit_turntable::{
    HomingResult, Table, TableOptions, TableStatus, TurntableAddress, TurntableError, find_serial,
};
use serde_json::{Value, json};

use super::environment::at_end;
use super::turntable_arguments::{Action, TurntableArguments};
use relit_console::{Console, Event, Outcome};

pub(crate) fn run(console: Console, asked: &TurntableArguments) -> Result<Outcome, TurntableError> {
    let port = match &asked.turntable {
        TurntableAddress::Serial(Some(path)) => path.clone(),
        TurntableAddress::Serial(None) => find_serial()?,
        TurntableAddress::Simulated(_) | TurntableAddress::None => {
            return Err(no_port(&asked.turntable));
        }
    };
    let options = TableOptions::default();
    match asked.action {
        Action::Status => {
            let table = open(console, &port, &options)?;
            report(console, Event::Status, &table.status()?);
            Ok(Outcome::Success)
        }
        Action::Stop => {
            let table = Table::take_over(&port, &options)?;
            report(console, Event::Stopped, &table.stop()?);
            Ok(Outcome::Success)
        }
        Action::Home => home(console, open_to_move(console, &port, &options)?.as_ref()),
        Action::Jog {
            degrees,
            speed,
            home: with_home,
        } => {
            let table = open_to_move(console, &port, &options)?;
            if with_home {
                home(console, &table)?;
            }
            report(console, Event::Jogged, &table.jog(degrees, speed)?);
            Ok(Outcome::Success)
        }
        Action::Unlock => {
            let table = open(console, &port, &options)?;
            report(console, Event::Unlocked, &table.unlock()?);
            Ok(Outcome::Success)
        }
    }
}

/// Opens a table, and says if it was moving and nobody had it.
fn open(console: Console, port: &Path, options: &TableOptions) -> Result<Table, TurntableError> {
    let table = Table::open_serial(port, options)?;
    if table.was_stopped() {
        console.warn("the table was moving without a program: it was stopped");
    }
    Ok(table)
}

/// Opens a table that is stopped if the program gets a signal to end.
fn open_to_move(
    console: Console,
    port: &Path,
    options: &TableOptions,
) -> Result<Arc<Table>, TurntableError> {
    let table = Arc::new(open(console, port, options)?);
    // A weak reference, so that table and port are closed when the motion has ended.
    let moving = Arc::downgrade(&table);
    let listening = at_end(move || {
        if let Some(table) = moving.upgrade() {
            // The motion ends with an error then and reports it.
            let _reported = table.stop();
        }
    });
    if let Err(error) = listening {
        console.warn(&format!(
            "a signal ends this program without stopping the table first: {error}"
        ));
    }
    Ok(table)
}

fn no_port(address: &TurntableAddress) -> TurntableError {
    TurntableError::Address {
        text: address.to_string(),
        why: "it has no port that outlives this command; for a simulated table start \
              `relit-capture simulate` and name the port that it prints"
            .to_owned(),
    }
}

fn home(console: Console, table: &Table) -> Result<Outcome, TurntableError> {
    let homed = table.home()?;
    let status = table.status()?;
    if homed == HomingResult::WhereItStands {
        console.warn(
            "homing is off ($22=0): zero is where the table stands, until the controller is switched \
             off or reset",
        );
    }
    report(console, Event::Homed, &status);
    Ok(Outcome::Success)
}

fn report(console: Console, event: fn(Value) -> Event, status: &TableStatus) {
    console.print(&describe(status), &event(json!(status)));
}

fn describe(status: &TableStatus) -> String {
    let mut text = format!("{}, {:.3} degrees", status.state, status.angle_deg);
    if status.restarted {
        text += " (not homed: the controller restarted)";
    } else if !status.homed {
        text += " (not homed: from where it was switched on)";
    }
    if status.degrees_per_second != 0.0 {
        text += &format!(", {:.2} degrees/s", status.degrees_per_second);
    }
    if let Some(volts) = status.battery_v {
        text += &format!(", battery {volts:.2} V");
    }
    if status.index {
        text += ", at the index";
    }
    if status.emergency_stop {
        text += ", emergency stop pressed";
    }
    if let Some(alarm) = &status.alarm {
        text += &format!("; locked: {alarm}");
    }
    text
}
