//! The kernel's V4L2 calls as safe functions: the one place of this module with unsafe code.
//!
//! The crate `v4l` has the structures and call numbers. Its devices and streams are not used: dropping
//! a stream panics on every error but one, frames lack the number of bytes used, waiting does not
//! distinguish a broken stream from a frame, and reading controls panics on unknown kinds.
#![allow(unsafe_code)]

mod buffers;
mod controls;

use std::ffi::c_void;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::marker::PhantomData;
use std::mem::{self, size_of};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::ptr;

use rustix::fs::OFlags;
use rustix::io::Errno;
use v4l::v4l_sys as sys;
use v4l::v4l2;
use v4l::v4l2::vidioc;

use crate::Sizes;

pub(super) use buffers::Mapping;

/// The single-planar capture queue.
const CAPTURE: u32 = sys::v4l2_buf_type_V4L2_BUF_TYPE_VIDEO_CAPTURE;

/// A call's number, tied to the structure that it reads and writes.
struct Request<T> {
    code: vidioc::_IOC_TYPE,
    argument: PhantomData<T>,
}

impl<T> Request<T> {
    /// Does not compile if the number was made for a structure of another size.
    const fn new(code: vidioc::_IOC_TYPE) -> Self {
        assert!((code as usize >> 16) & 0x3fff == size_of::<T>());
        Self {
            code,
            argument: PhantomData,
        }
    }
}

const QUERYCAP: Request<sys::v4l2_capability> = Request::new(vidioc::VIDIOC_QUERYCAP);
const ENUM_FMT: Request<sys::v4l2_fmtdesc> = Request::new(vidioc::VIDIOC_ENUM_FMT);
const ENUM_FRAMESIZES: Request<sys::v4l2_frmsizeenum> =
    Request::new(vidioc::VIDIOC_ENUM_FRAMESIZES);
const ENUM_FRAMEINTERVALS: Request<sys::v4l2_frmivalenum> =
    Request::new(vidioc::VIDIOC_ENUM_FRAMEINTERVALS);
const S_FMT: Request<sys::v4l2_format> = Request::new(vidioc::VIDIOC_S_FMT);
const G_PARM: Request<sys::v4l2_streamparm> = Request::new(vidioc::VIDIOC_G_PARM);
const S_PARM: Request<sys::v4l2_streamparm> = Request::new(vidioc::VIDIOC_S_PARM);

/// Structures of the kernel's interface for which all zeros is a valid value.
///
/// # Safety
/// The type must be made of numbers, pointers, and arrays and unions of them.
unsafe trait Zeroable {}

/// Structures in which the kernel finds no pointer to follow.
///
/// # Safety
/// The type must be made of numbers, and arrays and unions of them.
unsafe trait PointerFree {}

macro_rules! structures {
    (pointer_free: $($plain:ident)*; with_pointers: $($pointing:ident)*) => {
        // SAFETY: structures of the kernel's C interface, of numbers, pointers and their unions.
        $(unsafe impl Zeroable for sys::$plain {})*
        // SAFETY: as above.
        $(unsafe impl Zeroable for sys::$pointing {})*
        // SAFETY: structures of the kernel's C interface, of numbers and their unions.
        $(unsafe impl PointerFree for sys::$plain {})*
    };
}

structures!(
    pointer_free: v4l2_capability v4l2_fmtdesc v4l2_frmsizeenum v4l2_frmivalenum v4l2_pix_format
        v4l2_streamparm v4l2_query_ext_ctrl v4l2_querymenu v4l2_requestbuffers;
    with_pointers: v4l2_format v4l2_buffer v4l2_ext_control v4l2_ext_controls
);

// SAFETY: a number.
unsafe impl PointerFree for i32 {}

fn zeroed<T: Zeroable>() -> T {
    // SAFETY: `Zeroable` promises that all zeros is a value.
    unsafe { mem::zeroed() }
}

/// An opened device node.
#[derive(Debug)]
pub(super) struct Node(File);

/// What a node can do.
#[derive(Debug, Clone)]
pub(super) struct Identity {
    pub(super) driver: String,
    pub(super) card: String,
    pub(super) bus: String,
    /// `V4L2_CAP_*` of this node.
    pub(super) capabilities: u32,
}

