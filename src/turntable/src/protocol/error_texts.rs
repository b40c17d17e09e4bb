//! Errors in words: FluidNC and Grbl_ESP32 write them in place of Grbl's numbers if `verbose_errors`
//! or `$Errors/Verbose` is on, which some versions have on by default.

/// The words, with Grbl's number.
const TEXTS: [(&str, u8); 15] = [
    ("invalid $ statement", 3),
    ("invalid statement", 3),
    ("setting disabled", 5),
    ("homing not enabled", 5),
    ("no homing/cycle defined", 5),
    ("command requires idle state", 8),
    ("gcode cannot be executed in lock or alarm", 9),
    ("soft limit error", 10),
    ("max step rate exceeded", 12),
    ("check door", 13),
    ("max travel exceeded", 15),
    ("unsupported gcode command", 20),
    ("check startup pins", 40),
    ("system reset", 18),
    ("configuration is invalid", 152),
];
/// The number for words that are not known.
const UNKNOWN: u8 = 0;

/// The number of an error in words.
pub(super) fn code(text: &str) -> u8 {
    let text = text.to_ascii_lowercase();
    let found = TEXTS.iter().find(|(words, _)| text.starts_with(words));
    found.map_or(UNKNOWN, |(_, code)| *code)
}
