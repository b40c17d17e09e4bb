//! A V4L2 device that is open, and what its errors mean.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;
use rustix::io::Errno;
use v4l::v4l_sys as sys;

use super::ioctl::{Identity, Node};
use super::modes;
use crate::{CameraAddress, CameraError, DeviceInfo, Mode};

/// A node and its name, for errors.
#[derive(Debug)]
pub(super) struct Device {
    pub(super) node: Node,
    pub(super) path: PathBuf,
}

impl Device {
    /// Opens a node that delivers pictures, and describes it.
    pub(super) fn open(path: &Path) -> Result<(Self, DeviceInfo), CameraError> {
        let node = Node::open(path).map_err(|error| open_error(path, error))?;
        let device = Self {
            node,
            path: path.to_owned(),
        };
        let identity = device.node.identity();
        let identity = identity.map_err(|error| device.no_camera(error))?;
        device.check_capabilities(identity.capabilities)?;
        let info = device.describe(identity)?;
        Ok((device, info))
    }

    /// Takes it for this process, until it is closed.
    pub(super) fn claim(&self) -> Result<(), CameraError> {
        let locked = self.node.lock();
        locked.map_err(|error| self.error("it was locked", error))
    }

    pub(super) fn name(&self) -> String {
        self.path.display().to_string()
    }

    fn describe(&self, identity: Identity) -> Result<DeviceInfo, CameraError> {
        let mut problems = Vec::new();
        let modes = match self.modes() {
            Err(error @ CameraError::Refused { .. }) => {
                problems.push(with_causes(&error));
                Vec::new()
            }
            answer => answer?,
        };
        Ok(DeviceInfo {
            address: CameraAddress::V4l2(self.path.clone()),
            name: identity.card,
            driver: identity.driver,
            bus: identity.bus,
            modes,
            problems,
        })
    }

    fn check_capabilities(&self, capabilities: u32) -> Result<(), CameraError> {
        let why = if capabilities & sys::V4L2_CAP_VIDEO_CAPTURE == 0 {
            if capabilities & sys::V4L2_CAP_VIDEO_CAPTURE_MPLANE != 0 {
                "it delivers frames in several planes only"
            } else {
                "it delivers no pictures"
            }
        } else if capabilities & sys::V4L2_CAP_STREAMING == 0 {
            "it cannot stream"
        } else {
            return Ok(());
        };
        Err(CameraError::NotACamera {
            device: self.name(),
            why: why.to_owned(),
            source: None,
        })
    }

    /// The meaning of an error, except for controls and a running stream.
    pub(super) fn error(&self, doing: &'static str, source: io::Error) -> CameraError {
        let device = self.name();
        match Errno::from_io_error(&source) {
            Some(Errno::NODEV) => unplugged(device, source),
            Some(Errno::BUSY) => in_use(&self.path, source),
            Some(Errno::NOSPC) => CameraError::BusFull { device, source },
            _ => CameraError::Refused {
                device,
                doing,
                source: source.into(),
            },
        }
    }

    /// The meaning of an error of a running stream. An unplugged device can return any error first,
    /// and that it is gone only with the next call.
    pub(super) fn stream_error(&self, doing: &'static str, source: io::Error) -> CameraError {
        let device = self.name();
        if Errno::from_io_error(&source) == Some(Errno::NODEV) || self.absence().is_some() {
            return unplugged(device, source);
        }
        CameraError::Stream {
            device,
            doing,
            source,
        }
    }

    /// The error of a device that is gone.
    pub(super) fn absence(&self) -> Option<io::Error> {
        let answer = self.node.identity().err();
        answer.filter(|error| Errno::from_io_error(error) == Some(Errno::NODEV))
    }

    /// The meaning of an error of the first call, which nodes of other kinds do not know.
    fn no_camera(&self, error: io::Error) -> CameraError {
        match Errno::from_io_error(&error) {
            Some(Errno::NOTTY | Errno::INVAL) => CameraError::NotACamera {
                device: self.name(),
                why: "it does not answer as a camera".to_owned(),
                source: Some(error),
            },
            _ => self.error("its capabilities were read", error),
        }
    }

    /// What it offers: formats that can be recorded, with sizes and rates.
    pub(super) fn modes(&self) -> Result<Vec<Mode>, CameraError> {
        modes::read(&self.node).map_err(|error| self.error("its modes were read", error))
    }
}

