//! Times as people say them.

use std::time::Duration;

const MINUTE: u64 = 60;
const HOUR: u64 = 60 * MINUTE;
const DAY: u64 = 24 * HOUR;

/// A time in its two largest units, rounded up to the minute: nobody waits in vain for the last one.
///
/// ```
/// use std::time::Duration;
///
/// assert_eq!(relit_console::format_duration(Duration::from_secs(8000)), "2 h 14 min");
/// ```
pub fn format_duration(time: Duration) -> String {
    let minutes = time.as_secs_f64() / MINUTE as f64;
    let seconds = MINUTE * minutes.ceil() as u64;
    let (days, hours) = (seconds / DAY, seconds % DAY / HOUR);
    let minutes = seconds % HOUR / MINUTE;
    match (days, hours, minutes) {
        (0, 0, minutes) => format!("{} min", minutes.max(1)),
        (0, hours, minutes) => format!("{hours} h {minutes} min"),
        (1, hours, _) => format!("1 day {hours} h"),
        (days, hours, _) => format!("{days} days {hours} h"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_two_units_at_most() {
        for (seconds, words) in [
            (0, "1 min"),
            (61, "2 min"),
            (3599, "1 h 0 min"),
            (8000, "2 h 14 min"),
            (90_000, "1 day 1 h"),
            (200_000, "2 days 7 h"),
        ] {
            assert_eq!(format_duration(Duration::from_secs(seconds)), words);
        }
    }
}
