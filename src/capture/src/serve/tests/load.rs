use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use super::{LONG, Serving, begin};

/// Answers after which the clients have shown what they can do.
const ANSWERS: u64 = 200;
/// Longest time between two ticks.
const TICK: Duration = Duration::from_millis(10);

/// Ticks as a recorder does, until there are so many answers; how often.
fn tick(serving: &Serving, answers: &Receiver<()>) -> u64 {
    let picture: Arc<[u8]> = vec![7; 100_000].into();
    let began = Instant::now();
    let (mut ticks, mut answered) = (0, 0);
    while answered < ANSWERS {
        serving.rig.monitor.update(|state| state.frames += 1);
        serving.rig.monitor.show(0, picture.clone());
        ticks += 1;
        answered += u64::from(answers.recv_timeout(TICK).is_ok());
        assert!(
            began.elapsed() < 10 * LONG,
            "{answered} answers in {ticks} ticks"
        );
    }
    ticks
}

#[test]
fn fifty_clients_that_hammer_are_answered_while_the_recorder_goes_on() {
    let serving = Serving::start();
    let done = AtomicBool::new(false);
    let (answer, answers) = mpsc::sync_channel(1);
    let ticks = thread::scope(|scope| {
        for client in 0..50 {
            let (serving, done, answer) = (&serving, &done, answer.clone());
            scope.spawn(move || {
                let path = ["/api/v1/state", "/api/v1/preview.jpg?after=0"][client % 2];
                let mut stream = begin(serving, "/api/v1/events");
                while !done.load(Ordering::Relaxed) {
                    // Those that came too late for a permit were refused, which is an answer too.
                    let _ = stream.reader.read(&mut [0; 4096]);
                    serving.get(path);
                    // Nobody waits where one answer lies there already.
                    let _ = answer.try_send(());
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
