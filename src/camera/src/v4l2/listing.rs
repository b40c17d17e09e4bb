//! Which devices there are.

use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;

use super::device::Device;
use crate::{CameraAddress, CameraError, DeviceInfo};

/// All video devices that deliver pictures, by number. A device that cannot be opened is listed with
/// the reason; nodes of other kinds, such as those for metadata, are not listed.
pub(crate) fn list() -> Vec<DeviceInfo> {
    let mut nodes = nodes(Path::new("/dev"));
    nodes.sort_unstable();
    let devices = nodes.into_iter();
    devices
        .filter_map(|(_, path)| match Device::open(&path) {
            Ok((_, info)) => Some(info),
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
        problems: vec![with_causes(error)],
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

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
        assert!(info.problems[0].contains("`video`"), "{info:?}");
        let answer = io::Error::from(io::ErrorKind::PermissionDenied).to_string();
        assert!(info.problems[0].contains(&answer), "{info:?}");
    }
}
