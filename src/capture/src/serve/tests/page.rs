use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::{LONG, Serving};
use crate::serve::{Heartbeat, page};

#[test]
fn the_page_and_its_files_are_served_and_need_nothing_else() {
    let serving = Serving::start();
    let index = serving.get("/");
    assert_eq!(
        index.header("content-type"),
        Some("text/html; charset=utf-8")
    );
    let index = String::from_utf8(index.body).unwrap();
    for asset in &page::ASSETS {
        let answer = serving.get(asset.path);
        assert_eq!(
            answer.header("content-type"),
            Some(asset.kind),
            "{}",
            asset.path
        );
        assert_eq!(answer.body, asset.text.as_bytes());
    }
    // The policy allows no script or style in the page itself, and nothing from elsewhere.
    for forbidden in [
        "<style", "style=", "onclick", "https://", "http://", "<script>",
    ] {
        assert!(!index.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn scripts_set_text_never_markup_and_look_only_for_what_the_page_has() {
    let index = include_str!("../page/index.html");
    let scripts = page::ASSETS
        .iter()
        .filter(|asset| asset.path.ends_with(".js"));
    for script in scripts {
        for forbidden in [
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
        ] {
            assert!(
                !script.text.contains(forbidden),
                "{forbidden} in {}",
                script.path
            );
        }
        for opening in ["$(\"", "getElementById(\""] {
            for piece in script.text.split(opening).skip(1) {
                let id = piece.split('"').next().unwrap();
                assert!(
                    index.contains(&format!("id=\"{id}\"")),
                    "{id} in {}",
                    script.path
                );
            }
        }
    }
}

/// A server whose beats come through a channel, which closes when there will be no more.
fn beating() -> (Serving, Receiver<()>) {
    let (sender, beats) = mpsc::sync_channel(64);
    let serving = Serving::with(|options| {
        options.heartbeat = Some(Heartbeat {
            period: Duration::from_millis(5),
            beat: Box::new(move || {
                let _ = sender.try_send(());
            }),
        });
    });
    (serving, beats)
}

/// Takes the beats that are left, until there will be no more.
fn wait_end(beats: &Receiver<()>) {
    let began = Instant::now();
    while beats.recv_timeout(LONG) != Err(RecvTimeoutError::Disconnected) {
        assert!(began.elapsed() < LONG, "it beats on");
    }
}

#[test]
fn a_supervisor_hears_that_the_server_is_alive_until_it_ends() {
    let (mut serving, beats) = beating();
    for _ in 0..3 {
        beats.recv_timeout(LONG).unwrap();
    }
    serving.stop();
    wait_end(&beats);
}

#[test]
fn a_supervisor_hears_nothing_more_once_the_rig_has_failed() {
    let (serving, beats) = beating();
    beats.recv_timeout(LONG).unwrap();
    serving.rig.failed.store(true, Ordering::Relaxed);
    wait_end(&beats);
    assert_eq!(serving.get("/").status, 200);
}
