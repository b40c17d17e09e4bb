//! `relit-capture serve`: the daemon and its page.

use std::fs;
use std::sync::Arc;

use relit_rig::capture::CaptureError;
use relit_rig::daemon::Daemon;
use relit_rig::serve::{Announcement, ServeError, ServeOptions, Shutdown, serve};
use serde_json::json;

use crate::arguments::Serve;
use crate::environment::{at_end, service_manager};
use relit::console::{Console, Outcome};

/// Why the rig is not served.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The rig.
    #[error(transparent)]
    Rig(#[from] CaptureError),
    /// The server.
    #[error(transparent)]
    Serve(#[from] ServeError),
}

pub(crate) fn run(console: Console, asked: Serve) -> Result<Outcome, Error> {
    let root = &asked.settings.root;
    let failed = |what: String, doing| {
        move |source| CaptureError::System {
            what,
            doing,
            source,
        }
    };
    fs::create_dir_all(root).map_err(failed(root.display().to_string(), "made"))?;
    let shutdown = Shutdown::new();
    let told = shutdown.clone();
    at_end(move || told.request()).map_err(failed("the signals".to_owned(), "listened to"))?;
    let rig = Arc::new(Daemon::start(asked.settings)?);
    let options = ServeOptions {
        token: asked.token,
        names: asked.names,
        service: service_manager(),
        ..ServeOptions::at(asked.address)
    };
    serve(rig.clone(), options, &shutdown, |announcement| {
        announce(console, announcement)
    })?;
    // Threads of the server may hold the rig a moment longer: its end does not wait for them.
    rig.end();
    Ok(Outcome::Whole)
}

fn announce(console: Console, announcement: &Announcement) {
    let mut text = format!("The rig is at {}", announcement.url);
    if let Some(qr) = &announcement.qr {
        text = format!("{qr}\n{text}");
    }
    console.say(
        &text,
        &json!({ "event": "serving", "url": announcement.url, "address": announcement.address.to_string() }),
    );
}
