//! The names of files: which are videos, which are hidden, and which are the same on file systems that ignore case.

use std::path::Path;
#[cfg(feature = "files")]
use std::{ffi::OsString, fs, io};

#[cfg(feature = "files")]
use icu_normalizer::{ComposingNormalizerBorrowed, DecomposingNormalizerBorrowed};

/// How the files of videos end, in lower case: what cameras, phones, camcorders and programs write. `.ts` is MPEG's
/// transport stream.
pub const VIDEO_EXTENSIONS: [&str; 43] = [
    "264", "265", "3g2", "3gp", "asf", "avi", "divx", "dv", "f4v", "flv", "h264", "h265", "hevc",
    "ivf", "m1v", "m2t", "m2ts", "m2v", "m4v", "mjpeg", "mjpg", "mkv", "mod", "mov", "mp2v", "mp4",
    "mpe", "mpeg", "mpg", "mts", "mxf", "nut", "obu", "ogm", "ogv", "qt", "rm", "tod", "ts", "vob",
    "webm", "wmv", "y4m",
];

/// Files that file managers leave in folders, and that nobody sees.
const HIDDEN: [&str; 6] = [
    "desktop.ini",
    "ehthumbs.db",
    "folder.htt",
    "icon\r",
    "picasa.ini",
    "thumbs.db",
];

/// Whether a file's name ends as that of a video, in any case, and is not hidden.
pub fn is_video(path: &Path) -> bool {
    has_extension(path, &VIDEO_EXTENSIONS) && !is_hidden(path)
}

/// Whether a file's name has one of these extensions, which are in lower case; its own may be in any.
pub fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|found| {
        extensions
            .iter()
            .any(|known| found.eq_ignore_ascii_case(known))
    })
}

/// Whether a file is none that a person put there: its name begins with a dot, as `.DS_Store` and the `._*` that macOS
/// writes beside each file on other file systems, or a file manager made it.
pub fn is_hidden(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.as_encoded_bytes().starts_with(b".")
        || HIDDEN.iter().any(|known| name.eq_ignore_ascii_case(known))
}

/// What two names have in common if they are one file on some file system: exFAT, NTFS, APFS and SMB ignore case, APFS and
/// HFS+ ignore how an accent is composed, and Windows drops dots and spaces at the end.
///
/// ```
/// use relit_data::file_names::folded;
///
/// assert_eq!(folded("Mug"), folded("mug"));
/// assert_eq!(folded("caf\u{e9}"), folded("CAFE\u{301}. "));
/// assert_ne!(folded("mug"), folded("mug2"));
/// ```
#[cfg(feature = "files")]
pub fn folded(name: &str) -> String {
    let apart = DecomposingNormalizerBorrowed::new_nfd().normalize(name);
    // Upper case first: a letter of two capitals, such as the German sharp s, then has their small ones.
    let small = apart.to_uppercase().to_lowercase();
    composed(small.trim_end_matches(['.', ' ']))
}

/// A name with each accent as part of its letter (Unicode's form C), as most systems write it.
#[cfg(feature = "files")]
pub(crate) fn composed(name: &str) -> String {
    let normalizer = ComposingNormalizerBorrowed::new_nfc();
    normalizer.normalize(name).into_owned()
}

/// Another file or folder beside `path` that would be the same one on a file system that ignores case.
///
/// # Errors
/// If the folder is there and cannot be listed.
#[cfg(feature = "files")]
pub fn name_differing_in_case(path: &Path) -> io::Result<Option<OsString>> {
    let (Some(name), Some(folder)) = (path.file_name(), path.parent()) else {
        return Ok(None);
    };
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let entries = match fs::read_dir(folder) {
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
            ) =>
        {
            return Ok(None);
        }
        entries => entries?,
    };
    let wanted = folded(&name.to_string_lossy());
    for entry in entries {
        let found = entry?.file_name();
        if found != name && folded(&found.to_string_lossy()) == wanted {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_video_is_known_by_its_extension_in_any_case() {
        for name in [
            "clip.MTS",
            "a/b.m2ts",
            "x.Ts",
            "tape.MPG",
            "phone.3gp",
            "c.MOV",
            "v.webm",
            "c.h264",
            "cup%d.mp4",
            "http:x.mkv",
            "-x.avi",
            "a.b.c.MXF",
        ] {
            assert!(is_video(Path::new(name)), "{name}");
        }
        for name in [
            "mp4",
            "clip",
            "clip.txt",
            "clip.mp4.part",
            "._clip.mp4",
            ".mp4",
            "Thumbs.db",
        ] {
            assert!(!is_video(Path::new(name)), "{name}");
        }
        assert!(VIDEO_EXTENSIONS.is_sorted());
    }

    #[test]
    fn what_file_managers_leave_behind_is_hidden() {
        for name in [
            "._Mug.mp4",
            ".DS_Store",
            "a/THUMBS.DB",
            "desktop.ini",
            ".Trashes",
        ] {
            assert!(is_hidden(Path::new(name)), "{name}");
        }
        for name in ["Mug.mp4", "_mug", "a.b"] {
            assert!(!is_hidden(Path::new(name)), "{name}");
        }
    }

    #[cfg(feature = "files")]
    #[test]
    fn names_are_folded_as_the_least_exact_file_system_does() {
        for (one, other) in [
            ("Mug", "mUG"),
            ("\u{c4}pfel", "a\u{308}PFEL"),
            ("Stra\u{df}e", "STRASSE"),
            ("\u{3a3}\u{39f}\u{3a3}", "\u{3c3}\u{3bf}\u{3c2}"),
            ("\u{212b}ngstr\u{f6}m", "\u{e5}ngstro\u{308}m"),
            ("mug.", "mug"),
            ("mug . ", "MUG"),
            ("\u{ac00}", "\u{1100}\u{1161}"),
        ] {
            assert_eq!(folded(one), folded(other), "{one} {other}");
        }
        for (one, other) in [("mug", "mug_"), ("a.b", "ab"), ("\u{e9}", "e"), ("1", "2")] {
            assert_ne!(folded(one), folded(other), "{one} {other}");
        }
    }

    #[cfg(feature = "files")]
    #[test]
    fn a_file_beside_is_found_by_its_folded_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("Mug.png"), "").unwrap();
        assert_eq!(
            name_differing_in_case(&at("mug.PNG")).unwrap(),
            Some("Mug.png".into())
        );
        assert_eq!(name_differing_in_case(&at("Mug.png")).unwrap(), None);
        assert_eq!(name_differing_in_case(&at("cup.png")).unwrap(), None);
        assert_eq!(name_differing_in_case(&at("none/cup.png")).unwrap(), None);
    }
}
