//! `relit-capture serve`: the daemon and its page.

use std::error::Error;
use std::sync::Arc;

use relit_capture::capture::{CaptureError, Settings};
use relit_capture::command::Rig;
use relit_capture::daemon::Daemon;
use relit_capture::processing::Processing;
use relit_capture::serve::{Announcement, ServeOptions, Shutdown, Token, check_address, serve};
use sd_notify::NotifyState;

use super::arguments::ServeArguments;
use super::environment::{at_end, notify_service, programs};
use super::recording::make_root;
use relit_console::{Console, Event, Outcome};

pub(crate) fn run(console: Console, asked: ServeArguments) -> Result<Outcome, Box<dyn Error>> {
    let settings: Settings = asked.rig.into();
    let address = asked.listen.socket();
    let token = asked.token_file.as_deref().map(Token::from_file_or_new);
    let token = token.transpose()?;
    // An address that is taken is known before anything is made or moved.
    check_address(address)?;
    let made = make_root(&settings)?;
    let shutdown = Shutdown::new();
    let ending = shutdown.clone();
    let end = move || {
        notify_service(&[NotifyState::Stopping]);
        ending.cancel();
    };
    at_end(end).map_err(CaptureError::system("the signals", "listened to"))?;
    let failing = shutdown.clone();
    let rig = Arc::new(Daemon::start(settings, move || failing.cancel())?);
    let monitor = rig.monitor().clone();
    let processing = Processing::start(rig.root(), monitor, asked.datasets, programs())?;
    let processing = Arc::new(processing);
    let names = asked.listen.names(&asked.names);
    // Another name than the machine's own leads here from elsewhere.
    let is_for_phones = !address.ip().is_loopback() || !names.is_empty();
    let keeps_token = address.ip().is_loopback() || token.is_some();
    let options = ServeOptions {
        processing: Some(Arc::clone(&processing)),
        token,
        names,
        ..ServeOptions::at(address)
    };
    serve(rig.clone(), options, &shutdown, |announcement| {
        let status = format!("Serving on {}", announcement.address);
        notify_service(&[NotifyState::Ready, NotifyState::Status(&status)]);
        announce(console, announcement, is_for_phones, keeps_token);
    })?;
    // Threads of the server may hold the rig a moment longer: its end does not wait for them.
    let ended_well = rig.end();
    processing.end();
    drop(made);
    Ok(if ended_well {
        Outcome::Success
    } else {
        Outcome::Failure
    })
}

fn announce(console: Console, announcement: &Announcement, is_for_phones: bool, keeps_token: bool) {
    let mut text = format!("The rig is at {}", announcement.url);
    match &announcement.qr {
        Some(qr) if is_for_phones => text = format!("{qr}\n{text}"),
        Some(_) => text += "\nOnly this machine can open it. For a phone: --listen 0.0.0.0:8420",
        None => {}
    }
    if !keeps_token {
        text += "\nAfter a restart, phones have to scan a new code. To keep it: --token-file FILE";
    }
    console.print(
        &text,
        &Event::Serving {
            url: announcement.url.clone(),
            address: announcement.address.to_string(),
        },
    );
}
