//! How Grbl and its relatives word the same things, by their published interfaces.

/// A firmware of the Grbl family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dialect {
    Grbl,
    GrblHal,
    FluidNc,
    GrblEsp32,
    /// FluidNC whose owner has set its first line to nothing (`$Start/Message`).
    WithoutBanner,
}

impl Dialect {
    pub(crate) const RELATIVES: [Dialect; 4] = [
        Dialect::GrblHal,
        Dialect::FluidNc,
        Dialect::GrblEsp32,
        Dialect::WithoutBanner,
    ];

    /// The line after every reset.
    pub(super) fn banner(self) -> Option<&'static str> {
        match self {
            Dialect::Grbl => Some("Grbl 1.1h ['$' for help]"),
            Dialect::GrblHal => Some("GrblHAL 1.1f ['$' or '$HELP' for help]"),
            Dialect::FluidNc => Some("Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]"),
            Dialect::GrblEsp32 => Some("Grbl 1.3a ['$' for help]"),
            Dialect::WithoutBanner => None,
        }
    }

    /// What the chip prints after its power came on, before the banner.
    pub(super) fn boot_log(self) -> &'static [&'static str] {
        match self {
            Dialect::GrblEsp32 => &[
                "ets Jun  8 2016 00:22:57",
                "\u{fffd}\u{fffd}garbage",
                "[MSG:Grbl_ESP32 Ver 1.3a Date 20211103]",
                "[MSG:Using machine:Turntable]",
            ],
            Dialect::FluidNc => &[
                "[MSG:INFO: FluidNC v3.7.8]",
                "[MSG:INFO: Machine Turntable]",
            ],
            Dialect::Grbl | Dialect::GrblHal | Dialect::WithoutBanner => &[],
        }
    }

    /// The answer to `$I`.
    pub(super) fn about(self) -> &'static [&'static str] {
        match self {
            Dialect::Grbl => &["[VER:1.1h.20190830:]", "[OPT:V,15,128]"],
            Dialect::GrblHal => &[
                "[VER:1.1f.20240812:]",
                "[OPT:VNMZL,35,1024,3,0]",
                "[AXS:3:XYZ]",
                "[NEWOPT:ENUMS,RT+,ES,SED]",
                "[FIRMWARE:grblHAL]",
                "[NVS STORAGE:*FLASH 4K]",
                "[DRIVER:STM32F401CC]",
            ],
            Dialect::FluidNc | Dialect::WithoutBanner => &[
                "[VER:3.7 FluidNC v3.7.8 (wifi):]",
                "[OPT:PHS]",
                "[MSG: Machine: Turntable]",
            ],
            Dialect::GrblEsp32 => &["[VER:1.3a.20211103:]", "[OPT:PHBSW]"],
        }
    }

    pub(super) fn has_setting(self, line: &str) -> bool {
        let fluid = matches!(self, Dialect::FluidNc | Dialect::WithoutBanner);
        !(fluid && line.starts_with("$13="))
    }

    pub(super) fn more_settings(self) -> &'static [&'static str] {
        match self {
            Dialect::GrblHal => &["$300=grblHAL", "$302=192.168.5.1", "$384=0", "$481=N/A"],
            _ => &[],
        }
    }

    /// The answer to a motion of a table that is locked or held.
    pub(super) fn locked(self) -> &'static str {
        match self {
            Dialect::FluidNc => "error:GCode cannot be executed in lock or alarm state",
            _ => "error:9",
        }
    }

    /// A status report in the words of this firmware.
    pub(super) fn report(self, report: String, alarm: Option<u8>) -> String {
        let inside = report.trim_end_matches('>');
        match self {
            Dialect::Grbl => report,
            Dialect::GrblHal => {
                let code = alarm.map_or_else(String::new, |code| format!("<Alarm:{code}|"));
                let inside = match alarm {
                    Some(_) => inside.replace("<Alarm|", &code),
                    None => inside.to_owned(),
                };
                let axes = inside.replace(",0.000,0.000|", ",0.000,0.000,0.000,0.000,0.000|");
                format!(
                    "{axes},0|Bf:35,1023|Pn:PZ|SP1:0,,,100|Ov:100,100,100|A:|Sc:|T:3|AR|FW:grblHAL>"
                )
            }
            Dialect::FluidNc | Dialect::WithoutBanner => {
                format!("{inside}|Pn:P02|SD:12.50,/turn table.nc>")
            }
            Dialect::GrblEsp32 => format!("{inside}|Bf:15,128|WCO:0.000,0.000,0.000>"),
        }
    }
}
