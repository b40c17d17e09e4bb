//! Seeds that a person painted, from a file.

use std::fs;
use std::path::Path;

use relit_grabcut::Seeds;

use super::MaskingError;

/// Reads seeds from a PNG file of any colour type and depth.
///
/// # Errors
/// [`MaskingError::Io`] or [`MaskingError::Seeds`].
pub fn read_seeds(path: &Path) -> Result<Seeds, MaskingError> {
    let bytes = fs::read(path).map_err(MaskingError::io(path, "read"))?;
    Seeds::from_png(&bytes).map_err(|fault| MaskingError::Seeds {
        path: path.to_owned(),
        fault,
    })
}
