use std::thread;
use std::time::Duration;

use super::{PICTURE, Serving, begin, wait_until};

#[test]
fn the_newest_picture_is_served_with_its_number() {
    let serving = Serving::start();
    let none = serving.get("/api/v1/preview.jpg");
    assert_eq!(none.status, 503);
    assert!(!none.error().is_empty());
    serving.rig.monitor.show(1, PICTURE.into());
    let picture = serving.get("/api/v1/preview.jpg?after=0");
    assert_eq!(
        (picture.status, picture.header("relit-frame")),
        (200, Some("1"))
    );
    assert_eq!(picture.header("content-type"), Some("image/jpeg"));
    assert_eq!(picture.body, PICTURE);
}

#[test]
fn who_has_the_newest_picture_waits_for_the_next() {
    let serving = Serving::start();
    serving.rig.monitor.show(1, PICTURE.into());
    thread::scope(|scope| {
        let waiting = scope.spawn(|| serving.get("/api/v1/preview.jpg?after=1"));
        wait_until("a viewer waits", || serving.rig.monitor.is_watched());
        assert!(!waiting.is_finished());
        serving.rig.monitor.show(2, PICTURE.into());
        assert_eq!(waiting.join().unwrap().header("relit-frame"), Some("2"));
    });
    assert_eq!(serving.get("/api/v1/preview.jpg?after=2").status, 204);
    assert_eq!(serving.get("/api/v1/preview.jpg?after=x").status, 400);
}

#[test]
fn a_client_that_stopped_reading_loses_its_place() {
    let serving = Serving::with(|options| {
        options.limits.subscribers = 1;
        options.limits.connections.stall = Duration::from_millis(500);
    });
    let stream = begin(&serving, "/api/v1/events");
    assert_eq!(serving.get("/api/v1/events").status, 503);
    wait_until("its place is free", || {
        serving
            .rig
            .monitor
            .update(|state| state.object = Some("x".repeat(2_000_000)));
        begin(&serving, "/api/v1/events").status == 200
    });
    drop(stream);
}
