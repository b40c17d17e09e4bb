//! The first exchange with a controller: whether it is there, whether it moves, what it is.

use std::time::Duration;

use super::TableOptions;
use super::error::TurntableError;
use super::identity::{GrblSettings, Identity, offers_extras};
use super::io_thread::Connection;
use super::protocol::{ControllerState, Counts, LineFault, LineOutcome, Message, ReplyTimeout};
use super::supervisor::ControllerFeatures;

/// Longest start of an Arduino after its port was opened.
const START_WAIT: Duration = Duration::from_secs(4);
/// How long to wait for the banner of a controller that opening the port should not have reset.
const SHORT_WAIT: Duration = Duration::from_millis(300);
/// Longest wait for the answer to the first `?`.
const PROBE_WAIT: Duration = Duration::from_secs(5);
/// How many times that is waited for while the controller prints something else.
const PROBES: usize = 4;
/// How long answers to an echo may be in transit.
const ECHO_WAIT: Duration = Duration::from_millis(250);
/// Attempts to read the settings completely and, without checksums, twice the same.
const READINGS: usize = 20;
/// Grbl's error for a line without checksum in a checked session.
const SESSION_OPEN: u8 = 70;
/// Interval of reports in motion, with and without the chip's time stamps.
const POLL_STAMPED: Duration = Duration::from_micros(66_667);
const POLL_STOCK: Duration = Duration::from_millis(200);

/// What is assumed of a controller until its identity is known.
pub(super) fn unknown_controller() -> ControllerFeatures {
    ControllerFeatures {
        poll: POLL_STOCK,
        ..ControllerFeatures::default()
    }
}

/// Identifies the controller, stops the table if it moves, and opens a checked session if the
/// controller offers one. The second value tells whether it had to be stopped.
pub(super) fn run(
    connection: &Connection,
    resets: bool,
    options: &TableOptions,
) -> Result<(Identity, bool), TurntableError> {
    let moved = wake(connection, resets)?;
    let about = about(connection)?;
    let extras = options.extras && offers_extras(&about);
    ensure_checked_session(connection, extras)?;
    let settings = settings(connection, extras)?;
    let identity = Identity::read(&about, &settings, extras)?;
    connection.supervisor().set_features(ControllerFeatures {
        family: identity.family,
        poll: if extras { POLL_STAMPED } else { POLL_STOCK },
        stamps: extras,
        reports_homing: extras,
        step_deg: identity.step_deg(),
    });
    Ok((identity, moved))
}

/// Opens a checked session if the controller offers one and none is open.
pub(super) fn ensure_checked_session(
    connection: &Connection,
    extras: bool,
) -> Result<(), TurntableError> {
    if !extras || connection.supervisor().is_checked() {
        return Ok(());
    }
    done(connection, "N0", connection.open_session()?).map(|_| ())
}

/// Waits for the banner and for a first report; stops a table that moves or is held, and tells
/// whether it did.
fn wake(connection: &Connection, resets: bool) -> Result<bool, TurntableError> {
    let limit = if resets { START_WAIT } else { SHORT_WAIT };
    connection.wait(limit, |supervisor| {
        (supervisor.restarts() > 0).then_some(())
    });
    let moves = match first_state(connection) {
        Some(ControllerState::Idle | ControllerState::Alarm | ControllerState::Check) => false,
        Some(_) => true,
        None => return Err(no_controller(connection)),
    };
    if moves {
        connection.stop()?;
    }
    forget_echo(connection)?;
    Ok(moves)
}

/// The state of the first report. A controller with a radio can take long to start, and prints what it
/// does meanwhile: as long as it does, it is waited for.
fn first_state(connection: &Connection) -> Option<ControllerState> {
    for _ in 0..PROBES {
        let before = lines_received(&connection.supervisor().counts());
        let until_us = connection.clock().after(PROBE_WAIT);
        connection.supervisor().want_reports(until_us);
        let state = connection.wait(PROBE_WAIT, |supervisor| {
            if supervisor.closed().is_some() {
                return Some(None);
            }
            supervisor.last_report().map(|report| Some(report.state))
        });
        if state.is_some() {
            return state.flatten();
        }
        if lines_received(&connection.supervisor().counts()) == before {
            return None;
        }
    }
    None
}

/// Lines received that are neither reports nor answers.
fn lines_received(counts: &Counts) -> u64 {
    counts.noise + counts.messages
}

