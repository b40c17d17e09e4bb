//! `relit-capture serve`: the daemon and its page.

use std::error::Error;
use std::sync::Arc;

use relit_capture::capture::{CaptureError, Settings};
use relit_capture::command::Rig;
use relit_capture::daemon::Daemon;
use relit_capture::processing::{Processing, ProcessingOptions};
use relit_capture::serve::{Announcement, ServeOptions, Shutdown, Token, check_address, serve};
use relit_turntable::lockfile::LockFile;
use sd_notify::NotifyState;

use super::arguments::ServeArguments;
use super::environment::{at_end, heartbeat, notify_service, programs};
use relit_console::{Console, Event, Outcome};
use relit_data::durable::CreatedFolder;

pub(crate) fn run(console: Console, asked: ServeArguments) -> Result<Outcome, Box<dyn Error>> {
    let settings: Settings = asked.rig.into();
    let root = &settings.root.clone();
    let address = asked.listen.socket();
    let token = asked.token_file.as_deref().map(Token::from_file_or_new);
    let token = token.transpose()?;
    // An address that is taken is known before anything is made or moved.
    check_address(address)?;
    let made = CreatedFolder::make(root)
        .map_err(CaptureError::system(root.display().to_string(), "made"))?;
    let shutdown = Shutdown::new();
    let ending = shutdown.clone();
    let end = move || {
        notify_service(&[NotifyState::Stopping]);
        ending.cancel();
    };
    at_end(end).map_err(CaptureError::system("the signals", "listened to"))?;
    let rig = Daemon::start(settings).inspect_err(|_| {
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
        names: asked.listen.names(&asked.names),
        heartbeat: heartbeat(),
        ..ServeOptions::at(address)
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
    Ok(Outcome::Success)
}

fn announce(console: Console, announcement: &Announcement) {
    let mut text = format!("The rig is at {}", announcement.url);
    if let Some(qr) = &announcement.qr {
        text = format!("{qr}\n{text}");
    }
    console.print(
        &text,
        &Event::Serving {
            url: announcement.url.clone(),
            address: announcement.address.to_string(),
        },
    );
}
