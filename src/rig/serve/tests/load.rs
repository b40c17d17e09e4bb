use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use super::{Serving, begin};

/// The longest that one tick of a recorder took at the monitor, over so many ticks of 10 ms.
fn worst_tick(serving: &Serving, ticks: u32) -> Duration {
    let picture: Arc<[u8]> = vec![7; 100_000].into();
    let mut worst = Duration::ZERO;
    for tick in 0..ticks {
        let began = Instant::now();
        serving.rig.monitor.update(|state| state.frames += 1);
        serving.rig.monitor.show(i64::from(tick), picture.clone());
        worst = worst.max(began.elapsed());
        thread::sleep(Duration::from_millis(10));
    }
    worst
}

#[test]
fn fifty_clients_that_hammer_never_hold_the_recorder_up() {
    let serving = Serving::start();
    let done = AtomicBool::new(false);
    let answers = AtomicU64::new(0);
    let worst = thread::scope(|scope| {
        for client in 0..50 {
            let (serving, done, answers) = (&serving, &done, &answers);
            scope.spawn(move || {
                let path = ["/api/v1/state", "/api/v1/preview.jpg?after=0", "/metrics"][client % 3];
                let mut stream = begin(
                    serving,
                    ["/api/v1/preview.mjpg", "/api/v1/events"][client % 2],
                );
                while !done.load(Ordering::Relaxed) {
                    // Those that came too late for a place were refused, which is an answer too.
                    let _ = stream.reader.read(&mut [0; 4096]);
                    serving.get(path);
                    answers.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        let worst = worst_tick(&serving, 300);
        done.store(true, Ordering::Relaxed);
        worst
    });
    assert!(answers.load(Ordering::Relaxed) > 200, "{answers:?}");
    // Two locks, each held for a copy of a few hundred bytes: a tick of a 30 frames/s camera is 33 ms.
    assert!(worst < Duration::from_millis(500), "{worst:?}");
    eprintln!("{answers:?} answers, slowest tick {worst:?}");
    assert_eq!(serving.get("/api/v1/state").json()["frames"], 300);
}
