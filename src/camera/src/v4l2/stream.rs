//! A running stream: buffers in mapped memory, frames out.

use std::io;
use std::time::{Duration, Instant};

use v4l::v4l_sys as sys;

use super::device::{Device, unplugged};
use super::ioctl::Mapping;
use crate::frame::without_padding;
use crate::{CameraError, CameraMode, Fourcc, Frame, Rate, SequenceUnwrapper};
use relit_data::clock::Clock;
use relit_data::session::FrameClock;
use relit_video::PixelFormat;

/// Buffers requested of the driver: at 30 frames/s they last for a quarter of a second without
/// anybody reading a frame.
const BUFFERS: u32 = 8;
/// Fewest with which a driver can fill one while others wait.
const MIN_BUFFERS: usize = 2;

/// Longest wait in one call; a longer one is made of several.
const MAX_WAIT: Duration = Duration::from_secs(60);

pub(super) struct Stream {
    layout: sys::v4l2_pix_format,
    format: PixelFormat,
    buffers: Vec<Mapping>,
    counter: SequenceUnwrapper,
}

impl Stream {
    pub(super) fn start(
        device: &Device,
        want: &CameraMode,
    ) -> Result<(Self, CameraMode), CameraError> {
        let layout = device
            .node
            .set_format(want.fourcc.code(), want.width, want.height)
            .map_err(|error| device.error("its format was set", error))?;
        let fourcc = Fourcc::from_code(layout.pixelformat);
        let format = fourcc
            .pixel_format()
            .ok_or_else(|| CameraError::format(device.name(), fourcc))?;
        let interval = device
            .node
            .set_interval(sys::v4l2_fract {
                numerator: want.rate.denominator(),
                denominator: want.rate.numerator(),
            })
            .map_err(|error| device.error("its frame rate was set", error))?;
        let rate = interval.and_then(|seconds| Rate::new(seconds.denominator, seconds.numerator));
        let mut stream = Self {
            layout,
            format,
            buffers: Vec::new(),
            counter: SequenceUnwrapper::default(),
        };
        if let Err(error) = stream.run(device) {
            stream.release(device);
            return Err(device.error("its stream was started", error));
        }
        let granted = CameraMode {
            fourcc,
            width: layout.width,
            height: layout.height,
            rate: rate.unwrap_or(want.rate),
        };
        Ok((stream, granted))
    }

    /// Requests, maps and queues buffers, and starts the stream.
    fn run(&mut self, device: &Device) -> io::Result<()> {
        let count = device.node.request_buffers(BUFFERS)?;
        for index in 0..count {
            self.buffers.push(device.node.map(index)?);
            device.node.queue(index)?;
        }
        if self.buffers.len() < MIN_BUFFERS {
            return Err(io::Error::other(format!("it has only {count} buffers")));
        }
        device.node.stream_on()
    }

    /// Stops the stream and frees the buffers, also after errors of the driver.
    fn release(&mut self, device: &Device) {
        let _ = device.node.stream_off();
        self.buffers.clear();
        let _ = device.node.request_buffers(0);
    }

    pub(super) fn stop(mut self, device: &Device) -> Result<(), CameraError> {
        let stopped = device.node.stream_off();
        self.release(device);
        stopped.map_err(|error| device.stream_error("stopped", error))
    }

    pub(super) fn next(
        &mut self,
        device: &Device,
        timeout: Duration,
    ) -> Result<Frame, CameraError> {
        let start = Instant::now();
        loop {
            let left = timeout.saturating_sub(start.elapsed()).min(MAX_WAIT);
            let broken = device.node.wait(left);
            let broken = broken.map_err(|error| device.stream_error("waited for", error))?;
            match device.node.dequeue() {
                Ok(filled) => return self.take(device, filled),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if broken {
                        return Err(device.stream_error("waited for", error));
                    }
                }
                Err(error) => return Err(device.stream_error("read", error)),
            }
            if start.elapsed() >= timeout {
                return Err(self.too_late(device, timeout));
            }
        }
    }

    fn too_late(&self, device: &Device, waited: Duration) -> CameraError {
        match device.absence() {
            Some(source) => unplugged(device.name(), source),
            None => CameraError::Timeout {
                device: device.name(),
                waited,
            },
        }
    }

    /// Copies a filled buffer's frame and queues the buffer again at once.
    fn take(&mut self, device: &Device, filled: sys::v4l2_buffer) -> Result<Frame, CameraError> {
        let arrived_us = Clock::monotonic().now_us();
        // An unknown index is a fault of the driver; the frame is then empty.
        let data = usize::try_from(filled.index)
            .ok()
            .and_then(|index| self.buffers.get(index))
            .map(|buffer| buffer.copy(filled.bytesused as usize))
            .unwrap_or_default();
        let queued = device.node.queue(filled.index);
        queued.map_err(|error| device.stream_error("given its buffer back", error))?;
        let (t_us, clock) = stamp(filled.flags, filled.timestamp, arrived_us);
        let sys::v4l2_pix_format { width, height, .. } = self.layout;
        let stride = self.layout.bytesperline as usize;
        let data = match self.format.rows(width, height) {
            Some((row, rows)) => without_padding(data, stride, row, rows),
            None => data,
        };
        Ok(Frame {
            fourcc: Fourcc::from_code(self.layout.pixelformat),
            width,
            height,
            data,
            sequence: Some(self.counter.next(filled.sequence)),
            t_us,
            clock,
            flagged: filled.flags & sys::V4L2_BUF_FLAG_ERROR != 0,
        })
    }
}

/// A frame's time stamp: the driver's if it uses the monotonic clock, otherwise the arrival. No frame is taken after it has
/// arrived.
fn stamp(flags: u32, time: sys::timeval, arrived_us: i64) -> (i64, FrameClock) {
    let t_us = time.tv_sec.saturating_mul(1_000_000);
    match flags & sys::V4L2_BUF_FLAG_TIMESTAMP_MASK {
        sys::V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC => {
            let t_us = t_us.saturating_add(time.tv_usec);
            (t_us.min(arrived_us), FrameClock::Driver)
        }
        _ => (arrived_us, FrameClock::Host),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_stamp_of_another_clock_is_replaced_and_marked() {
        let time = sys::timeval {
            tv_sec: 2,
            tv_usec: 5,
        };
        let monotonic = sys::V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
        let arrived_us = 3_000_000;
        let at = |flags| stamp(flags, time, arrived_us);
        assert_eq!(at(monotonic), (2_000_005, FrameClock::Driver));
        let exposure = monotonic | sys::V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
        assert_eq!(at(exposure), (2_000_005, FrameClock::Driver));
        for other in [0, sys::V4L2_BUF_FLAG_TIMESTAMP_COPY] {
            assert_eq!(at(other), (arrived_us, FrameClock::Host));
        }
        assert_eq!(stamp(monotonic, time, 9), (9, FrameClock::Driver));
    }
}
