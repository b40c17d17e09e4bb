//! `relit-capture serve`: the daemon and its page.

use std::sync::Arc;

use relit_rig::capture::CaptureError;
use relit_rig::command::Rig;
use relit_rig::daemon::Daemon;
use relit_rig::lockfile::LockFile;
use relit_rig::processing::{Processing, ProcessingError, ProcessingOptions};
use relit_rig::serve::{
    Announcement, ServeError, ServeOptions, Shutdown, Token, TokenFileError, check_address, serve,
};
use sd_notify::NotifyState;

use crate::arguments::Serve;
use crate::environment::{at_end, heartbeat, notify_service, programs};
use relit_console::{Console, Event, Outcome};
use relit_data::durable::MadeFolder;

/// Why the rig is not served.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The rig.
    #[error(transparent)]
    Rig(#[from] CaptureError),
    /// The server.
    #[error(transparent)]
    Serve(#[from] ServeError),
    /// The token's file.
    #[error(transparent)]
    Token(#[from] TokenFileError),
    /// The processing of sessions.
    #[error(transparent)]
    Processing(#[from] ProcessingError),
}

pub(crate) fn run(console: Console, asked: Serve) -> Result<Outcome, Error> {
    let root = &asked.settings.root.clone();
    let failed = |what: String, doing| {
        move |source| CaptureError::System {
            what,
            doing,
            source,
        }
    };
    let token = match &asked.token_file {
        Some(path) => Some(Token::from_file_or_new(path)?),
        None => asked.token,
    };
    // An address that is taken is known before anything is made or moved.
    check_address(asked.address)?;
    let made = MadeFolder::make(root).map_err(failed(root.display().to_string(), "made"))?;
    let shutdown = Shutdown::new();
    let ending = shutdown.clone();
    let end = move || {
        notify_service(&[NotifyState::Stopping]);
        ending.cancel();
    };
    at_end(end).map_err(failed("the signals".to_owned(), "listened to"))?;
    let rig = Daemon::start(asked.settings).inspect_err(|_| {
        if made.is_new() {
            LockFile::forget_root(root);
        }
    })?;
    let rig = Arc::new(rig);
    let processing = ProcessingOptions {
        datasets: asked.datasets,
        programs: Box::new(programs),
    };
    let processing = Processing::start(rig.root(), rig.monitor().clone(), processing)?;
    let processing = Arc::new(processing);
    let options = ServeOptions {
        processing: Some(Arc::clone(&processing)),
        token,
        names: asked.names,
        heartbeat: heartbeat(),
        ..ServeOptions::at(asked.address)
    };
    serve(rig.clone(), options, &shutdown, |announcement| {
        let status = format!("Serving on {}", announcement.address);
        notify_service(&[NotifyState::Ready, NotifyState::Status(&status)]);
        announce(console, announcement);
    })?;
    // Threads of the server may hold the rig a moment longer: its end does not wait for them.
    rig.end();
    processing.end();
    drop(made);
    Ok(Outcome::Whole)
}

fn announce(console: Console, announcement: &Announcement) {
    let mut text = format!("The rig is at {}", announcement.url);
    if let Some(qr) = &announcement.qr {
        text = format!("{qr}\n{text}");
    }
    console.say(
        &text,
        &Event::Serving {
            url: announcement.url.clone(),
            address: announcement.address.to_string(),
        },
    );
}
