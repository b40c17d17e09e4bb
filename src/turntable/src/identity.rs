//! A controller's identity and settings, as it reports them.

use std::collections::BTreeMap;

use super::error::TurntableError;
use super::family::Family;
use super::protocol::Message;

/// How far a table without its own limit may turn in either direction before its cable is wound up, degrees.
const TRAVEL_DEG: f64 = 400.0;

/// The letters in `[OPT:..]` of the rig's own firmware, Grbl's own being capitals: its reports carry the chip's time
/// of the position, lines can be numbered and checksummed, and the table stops by itself when the host falls silent.
const EXTRAS: [char; 3] = ['t', 'c', 'l'];

/// Whether a controller offers what the rig's own firmware has beyond Grbl.
pub(super) fn offers_extras(about: &[Message]) -> bool {
    let build = about.iter().find_map(|message| match message {
        Message::Build { letters } => Some(letters),
        _ => None,
    });
    build.is_some_and(|letters| EXTRAS.iter().all(|letter| letters.contains(*letter)))
}

/// A controller, as it describes itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The firmware's version and note, such as `1.1h.20190830` or `1.1h.20261121 (relit)`.
    pub firmware: String,
    /// Which firmware of the Grbl family it is.
    pub family: Family,
    /// Whether what the rig's firmware has beyond Grbl is used: never on a stock board.
    pub extras: bool,
    /// Steps per degree.
    pub steps_per_degree: f64,
    /// Highest speed, degrees/s.
    pub max_degrees_per_second: f64,
    /// Acceleration, degrees/s^2.
    pub acceleration: f64,
    /// The range in which it may turn, degrees from machine zero.
    pub limits: (f64, f64),
    /// Whether homing with an index sensor is enabled (`$22`).
    pub homing: bool,
    /// Its lease, seconds; 0 if it is off, `None` if the controller has none.
    pub lease_s: Option<f64>,
}

impl Identity {
    /// One step, degrees.
    pub fn step_deg(&self) -> f64 {
        self.steps_per_degree.recip()
    }

    /// Reads the answers to `$I` and `$$`. `extras`: whether to use what goes beyond Grbl.
    pub(super) fn read(
        about: &[Message],
        settings: &GrblSettings,
        extras: bool,
    ) -> Result<Identity, TurntableError> {
        if settings.is_on(13) {
            return Err(not_reported("positions in millimetres ($13=0)"));
        }
        let family = Family::from_messages(about);
        let mut firmware = None;
        for message in about {
            match message {
                Message::Version { version, note } if note.is_empty() => {
                    firmware = Some(version.clone());
                }
                Message::Version { version, note } => {
                    firmware = Some(format!("{version} ({note})"))
                }
                _ => {}
            }
        }
        let firmware = firmware.ok_or_else(|| not_reported("its version ([VER:..])"))?;
        let positive = |number, what| settings.positive(number).ok_or_else(|| not_reported(what));
        Ok(Identity {
            firmware: match family {
                Family::GrblHal | Family::GrblEsp32 => format!("{firmware} ({family})"),
                Family::Rig | Family::Grbl | Family::FluidNc => firmware,
            },
            family,
            extras,
            steps_per_degree: positive(100, "its steps per degree ($100)")?,
            max_degrees_per_second: positive(110, "its fastest speed ($110)")? / 60.0,
            acceleration: positive(120, "its acceleration ($120)")?,
            limits: settings.limits(offers_extras(about))?,
            // grblHAL's setting is a set of bits, of which the first switches homing on.
            homing: settings.get(22).is_some_and(|value| value % 2.0 == 1.0),
            lease_s: extras.then(|| settings.get(60)).flatten(),
        })
    }
}

fn not_reported(what: &str) -> TurntableError {
    TurntableError::NotReported(what.to_owned())
}

/// The answer to `$$`: a value for each setting's number.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct GrblSettings(BTreeMap<u16, f64>);

impl GrblSettings {
    /// The settings among `messages`.
    pub(super) fn from_messages(messages: &[Message]) -> GrblSettings {
        let setting = |message: &Message| match message {
            Message::Setting { number, value } => Some((*number, *value)),
            _ => None,
        };
        GrblSettings(messages.iter().filter_map(setting).collect())
    }

    /// The settings that this program needs and that are not there.
    pub(super) fn missing(&self, extras: bool) -> Vec<u16> {
        let mut needed = vec![20, 22, 100, 110, 120, 130];
        if extras {
            needed.push(60);
        }
        needed.retain(|number| !self.0.contains_key(number));
        needed
    }

