//! Buffers in mapped memory, and the stream that fills them.

use std::ffi::c_void;
use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::ptr;
use std::slice;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use v4l::v4l_sys as sys;
use v4l::v4l2::vidioc;

use super::{CAPTURE, Node, Request, zeroed};

const MMAP: u32 = sys::v4l2_memory_V4L2_MEMORY_MMAP;

const REQBUFS: Request<sys::v4l2_requestbuffers> = Request::new(vidioc::VIDIOC_REQBUFS);
const QUERYBUF: Request<sys::v4l2_buffer> = Request::new(vidioc::VIDIOC_QUERYBUF);
const QBUF: Request<sys::v4l2_buffer> = Request::new(vidioc::VIDIOC_QBUF);
const DQBUF: Request<sys::v4l2_buffer> = Request::new(vidioc::VIDIOC_DQBUF);
const STREAMON: Request<i32> = Request::new(vidioc::VIDIOC_STREAMON);
const STREAMOFF: Request<i32> = Request::new(vidioc::VIDIOC_STREAMOFF);

impl Node {
    /// Requests this many buffers, 0 to free all; returns how many there are.
    pub(in crate::v4l2) fn request_buffers(&self, count: u32) -> io::Result<u32> {
        let mut buffers = sys::v4l2_requestbuffers {
            count,
            type_: CAPTURE,
            memory: MMAP,
            ..zeroed()
        };
        self.call(&REQBUFS, &mut buffers)?;
        Ok(buffers.count)
    }

    /// A call about one buffer in mapped memory.
    fn buffer_call(
        &self,
        request: &Request<sys::v4l2_buffer>,
        index: u32,
    ) -> io::Result<sys::v4l2_buffer> {
        let mut buffer = sys::v4l2_buffer {
            index,
            type_: CAPTURE,
            memory: MMAP,
            ..zeroed()
        };
        // SAFETY: of a buffer in mapped memory, in a queue of single planes, the kernel follows no
        // pointer: it keeps an offset in their place.
        unsafe { self.call_with_pointers(request, &mut buffer) }?;
        Ok(buffer)
    }

    /// Maps a buffer into memory.
    pub(in crate::v4l2) fn map(&self, index: u32) -> io::Result<Mapping> {
        let buffer = self.buffer_call(&QUERYBUF, index)?;
        // SAFETY: of a buffer in mapped memory, the call filled the offset.
        let offset = unsafe { buffer.m.offset };
        Mapping::new(&self.0, u64::from(offset), buffer.length as usize)
    }

    /// Queues a buffer for the driver to fill.
    pub(in crate::v4l2) fn queue(&self, index: u32) -> io::Result<()> {
        self.buffer_call(&QBUF, index).map(|_| ())
    }

    /// Takes the next filled buffer; [`io::ErrorKind::WouldBlock`] if there is none.
    pub(in crate::v4l2) fn dequeue(&self) -> io::Result<sys::v4l2_buffer> {
        self.buffer_call(&DQBUF, 0)
    }

    pub(in crate::v4l2) fn stream_on(&self) -> io::Result<()> {
        self.call(&STREAMON, &mut CAPTURE.cast_signed())
    }

    pub(in crate::v4l2) fn stream_off(&self) -> io::Result<()> {
        self.call(&STREAMOFF, &mut CAPTURE.cast_signed())
    }

    /// Waits until a frame can be taken; true if the device reports an error instead, or is gone.
    pub(in crate::v4l2) fn wait(&self, timeout: Duration) -> io::Result<bool> {
        let timeout = Timespec::try_from(timeout).map_err(|_| io::ErrorKind::InvalidInput)?;
        let mut watched = [PollFd::from_borrowed_fd(self.0.as_fd(), PollFlags::IN)];
        match poll(&mut watched, Some(&timeout)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => return Ok(false),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        let broken = PollFlags::ERR | PollFlags::HUP | PollFlags::NVAL;
        Ok(watched[0].revents().intersects(broken))
    }
}

/// A driver's buffer in this program's memory, until it is dropped.
#[derive(Debug)]
pub(in crate::v4l2) struct Mapping {
    start: *mut c_void,
    length: usize,
}

// SAFETY: the memory belongs to the process, not to a thread, and nobody else has the pointer.
unsafe impl Send for Mapping {}

impl Mapping {
    fn new(file: &File, offset: u64, length: usize) -> io::Result<Self> {
        if length == 0 {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let (protection, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: the kernel chooses a place where nothing is mapped.
        let start = unsafe { mmap(ptr::null_mut(), length, protection, flags, file, offset) }?;
        Ok(Self { start, length })
    }

    /// A copy of the first `bytes`, or of all if there are fewer. To be called while the buffer is not
    /// queued, so that the driver does not write to it.
    pub(in crate::v4l2) fn copy(&self, bytes: usize) -> Vec<u8> {
        let bytes = bytes.min(self.length);
        // SAFETY: the mapping is `length` bytes, readable, and lives as long as `self`; a device
        // that is unplugged leaves its memory mapped. Only bytes are read, of which any value goes.
        unsafe { slice::from_raw_parts(self.start.cast::<u8>(), bytes) }.to_vec()
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: the mapping was made with this start and length, and no slice of it outlives a
        // call of `copy`. Failing, it stays mapped until the process ends.
        let _ = unsafe { munmap(self.start, self.length) };
    }
}
