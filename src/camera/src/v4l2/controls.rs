//! Reading and setting a V4L2 device's controls.

use std::io;

use rustix::io::Errno;
use v4l::v4l_sys as sys;

use super::device::{Device, unplugged};
use crate::{CameraError, Control, ControlFlags, ControlKind, MenuItem, snake_case};

/// Most controls that are read of a device, and most items of a menu, in case a faulty driver's list
/// does not end.
const MAX_CONTROLS: usize = 1024;
const MAX_ITEMS: i64 = 256;

impl Device {
    pub(super) fn controls(&self) -> Result<Vec<Control>, CameraError> {
        let failed = |error| self.error("its controls were read", error);
        let (mut found, mut id) = (Vec::new(), 0);
        for _ in 0..MAX_CONTROLS {
            let Some(raw) = self.node.control_after(id).map_err(failed)? else {
                break;
            };
            // A driver that does not count up has no end.
            if raw.id <= id {
                break;
            }
            id = raw.id;
            found.extend(self.control_of(&raw).map_err(failed)?);
        }
        Ok(found)
    }

    /// A control of one number; `None` for classes, texts, arrays, and disabled ones.
    fn control_of(&self, raw: &sys::v4l2_query_ext_ctrl) -> io::Result<Option<Control>> {
        let Some(kind) = self.kind_of(raw)? else {
            return Ok(None);
        };
        let flag = |flag: u32| raw.flags & flag != 0;
        if flag(sys::V4L2_CTRL_FLAG_DISABLED) {
            return Ok(None);
        }
        let value = if flag(sys::V4L2_CTRL_FLAG_WRITE_ONLY) || kind == ControlKind::Button {
            None
        } else {
            match self.node.value(raw.id, kind == ControlKind::Integer64) {
                Err(error) if Errno::from_io_error(&error) == Some(Errno::NODEV) => {
                    return Err(error);
                }
                // Some cameras list controls that cannot be read at the moment.
                answer => answer.ok(),
            }
        };
        // A C char has a sign on x86 and none on ARM.
        let name: Vec<u8> = raw
            .name
            .iter()
            .flat_map(|byte| byte.to_ne_bytes())
            .collect();
        Ok(Some(Control {
            id: raw.id,
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
        let last = raw.maximum.min(raw.minimum.saturating_add(MAX_ITEMS));
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

    pub(super) fn set_control(&self, id: u32, value: i64) -> Result<i64, CameraError> {
        let setting = || format!("set to {value}");
        let failed = |error| self.control_error(id, setting(), None, error);
        let Some((raw, kind)) = self.look_up(id).map_err(failed)? else {
            return Err(CameraError::Control {
                device: self.name(),
                control: id,
                doing: setting(),
                fault: "the camera has no such control".to_owned(),
                source: None,
            });
        };
        let wide = kind == ControlKind::Integer64;
        let write_only = raw.flags & sys::V4L2_CTRL_FLAG_WRITE_ONLY != 0;
        let has_value = kind != ControlKind::Button && !write_only;
        let taken = Some(taken_values(&raw, kind));
        let set = self.node.set_value(id, wide, value);
        set.map_err(|error| self.control_error(id, setting(), taken, error))?;
        if !has_value {
            return Ok(value);
        }
        let read = self.node.value(id, wide);
        read.map_err(|error| self.control_error(id, "read back".to_owned(), None, error))
    }

    /// A control of one number, with any flags; `None` if there is none.
    fn look_up(&self, id: u32) -> io::Result<Option<(sys::v4l2_query_ext_ctrl, ControlKind)>> {
        let Some(raw) = self.node.control(id)? else {
            return Ok(None);
        };
        Ok(self.kind_of(&raw)?.map(|kind| (raw, kind)))
    }

    /// `taken`: what it takes, if the driver rejects the value itself.
    fn control_error(
        &self,
        control: u32,
        doing: String,
        taken: Option<String>,
        error: io::Error,
    ) -> CameraError {
        let device = self.name();
        let fault = match (Errno::from_io_error(&error), taken) {
            (Some(Errno::NODEV), _) => return unplugged(device, error),
            (Some(Errno::ACCESS | Errno::PERM), _) => {
                "it is read-only, or set automatically: switch that off first".to_owned()
            }
            (Some(Errno::BUSY), _) => {
                "it is locked while the camera streams, or by another program: stop that first"
                    .to_owned()
            }
            // A value that does not fit into 32 bits never reaches the driver.
            (Some(Errno::RANGE | Errno::INVAL) | None, Some(taken)) => taken,
            _ => "the driver refuses".to_owned(),
        };
        CameraError::Control {
            device,
            control,
            doing,
            fault,
            source: Some(error),
        }
    }
}

/// Which values a control takes, in words.
fn taken_values(raw: &sys::v4l2_query_ext_ctrl, kind: ControlKind) -> String {
    match kind {
        ControlKind::Menu(items) => {
            let items: Vec<String> = items.iter().map(|item| item.index.to_string()).collect();
            format!("it takes one of {}", items.join(", "))
        }
        _ => format!("it takes values from {} to {}", raw.minimum, raw.maximum),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::path::Path;

    use super::super::ioctl::Node;
    use super::*;

    #[test]
    fn errors_of_controls_are_distinguished() {
        let device = Device {
            node: Node::open(Path::new("/dev/null")).unwrap(),
            path: "/dev/video9".into(),
        };
        let error = |error: io::Error| {
            let taken = Some("it takes one of 0, 9".to_owned());
            device.control_error(7, "set to 10".to_owned(), taken, error)
        };
        let fault = |errno: Errno| match error(errno.into()) {
            CameraError::Control { fault, .. } => fault,
            other => panic!("{other}"),
        };
        let errors = [Errno::ACCESS, Errno::BUSY, Errno::RANGE, Errno::IO];
        let faults: HashSet<String> = errors.into_iter().map(fault).collect();
        assert_eq!(faults.len(), errors.len(), "{faults:?}");
        assert_eq!(fault(Errno::RANGE), "it takes one of 0, 9");
        let unplugged = error(Errno::NODEV.into());
        assert!(matches!(unplugged, CameraError::Unplugged { .. }));
        let too_wide = error(io::ErrorKind::InvalidInput.into());
        for named in ["0x00000007", "/dev/video9", "10", "it takes one of 0, 9"] {
            assert!(too_wide.to_string().contains(named), "{named}: {too_wide}");
        }
        let unknown = device.set_control(7, 1).unwrap_err();
        assert!(
            matches!(unknown, CameraError::Control { control: 7, .. }),
            "{unknown}"
        );
    }
}
