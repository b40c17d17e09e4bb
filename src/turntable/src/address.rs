//! Where a turntable is: `serial:/dev/ttyUSB0`, `serial:`, `sim:?speed=10&fault=reset@5s`, `none`.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serialport::{SerialPortType, UsbPortInfo};

use super::error::TurntableError;
use crate::simulator::{SimulatorError, TableFaults};

/// USB ids of the serial adapters that Grbl controllers use: vendor, product (`None`: all products
/// of that vendor). From usb.ids and the vendors' drivers.
const ADAPTERS: [(u16, Option<u16>); 8] = [
    (0x2341, None),         // Arduino
    (0x2a03, None),         // Arduino (arduino.org)
    (0x1a86, Some(0x7523)), // CH340
    (0x1a86, Some(0x5523)), // CH341
    (0x1a86, Some(0x55d4)), // CH9102
    (0x0403, Some(0x6001)), // FTDI FT232R
    (0x0403, Some(0x6015)), // FTDI FT231X
    (0x10c4, Some(0xea60)), // CP2102
];

/// A turntable's address.
#[derive(Debug, Clone, PartialEq)]
pub enum TurntableAddress {
    /// A serial port; `None`: look for the one that has a controller.
    Serial(Option<PathBuf>),
    /// A simulated table.
    Simulated(SimulatedAddress),
    /// No table.
    None,
}

/// How a simulated table behaves.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedAddress {
    /// How many times faster than real time it runs; 0: as fast as possible.
    pub speed: f64,
    /// The faults to inject.
    pub faults: TableFaults,
}

impl Default for SimulatedAddress {
    fn default() -> Self {
        Self {
            speed: 1.0,
            faults: TableFaults::default(),
        }
    }
}

impl FromStr for TurntableAddress {
    type Err = TurntableError;

    fn from_str(text: &str) -> Result<Self, TurntableError> {
        let wrong = |why: String| TurntableError::Address {
            text: text.to_owned(),
            why,
        };
        if text == "none" {
            return Ok(TurntableAddress::None);
        }
        let (kind, rest) = text
            .split_once(':')
            .ok_or_else(|| wrong("it has no colon".to_owned()))?;
        match kind {
            "serial" if rest.is_empty() => Ok(TurntableAddress::Serial(None)),
            "serial" if rest.contains('\0') => Err(wrong("a path has no zero byte".to_owned())),
            "serial" => Ok(TurntableAddress::Serial(Some(PathBuf::from(rest)))),
            "sim" => simulated(rest)
                .map(TurntableAddress::Simulated)
                .map_err(wrong),
            other => Err(wrong(format!("{other:?} is not a kind of turntable"))),
        }
    }
}

fn simulated(rest: &str) -> Result<SimulatedAddress, String> {
    let mut address = SimulatedAddress::default();
    let options = match rest.strip_prefix('?') {
        Some(options) => options,
        None if rest.is_empty() => return Ok(address),
        None => return Err("options follow a question mark, as in sim:?speed=10".to_owned()),
    };
    for option in options.split('&') {
        match option.split_once('=') {
            Some(("speed", factor)) => {
                let usable = |factor: &f64| factor.is_finite() && *factor >= 0.0;
                let factor = factor.parse().ok().filter(usable);
                address.speed = factor.ok_or("a speed is a number from 0 on, as in speed=10")?;
            }
            Some(("fault", faults)) => {
                address.faults = faults
                    .parse()
                    .map_err(|fault: SimulatorError| fault.to_string())?;
            }
            _ => {
                return Err(format!(
                    "unknown option {option:?}: the options are speed= and fault="
                ));
            }
        }
    }
    Ok(address)
}

/// The address without options.
impl fmt::Display for TurntableAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TurntableAddress::Serial(None) => f.write_str("serial:"),
            TurntableAddress::Serial(Some(path)) => write!(f, "serial:{}", path.display()),
            TurntableAddress::None => f.write_str("none"),
            TurntableAddress::Simulated(_) => f.write_str("sim:"),
        }
    }
}

