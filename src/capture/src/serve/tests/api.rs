use std::sync::Barrier;
use std::thread;

use super::{Serving, begin, wait_until};
use crate::command::Command;
use crate::state::Phase;

#[test]
fn the_state_is_what_the_monitor_holds() {
    let serving = Serving::start();
    serving.rig.monitor.update(|state| {
        state.phase = Phase::MovingBack;
        state.table.angle_deg = Some(12.5);
        state.object = Some("mug".to_owned());
    });
    let fault = "the table does not answer";
    serving.rig.monitor.fault(7, fault);
    let mut events = begin(&serving, "/api/v1/events");
    events.until(fault);
    let state = serving.get("/api/v1/state");
    assert_eq!(state.status, 200);
    assert_eq!(state.header("content-type"), Some("application/json"));
    let state = state.json();
    assert_eq!(state["phase"], "moving-back");
    assert_eq!(state["table"]["angle_deg"], 12.5);
    assert_eq!(state["object"], "mug");
    assert_eq!(state["faults"][0]["what"], fault);
}

#[test]
fn a_command_reaches_the_rig_and_its_answer_is_the_state_after_it() {
    let serving = Serving::start();
    let answer = serving.command(r#"{"command":"start","object":"mug"}"#);
    assert_eq!(answer.status, 202);
    assert_eq!(answer.json()["phase"], "recording");
    assert_eq!(serving.get("/api/v1/state").json()["object"], "mug");
    for body in [
        r#"{"command":"reset"}"#,
        r#"{"command":"set-control","name":"gain","value":-3}"#,
        r#"{"command":"stop"}"#,
    ] {
        assert_eq!(serving.command(body).status, 202, "{body}");
    }
    let told = serving.rig.told.lock().unwrap();
    let object = "mug".to_owned();
    assert_eq!(told[0], Command::Start { object });
    assert_eq!(
        told[2],
        Command::SetControl {
            name: "gain".to_owned(),
            value: -3
        }
    );
    assert_eq!(told.last(), Some(&Command::Stop));
}

#[test]
fn what_the_rig_refuses_is_told_in_its_words() {
    let serving = Serving::start();
    let refused = serving.command(r#"{"command":"home"}"#);
    assert_eq!((refused.status, &*refused.error()), (503, super::NO_TABLE));
    let refused = serving.command(r#"{"command":"jog","degrees":1e9}"#);
    assert_eq!((refused.status, &*refused.error()), (422, super::TOO_FAR));
    let start = r#"{"command":"start","object":"mug"}"#;
    assert_eq!(serving.command(start).status, 202);
    let refused = serving.command(start);
    assert_eq!(refused.status, 409);
    assert_eq!(refused.error(), super::BUSY);
}

#[test]
fn what_is_no_command_does_not_reach_the_rig() {
    let serving = Serving::start();
    for body in [
        "",
        "start",
        "[]",
        r#"{"command":"explode"}"#,
        r#"{"command":"start"}"#,
        r#"{"command":"start","object":"mug","speed":9}"#,
        r#"{"command":"jog","degrees":"far"}"#,
        r#"{"command":"stop"} {"command":"stop"}"#,
    ] {
        let refused = serving.command(body);
        assert_eq!(refused.status, 400, "{body}");
        assert!(!refused.error().is_empty(), "{body}");
    }
    assert!(serving.rig.told.lock().unwrap().is_empty());
}

#[test]
fn of_many_starts_at_once_exactly_one_is_taken() {
    let serving = Serving::start();
    let together = Barrier::new(12);
    let statuses: Vec<u16> = thread::scope(|scope| {
        let starts: Vec<_> = (0..12)
            .map(|number| {
                let (serving, together) = (&serving, &together);
                scope.spawn(move || {
                    together.wait();
                    let start = format!(r#"{{"command":"start","object":"mug{number}"}}"#);
                    serving.command(&start).status
                })
            })
            .collect();
        starts
            .into_iter()
            .map(|start| start.join().unwrap())
            .collect()
    });
    let count = |wanted| statuses.iter().filter(|status| **status == wanted).count();
    assert_eq!((count(202), count(409)), (1, 11), "{statuses:?}");
}

#[test]
fn events_tell_the_state_at_once_then_its_changes_and_beat_between() {
    let serving = Serving::start();
    let mut events = begin(&serving, "/api/v1/events");
    assert_eq!(events.header("content-type"), Some("text/event-stream"));
    assert!(events.until("\n\n").contains(r#""phase":"idle""#));
    serving
        .rig
        .monitor
        .update(|state| state.phase = Phase::Starting);
    assert!(events.until("\n\n").contains(r#""phase":"starting""#));
    assert!(events.until("\n\n").contains("event: beat"));
}

#[test]
fn a_state_that_changes_all_the_time_is_told_ten_times_a_second_at_most() {
    let serving = Serving::start();
    let mut events = begin(&serving, "/api/v1/events");
    events.until("\n\n");
    let began = std::time::Instant::now();
    for _ in 0..10 {
        for _ in 0..100 {
            serving.rig.monitor.update(|state| state.frames += 1);
        }
        events.until("\n\n");
    }
    assert!(began.elapsed().as_millis() >= 900, "{:?}", began.elapsed());
}

#[test]
fn one_subscriber_too_many_is_refused_and_a_place_comes_free_again() {
    let serving = Serving::with(|options| options.limits.subscribers = 2);
    let one = begin(&serving, "/api/v1/events");
    let other = begin(&serving, "/api/v1/events");
    let refused = serving.get("/api/v1/events");
    assert_eq!(refused.status, 503);
    assert!(!refused.error().is_empty());
    drop(one);
    wait_until("a place is free", || {
        begin(&serving, "/api/v1/events").status == 200
    });
    drop(other);
}
