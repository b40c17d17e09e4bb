//! The table behind `/dev/ttyS1`, asked without the programs that are tested.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use relit_turntable::{Port, SerialPort};

const LINE: &str = "/dev/ttyS1";
/// Between two questions: one that comes while the controller starts is lost.
const ASKED_EVERY: Duration = Duration::from_secs(1);
/// How long a report may take.
const MAX_WAIT: Duration = Duration::from_secs(20);

/// Asks the controller twice, and checks that the table stands; gives its state.
pub(crate) fn stands() -> String {
    let mut port = SerialPort::open(Path::new(LINE)).unwrap();
    let first = report(&mut port);
    thread::sleep(Duration::from_millis(500));
    let (state, at) = report(&mut port);
    assert_eq!(first, (state.clone(), at), "the table turns");
    assert!(!["Run", "Jog", "Home"].contains(&state.as_str()), "{state}");
    state
}

/// State and position of one status report.
fn report(port: &mut SerialPort) -> (String, String) {
    let until = Instant::now() + MAX_WAIT;
    let mut text = String::new();
    while Instant::now() < until {
        port.write(b"?").unwrap();
        let again = Instant::now() + ASKED_EVERY;
        while Instant::now() < again {
            let mut bytes = [0; 256];
            let count = port.read(&mut bytes, Duration::from_millis(50)).unwrap();
            text.push_str(&String::from_utf8_lossy(&bytes[..count]));
            if let Some(report) = state_and_position(&text) {
                return report;
            }
        }
    }
    panic!("the table does not answer: {text:?}");
}

fn state_and_position(text: &str) -> Option<(String, String)> {
    let (_, rest) = text.split_once('<')?;
    let (report, _) = rest.split_once('>')?;
    let mut fields = report.split('|');
    let state = fields.next()?.to_owned();
    let at = fields.find(|field| field.contains("Pos:"))?;
    Some((state, at.to_owned()))
}
