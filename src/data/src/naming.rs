//! The names that a session may have. Knows nothing else of sessions.

/// Longest name of a session, bytes. A file name can have 255, and a temporary name adds two numbers
/// and two extensions.
const MAX_LENGTH: usize = 120;

/// Names that Windows keeps for devices, whatever extension follows.
const DEVICES: [&str; 4] = ["aux", "con", "nul", "prn"];
/// Windows devices with a number.
const NUMBERED_DEVICES: [&str; 2] = ["com", "lpt"];

/// Whether `name` can be a session's name, which becomes a folder's name, a file's stem and part of
/// a sample's key: letters and digits of any script, `-`, `_` and `.`, not starting or ending with `.`, 1 to
/// 120 bytes, and not the name of a device of Windows such as `con`.
pub fn is_session_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= MAX_LENGTH
        && !name.starts_with('.')
        && !name.ends_with('.')
        && !is_device(name)
        && name
            .chars()
            .all(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.'))
}

/// That a text cannot be a session's name, and what can.
#[cfg(feature = "files")]
pub(crate) fn not_a_name(name: &str) -> String {
    format!(
        "{name:?} cannot be a session's name: use at most {MAX_LENGTH} bytes of letters, digits, '-', '_' or inner '.', and no Windows device such as con"
    )
}

/// Whether the name is that of a device in Windows.
fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default();
    let is = |device: &&str| stem.eq_ignore_ascii_case(device);
    let is_numbered = |device: &&str| {
        let start = stem.get(..device.len());
        let mut rest = stem.chars().skip(device.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(device))
            && matches!(
                rest.next(),
                Some('0'..='9' | '\u{b9}' | '\u{b2}' | '\u{b3}')
            )
            && rest.next().is_none()
    };
    DEVICES.iter().any(is) || NUMBERED_DEVICES.iter().any(is_numbered)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_no_plain_part_of_a_path_are_refused() {
        let longest = "x".repeat(MAX_LENGTH);
        for name in [
            "20261120T093015Z-mug",
            "Ölkanne.v2",
            "_",
            "cone",
            "com",
            "com10",
            "x.con",
            &longest,
        ] {
            assert!(is_session_name(name), "{name}");
        }
        let too_long = "ä".repeat(MAX_LENGTH / 2 + 1);
        for name in [
            "",
            ".",
            "..",
            ".hidden",
            "mug.",
            "con",
            "AUX.mug",
            "Com1",
            "lpt\u{b2}.x",
            "a/b",
            "a\\b",
            "a\nb",
            "a:b",
            "a b",
            &too_long,
        ] {
            assert!(!is_session_name(name), "{name}");
        }
    }
}
