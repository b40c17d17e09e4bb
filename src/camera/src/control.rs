//! Controls of a camera, by the names that `v4l2-ctl` prints.

/// One control, with its value when it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Control {
    /// Its number, as the kernel gives it.
    pub id: u32,
    /// The driver's name in snake case, such as `exposure_time_absolute`.
    pub name: String,
    /// What values it takes.
    pub kind: ControlKind,
    /// Smallest value.
    pub minimum: i64,
    /// Largest value.
    pub maximum: i64,
    /// Distance between values, at least 1.
    pub step: u64,
    /// The driver's default.
    pub default: i64,
    /// Its value; `None` for buttons and for what cannot be read.
    pub value: Option<i64>,
    /// What may be done with it.
    pub flags: ControlFlags,
}

/// What values a control takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ControlKind {
    /// A number.
    Integer,
    /// A number of 64 bits.
    Integer64,
    /// 0 or 1.
    Boolean,
    /// The index of one of these.
    Menu(Vec<MenuItem>),
    /// A set of bits.
    Bitmask,
    /// Does something when it is set; has no value.
    Button,
}

/// One item of a menu. Menus may have holes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MenuItem {
    /// The value that chooses it.
    pub index: i64,
    /// The driver's words; for a menu of numbers, the number.
    pub label: String,
}

/// What may be done with a control at the moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControlFlags {
    /// It has no effect now, because an automatic is on.
    pub inactive: bool,
    /// It cannot be set.
    pub read_only: bool,
    /// It cannot be set while the camera streams, or another program holds it.
    pub grabbed: bool,
    /// The hardware changes it by itself.
    pub volatile: bool,
}

/// The kernel's name of a control as `v4l2-ctl` prints it: lower case, runs of anything else than
/// letters and digits as one underscore, none at the ends.
pub fn snake_case(name: &str) -> String {
    let words = name
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty());
    words
        .map(str::to_ascii_lowercase)
        .collect::<Vec<_>>()
        .join("_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_v4l2_ctl() {
        for (kernel, printed) in [
            ("Exposure Time, Absolute", "exposure_time_absolute"),
            ("White Balance, Automatic", "white_balance_automatic"),
            ("Exposure, Auto Priority", "exposure_auto_priority"),
            ("Gain", "gain"),
            (" U32 1 Element Array ", "u32_1_element_array"),
            ("Y'CbCr Encoding", "y_cbcr_encoding"),
            ("", ""),
        ] {
            assert_eq!(snake_case(kernel), printed);
        }
    }
}
