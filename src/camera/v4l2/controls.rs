//! Reading and setting a V4L2 device's controls.

use std::io;

use rustix::io::Errno;
use v4l::v4l_sys as sys;

use super::{CameraError, Device};
use crate::camera::{
    Control, ControlFault, ControlFlags, ControlId, ControlKind, MenuItem, snake_case,
};

/// Most controls that are read of a device, and most items of a menu: a faulty driver must not
/// list for ever.
const MOST_CONTROLS: usize = 1024;
const MOST_ITEMS: i64 = 256;

impl Device {
    pub(super) fn controls(&self) -> Result<Vec<Control>, CameraError> {
        let failed = |error| self.error("its controls were read", error);
        let (mut found, mut id) = (Vec::new(), 0);
        for _ in 0..MOST_CONTROLS {
            let Some(raw) = self.node.control_after(id).map_err(failed)? else {
                break;
            };
            // A driver that does not count up would be asked for ever.
            if raw.id <= id {
                break;
            }
            id = raw.id;
            found.extend(self.control_of(&raw).map_err(failed)?);
        }
        Ok(found)
    }

    /// A control of one number; `None` for classes, texts, arrays, and what is switched off.
    fn control_of(&self, raw: &sys::v4l2_query_ext_ctrl) -> io::Result<Option<Control>> {
        let Some(kind) = self.kind_of(raw)? else {
            return Ok(None);
        };
        let flag = |flag: u32| raw.flags & flag != 0;
        if flag(sys::V4L2_CTRL_FLAG_DISABLED) {
            return Ok(None);
        }
        let write_only = flag(sys::V4L2_CTRL_FLAG_WRITE_ONLY);
        let value = if write_only || kind == ControlKind::Button {
            None
        } else {
            match self.node.value(raw.id, kind == ControlKind::Integer64) {
                Err(error) if Errno::from_io_error(&error) == Some(Errno::NODEV) => {
                    return Err(error);
                }
                // Some cameras list controls that they cannot read at the moment.
                answer => answer.ok(),
            }
        };
        let name: Vec<u8> = raw.name.iter().map(|&byte| byte.cast_unsigned()).collect();
        Ok(Some(Control {
            id: ControlId(raw.id),
            name: snake_case(&super::ioctl::text(&name)),
            kind,
            minimum: raw.minimum,
            maximum: raw.maximum,
            step: raw.step.max(1),
            default: raw.default_value,
            value,
            flags: ControlFlags {
                inactive: flag(sys::V4L2_CTRL_FLAG_INACTIVE),
                read_only: flag(sys::V4L2_CTRL_FLAG_READ_ONLY),
                write_only,
                grabbed: flag(sys::V4L2_CTRL_FLAG_GRABBED),
                volatile: flag(sys::V4L2_CTRL_FLAG_VOLATILE),
            },
        }))
    }

    fn kind_of(&self, raw: &sys::v4l2_query_ext_ctrl) -> io::Result<Option<ControlKind>> {
        if raw.elems > 1 || raw.flags & sys::V4L2_CTRL_FLAG_HAS_PAYLOAD != 0 {
            return Ok(None);
        }
        Ok(Some(match raw.type_ {
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER => ControlKind::Integer,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER64 => ControlKind::Integer64,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BOOLEAN => ControlKind::Boolean,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BITMASK => ControlKind::Bitmask,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_BUTTON => ControlKind::Button,
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_MENU => ControlKind::Menu(self.items(raw, false)?),
            sys::v4l2_ctrl_type_V4L2_CTRL_TYPE_INTEGER_MENU => {
                ControlKind::Menu(self.items(raw, true)?)
            }
            _ => return Ok(None),
        }))
    }

