//! Which pixels a picture of a mask marks, whatever program made it: a painted mask, a cut-out, or an image of labels.
//!
//! A picture is read by the first of these that it has:
//!
//! 1. **alpha** that is transparent in some places and opaque in others: a cut-out. Where what is opaque is itself black and
//!    white, it is a painted mask on a layer, and the white of it counts;
//! 2. **brightness**: the object is at least half as bright as white. Edges may be soft, and a JPEG's may ring;
//! 3. **a label**: one colour or level on black, whatever it is, such as 1 on 0.
//!
//! A photograph, a picture of several labels, and one that marks nothing are refused: [`MaskFault`]. One that marks the
//! whole border may be inverted: [`ObjectPixels::note`] says so.
//!
//! `file` reads the mask of a video; all else knows pixels only.

mod colours;
mod fault;
#[cfg(all(feature = "files", feature = "still"))]
mod file;
mod levels;
mod picture;

pub use fault::MaskFault;
use fault::several;
#[cfg(all(feature = "files", feature = "still"))]
pub use file::{VideoMask, VideoMaskFault};
pub use picture::MaskPicture;

use image::GrayImage;

use crate::geometry::Rect;

/// By what a mask says where the object is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MaskBasis {
    /// The object is bright.
    Brightness,
    /// The object is opaque, and its colours do not count.
    Alpha,
    /// The object has this value or colour, and the rest is black.
    Label(String),
}

impl MaskBasis {
    /// What a person may want to know of it: nothing where the object is bright, as in most masks.
    fn note(&self) -> Option<String> {
        match self {
            Self::Brightness => None,
            Self::Alpha => Some("has colours and alpha: the object is what is opaque".to_owned()),
            Self::Label(label) => Some(format!("is a label image: the object is what has {label}")),
        }
    }
}

/// What a picture of a mask marks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectPixels {
    /// Whether each pixel is the object's, row by row; at least one is.
    pub inside: Vec<bool>,
    /// What says so.
    pub basis: MaskBasis,
}

impl ObjectPixels {
    /// What a person may want to know of a mask of this width, after "the mask": what it was taken for where that is not
    /// plain, and whether it may be inverted.
    pub fn note(&self, width: u32) -> Option<String> {
        let is_inverted = || {
            self.marks_the_border(width as usize).then(|| {
                "marks all of the picture's border: it is inverted if the object does not fill the picture".to_owned()
            })
        };
        self.basis.note().or_else(is_inverted)
    }

    fn marks_the_border(&self, width: usize) -> bool {
        let rows = || self.inside.chunks(width.max(1));
        let is_whole =
            |row: Option<&[bool]>| row.is_some_and(|row| row.iter().all(|&inside| inside));
        is_whole(rows().next())
            && is_whole(rows().next_back())
            && rows().all(|row| row.first() == Some(&true) && row.last() == Some(&true))
    }
}

/// The smallest rectangle that holds all non-zero pixels; `None` if there are none.
pub fn bounding_box(mask: &GrayImage) -> Option<Rect> {
    let mut corners: Option<(u32, u32, u32, u32)> = None;
    for (x, y, pixel) in mask.enumerate_pixels() {
        if pixel.0[0] != 0 {
            let (x0, y0, x1, y1) = corners.unwrap_or((x, y, x, y));
            corners = Some((x0.min(x), y0.min(y), x1.max(x), y1.max(y)));
        }
    }
    let (x0, y0, x1, y1) = corners?;
    Some(Rect::new(x0 as i32, y0 as i32, x1 - x0 + 1, y1 - y0 + 1))
}

/// What a mask of another size than its picture's may be, after "the mask PATH is W x H pixels".
pub fn size_hint(mask: (u32, u32), picture: (u32, u32)) -> Option<&'static str> {
    let [(w, h), (wide, high)] = [mask, picture].map(|(w, h)| (f64::from(w), f64::from(h)));
    // Sizes are rounded to whole pixels.
    let fits =
        |scale: f64, length: f64, wanted: f64| (scale * length - wanted).abs() < scale.max(1.0);
    if (mask.1, mask.0) == picture && w != h {
        Some("it lies on its side: turn it by 90 degrees")
    } else if mask.0 > 0 && mask.1 > 0 && fits(wide / w, h, high) {
        Some("make it on this video, or scale it back if it was made on a scaled copy")
    } else {
        None
    }
}

#[cfg(test)]
mod tests;
