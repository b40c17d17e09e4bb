//! What the name of a file tells of it.

use std::path::Path;

use super::ENDINGS;

/// Files that operating systems and viewers leave behind in folders, in lower case.
const LEFT_BEHIND: [&str; 6] = [
    "thumbs.db",
    "ehthumbs.db",
    "desktop.ini",
    "icon\r",
    "picasa.ini",
    "folder.htt",
];

/// Whether a file is called as a picture that is read.
#[must_use]
pub fn is_named(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    ENDINGS
        .iter()
        .any(|known| ending.eq_ignore_ascii_case(known))
}

/// Whether a file is hidden, as `._photo.jpg` and `.DS_Store` are, or left behind by an operating system: nobody means it.
#[must_use]
pub fn is_left_behind(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') || LEFT_BEHIND.contains(&name.to_ascii_lowercase().as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_are_known_in_any_case() {
        for name in ["a.JPG", "a.jfif", "b.jpe", "c.Tiff", "d.HDR"] {
            assert!(is_named(Path::new(name)), "{name}");
        }
        for name in ["a.heic", "jpg", "a.png.txt", ""] {
            assert!(!is_named(Path::new(name)), "{name}");
        }
    }

    #[test]
    fn what_systems_leave_behind_is_known() {
        for name in ["._a.jpg", ".DS_Store", "Thumbs.db", "dir/desktop.ini"] {
            assert!(is_left_behind(Path::new(name)), "{name}");
        }
        assert!(!is_left_behind(Path::new("./a.jpg")));
    }
}
