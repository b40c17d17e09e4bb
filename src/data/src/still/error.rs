//! What can be wrong with a still image, as the rest of a sentence that begins with its name.

/// Why a still image is not decoded.
#[derive(Debug, thiserror::Error)]
pub enum StillError {
    /// It is in a format, or has its colours in a form, that is known and not read: which, and what to do.
    #[error("{0}")]
    NotRead(String),
    /// It is in no format that is known here, or it is damaged.
    #[error("is not a readable PNG, JPEG, WebP, TIFF, BMP, GIF, EXR or HDR image")]
    Decode(#[source] image::ImageError),
    /// It ends before the picture does.
    #[error("is cut off: a part of the picture is missing; copy the file again")]
    CutOff,
    /// It has more pixels than are read.
    #[error("is too large: its pixels would take more than 512 MiB of memory")]
    TooLarge,
}

/// Why the colours of a still image are not converted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ColourError(pub(super) String);

impl ColourError {
    /// That its profile cannot be read.
    pub(super) fn profile() -> Self {
        Self("has a damaged colour profile".to_owned())
    }

    /// That it states a transfer function that is not converted.
    pub(super) fn transfer(by: &str) -> Self {
        Self(format!("says that its values are encoded by {by}"))
    }
}
