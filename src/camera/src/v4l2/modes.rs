//! The modes that a device offers.

use std::io;

use v4l::v4l_sys as sys;

use super::ioctl::Node;
use crate::{Fourcc, Mode, Rate, Rates};

/// Most entries that are read of a driver's list, in case a faulty driver's list does not end.
const MAX_ENTRIES: u32 = 256;

/// Formats that can be recorded, with sizes and rates.
pub(super) fn read(node: &Node) -> io::Result<Vec<Mode>> {
    let mut modes = Vec::new();
    for code in entries(|index| node.pixel_format(index))? {
        let fourcc = Fourcc::from_code(code);
        if fourcc.pixel_format().is_none() {
            continue;
        }
        for sizes in entries(|index| node.frame_size(code, index))? {
            let largest = sizes.largest();
            let intervals = entries(|index| node.frame_interval(code, largest, index))?;
            modes.push(Mode {
                fourcc,
                sizes,
                rates: rates(&intervals),
            });
        }
    }
    Ok(modes)
}

/// A driver's list from index 0 to its end.
fn entries<T>(entry: impl Fn(u32) -> io::Result<Option<T>>) -> io::Result<Vec<T>> {
    let mut found = Vec::new();
    for index in 0..MAX_ENTRIES {
        match entry(index)? {
            Some(entry) => found.push(entry),
            None => break,
        }
    }
    Ok(found)
}

/// Intervals are seconds; the shortest is the fastest rate.
fn rates(intervals: &[(sys::v4l2_fract, sys::v4l2_fract)]) -> Rates {
    let rate = |of: sys::v4l2_fract| Rate::new(of.denominator, of.numerator);
    let mut list = Vec::new();
    for &(shortest, longest) in intervals {
        match (rate(shortest), rate(longest)) {
            (Some(fastest), Some(slowest)) if fastest == slowest => list.push(fastest),
            (Some(fastest), Some(slowest)) => return Rates::Range { slowest, fastest },
            _ => {}
        }
    }
    if list.is_empty() {
        return Rates::Unknown;
    }
    Rates::List(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_become_rates() {
        let interval = |numerator, denominator| sys::v4l2_fract {
            numerator,
            denominator,
        };
        let one = |numerator, denominator| {
            let one = interval(numerator, denominator);
            (one, one)
        };
        let list = rates(&[one(1, 30), one(1001, 30000), one(0, 5)]);
        let wanted = [Rate::new(30, 1), Rate::new(30000, 1001)];
        assert_eq!(list, Rates::List(wanted.into_iter().flatten().collect()));
        let range = (interval(1, 60), interval(1, 5));
        let (slowest, fastest) = (Rate::new(5, 1).unwrap(), Rate::new(60, 1).unwrap());
        assert_eq!(rates(&[range]), Rates::Range { slowest, fastest });
        assert_eq!(rates(&[]), Rates::Unknown);
    }

    #[test]
    fn a_list_without_end_is_cut() {
        let endless = entries(|index| Ok(Some(index))).unwrap();
        assert_eq!(endless.len(), MAX_ENTRIES as usize);
    }
}