/// The error of a device that is gone.
pub(super) fn unplugged(device: String, source: io::Error) -> CameraError {
    CameraError::Unplugged {
        device,
        source: Some(source),
    }
}

fn in_use(path: &Path, source: io::Error) -> CameraError {
    let device = path.display().to_string();
    CameraError::InUse { device, source }
}

fn open_error(path: &Path, error: io::Error) -> CameraError {
    let device = path.display().to_string();
    match Errno::from_io_error(&error) {
        Some(Errno::NOENT | Errno::NODEV | Errno::NXIO | Errno::NOTDIR) => CameraError::NotThere {
            device,
            source: Some(error),
        },
        Some(Errno::ACCESS | Errno::PERM) => CameraError::NotPermitted {
            device,
            source: Some(error),
        },
        Some(Errno::BUSY) => in_use(path, error),
        _ => CameraError::Refused {
            device,
            doing: "it was opened",
            source: error.into(),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    fn device(node: Node) -> Device {
        Device {
            node,
            path: "/dev/video9".into(),
        }
    }

    /// A node that is not a camera: every call is refused.
    fn null() -> Device {
        device(Node::open(Path::new("/dev/null")).unwrap())
    }

    #[test]
    fn errors_of_opening_are_distinguished() {
        let open = |path: &str| Device::open(Path::new(path)).err().unwrap();
        let missing = open("/dev/there-is-no-such-camera");
        assert!(matches!(missing, CameraError::NotThere { .. }), "{missing}");
        let other = open("/dev/null");
        assert!(matches!(other, CameraError::NotACamera { .. }), "{other}");
        let errno = |errno: Errno| open_error(Path::new("/dev/video9"), errno.into());
        assert!(matches!(
            errno(Errno::ACCESS),
            CameraError::NotPermitted { .. }
        ));
        assert!(matches!(errno(Errno::NODEV), CameraError::NotThere { .. }));
        assert!(matches!(errno(Errno::BUSY), CameraError::InUse { .. }));
        assert!(matches!(errno(Errno::IO), CameraError::Refused { .. }));
    }

    #[test]
    fn errors_of_calls_are_distinguished() {
        let error = |errno: Errno| null().error("its modes were read", errno.into());
        assert!(matches!(error(Errno::NODEV), CameraError::Unplugged { .. }));
        assert!(matches!(error(Errno::BUSY), CameraError::InUse { .. }));
        assert!(matches!(error(Errno::NOSPC), CameraError::BusFull { .. }));
        assert!(matches!(error(Errno::INVAL), CameraError::Refused { .. }));
        let stream = |errno: Errno| null().stream_error("read", errno.into());
        assert!(matches!(
            stream(Errno::NODEV),
            CameraError::Unplugged { .. }
        ));
        assert!(matches!(stream(Errno::IO), CameraError::Stream { .. }));
    }

    #[test]
    fn the_systems_error_is_part_of_every_message() {
        let device = null();
        for errno in [Errno::NODEV, Errno::BUSY, Errno::NOSPC, Errno::IO] {
            let text = with_causes(&device.error("its stream was started", errno.into()));
            let answer = io::Error::from(errno).to_string();
            assert!(
                text.contains("/dev/video9") && text.ends_with(&answer),
                "{text}"
            );
            let text = with_causes(&device.stream_error("read", errno.into()));
            assert!(text.ends_with(&answer), "{text}");
            let text = with_causes(&open_error(Path::new("/dev/video9"), errno.into()));
            assert!(text.ends_with(&answer), "{text}");
        }
    }

    #[test]
    fn nodes_that_give_no_pictures_are_refused_with_the_reason() {
        let why = |capabilities| match null().check_capabilities(capabilities) {
            Err(CameraError::NotACamera { why, .. }) => why,
            answer => panic!("{answer:?}"),
        };
        let reasons = [
            sys::V4L2_CAP_META_CAPTURE,
            sys::V4L2_CAP_VIDEO_CAPTURE_MPLANE,
            sys::V4L2_CAP_VIDEO_CAPTURE,
        ];
        let reasons: HashSet<String> = reasons.into_iter().map(why).collect();
        assert_eq!(reasons.len(), 3, "{reasons:?}");
        let camera = sys::V4L2_CAP_VIDEO_CAPTURE | sys::V4L2_CAP_STREAMING;
        assert!(null().check_capabilities(camera).is_ok());
    }
}
