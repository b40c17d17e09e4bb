//! Which devices there are, and what they offer.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;
use v4l::v4l_sys as sys;

use super::ioctl::Node;
use super::{Camera as _, CameraError, V4l2Camera};
use crate::camera::{CameraAddress, DeviceInfo, Fourcc, Mode, Rate, Rates};

/// Most entries that are read of a driver's list, in case a faulty driver's list does not end.
const MOST_ENTRIES: u32 = 256;

/// All video devices that deliver pictures, by number. A device that cannot be opened is listed with
/// the reason; nodes of other kinds, such as those for metadata, are not listed.
pub(in crate::camera) fn list() -> Vec<DeviceInfo> {
    let mut nodes = nodes(Path::new("/dev"));
    nodes.sort_unstable();
    let devices = nodes.into_iter();
    devices
        .filter_map(|(_, path)| match V4l2Camera::open(&path) {
            Ok(camera) => Some(camera.info().clone()),
            Err(CameraError::NotACamera { .. }) => None,
            Err(error) => Some(unreadable(path, &error)),
        })
        .collect()
}

/// Numbers and paths of a folder's video nodes.
fn nodes(folder: &Path) -> Vec<(u32, PathBuf)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let number = name.to_str()?.strip_prefix("video")?.parse().ok()?;
            Some((number, entry.path()))
        })
        .collect()
}

fn unreadable(path: PathBuf, error: &CameraError) -> DeviceInfo {
    DeviceInfo {
        address: CameraAddress::V4l2(path),
        name: String::new(),
        driver: String::new(),
        bus: String::new(),
        modes: Vec::new(),
        other_formats: Vec::new(),
        problems: vec![with_causes(error)],
    }
}

/// Formats that can be recorded, with sizes and rates, and the others.
pub(super) fn modes(node: &Node) -> io::Result<(Vec<Mode>, Vec<Fourcc>)> {
    let (mut modes, mut others) = (Vec::new(), Vec::new());
    for code in entries(|index| node.pixel_format(index))? {
        let fourcc = Fourcc::from_code(code);
        if fourcc.pixel_format().is_none() {
            others.push(fourcc);
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
    Ok((modes, others))
}

/// A driver's list from index 0 to its end.
fn entries<T>(entry: impl Fn(u32) -> io::Result<Option<T>>) -> io::Result<Vec<T>> {
    let mut found = Vec::new();
    for index in 0..MOST_ENTRIES {
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
        assert_eq!(endless.len(), MOST_ENTRIES as usize);
    }

    #[test]
    fn only_numbered_video_nodes_count() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["video10", "video2", "video", "vbi0", "videox"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let mut found = nodes(folder.path());
        found.sort_unstable();
        let numbers: Vec<u32> = found.iter().map(|&(number, _)| number).collect();
        assert_eq!(numbers, [2, 10]);
    }

    #[test]
    fn a_device_that_cannot_be_opened_is_listed_with_the_reason() {
        let error = CameraError::NotPermitted {
            device: "/dev/video3".to_owned(),
            source: Some(io::ErrorKind::PermissionDenied.into()),
        };
        let info = unreadable("/dev/video3".into(), &error);
        assert_eq!(info.address.to_string(), "v4l2:/dev/video3");
        assert!(info.problems[0].contains("group `video`"), "{info:?}");
        assert!(info.problems[0].contains("permission denied"), "{info:?}");
    }
}
