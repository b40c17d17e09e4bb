//! The names that a session may have. Knows nothing else of sessions.

/// Longest name of a session, bytes. A file name can have 255, and a temporary name adds two numbers
/// and two extensions.
const LONGEST: usize = 120;

/// Whether `name` can be a session's name, which becomes a folder's name, a file's stem and part of
/// a sample's key: letters and digits of any script, `-`, `_` and `.`, not starting with `.`, 1 to
/// 120 bytes.
#[must_use]
pub fn is_session_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= LONGEST
        && !name.starts_with('.')
        && name
            .chars()
            .all(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_no_plain_part_of_a_path_are_refused() {
        let longest = "x".repeat(LONGEST);
        for name in ["20261120T093015Z-mug", "Ölkanne.v2", "_", &longest] {
            assert!(is_session_name(name), "{name}");
        }
        let too_long = "ä".repeat(LONGEST / 2 + 1);
        for name in [
            "", ".", "..", ".hidden", "a/b", "a\\b", "a\nb", "a:b", "a b", &too_long,
        ] {
            assert!(!is_session_name(name), "{name}");
        }
    }
}
