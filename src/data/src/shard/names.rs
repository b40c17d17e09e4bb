//! Names of sessions, samples, members and files, and checks that they are safe.

use super::ShardError;
use crate::durable;
use crate::naming::{is_session_name, not_a_name};

/// Checks that `name` can be a session's name, by the rule of [`is_session_name`].
///
/// # Errors
/// [`ShardError::Refused`] if it cannot.
pub fn check_session(name: &str) -> Result<(), ShardError> {
    if is_session_name(name) {
        Ok(())
    } else {
        Err(ShardError::Refused(not_a_name(name)))
    }
}

/// Checks that `path` stays inside the data set: relative, parts separated by `/`, none of them
/// empty, `.` or `..`.
pub(super) fn check_path(path: &str) -> Result<(), ShardError> {
    let plain = |part: &str| !matches!(part, "" | "." | "..");
    let forbidden = |c: char| c == '\\' || c == ':' || c.is_control();
    if path.split('/').all(plain) && !path.contains(forbidden) {
        Ok(())
    } else {
        Err(ShardError::Refused(format!(
            "{path:?} cannot be a file of a data set: it must be relative, without `..`, `\\` and `:`; do not trust its dataset.json"
        )))
    }
}

/// The parts of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Image,
    Mask,
    Record,
}

impl Part {
    /// All parts, in their order in a shard.
    pub(super) const ALL: [Self; 3] = [Self::Image, Self::Mask, Self::Record];

    /// The member's name after the key and a dot.
    pub(super) const fn suffix(self) -> &'static str {
        match self {
            Self::Image => "png",
            Self::Mask => "mask.png",
            Self::Record => "json",
        }
    }

    fn from_suffix(suffix: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|part| part.suffix() == suffix)
    }
}

/// The key of a sample: `<session>/<kkkk>`, the index with at least four digits.
pub fn sample_key(session: &str, index: u32) -> String {
    format!("{session}/{index:04}")
}

/// The name of a member of a shard.
pub(super) fn member(session: &str, index: u32, part: Part) -> String {
    format!("{}.{}", sample_key(session, index), part.suffix())
}

/// The sample and the part that a member's name denotes, if it belongs to this session.
pub(super) fn parse_member(session: &str, path: &str) -> Option<(u32, Part)> {
    let (number, suffix) = path
        .strip_prefix(session)?
        .strip_prefix('/')?
        .split_once('.')?;
    let index: u32 = number.parse().ok()?;
    let part = Part::from_suffix(suffix)?;
    // Only the form that the writer uses: no sign, no other number of leading zeros.
    (member(session, index, part) == path).then_some((index, part))
}

/// The file of a session's shard, table, image folder, mask and mean image.
pub(super) fn tar_file(session: &str) -> String {
    format!("{session}.tar")
}

pub(super) fn table_file(session: &str) -> String {
    format!("{session}.parquet")
}

pub(super) fn image_folder(session: &str) -> String {
    format!("{IMAGES}/{session}")
}

pub(super) fn mask_file(session: &str) -> String {
    format!("{MASKS}/{session}.png")
}

pub(super) fn mean_file(session: &str) -> String {
    format!("{MEANS}/{session}.png")
}

/// The folders of the layout `paper`.
pub(super) const IMAGES: &str = "imgs";
pub(super) const MASKS: &str = "masks";
pub(super) const MEANS: &str = "mean_img";
/// The folder of the tasks' pieces.
pub(super) const TASKS: &str = "tasks";

/// The name under which a folder of images is written before it is complete.
pub(super) fn partial(session: &str) -> String {
    format!(".{session}.partial")
}

/// The name of the file that holds a session's images until the tar is written.
pub(super) fn spool(session: &str) -> String {
    format!(".{session}.spool")
}

/// The name to which a folder of images is moved while another one replaces it.
pub(super) fn outgoing(session: &str) -> String {
    format!(".{session}.outgoing")
}

/// The session whose folder of images was moved to `name`, if `name` has that form.
pub(super) fn session_of_outgoing(name: &str) -> Option<&str> {
    name.strip_prefix('.')?.strip_suffix(".outgoing")
}

/// Whether a file of this name in the data set's folder was left behind by an interrupted writer.
pub(super) fn is_leftover(name: &str) -> bool {
    let is_data = |file: &str| {
        let ends = [".tar", ".parquet", ".html", ".json", ".png"];
        ends.iter().any(|end| file.ends_with(end))
    };
    let is_spool = name.starts_with('.') && name.ends_with(".spool");
    is_spool || durable::target_of(name).is_some_and(is_data)
}

/// Whether a file of this name was left behind by an interrupted writer of `session`.
pub(super) fn is_leftover_of(session: &str, name: &str) -> bool {
    let of_session = |target: &str| {
        target
            .rsplit_once('.')
            .is_some_and(|(stem, _)| stem == session)
    };
    is_leftover(name)
        && (name == spool(session) || durable::target_of(name).is_some_and(of_session))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_member_name_has_one_valid_form() {
        assert_eq!(member("s.1", 7, Part::Mask), "s.1/0007.mask.png");
        assert_eq!(
            parse_member("s.1", "s.1/0007.mask.png"),
            Some((7, Part::Mask))
        );
        assert_eq!(
            parse_member("s", "s/12345.json"),
            Some((12345, Part::Record))
        );
        for path in [
            "s/7.png",
            "s/+007.png",
            "t/0007.png",
            "s/0007.jpg",
            "s0007.png",
            "s/0007",
        ] {
            assert_eq!(parse_member("s", path), None, "{path}");
        }
    }

    #[test]
    fn a_valid_session_name_gives_valid_file_names() {
        let longest = "x".repeat(120);
        for session in ["20261120T093015Z-mug", "Ölkanne.v2", &longest] {
            check_session(session).unwrap();
            for file in [tar_file(session), image_folder(session), mask_file(session)] {
                check_path(&file).unwrap();
            }
        }
        for name in ["a:b", "../a", ""] {
            assert!(matches!(
                check_session(name),
                Err(ShardError::Refused { .. })
            ));
        }
    }

    #[test]
    fn paths_that_lead_out_of_the_folder_are_refused() {
        assert!(check_path("imgs/a/0.png").is_ok());
        for path in [
            "",
            "/etc/passwd",
            "../a",
            "a/../b",
            "a//b",
            "a/",
            "C:/a",
            "a\\b",
            "./a",
        ] {
            assert!(check_path(path).is_err(), "{path}");
        }
    }

    #[test]
    fn only_names_of_our_own_pattern_are_leftovers() {
        for name in [
            ".a.tar.7.0.partial",
            ".dataset.json.12.34.partial",
            ".a.spool",
        ] {
            assert!(is_leftover(name), "{name}");
        }
        for name in [
            "a.tar.7.0.partial",
            ".a.7.0.partial",
            ".a.tar.7.partial",
            ".bashrc",
            "a.spool",
            ".partial",
        ] {
            assert!(!is_leftover(name), "{name}");
        }
    }
}