/// The only serial port with a USB adapter that controllers use.
///
/// # Errors
/// [`TurntableError::NoCandidate`], or [`TurntableError::SeveralCandidates`] with their names.
pub fn find_serial() -> Result<PathBuf, TurntableError> {
    // `available_ports` panics without the kernel's folder of terminals.
    if !Path::new("/sys/class/tty").is_dir() {
        return Err(TurntableError::NoCandidate);
    }
    let ports = serialport::available_ports().unwrap_or_default();
    let usb = ports.into_iter().filter_map(|port| match port.port_type {
        SerialPortType::UsbPort(usb) => Some((port.port_name, usb)),
        _ => None,
    });
    the_one(usb.collect())
}

fn the_one(ports: Vec<(String, UsbPortInfo)>) -> Result<PathBuf, TurntableError> {
    let known = |(_, usb): &(String, UsbPortInfo)| {
        let mut adapters = ADAPTERS.iter();
        adapters.any(|(vendor, product)| {
            *vendor == usb.vid && product.is_none_or(|product| product == usb.pid)
        })
    };
    let mut found: Vec<_> = ports.into_iter().filter(known).collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    match found.as_slice() {
        [] => Err(TurntableError::NoCandidate),
        [(path, _)] => Ok(PathBuf::from(path)),
        several => Err(TurntableError::SeveralCandidates(
            several.iter().map(described).collect(),
        )),
    }
}

fn described((path, usb): &(String, UsbPortInfo)) -> String {
    let name = usb.product.as_deref().unwrap_or("no name");
    format!("{path} ({name}, {:04x}:{:04x})", usb.vid, usb.pid)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn port(path: &str, vid: u16, pid: u16) -> (String, UsbPortInfo) {
        let usb = UsbPortInfo {
            vid,
            pid,
            serial_number: None,
            manufacturer: None,
            product: Some("USB Serial".to_owned()),
        };
        (path.to_owned(), usb)
    }

    #[test]
    fn the_forms_of_the_manual_are_addresses() {
        let read = |text: &str| text.parse::<TurntableAddress>().unwrap();
        assert_eq!(read("none"), TurntableAddress::None);
        assert_eq!(read("serial:"), TurntableAddress::Serial(None));
        let path = PathBuf::from("/dev/ttyUSB0");
        assert_eq!(
            read("serial:/dev/ttyUSB0"),
            TurntableAddress::Serial(Some(path))
        );
        assert_eq!(
            read("sim:"),
            TurntableAddress::Simulated(SimulatedAddress::default())
        );
        let faults = "stall@20s,reset@12.5s".parse().unwrap();
        let simulated = SimulatedAddress {
            speed: 10.0,
            faults,
        };
        assert_eq!(
            read("sim:?speed=10&fault=stall@20s,reset@12.5s"),
            TurntableAddress::Simulated(simulated)
        );
    }

    #[test]
    fn a_text_that_is_no_address_is_refused_with_the_valid_forms() {
        for text in [
            "",
            "usb",
            "serial",
            "tcp:x",
            "sim:10",
            "sim:?speed=-1",
            "sim:?speed=fast",
            "sim:?",
            "sim:?fault=",
            "none:",
        ] {
            let error = text.parse::<TurntableAddress>().unwrap_err().to_string();
            assert!(error.contains("serial:/dev/ttyUSB0"), "{error}");
        }
    }

    #[test]
    fn the_one_adapter_is_taken_and_of_several_none() {
        let mouse = port("/dev/ttyACM1", 0x046d, 0xc077);
        let uno = port("/dev/ttyACM0", 0x2341, 0x0043);
        let clone = port("/dev/ttyUSB0", 0x1a86, 0x7523);
        assert!(matches!(
            the_one(vec![mouse.clone()]),
            Err(TurntableError::NoCandidate)
        ));
        let found = the_one(vec![mouse, uno.clone()]).unwrap();
        assert_eq!(found, PathBuf::from("/dev/ttyACM0"));
        let error = the_one(vec![clone, uno]).unwrap_err();
        let text = error.to_string();
        let TurntableError::SeveralCandidates(ports) = error else {
            panic!("{error}");
        };
        assert_eq!(ports[0], "/dev/ttyACM0 (USB Serial, 2341:0043)");
        assert!(ports[1].starts_with("/dev/ttyUSB0 "), "{ports:?}");
        assert!(text.contains("serial:/dev/ttyACM0"), "{text}");
    }

    proptest! {
        #[test]
        fn any_text_is_an_address_or_an_error(text in "\\PC*") {
            let _read = text.parse::<TurntableAddress>();
        }
    }
}
