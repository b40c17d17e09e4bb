//! What can be wrong with a still image, as the rest of a sentence that begins with its name.

use super::Format;

/// Why a still image is not decoded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StillError {
    /// It is in a format that is known and not read.
    #[error("is {}, which is not read: {}", .0.name(), .0.advice())]
    NotRead(Format),
    /// It is in no format that is known here, or it is damaged.
    #[error("is not a readable PNG, JPEG, WebP, TIFF, BMP, GIF, EXR or HDR image")]
    Decode(#[source] image::ImageError),
    /// It ends before the picture does.
    #[error("is cut off: a part of the picture is missing; copy the file again")]
    CutOff,
    /// It has more pixels than are read.
    #[error("is too large: its pixels would take more than 512 MiB of memory")]
    TooLarge,
    /// An EXR has several layers, or none that shows a picture.
    #[error(
        "has no channels R, G and B, and not one channel alone: write the wanted one as R, G and B; it has {}",
        .0.join(", ")
    )]
    Channels(Vec<String>),
    /// An EXR has its colours as luminance and chroma.
    #[error("has its colours as luminance and chroma (Y, RY, BY): write them as R, G and B")]
    Chroma,
}

/// Why the colours of a still image are not converted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ColourError {
    /// Its colours are inks.
    #[error("has its colours in CMYK")]
    Cmyk,
    /// Its profile is for another kind of pictures.
    #[error("has the colour profile {name}, which is for {space}")]
    ProfileSpace {
        /// The profile's name.
        name: String,
        /// What it is for.
        space: &'static str,
    },
    /// Its profile states a transfer function that is not converted.
    #[error("has the colour profile {name}, which is encoded by {transfer}")]
    ProfileTransfer {
        /// The profile's name.
        name: String,
        /// The transfer function.
        transfer: &'static str,
    },
    /// Its profile cannot be read.
    #[error("has a damaged colour profile")]
    Profile,
    /// It states a transfer function that is not converted.
    #[error("says that its values are encoded by {0}")]
    Transfer(String),
    /// It states a colour space that is not converted.
    #[error("says that its colours are in {0}")]
    Space(String),
    /// It states primaries that span no colours.
    #[error("states primaries that are not possible ({0})")]
    Primaries(String),
}
