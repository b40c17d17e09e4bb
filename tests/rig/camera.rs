//! The driver behind the camera: its faults, and what the kernel says about each frame.

use std::fs;
use std::path::Path;
use std::process::Command;

use relit_camera::{self as camera, Camera};
use relit_data::clock::Clock;

pub(crate) const VIVID: &str = "v4l2:/dev/video0";
const DRIVER: &str = "/sys/bus/platform/drivers/vivid";
const TRACING: &str = "/sys/kernel/tracing";

/// The driver, opened beside the program that records.
pub(crate) struct Vivid(Box<dyn Camera>);

impl Vivid {
    /// The driver with no fault set. It paints a tenth of each picture only, which spares an
    /// emulated machine most of its work.
    pub(crate) fn open() -> Self {
        let opened = camera::open(&VIVID.parse().unwrap(), Clock::monotonic());
        let mut vivid = Self(opened.unwrap());
        vivid.set("percentage_of_dropped_buffers", 0);
        vivid.set("fill_percentage_of_frame", 10);
        vivid
    }

    pub(crate) fn set(&mut self, name: &str, value: i64) {
        assert_eq!(self.press(name, value), Ok(value), "{name}");
    }

    /// Sets a control whose device may not answer any more.
    pub(crate) fn press(&mut self, name: &str, value: i64) -> Result<i64, String> {
        let controls = self.0.controls().unwrap();
        let control = controls.iter().find(|control| control.name == name);
        let control = control.unwrap_or_else(|| panic!("no control {name}"));
        let set = self.0.set_control(control.id, value);
        set.map_err(|error| error.to_string())
    }
}

/// Takes the camera out, as if it were unplugged; it is back when this is dropped.
pub(crate) struct Unplugged(());

impl Unplugged {
    pub(crate) fn now() -> Self {
        fs::write(format!("{DRIVER}/unbind"), "vivid.0").unwrap();
        Self(())
    }
}

impl Drop for Unplugged {
    fn drop(&mut self) {
        fs::write(format!("{DRIVER}/bind"), "vivid.0").unwrap();
    }
}

/// One buffer that the kernel handed to a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DeliveredBuffer {
    pub(crate) sequence: u64,
    pub(crate) t_us: i64,
}

/// The kernel's record of the buffers that it hands out.
pub(crate) struct BufferTrace(());

impl BufferTrace {
    /// Begins an empty record.
    pub(crate) fn begin() -> Self {
        if !Path::new(TRACING).join("trace").exists() {
            let mount = ["-t", "tracefs", "tracefs", TRACING];
            assert!(
                Command::new("mount")
                    .args(mount)
                    .status()
                    .unwrap()
                    .success()
            );
        }
        fs::write(format!("{TRACING}/trace"), "").unwrap();
        Self::switch("1");
        Self(())
    }

    fn switch(on: &str) {
        fs::write(format!("{TRACING}/events/v4l2/v4l2_dqbuf/enable"), on).unwrap();
    }

    /// Ends the record.
    pub(crate) fn end(self) -> Vec<DeliveredBuffer> {
        Self::switch("0");
        let text = fs::read_to_string(format!("{TRACING}/trace")).unwrap();
        let handed = text.lines().filter(|line| line.contains("v4l2_dqbuf: "));
        handed
            .map(|line| DeliveredBuffer {
                sequence: number_after(line, " sequence = "),
                t_us: i64::try_from(number_after(line, " timestamp = ") / 1000).unwrap(),
            })
            .collect()
    }
}

fn number_after(line: &str, name: &str) -> u64 {
    let (_, rest) = line.split_once(name).unwrap();
    let end = rest.find(|c: char| !c.is_ascii_digit());
    rest[..end.unwrap_or(rest.len())].parse().unwrap()
}