/// Discards the effects of an echo. Until a port is set up, the system echoes what the controller
/// sends. The controller answers such lines with errors, which arrive here while no line waits for
/// an answer, and may keep a part of one as the beginning of the next line. That next line is an
/// empty one here, and its answer does not matter.
fn forget_echo(connection: &Connection) -> Result<(), TurntableError> {
    connection.clock().sleep(ECHO_WAIT);
    match connection.line("", ReplyTimeout::AtOnce)? {
        LineOutcome::Failed(fault) => recover(connection, fault),
        LineOutcome::Done(_) | LineOutcome::Refused(_) => Ok(()),
    }
}

/// Waits until another line can be sent after one that got no answer: the table is being stopped, unless
/// the controller has restarted.
fn recover(connection: &Connection, fault: LineFault) -> Result<(), TurntableError> {
    match fault {
        LineFault::Restarted => Ok(()),
        _ => connection.wait_stopped(),
    }
}

fn no_controller(connection: &Connection) -> TurntableError {
    let supervisor = connection.supervisor();
    let counts = supervisor.counts();
    let heard = match (supervisor.closed(), counts.noise) {
        (Some(why), _) => format!("the port is gone: {why}"),
        (None, 0) => "no answer came".to_owned(),
        (None, lines) => {
            format!("{lines} lines came that are not Grbl's, or lack the machine position ($10=1)")
        }
    };
    TurntableError::Failed(format!(
        "{} does not answer as a Grbl 1.1 controller ({heard}): check port, cable, power and firmware: the rig's, Grbl 1.1, grblHAL or FluidNC",
        connection.port_name()
    ))
}

/// The answer to `$I`, complete with version and options.
fn about(connection: &Connection) -> Result<Vec<Message>, TurntableError> {
    let mut last = Vec::new();
    for _ in 0..READINGS {
        let outcome = connection.line("$I", ReplyTimeout::AtOnce)?;
        if outcome == LineOutcome::Refused(SESSION_OPEN) {
            // The last owner ended in the middle of a checked session: continue it.
            done(connection, "N0", connection.open_session()?)?;
            continue;
        }
        let mut messages = match outcome {
            LineOutcome::Failed(fault) if recover(connection, fault).is_ok() => continue,
            outcome => done(connection, "$I", outcome)?,
        };
        // Relatives of Grbl report more, such as their radio's state, which changes.
        messages.retain(describes_firmware);
        if lacks(&messages).is_none() && last == messages {
            return Ok(messages);
        }
        last = messages;
    }
    let lacks = lacks(&last).unwrap_or("the same version and options (`$I`) twice");
    Err(TurntableError::NotReported(lacks.to_owned()))
}

fn describes_firmware(message: &Message) -> bool {
    match message {
        Message::Version { .. } | Message::Build { .. } => true,
        Message::Info { tag, .. } => tag == "FIRMWARE",
        _ => false,
    }
}

/// What an answer to `$I` has not.
fn lacks(about: &[Message]) -> Option<&'static str> {
    let has = |kind: fn(&Message) -> bool| about.iter().any(kind);
    if !has(|message| matches!(message, Message::Version { .. })) {
        return Some("its version ([VER:..])");
    }
    (!has(|message| matches!(message, Message::Build { .. }))).then_some("its options ([OPT:..])")
}

/// The answer to `$$`, complete and twice the same: without checksums a digit could be wrong.
fn settings(connection: &Connection, extras: bool) -> Result<GrblSettings, TurntableError> {
    let mut last = None;
    let mut missing = Vec::new();
    for _ in 0..READINGS {
        let messages = match connection.line("$$", ReplyTimeout::AtOnce)? {
            LineOutcome::Failed(fault) if recover(connection, fault).is_ok() => {
                ensure_checked_session(connection, extras)?;
                continue;
            }
            outcome => done(connection, "$$", outcome)?,
        };
        let settings = GrblSettings::from_messages(&messages);
        missing = settings.missing(extras);
        if !missing.is_empty() {
            continue;
        }
        if last.as_ref() == Some(&settings) {
            return Ok(settings);
        }
        last = Some(settings);
    }
    Err(TurntableError::NotReported(if missing.is_empty() {
        "the same settings (`$$`) twice".to_owned()
    } else {
        let missing: Vec<_> = missing.iter().map(|n| format!("${n}")).collect();
        let missing = missing.join(", ");
        format!("{missing}, which a table needs on its X axis")
    }))
}

fn done(
    connection: &Connection,
    block: &str,
    outcome: LineOutcome,
) -> Result<Vec<Message>, TurntableError> {
    let block = block.to_owned();
    match outcome {
        LineOutcome::Done(messages) => Ok(messages),
        LineOutcome::Refused(code) => Err(TurntableError::Refused { block, code }),
        LineOutcome::Failed(fault) => {
            recover(connection, fault)?;
            Err(TurntableError::Lost { block, fault })
        }
    }
}