    fn items(&self, raw: &sys::v4l2_query_ext_ctrl, numbers: bool) -> io::Result<Vec<MenuItem>> {
        let last = raw.maximum.min(raw.minimum.saturating_add(MOST_ITEMS));
        let mut items = Vec::new();
        for index in raw.minimum..=last {
            let Ok(number) = u32::try_from(index) else {
                continue;
            };
            if let Some(label) = self.node.menu_item(raw.id, number, numbers)? {
                items.push(MenuItem { index, label });
            }
        }
        Ok(items)
    }

    pub(super) fn set_control(&self, id: ControlId, value: i64) -> Result<i64, CameraError> {
        let failed = |error| self.control_error(id, format!("set to {value}"), None, error);
        let raw = self.node.control(id.0).map_err(failed)?;
        let Some((raw, kind)) = raw
            .map(|raw| self.kind_of(&raw).map(|kind| kind.map(|kind| (raw, kind))))
            .transpose()
            .map_err(failed)?
            .flatten()
        else {
            return Err(self.no_control(id, value));
        };
        let range = Some((raw.minimum, raw.maximum));
        let wide = kind == ControlKind::Integer64;
        self.node
            .set_value(id.0, wide, value)
            .map_err(|error| self.control_error(id, format!("set to {value}"), range, error))?;
        if kind == ControlKind::Button || raw.flags & sys::V4L2_CTRL_FLAG_WRITE_ONLY != 0 {
            return Ok(value);
        }
        self.node
            .value(id.0, wide)
            .map_err(|error| self.control_error(id, "read back".to_owned(), range, error))
    }

    fn no_control(&self, control: ControlId, value: i64) -> CameraError {
        CameraError::Control {
            device: self.name(),
            control,
            doing: format!("set to {value}"),
            fault: ControlFault::Unknown,
        }
    }

    fn control_error(
        &self,
        control: ControlId,
        doing: String,
        range: Option<(i64, i64)>,
        error: io::Error,
    ) -> CameraError {
        let device = self.name();
        let fault = match (Errno::from_io_error(&error), range) {
            (Some(Errno::NODEV), _) => return CameraError::Unplugged { device },
            (Some(Errno::ACCESS | Errno::PERM), _) => ControlFault::Locked,
            (Some(Errno::BUSY), _) => ControlFault::Busy,
            // A value that does not fit into 32 bits never reaches the driver.
            (Some(Errno::RANGE | Errno::INVAL) | None, Some((minimum, maximum))) => {
                ControlFault::Range { minimum, maximum }
            }
            _ => ControlFault::Driver(error),
        };
        CameraError::Control {
            device,
            control,
            doing,
            fault,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::ioctl::Node;
    use super::*;

    #[test]
    fn errors_of_controls_are_told_apart() {
        let device = Device {
            node: Node::open(Path::new("/dev/null")).unwrap(),
            path: "/dev/video9".into(),
        };
        let error = |error: io::Error| {
            let range = Some((0, 9));
            device.control_error(ControlId(7), "set to 10".to_owned(), range, error)
        };
        let fault = |errno: Errno| match error(errno.into()) {
            CameraError::Control { fault, .. } => fault,
            other => panic!("{other}"),
        };
        assert!(matches!(fault(Errno::ACCESS), ControlFault::Locked));
        assert!(matches!(fault(Errno::BUSY), ControlFault::Busy));
        assert!(matches!(
            fault(Errno::RANGE),
            ControlFault::Range { maximum: 9, .. }
        ));
        assert!(matches!(fault(Errno::IO), ControlFault::Driver(_)));
        let unplugged = error(Errno::NODEV.into());
        assert!(matches!(unplugged, CameraError::Unplugged { .. }));
        let too_wide = error(io::ErrorKind::InvalidInput.into());
        let words =
            "control 0x00000007 of /dev/video9 cannot be set to 10: it takes values from 0 to 9";
        assert_eq!(too_wide.to_string(), words);
        let unknown = device.set_control(ControlId(7), 1).unwrap_err();
        let fault = ControlFault::Unknown;
        assert!(
            unknown.to_string().ends_with(&fault.to_string()),
            "{unknown}"
        );
    }
}