impl Node {
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        // Non-blocking, so that only poll waits, which has a time limit.
        let flags = OFlags::NONBLOCK.bits().cast_signed();
        let mut options = OpenOptions::new();
        options.read(true).write(true).custom_flags(flags);
        options.open(path).map(Self)
    }

    /// Takes the node for this process; `EBUSY` if another one has it.
    pub(super) fn lock(&self) -> io::Result<()> {
        self.0.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => Errno::BUSY.into(),
            TryLockError::Error(error) => error,
        })
    }

    /// A call whose structure holds no pointers.
    fn call<T: PointerFree>(&self, request: &Request<T>, argument: &mut T) -> io::Result<()> {
        // SAFETY: there is no pointer that the kernel could follow.
        unsafe { self.call_with_pointers(request, argument) }
    }

    /// A call whose structure can hold pointers; repeated if a signal interrupts it.
    ///
    /// # Safety
    /// Where the kernel follows a pointer of `argument` in this call, it must be valid for everything
    /// the call reads and writes there.
    unsafe fn call_with_pointers<T>(
        &self,
        request: &Request<T>,
        argument: &mut T,
    ) -> io::Result<()> {
        loop {
            let pointer = ptr::from_mut(argument).cast::<c_void>();
            // SAFETY: the request's number was made for a structure of T's size, so that the
            // kernel reads and writes inside `argument`, which is borrowed for the call; the caller
            // promises the same of what lies behind its pointers.
            match unsafe { v4l2::ioctl(self.0.as_raw_fd(), request.code, pointer) } {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                answer => return answer,
            }
        }
    }

    pub(super) fn identity(&self) -> io::Result<Identity> {
        let mut found: sys::v4l2_capability = zeroed();
        self.call(&QUERYCAP, &mut found)?;
        // The node's own capabilities, if the driver distinguishes them from the device's.
        let own = found.capabilities & sys::V4L2_CAP_DEVICE_CAPS != 0;
        Ok(Identity {
            driver: text(&found.driver),
            card: text(&found.card),
            bus: text(&found.bus_info),
            capabilities: if own {
                found.device_caps
            } else {
                found.capabilities
            },
        })
    }

    /// The pixel format with this index; `None` after the last.
    pub(super) fn pixel_format(&self, index: u32) -> io::Result<Option<u32>> {
        let mut found = sys::v4l2_fmtdesc {
            index,
            type_: CAPTURE,
            ..zeroed()
        };
        Ok(listed(self.call(&ENUM_FMT, &mut found))?.map(|()| found.pixelformat))
    }

    /// The frame size with this index; `None` after the last.
    pub(super) fn frame_size(&self, fourcc: u32, index: u32) -> io::Result<Option<Sizes>> {
        let mut found = sys::v4l2_frmsizeenum {
            index,
            pixel_format: fourcc,
            ..zeroed()
        };
        if listed(self.call(&ENUM_FRAMESIZES, &mut found))?.is_none() {
            return Ok(None);
        }
        // SAFETY: all fields of the union are plain numbers, and the call filled or zeroed them.
        let (one, range) = unsafe {
            let sizes = found.__bindgen_anon_1;
            (sizes.discrete, sizes.stepwise)
        };
        Ok(Some(
            if found.type_ == sys::v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE {
                Sizes::One(one.width, one.height)
            } else {
                Sizes::Range {
                    min: (range.min_width, range.min_height),
                    max: (range.max_width, range.max_height),
                    step: (range.step_width.max(1), range.step_height.max(1)),
                }
            },
        ))
    }

    /// The shortest and the longest of the frame intervals with this index, seconds; both are the same
    /// where there is one. `None` after the last.
    pub(super) fn frame_interval(
        &self,
        fourcc: u32,
        (width, height): (u32, u32),
        index: u32,
    ) -> io::Result<Option<(sys::v4l2_fract, sys::v4l2_fract)>> {
        let mut found = sys::v4l2_frmivalenum {
            index,
            pixel_format: fourcc,
            width,
            height,
            ..zeroed()
        };
        if listed(self.call(&ENUM_FRAMEINTERVALS, &mut found))?.is_none() {
            return Ok(None);
        }
        // SAFETY: all fields of the union are plain numbers, and the call filled or zeroed them.
        let (one, range) = unsafe {
            let intervals = found.__bindgen_anon_1;
            (intervals.discrete, intervals.stepwise)
        };
        Ok(Some(
            if found.type_ == sys::v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE {
                (one, one)
            } else {
                (range.min, range.max)
            },
        ))
    }

    /// Requests a format; the driver replaces it by the nearest that it has.
    pub(super) fn set_format(
        &self,
        fourcc: u32,
        width: u32,
        height: u32,
    ) -> io::Result<sys::v4l2_pix_format> {
        let mut format: sys::v4l2_format = zeroed();
        format.type_ = CAPTURE;
        format.fmt.pix = sys::v4l2_pix_format {
            width,
            height,
            pixelformat: fourcc,
            field: sys::v4l2_field_V4L2_FIELD_NONE,
            ..zeroed()
        };
        // SAFETY: a format for a queue of this type has numbers only; those with pointers are for
        // overlays.
        unsafe { self.call_with_pointers(&S_FMT, &mut format) }?;
        // SAFETY: the field for this type of queue, which the call filled; plain numbers.
        Ok(unsafe { format.fmt.pix })
    }

    /// Requests a frame interval, seconds, and returns the granted one; `None` if the driver does not
    /// support it.
    pub(super) fn set_interval(
        &self,
        interval: sys::v4l2_fract,
    ) -> io::Result<Option<sys::v4l2_fract>> {
        let mut parameters: sys::v4l2_streamparm = zeroed();
        parameters.type_ = CAPTURE;
        if listed(self.call(&G_PARM, &mut parameters))?.is_none() {
            return Ok(None);
        }
        // SAFETY: the field for this type of queue; plain numbers.
        if unsafe { parameters.parm.capture.capability } & sys::V4L2_CAP_TIMEPERFRAME != 0 {
            parameters.parm.capture.timeperframe = interval;
            self.call(&S_PARM, &mut parameters)?;
        }
        // SAFETY: as above.
        Ok(Some(unsafe { parameters.parm.capture.timeperframe }))
    }
}

/// `None` for the errors with which drivers end a list, or report that they have none.
fn listed(answer: io::Result<()>) -> io::Result<Option<()>> {
    match answer {
        Ok(()) => Ok(Some(())),
        Err(error) => match Errno::from_io_error(&error) {
            Some(Errno::INVAL | Errno::NOTTY | Errno::NODATA) => Ok(None),
            _ => Err(error),
        },
    }
}

/// The text in a field, up to a zero byte or the field's end.
pub(super) fn text(field: &[u8]) -> String {
    let end = field
        .iter()
        .position(|&byte| byte == 0)
        .unwrap_or(field.len());
    String::from_utf8_lossy(&field[..end]).into_owned()
}
