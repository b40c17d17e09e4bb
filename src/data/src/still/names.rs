//! What the name of a file tells of it.

use std::path::Path;

use super::ENDINGS;
use crate::file_names::has_extension;

/// Whether a file is called as a picture that is read.
pub fn is_named(path: &Path) -> bool {
    has_extension(path, &ENDINGS)
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
}
