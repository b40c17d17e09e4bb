//! An object before a plain background, found without a hint: the border shows the background, what differs from it
//! is the object, and the cut is that of seeds.
//!
//! | module | concern |
//! | --- | --- |
//! | `surface` | the background's colour at each pixel: a smooth surface through the border |
//! | `regions` | background, its shadows and the object at a small size, and whether they can be trusted |
//! | `seeds` | the regions as marks in the size of the frame |
//! | `nearest` | the nearest marked pixel of each pixel |

mod nearest;
mod regions;
mod seeds;
mod surface;

use image::RgbImage;

use crate::bitmap::Bitmap;
use crate::{Effort, Hints, Mask, MaskError, SegmentSettings, Strokes, segment_with};
use regions::Regions;

/// The mask overlaps at least so much with the region that it was made from: intersection over union.
const MIN_OVERLAP: f64 = 0.8;

/// An object that was cut out by its plain background.
#[derive(Debug, Clone)]
pub struct PlainCut {
    /// The mask.
    pub mask: Mask,
    /// The seeds that were found, with the strokes over them: [`segment`](crate::segment()) makes the same mask of them.
    pub hints: Hints,
}

/// Finds an object before a background of one colour, or of softly graded ones, which may show the object's shadow.
/// What is not clearly so is refused: then a person has to say where the object is. Strokes overrule what is found.
///
/// # Errors
/// [`MaskError::NotPlain`]; those of [`segment`](crate::segment()).
pub fn segment_on_plain(
    frame: &RgbImage,
    strokes: &Strokes,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<PlainCut, MaskError> {
    crate::segment::check_size(frame.dimensions())?;
    let regions = Regions::find(frame)?;
    let hints = Hints {
        rect: None,
        seeds: Some(seeds::seeds(frame, &regions)?),
        strokes: strokes.clone(),
    };
    let mask = segment_with(frame, None, &hints, settings, effort)?;
    if strokes.is_empty() && overlap(&mask, &regions) < MIN_OVERLAP {
        return Err(MaskError::NotPlain {
            why: "parts of the object look like it",
        });
    }
    Ok(PlainCut { mask, hints })
}

/// How much a mask overlaps with the object's region: intersection over union.
fn overlap(mask: &Mask, regions: &Regions) -> f64 {
    let size = mask.image.dimensions();
    let object = seeds::enlarged(&regions.object, regions.size, size);
    let mask = Bitmap::from_mask(&mask.image);
    mask.and(&object).count() as f64 / mask.or(&object).count().max(1) as f64
}
