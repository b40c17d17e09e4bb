//! Decoding a part of a JPEG, and no more than that needs.
//!
//! libjpeg-turbo skips rows and columns: what lies outside is parsed, because damage shows there, and neither
//! transformed nor converted. A pixel of a part is the same as in the whole
//! picture: the accurate integer transform, each pixel with the colour of its own chroma sample, and the
//! conversion of JFIF (full-range BT.601).
//!
//! Only ordinary JPEGs of cameras are taken ([`layout`]), and any doubt refuses the picture: FFmpeg then
//! decodes it, or says what is wrong with it.

mod decode;
mod layout;

pub(super) use decode::decode_part;

/// The picture is not decoded here: it is of an unusual kind, or something is wrong with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NotDecoded;

#[cfg(test)]
mod tests;
