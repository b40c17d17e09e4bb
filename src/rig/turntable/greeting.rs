//! The first words with a controller: is it there, does it move, what is it.

use std::time::Duration;

use super::Options;
use super::error::TurntableError;
use super::identity::{Extras, Identity, Settings};
use super::link::Link;
use super::supervisor::Habits;
use super::wire::{Message, Outcome, Patience, State};

/// How long an Arduino takes at most to start after its port was opened.
const START_WAIT: Duration = Duration::from_secs(4);
/// How long a controller that was not reset is given to say that it was.
const SHORT_WAIT: Duration = Duration::from_millis(300);
/// How long a controller may take to answer its first `?`.
const PROBE_WAIT: Duration = Duration::from_secs(5);
/// How long answers to an echo may be under way.
const ECHO_WAIT: Duration = Duration::from_millis(250);
/// How often the settings are read until they are whole, and, unchecked, the same twice.
const READINGS: usize = 20;
/// The complaint of a line without checksum in a checked session.
const SESSION_OPEN: u8 = 70;
/// Between two reports in motion, with the chip's stamp and without.
const POLL_STAMPED: Duration = Duration::from_micros(66_667);
const POLL_STOCK: Duration = Duration::from_millis(200);

/// What is assumed of a controller before it is known.
pub(super) const STRANGER: Habits = Habits {
    degrees_per_unit: 1.0,
    poll: POLL_STOCK,
    stamps: false,
    reports_homing: false,
    step_deg: 0.0,
};

/// Finds out who is there, stops the table if it moves, and opens a checked session where it is
/// offered.
pub(super) fn greet(
    link: &Link,
    resets: bool,
    options: &Options,
) -> Result<Identity, TurntableError> {
    rouse(link, resets)?;
    let about = about(link)?;
    let build = |message: &Message| match message {
        Message::Build { letters, .. } => Some(Extras::of(letters)),
        _ => None,
    };
    let offered = about.iter().find_map(build).filter(|_| options.extras);
    let extras = offered.unwrap_or_default();
    secure(link, &extras)?;
    let settings = settings(link, extras)?;
    let mut identity = Identity::read(&about, &settings, options.travel_deg)?;
    identity.extras = extras;
    identity.lease_s = identity.lease_s.filter(|_| extras.lease);
    link.supervisor().set_habits(Habits {
        degrees_per_unit: identity.degrees_per_unit,
        poll: if extras.stamps {
            POLL_STAMPED
        } else {
            POLL_STOCK
        },
        stamps: extras.stamps,
        reports_homing: !identity.is_stock(),
        step_deg: identity.step_deg(),
    });
    Ok(identity)
}

/// Opens a checked session where the controller offers one and none is open.
pub(super) fn secure(link: &Link, extras: &Extras) -> Result<(), TurntableError> {
    if !extras.checked_lines || link.supervisor().is_checked() {
        return Ok(());
    }
    done(link, "N0", link.open_session()?).map(|_| ())
}

/// Waits for the banner, and for a first report; stops a table that moves or is held.
fn rouse(link: &Link, resets: bool) -> Result<(), TurntableError> {
    let limit = if resets { START_WAIT } else { SHORT_WAIT };
    link.wait(limit, |supervisor| {
        (supervisor.restarts() > 0).then_some(())
    });
    let until_us = link.clock().after(PROBE_WAIT);
    link.supervisor().want_reports(until_us);
    let state = link.wait(PROBE_WAIT, |supervisor| {
        if supervisor.closed().is_some() {
            return Some(None);
        }
        supervisor.seen().map(|seen| Some(seen.state))
    });
    match state {
        Some(Some(State::Idle | State::Alarm | State::Check)) => {}
        Some(Some(_)) => link.stop().map(|_| ())?,
        Some(None) | None => return Err(stranger(link)),
    }
    forget_echo(link)
}

/// Until a port is set up, the system echoes what the controller says. The controller answers such
/// lines with errors, which come here while no line waits for an answer; a part of one it keeps as
/// the head of the next line, which is an empty one here, whatever the answer.
fn forget_echo(link: &Link) -> Result<(), TurntableError> {
    link.clock().sleep(ECHO_WAIT);
    match link.line("", Patience::Short)? {
        Outcome::Failed(_) => link.wait_stopped(),
        Outcome::Done(_) | Outcome::Refused(_) => Ok(()),
    }
}

fn stranger(link: &Link) -> TurntableError {
    let supervisor = link.supervisor();
    let counts = supervisor.counts();
    let heard = match (supervisor.closed(), counts.noise) {
        (Some(why), _) => format!("the port is gone: {why}"),
        (None, 0) => "nothing was heard".to_owned(),
        (None, lines) => format!("{lines} lines were heard that are none of Grbl's"),
    };
    TurntableError::NoController {
        port: link.port_name().to_owned(),
        heard,
    }
}

/// What `$I` gives, with the options in it.
fn about(link: &Link) -> Result<Vec<Message>, TurntableError> {
    let mut told = Vec::new();
    for _ in 0..READINGS {
        let outcome = link.line("$I", Patience::Short)?;
        if outcome == Outcome::Refused(SESSION_OPEN) {
            // The last owner went away in the middle of a checked session: go on with it.
            done(link, "N0", link.open_session()?)?;
            continue;
        }
        let messages = match outcome {
            Outcome::Failed(_) if link.wait_stopped().is_ok() => continue,
            outcome => done(link, "$I", outcome)?,
        };
        let whole = |kind: fn(&Message) -> bool| messages.iter().any(kind);
        let options = whole(|message| matches!(message, Message::Build { .. }));
        let version = whole(|message| matches!(message, Message::Version { .. }));
        if options && version && told == messages {
            return Ok(messages);
        }
        told = messages;
    }
    Err(TurntableError::Untold(
        "its version and options (`$I`) twice the same",
    ))
}

/// What `$$` gives, whole, and the same twice: without checksums a digit could be wrong.
fn settings(link: &Link, extras: Extras) -> Result<Settings, TurntableError> {
    let mut told = None;
    for _ in 0..READINGS {
        let messages = match link.line("$$", Patience::Short)? {
            Outcome::Failed(_) if link.wait_stopped().is_ok() => {
                secure(link, &extras)?;
                continue;
            }
            outcome => done(link, "$$", outcome)?,
        };
        let settings = Settings::of(&messages);
        if !settings.is_whole(extras) {
            continue;
        }
        if told.as_ref() == Some(&settings) {
            return Ok(settings);
        }
        told = Some(settings);
    }
    Err(TurntableError::Untold("its settings (`$$`) twice the same"))
}

fn done(link: &Link, block: &str, outcome: Outcome) -> Result<Vec<Message>, TurntableError> {
    let block = block.to_owned();
    match outcome {
        Outcome::Done(messages) => Ok(messages),
        Outcome::Refused(code) => Err(TurntableError::Refused { block, code }),
        Outcome::Failed(fault) => {
            link.wait_stopped()?;
            Err(TurntableError::Lost { block, fault })
        }
    }
}
