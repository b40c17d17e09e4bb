//! The part of a photograph around an object.

use relight_core::image::{Extent, Linear, Planes, Rgb, check_extent};

use super::InsertError;
use super::fringe::Fringe;
use super::matte::Matte;
use crate::decompose::{CropSquare, DecomposeError};

/// The part of a photograph around an object.
pub(crate) struct Cut {
    /// Column and row of its first pixel.
    pub(crate) place: [usize; 2],
    /// Width and height of the photograph.
    pub(crate) photo: Extent,
    /// 1 on the object, else 0.
    pub(crate) mask: Planes<1>,
    pub(crate) matte: Matte,
    /// `None` where alpha says what belongs to the object.
    pub(crate) fringe: Option<Fringe>,
}

impl Cut {
    pub(crate) fn new(
        photo: &Rgb<Linear>,
        (mask, alpha): (&Planes<1>, Option<&Planes<1>>),
    ) -> Result<Self, InsertError> {
        let expected = photo.planes().extent();
        for (what, image) in [("mask", Some(mask)), ("alpha", alpha)] {
            check_extent(what, image.map_or(expected, Planes::extent), expected)?;
        }
        check_light(photo)?;
        let region = CropSquare::around(mask).ok_or(DecomposeError::EmptyMask)?;
        let edge = Matte::edge_for(region.extent());
        let margin = 8 * edge;
        let (place, extent) = window(&region, margin, expected);
        let picture = photo.planes().cut(place, extent);
        let mask = mask
            .cut(place, extent)
            .map(|m| f32::from(u8::from(m >= 0.5)));
        let (matte, fringe) = match alpha {
            Some(alpha) => (Matte::from_alpha(&picture, &alpha.cut(place, extent)), None),
            None => (
                Matte::estimate(&picture, &mask, edge),
                Some(Fringe::new(&mask, edge)),
            ),
        };
        Ok(Self {
            place,
            photo: expected,
            mask,
            matte,
            fringe,
        })
    }
}

/// Whether all values are light.
fn check_light(photo: &Rgb<Linear>) -> Result<(), InsertError> {
    let width = photo.planes().extent().width;
    for plane in photo.planes().planes() {
        let odd = plane
            .iter()
            .position(|value| !(value.is_finite() && *value >= 0.0));
        if let Some(at) = odd {
            return Err(InsertError::Input(format!(
                "the photograph has a value that is negative, infinite or not a number at column {}, row {}",
                at % width,
                at / width
            )));
        }
    }
    Ok(())
}

/// The part of an image that a square with a margin covers.
fn window(region: &CropSquare, margin: usize, image: Extent) -> ([usize; 2], Extent) {
    let margin = margin as i64;
    let line = |from: i64, length: usize| {
        let inside = |at: i64| at.clamp(0, length as i64) as usize;
        (
            inside(from - margin),
            inside(from + region.side as i64 + margin),
        )
    };
    let ((left, right), (top, bottom)) =
        (line(region.x, image.width), line(region.y, image.height));
    ([left, top], Extent::new(right - left, bottom - top))
}
