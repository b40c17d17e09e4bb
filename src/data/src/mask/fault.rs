//! When a mask is refused: it is a picture, marks several things, or nothing.

/// How many labels a message lists.
const LISTED: usize = 6;

/// Why a picture is not a mask of an object. Each begins with a verb, after "the mask PATH".
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MaskFault {
    /// Its tones or colours are those of a photograph or a rendering.
    #[error(
        "is a picture, not a mask: make a mask with relit-mask, or paint the object white and all else black"
    )]
    Photograph,
    /// It marks several things, which are named.
    #[error("has {0}: paint the one object white and all else black")]
    Labels(String),
    /// It marks nothing.
    #[error(
        "is empty: its brightest pixel is {brightest} of {white}, less than half; make it again with relit-mask, or paint the object white"
    )]
    Empty {
        /// The largest value.
        brightest: u16,
        /// The largest that is possible.
        white: u16,
    },
    /// It is transparent, or nearly, where it is not wholly.
    #[error(
        "is empty: no pixel of it is more than half opaque; make it again with relit-mask, or paint the object white on black"
    )]
    Transparent,
}

/// That there are several labels: values or colours, the smallest first.
pub(super) fn several(noun: &str, labels: impl IntoIterator<Item = String>) -> MaskFault {
    let labels: Vec<String> = labels.into_iter().collect();
    let listed = &labels[..labels.len().min(LISTED)];
    let more = match labels.len() - listed.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    MaskFault::Labels(format!("the {noun} {}{more}", listed.join(", ")))
}
