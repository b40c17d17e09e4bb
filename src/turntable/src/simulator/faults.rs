//! The faults of a simulated table; those of its chip also as text: `reset@12.5s,stall@20s`.

use std::str::FromStr;
use std::time::Duration;

use super::SimulatorError;

/// Faults of the serial line and of the chip.
///
/// As text, separated by commas: `reset@12.5s` restarts the chip at that time, as its watchdog does; `stall@20s` makes
/// it stop answering and moving; `estop@30s` presses the emergency stop. Times count from the table's start on its
/// clock.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableFaults {
    /// Faults of the line to the chip.
    pub to_chip: SerialFaults,
    /// Faults of the line from the chip.
    pub from_chip: SerialFaults,
    /// Times at which the chip restarts.
    pub resets: Vec<Duration>,
    /// Time at which the chip stops for good.
    pub stall: Option<Duration>,
    /// Time at which the emergency stop is pressed.
    pub emergency_stop: Option<Duration>,
}

/// Faults of one direction of the serial line; fractions from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SerialFaults {
    /// Fraction of the bytes that are lost.
    pub drop: f64,
    /// Fraction of the bytes in which one bit is flipped.
    pub flip: f64,
    /// Fraction of the lines that arrive twice.
    pub duplicate: f64,
    /// Fraction of the lines that lose their line end and merge with the next one.
    pub merge: f64,
    /// Fraction of the bytes that arrive late.
    pub delay: f64,
    /// Their delay.
    pub delay_by: Duration,
}

impl FromStr for TableFaults {
    type Err = SimulatorError;

    fn from_str(text: &str) -> Result<TableFaults, SimulatorError> {
        let mut faults = TableFaults::default();
        for item in text.split(',') {
            let (what, at) = item.split_once('@').unwrap_or_default();
            match (what, seconds(at)) {
                ("reset", Some(at)) => faults.resets.push(at),
                ("stall", Some(at)) => faults.stall = Some(at),
                ("estop", Some(at)) => faults.emergency_stop = Some(at),
                _ => {
                    return Err(SimulatorError(format!(
                        "the fault {item:?} is not understood: write reset@5s, stall@5s or estop@5s"
                    )));
                }
            }
        }
        Ok(faults)
    }
}

fn seconds(text: &str) -> Option<Duration> {
    let seconds = text.strip_suffix('s')?.parse().ok()?;
    Duration::try_from_secs_f64(seconds).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_faults_are_read() {
        let faults: TableFaults = "reset@12.5s,reset@20s,stall@30s,estop@5s".parse().unwrap();
        let expected = TableFaults {
            resets: vec![Duration::from_millis(12_500), Duration::from_secs(20)],
            stall: Some(Duration::from_secs(30)),
            emergency_stop: Some(Duration::from_secs(5)),
            ..TableFaults::default()
        };
        assert_eq!(faults, expected);
    }

    #[test]
    fn an_invalid_fault_is_named_in_the_error() {
        for text in [
            "",
            "drop=0.1",
            "reset@",
            "reset@5",
            "reset@-1s",
            "stall@1e99s",
            "flip@3s",
            "stall@NaNs",
        ] {
            let error = text.parse::<TableFaults>().unwrap_err().to_string();
            assert!(error.contains(&format!("{text:?}")), "{error}");
        }
    }
}