    fn get(&self, number: u16) -> Option<f64> {
        self.0.get(&number).copied()
    }

    fn positive(&self, number: u16) -> Option<f64> {
        self.get(number).filter(|value| *value > 0.0)
    }

    fn is_on(&self, number: u16) -> bool {
        self.get(number).is_some_and(|value| value != 0.0)
    }

    /// How far the table may turn in each direction; `offers_extras`: whether the firmware is the rig's own.
    fn limits(&self, offers_extras: bool) -> Result<(f64, f64), TurntableError> {
        let reach_deg = if self.is_on(20) {
            self.positive(130)
                .ok_or_else(|| not_reported("its soft limit ($130)"))?
        } else {
            TRAVEL_DEG
        };
        // Stock Grbl's soft limits reach from the far end of the axis to machine zero.
        let stock = self.is_on(20) && !offers_extras;
        Ok((-reach_deg, if stock { 0.0 } else { reach_deg }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::protocol::parse;
    use super::*;

    fn identity(about: &[&str], changed: &[(u16, f64)]) -> Result<Identity, TurntableError> {
        let usual = [
            (13, 0.0),
            (20, 1.0),
            (22, 0.0),
            (60, 0.0),
            (100, 88.889),
            (110, 2160.0),
            (120, 36.0),
            (130, 400.0),
        ];
        let settings = GrblSettings(usual.iter().chain(changed).copied().collect());
        let about: Vec<_> = about.iter().filter_map(|line| parse(line)).collect();
        Identity::read(&about, &settings, offers_extras(&about))
    }

    const RIG: [&str; 2] = ["[VER:1.1h.20261121:relit]", "[OPT:NHtcl,8,128]"];
    const STOCK: [&str; 2] = ["[VER:1.1h.20190830:]", "[OPT:V,15,128]"];

    #[test]
    fn the_rigs_firmware_is_known_by_its_option_letters() {
        let rig = identity(&RIG, &[]).unwrap();
        assert!(rig.extras);
        assert_eq!(rig.firmware, "1.1h.20261121 (relit)");
        assert_eq!(rig.lease_s, Some(0.0));
        assert_eq!(rig.limits, (-400.0, 400.0));
        assert!((rig.max_degrees_per_second - 36.0).abs() < 1e-9);
        let stock = identity(&STOCK, &[]).unwrap();
        assert!(!stock.extras);
        assert_eq!(stock.lease_s, None);
    }

    #[test]
    fn a_stock_boards_soft_limits_lie_below_zero_and_without_them_the_given_travel_counts() {
        let limits = |settings: &[(u16, f64)]| identity(&STOCK, settings).unwrap().limits;
        assert_eq!(limits(&[]), (-400.0, 0.0));
        assert_eq!(limits(&[(20, 0.0), (130, 200.0)]), (-400.0, 400.0));
    }

    #[test]
    fn grbls_relatives_are_known_by_their_version_and_lines_of_their_own() {
        let hal = [
            "[VER:1.1f.20240812:]",
            "[OPT:VNMZL,35,1024,3,0]",
            "[FIRMWARE:grblHAL]",
        ];
        let hal = identity(&hal, &[(22, 9.0)]).unwrap();
        assert_eq!((hal.family, hal.homing), (Family::GrblHal, true));
        assert!(!hal.extras && hal.firmware.contains("grblHAL"));
        let fluid = ["[VER:3.7 FluidNC v3.7.8 (wifi):]", "[OPT:PHS]"];
        assert_eq!(identity(&fluid, &[]).unwrap().family, Family::FluidNc);
        let esp = ["[VER:1.3a.20211103:]", "[OPT:PHBSW]"];
        assert_eq!(identity(&esp, &[]).unwrap().family, Family::GrblEsp32);
        assert_eq!(identity(&STOCK, &[]).unwrap().family, Family::Grbl);
        assert_eq!(identity(&RIG, &[]).unwrap().family, Family::Rig);
    }

    #[test]
    fn a_missing_setting_is_named_in_the_error() {
        for (setting, named) in [((100, 0.0), "$100"), ((13, 1.0), "$13=0")] {
            let error = identity(&RIG, &[setting]).unwrap_err();
            assert!(error.to_string().contains(named), "{error}");
        }
    }
}
