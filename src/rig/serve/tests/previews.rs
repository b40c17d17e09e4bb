use std::sync::Arc;
use std::thread;
use std::time::Duration;

use super::{PICTURE, Serving, begin, wait_until};

#[test]
fn the_newest_picture_is_served_with_its_number() {
    let serving = Serving::start();
    let none = serving.get("/api/v1/preview.jpg");
    assert_eq!(none.status, 503);
    assert!(none.error().contains("no picture yet"));
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
        wait_until("a viewer waits", || {
            let metrics = serving.get("/metrics").body;
            String::from_utf8_lossy(&metrics).contains("relit_http_viewers 1\n")
        });
        assert!(!waiting.is_finished());
        serving.rig.monitor.show(2, PICTURE.into());
        assert_eq!(waiting.join().unwrap().header("relit-frame"), Some("2"));
    });
    assert_eq!(serving.get("/api/v1/preview.jpg?after=2").status, 204);
    assert_eq!(serving.get("/api/v1/preview.jpg?after=x").status, 400);
}

#[test]
fn a_stream_of_pictures_gives_each_part_at_once() {
    let serving = Serving::start();
    serving.rig.monitor.show(1, PICTURE.into());
    let mut stream = begin(&serving, "/api/v1/preview.mjpg");
    let kind = stream.header("content-type").unwrap();
    assert_eq!(kind, "multipart/x-mixed-replace; boundary=picture");
    stream.until("--picture\r\n");
    // The boundary after the picture has come, though there is no other picture yet.
    let part = stream.until("--picture\r\n");
    assert!(
        part.contains("Content-Type: image/jpeg\r\nContent-Length: 8\r\n\r\n"),
        "{part}"
    );
    serving.rig.monitor.show(2, PICTURE.into());
    stream.until("--picture\r\n");
}

#[test]
fn a_viewer_that_does_not_read_skips_pictures() {
    let serving = Serving::start();
    let mut stream = begin(&serving, "/api/v1/preview.mjpg");
    // Another one reads: it takes so long as one that reads needs for all pictures.
    let mut other = begin(&serving, "/api/v1/preview.mjpg");
    // Far more in all than any buffer on the way holds.
    let shown: i64 = 30;
    for number in 1..=shown {
        let mut jpeg = vec![b'.'; 2_000_000];
        let mark = format!("number {number} ");
        jpeg[..mark.len()].copy_from_slice(mark.as_bytes());
        serving.rig.monitor.show(number, Arc::from(jpeg));
        other.until(&mark);
    }
    let mut numbers = Vec::new();
    while numbers.last() != Some(&shown) {
        stream.until("number ");
        numbers.push(stream.until(" ").trim().parse::<i64>().unwrap());
    }
    assert!(numbers.is_sorted(), "{numbers:?}");
    let jump = numbers.windows(2).map(|pair| pair[1] - pair[0]).max();
    assert!(jump > Some(10), "{numbers:?}");
}

#[test]
fn a_viewer_that_stopped_reading_loses_its_place() {
    let serving = Serving::with(|options| {
        options.limits.viewers = 1;
        options.limits.stall = Duration::from_millis(500);
    });
    let stream = begin(&serving, "/api/v1/preview.mjpg");
    assert_eq!(serving.get("/api/v1/preview.mjpg").status, 503);
    wait_until("its place is free", || {
        serving.rig.monitor.show(1, Arc::from(vec![0; 2_000_000]));
        begin(&serving, "/api/v1/preview.mjpg").status == 200
    });
    drop(stream);
}
