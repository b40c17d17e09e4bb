//! Controls: what they are, and their values.

use std::io;

use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;

use super::{Node, Request, listed, text, zeroed};

const QUERY_EXT_CTRL: Request<sys::v4l2_query_ext_ctrl> =
    Request::new(vidioc::VIDIOC_QUERY_EXT_CTRL);
const QUERYMENU: Request<sys::v4l2_querymenu> = Request::new(vidioc::VIDIOC_QUERYMENU);
const G_EXT_CTRLS: Request<sys::v4l2_ext_controls> = Request::new(vidioc::VIDIOC_G_EXT_CTRLS);
const S_EXT_CTRLS: Request<sys::v4l2_ext_controls> = Request::new(vidioc::VIDIOC_S_EXT_CTRLS);
impl Node {
    /// The first control after this number; `None` after the last. Controls of more than one
    /// number are passed over by the kernel.
    pub(in crate::v4l2) fn control_after(
        &self,
        id: u32,
    ) -> io::Result<Option<sys::v4l2_query_ext_ctrl>> {
        let mut found = sys::v4l2_query_ext_ctrl {
            id: id | sys::V4L2_CTRL_FLAG_NEXT_CTRL,
            ..zeroed()
        };
        Ok(listed(self.call(&QUERY_EXT_CTRL, &mut found))?.map(|()| found))
    }

    /// The control with this number; `None` if there is none.
    pub(in crate::v4l2) fn control(&self, id: u32) -> io::Result<Option<sys::v4l2_query_ext_ctrl>> {
        let mut found = sys::v4l2_query_ext_ctrl { id, ..zeroed() };
        Ok(listed(self.call(&QUERY_EXT_CTRL, &mut found))?.map(|()| found))
    }

    /// The text of a menu's item, or the number of an integer menu's; `None` if it has no such
    /// item.
    pub(in crate::v4l2) fn menu_item(
        &self,
        id: u32,
        index: u32,
        numbers: bool,
    ) -> io::Result<Option<String>> {
        let mut found = sys::v4l2_querymenu {
            id,
            index,
            ..zeroed()
        };
        if listed(self.call(&QUERYMENU, &mut found))?.is_none() {
            return Ok(None);
        }
        let item = found.__bindgen_anon_1;
        // SAFETY: bytes and a number share the place; the call filled it, and either can be read.
        Ok(Some(unsafe {
            if numbers {
                item.value.to_string()
            } else {
                text(&item.name)
            }
        }))
    }

    /// Reads a control of one number. `wide`: of 64 bits.
    pub(in crate::v4l2) fn value(&self, id: u32, wide: bool) -> io::Result<i64> {
        let mut control = sys::v4l2_ext_control { id, ..zeroed() };
        self.with_control(&G_EXT_CTRLS, &mut control)?;
        let value = control.__bindgen_anon_1;
        // SAFETY: numbers share the place; it was zeroed, and the call filled the one of its kind.
        Ok(unsafe {
            if wide {
                value.value64
            } else {
                i64::from(value.value)
            }
        })
    }

    /// Sets a control of one number. `wide`: of 64 bits; otherwise the value must fit into 32.
    pub(in crate::v4l2) fn set_value(&self, id: u32, wide: bool, value: i64) -> io::Result<()> {
        let mut control = sys::v4l2_ext_control { id, ..zeroed() };
        if wide {
            control.__bindgen_anon_1.value64 = value;
        } else {
            let value = i32::try_from(value).map_err(|_| io::ErrorKind::InvalidInput)?;
            control.__bindgen_anon_1.value = value;
        }
        self.with_control(&S_EXT_CTRLS, &mut control)
    }

    /// A call about one control of one number.
    fn with_control(
        &self,
        request: &Request<sys::v4l2_ext_controls>,
        control: &mut sys::v4l2_ext_control,
    ) -> io::Result<()> {
        // With size 0, the kernel follows no pointer of the control.
        control.size = 0;
        let mut controls = sys::v4l2_ext_controls {
            count: 1,
            controls: control,
            ..zeroed()
        };
        // SAFETY: the list is the one control, which is borrowed for the call and has no size.
        unsafe { self.call_with_pointers(request, &mut controls) }
    }
}
