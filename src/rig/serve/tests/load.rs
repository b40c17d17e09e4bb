use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use super::{LONG, Serving, begin};

/// Answers after which the clients have shown what they can do.
const ANSWERS: u64 = 200;

/// Ticks as a recorder does, until there are so many answers; how often.
fn tick(serving: &Serving, answers: &AtomicU64) -> u64 {
    let picture: Arc<[u8]> = vec![7; 100_000].into();
    let began = Instant::now();
    let mut ticks = 0;
    while answers.load(Ordering::Relaxed) < ANSWERS {
        serving.rig.monitor.update(|state| state.frames += 1);
        serving.rig.monitor.show(0, picture.clone());
        ticks += 1;
        assert!(
            began.elapsed() < 10 * LONG,
            "{answers:?} answers in {ticks} ticks"
        );
        thread::sleep(Duration::from_millis(10));
    }
    ticks
}

#[test]
fn fifty_clients_that_hammer_are_answered_while_the_recorder_goes_on() {
    let serving = Serving::start();
    let done = AtomicBool::new(false);
    let answers = AtomicU64::new(0);
    let ticks = thread::scope(|scope| {
        for client in 0..50 {
            let (serving, done, answers) = (&serving, &done, &answers);
            scope.spawn(move || {
                let path = ["/api/v1/state", "/api/v1/preview.jpg?after=0", "/metrics"][client % 3];
                let mut stream = begin(
                    serving,
                    ["/api/v1/preview.mjpg", "/api/v1/events"][client % 2],
                );
                while !done.load(Ordering::Relaxed) {
                    // Those that came too late for a permit were refused, which is an answer too.
                    let _ = stream.reader.read(&mut [0; 4096]);
                    serving.get(path);
                    answers.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        let ticks = tick(&serving, &answers);
        done.store(true, Ordering::Relaxed);
        ticks
    });
    let mut events = begin(&serving, "/api/v1/events");
    events.until(&format!("\"frames\":{ticks},"));
}
