//! New light out of files.

use std::path::Path;

use relight_core::light::{Panorama, ShLight};
use relit_data::file_names::has_extension;

use crate::relighting::{InsertError, LightSource};

impl LightSource {
    /// Whether a file is called as a text of coefficients (`.txt`).
    pub fn is_text(path: &Path) -> bool {
        has_extension(path, &["txt"])
    }

    /// Reads a text file of coefficients (`.txt`), or else a panorama.
    ///
    /// # Errors
    /// If the file cannot be read or holds no light.
    pub fn read(path: &Path) -> Result<Self, InsertError> {
        Ok(if Self::is_text(path) {
            Self::Coefficients(ShLight::read(path)?)
        } else {
            Self::Panorama(Panorama::read(path)?)
        })
    }
}
