//! The faults of a simulated table as text: `drop=0.01,flip=0.005,reset@12.5s`.

use std::str::FromStr;
use std::time::Duration;

use super::SimulatorError;

/// Faults of the serial line and of the chip.
///
/// As text, separated by commas: `drop=0.01` loses that fraction of the bytes, `flip=` flips a bit
/// in that fraction of the bytes, `duplicate=` repeats that fraction of the lines, `merge=` loses the
/// end of that fraction of the lines, `delay=0.02:30ms` delays that fraction of the bytes, and what
/// follows them, by that time. They apply to both directions, with the prefix `to.` only to bytes to
/// the chip, with `from.` only to bytes from it. `reset@12.5s` restarts the chip at that time, as its
/// watchdog does; `stall@20s` makes it stop answering and moving; `estop@30s:8s` presses the emergency
/// stop for eight seconds, and `estop@30s` for good. Times count from the table's start on its clock.
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
    /// When the emergency stop is pressed, and for how long; `None`: for good.
    pub emergency_stops: Vec<(Duration, Option<Duration>)>,
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
        for item in text
            .split(',')
            .map(str::trim)
            .filter(|item| !item.is_empty())
        {
            faults.add(item).map_err(|why| {
                SimulatorError(format!("the fault {item:?} is not understood: {why}"))
            })?;
        }
        Ok(faults)
    }
}

impl TableFaults {
    fn add(&mut self, item: &str) -> Result<(), &'static str> {
        if let Some((what, at)) = item.split_once('@') {
            match what {
                "reset" => self.resets.push(duration(at)?),
                "stall" => self.stall = Some(duration(at)?),
                "estop" => self.emergency_stops.push(emergency_stop(at)?),
                _ => return Err("only reset, stall and estop take a time"),
            }
            return Ok(());
        }
        let (what, how) = item
            .split_once('=')
            .ok_or("write it as drop=0.01 or reset@5s")?;
        if let Some(what) = what.strip_prefix("to.") {
            return self.to_chip.set(what, how);
        }
        if let Some(what) = what.strip_prefix("from.") {
            return self.from_chip.set(what, how);
        }
        self.to_chip.set(what, how)?;
        self.from_chip.set(what, how)
    }
}

impl SerialFaults {
    fn set(&mut self, what: &str, how: &str) -> Result<(), &'static str> {
        let place = match what {
            "drop" => &mut self.drop,
            "flip" => &mut self.flip,
            "duplicate" => &mut self.duplicate,
            "merge" => &mut self.merge,
            "delay" => {
                let (share_of, by) = how.split_once(':').ok_or("write it as delay=0.02:30ms")?;
                self.delay = share(share_of)?;
                self.delay_by = duration(by)?;
                return Ok(());
            }
            _ => {
                return Err(
                    "the faults are drop, flip, duplicate, merge, delay, reset, stall and estop",
                );
            }
        };
        *place = share(how)?;
        Ok(())
    }
}

fn share(text: &str) -> Result<f64, &'static str> {
    let share = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    share.ok_or("a share is a number from 0 to 1")
}

/// `30s` or `30s:8s`.
fn emergency_stop(text: &str) -> Result<(Duration, Option<Duration>), &'static str> {
    let (at, lasts) = match text.split_once(':') {
        Some((at, lasts)) => (at, Some(duration(lasts)?)),
        None => (text, None),
    };
    Ok((duration(at)?, lasts))
}

fn duration(text: &str) -> Result<Duration, &'static str> {
    const WRONG: &str = "a time is a number with its unit, as in 12.5s or 30ms";
    let (number, unit) = match text.strip_suffix("ms") {
        Some(number) => (number, 1000.0),
        None => (text.strip_suffix('s').ok_or(WRONG)?, 1.0),
    };
    let seconds = number.parse::<f64>().map_err(|_| WRONG)? / unit;
    if !(0.0..=1e6).contains(&seconds) {
        return Err(WRONG);
    }
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_faults_are_read() {
        let faults: TableFaults = "drop=0.01, to.flip=0.005,from.duplicate=1,merge=0,\
                              delay=0.02:30ms,reset@12.5s,reset@20s,stall@30s,\
                              estop@5s:250ms,estop@9s"
            .parse()
            .unwrap();
        let both = SerialFaults {
            drop: 0.01,
            delay: 0.02,
            delay_by: Duration::from_millis(30),
            ..SerialFaults::default()
        };
        let expected = TableFaults {
            to_chip: SerialFaults {
                flip: 0.005,
                ..both
            },
            from_chip: SerialFaults {
                duplicate: 1.0,
                ..both
            },
            resets: vec![Duration::from_millis(12_500), Duration::from_secs(20)],
            stall: Some(Duration::from_secs(30)),
            emergency_stops: vec![
                (Duration::from_secs(5), Some(Duration::from_millis(250))),
                (Duration::from_secs(9), None),
            ],
        };
        assert_eq!(faults, expected);
        assert_eq!("".parse::<TableFaults>().unwrap(), TableFaults::default());
    }

    #[test]
    fn an_invalid_fault_is_named_in_the_error() {
        for text in [
            "drop",
            "drop=",
            "drop=2",
            "drop=-0.1",
            "drop=NaN",
            "lose=0.1",
            "delay=0.1",
            "delay=0.1:3",
            "reset@",
            "reset@5",
            "reset@-1s",
            "stall@1e9s",
            "flip@3s",
            "estop@3s:",
            "estop@3s:4",
            "to.reset=1",
        ] {
            let error = text.parse::<TableFaults>().unwrap_err().to_string();
            assert!(error.contains(text), "{error}");
        }
    }
}
