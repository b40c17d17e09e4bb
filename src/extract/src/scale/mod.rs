//! Scaling a masked image to the output size without mixing background into the object, and measuring it on
//! the way.
//!
//! Light adds up linearly, sRGB values do not: the image is scaled in linear light. Before that it is
//! set to 0 outside the mask, and afterwards the filtered value is divided by the filtered mask (which
//! renormalises the filter's weights), so that the object's edge does not darken. The filter has no
//! negative weights, so that nothing rings: Hamming for scaling down, bilinear for scaling up.
//!
//! All of that is one pass over the rows of the source (`gather`), which measures each row while it is at hand.

mod filter;
mod gather;
mod light;

use image::{GrayImage, RgbImage};

use super::{CropView, ExtractError};
use filter::{Axis, Filter};
use gather::{Gather, Progress, SourceMask};
use light::Srgb;
use relit_data::image_stats::Measuring;

pub use gather::{APRON, ScaleBuffers};

/// The name of the method in `dataset.json`.
pub(super) const METHOD: &str = "linear light, masked before, Hamming down, bilinear up";
/// The name in `dataset.json` if nothing is scaled.
pub(super) const NO_METHOD: &str = "none";

/// The scaling of one crop, as far as its rows have come.
#[derive(Debug)]
pub(super) enum Scaling {
    Scaled(Progress),
    /// The source pixels are kept: of so many rows so far.
    Kept(RgbImage, u32),
}

impl Scaling {
    /// The image, when all rows were taken.
    pub(super) fn into_image(self) -> RgbImage {
        match self {
            Self::Scaled(Progress { scaled, .. }) => scaled,
            Self::Kept(image, _) => image,
        }
    }
}

/// Scales the crops of one video, which share a mask.
#[derive(Debug)]
pub struct Scaler {
    source: SourceMask,
    srgb: Srgb,
    /// `None` if the source pixels are kept.
    to: Option<Target>,
}

#[derive(Debug)]
struct Target {
    filter: Filter,
    across: Axis,
    down: Axis,
    mask: GrayImage,
    /// 1 / the filtered mask in each output pixel; 0 outside the output's mask.
    gain: Vec<f32>,
}

impl Scaler {
    /// A scaler for crops with this mask (0 or 255), to `side` x `side` pixels or without scaling.
    ///
    /// # Errors
    /// [`ExtractError::Refused`] if the object covers half of no output pixel.
    pub fn new(crop_mask: GrayImage, side: Option<u32>) -> Result<Self, ExtractError> {
        let to = match side {
            None => None,
            Some(side) => Some(Target::new(&crop_mask, side)?),
        };
        Ok(Self {
            source: SourceMask::new(crop_mask),
            srgb: Srgb::new(),
            to,
        })
    }

    /// The mask of the scaled images: 255 where the source mask covers at least half of the pixel,
    /// else 0.
    pub fn mask(&self) -> &GrayImage {
        self.to
            .as_ref()
            .map_or(&self.source.image, |target| &target.mask)
    }

    /// Masks and scales one crop, which has the size of the mask, and measures it.
    ///
    /// # Errors
    /// [`ExtractError::Refused`] if the crop has another size.
    pub fn scale(
        &self,
        crop: CropView<'_>,
        buffers: &mut ScaleBuffers,
        measuring: &mut Measuring<'_>,
    ) -> Result<RgbImage, ExtractError> {
        let mut scaling = self.begin(crop, buffers)?;
        let (_, height) = crop.dimensions();
        self.take_rows(&mut scaling, crop, height, buffers, measuring);
        Ok(scaling.into_image())
    }

    /// Begins to mask and scale a crop, which has the size of the mask and arrives row by row.
    ///
    /// # Errors
    /// [`ExtractError::Refused`] if the crop has another size.
    pub(super) fn begin(
        &self,
        crop: CropView<'_>,
        buffers: &mut ScaleBuffers,
    ) -> Result<Scaling, ExtractError> {
        if crop.dimensions() != self.source.image.dimensions() {
            return Err(other_size());
        }
        Ok(match &self.to {
            Some(target) => Scaling::Scaled(self.gather(crop, target).begin(buffers)),
            None => Scaling::Kept(RgbImage::new(crop.dimensions().0, crop.dimensions().1), 0),
        })
    }

    /// Masks, scales and measures the rows of a crop before row `until` that were not taken yet.
    pub(super) fn take_rows(
        &self,
        scaling: &mut Scaling,
        crop: CropView<'_>,
        until: u32,
        buffers: &mut ScaleBuffers,
        measuring: &mut Measuring<'_>,
    ) {
        match (scaling, &self.to) {
            (Scaling::Scaled(progress), Some(target)) => {
                let gather = self.gather(crop, target);
                gather.advance(until as usize, progress, buffers, measuring);
            }
            (Scaling::Kept(image, taken), _) => {
                for y in *taken..until {
                    let row = crop.row(i64::from(y), 0);
                    measuring.add_row::<4>(row);
                    keep_row(row, &self.source.image, y, image);
                }
                *taken = until.max(*taken);
            }
            // A scaling that another scaler began.
            (Scaling::Scaled(_), None) => {}
        }
    }

    /// The gathering of a crop that is not moved.
    fn gather<'a>(&'a self, crop: CropView<'a>, target: &'a Target) -> Gather<'a> {
        Gather {
            source: &self.source,
            mask: &target.mask,
            srgb: &self.srgb,
            crop,
            across: &target.across,
            down: &target.down,
            gain: Some(&target.gain),
            part: None,
        }
    }

    /// Masks and scales a crop whose object lies `part` of a pixel (-0.5..=0.5, to the right and down)
    /// beside its place in the mask, with one resampling. The picture of `crop` has [`APRON`] pixels more
    /// on each side. Mask and image move together: the background stays out.
    ///
    /// # Errors
    /// [`ExtractError::Refused`] if the crop has another size or no apron.
    pub fn scale_moved(
        &self,
        crop: CropView<'_>,
        part: [f64; 2],
        buffers: &mut ScaleBuffers,
        measuring: &mut Measuring<'_>,
    ) -> Result<RgbImage, ExtractError> {
        let fits = crop.dimensions() == self.source.image.dimensions();
        if !fits || crop.moved([0, 0], APRON).is_none() {
            return Err(other_size());
        }
        let (width, height) = self.source.image.dimensions();
        let filter = self.to.as_ref().map_or(Filter::CatmullRom, |to| to.filter);
        let axis = |extent: u32, part: f64, outputs: u32| {
            let source = (extent + 2 * APRON) as usize;
            let span = (f64::from(APRON) + part, f64::from(extent));
            Axis::new(source, span, outputs as usize, filter)
        };
        let gather = Gather {
            source: &self.source,
            mask: self.mask(),
            srgb: &self.srgb,
            crop,
            across: &axis(width, part[0], self.mask().width()),
            down: &axis(height, part[1], self.mask().height()),
            gain: None,
            part: Some(part),
        };
        Ok(gather.run(buffers, measuring))
    }
}

fn other_size() -> ExtractError {
    let text = "a frame could not be scaled: the crop and its mask differ in size";
    ExtractError::Refused(text.to_owned())
}

/// Copies row `y` of a crop to its place, where it is under the mask.
fn keep_row(row: &[u8], mask: &GrayImage, y: u32, image: &mut RgbImage) {
    let width = mask.width() as usize;
    let start = y as usize * width;
    let mask = mask.as_raw().get(start..start + width);
    let kept = image.get_mut(3 * start..3 * (start + width));
    let pixels = kept.unwrap_or_default().chunks_exact_mut(3);
    let pixels = pixels
        .zip(row.chunks_exact(4))
        .zip(mask.unwrap_or_default());
    for ((kept, pixel), mask) in pixels {
        if *mask != 0 {
            kept.copy_from_slice(&pixel[..3]);
        }
    }
}

impl Target {
    fn new(crop_mask: &GrayImage, side: u32) -> Result<Self, ExtractError> {
        let (width, height) = crop_mask.dimensions();
        let filter = if width.max(height) > side {
            Filter::Hamming
        } else {
            Filter::Bilinear
        };
        let axis = |extent: u32| {
            Axis::new(
                extent as usize,
                (0.0, f64::from(extent)),
                side as usize,
                filter,
            )
        };
        let (across, down) = (axis(width), axis(height));
        let shares = shares(crop_mask, &across, &down);
        let mut mask = GrayImage::new(side, side);
        let mut gain = vec![0.0; shares.len()];
        for ((share, mask), gain) in shares.iter().zip(mask.iter_mut()).zip(&mut gain) {
            // Half of the pixel, but for rounding.
            if *share > 0.5 - 1e-5 {
                *mask = 255;
                *gain = 1.0 / share;
            }
        }
        if mask.as_raw().iter().all(|&m| m == 0) {
            return Err(ExtractError::Refused(format!(
                "the object is too small: at {side} pixels it half covers no pixel; give a larger --size or a smaller --margin"
            )));
        }
        Ok(Self {
            filter,
            across,
            down,
            mask,
            gain,
        })
    }
}

/// The filtered mask, 0..=1.
fn shares(mask: &GrayImage, across: &Axis, down: &Axis) -> Vec<f32> {
    let width = mask.width().max(1) as usize;
    let rows: Vec<Vec<f32>> = mask
        .as_raw()
        .chunks_exact(width)
        .map(|row| {
            let filtered = |output| {
                let (start, weights) = across.window(output);
                let values = row.iter().skip(start).map(|&m| f32::from(m) / 255.0);
                values
                    .zip(weights)
                    .map(|(value, weight)| value * weight)
                    .sum()
            };
            (0..across.outputs()).map(filtered).collect()
        })
        .collect();
    let filtered = |y: usize, x: usize| {
        let (start, weights) = down.window(y);
        let rows = rows.iter().skip(start).zip(weights);
        rows.map(|(row, weight)| row.get(x).map_or(0.0, |value| value * weight))
            .sum()
    };
    (0..down.outputs())
        .flat_map(|y| (0..across.outputs()).map(move |x| (y, x)))
        .map(|(y, x)| filtered(y, x))
        .collect()
}

#[cfg(test)]
mod tests {
    use image::{Luma, Rgba, RgbaImage};
    use proptest::prelude::*;
    use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};

    use super::*;

    fn disc(side: u32) -> GrayImage {
        let centre = f64::from(side) / 2.0;
        GrayImage::from_fn(side, side, |x, y| {
            let (dx, dy) = (f64::from(x) + 0.5 - centre, f64::from(y) + 0.5 - centre);
            Luma([if dx.hypot(dy) < 0.4 * f64::from(side) {
                255
            } else {
                0
            }])
        })
    }

    fn opaque([r, g, b]: [u8; 3]) -> Rgba<u8> {
        Rgba([r, g, b, 255])
    }

    fn still(scaler: &Scaler, crop: CropView<'_>) -> RgbImage {
        let spans = MaskSpans::from_mask(&scaler.source.image);
        let mut buffers = ScaleBuffers::default();
        scaler
            .scale(crop, &mut buffers, &mut spans.measuring(SATURATION_LEVEL))
            .unwrap()
    }

    fn scaled(crop: &RgbaImage, mask: &GrayImage, side: Option<u32>) -> (RgbImage, GrayImage) {
        let scaler = Scaler::new(mask.clone(), side).unwrap();
        (still(&scaler, CropView::whole(crop)), scaler.mask().clone())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn an_even_object_stays_even_to_its_edge_and_0_outside(
            colour in any::<[u8; 3]>(), background in any::<[u8; 3]>(),
            from in 20_u32..200, to in 8_u32..120,
        ) {
            let mask = disc(from);
            let crop = RgbaImage::from_fn(from, from, |x, y| {
                opaque(if mask.get_pixel(x, y).0[0] != 0 { colour } else { background })
            });
            let (image, mask) = scaled(&crop, &mask, Some(to));
            for (pixel, mask) in image.pixels().zip(mask.as_raw()) {
                let wanted = if *mask != 0 { colour } else { [0; 3] };
                for (found, wanted) in pixel.0.into_iter().zip(wanted) {
                    prop_assert!(found.abs_diff(wanted) <= 1, "{found} for {wanted}");
                }
            }
        }

        #[test]
        fn the_background_changes_nothing(seed in any::<u8>(), to in 8_u32..64) {
            let mask = disc(50);
            let object = |x: u32, y: u32| [(x * 5) as u8, (y * 5) as u8, seed];
            let image = |background: [u8; 3]| {
                RgbaImage::from_fn(50, 50, |x, y| {
                    opaque(if mask.get_pixel(x, y).0[0] != 0 { object(x, y) } else { background })
                })
            };
            let (black, _) = scaled(&image([0; 3]), &mask, Some(to));
            let (white, _) = scaled(&image([255; 3]), &mask, Some(to));
            prop_assert_eq!(black, white);
        }
    }

    #[test]
    fn a_black_and_white_pattern_becomes_half_the_light_and_not_half_the_value() {
        let mask = GrayImage::from_pixel(64, 64, Luma([255]));
        let board = RgbaImage::from_fn(64, 64, |x, y| {
            opaque([if (x + y) % 2 == 0 { 255 } else { 0 }; 3])
        });
        let (image, _) = scaled(&board, &mask, Some(8));
        let middle = image.get_pixel(4, 4).0[0];
        assert!(middle.abs_diff(188) <= 1, "{middle}");
    }

    #[test]
    fn native_size_keeps_every_pixel_under_the_mask() {
        let mask = disc(31);
        let crop = RgbaImage::from_fn(31, 31, |x, y| opaque([x as u8, y as u8, 200]));
        let (image, kept) = scaled(&crop, &mask, None);
        assert_eq!(kept, mask);
        for ((found, source), mask) in image.pixels().zip(crop.pixels()).zip(mask.as_raw()) {
            assert_eq!(found.0, if *mask != 0 { &source.0[..3] } else { &[0; 3] });
        }
    }

    /// A crop with its apron, of an object of smooth colours that lies by `shift` beside the mask, in front
    /// of a bright background.
    fn around(mask: &GrayImage, [dx, dy]: [f64; 2]) -> RgbaImage {
        let (width, height) = mask.dimensions();
        let centre = f64::from(width) / 2.0;
        RgbaImage::from_fn(width + 2 * APRON, height + 2 * APRON, |x, y| {
            let x = f64::from(x) - f64::from(APRON) - dx;
            let y = f64::from(y) - f64::from(APRON) - dy;
            let far = (x + 0.5 - centre).hypot(y + 0.5 - centre);
            if far < 0.42 * f64::from(width) {
                opaque([
                    (120.0 + 60.0 * (0.15 * x).sin()) as u8,
                    (120.0 + 60.0 * (0.12 * y).cos()) as u8,
                    90,
                ])
            } else {
                opaque([255; 3])
            }
        })
    }

    #[test]
    fn a_moved_object_is_brought_back_to_its_place_and_without_background() {
        let mask = disc(60);
        for side in [None, Some(24)] {
            let scaler = Scaler::new(mask.clone(), side).unwrap();
            let unmoved = around(&mask, [0.0; 2]);
            let wanted = still(&scaler, CropView::within(&unmoved, APRON));
            let mut buffers = ScaleBuffers::default();
            for part in [[0.5, -0.25], [-0.4, 0.5], [0.2, 0.0]] {
                let around = around(&mask, part);
                let crop = CropView::within(&around, APRON);
                let spans = MaskSpans::from_mask(&mask);
                let found = scaler
                    .scale_moved(
                        crop,
                        part,
                        &mut buffers,
                        &mut spans.measuring(SATURATION_LEVEL),
                    )
                    .unwrap();
                for (a, b) in found.as_raw().iter().zip(wanted.as_raw()) {
                    assert!(a.abs_diff(*b) <= 4, "{side:?} {part:?}: {a} for {b}");
                }
            }
        }
    }

    #[test]
    fn a_crop_is_measured_as_it_is_and_not_what_lies_around_it() {
        let mask = disc(20);
        let around = RgbaImage::from_fn(20 + 2 * APRON, 20 + 2 * APRON, |x, y| {
            opaque([(9 * x) as u8, (8 * y * y) as u8, (x * y) as u8])
        });
        let crop = CropView::within(&around, APRON);
        let spans = MaskSpans::from_mask(&mask);
        let rgb = image::DynamicImage::from(around.clone()).to_rgb8();
        let rgb = image::imageops::crop_imm(&rgb, APRON, APRON, 20, 20).to_image();
        let wanted = spans.measure(&rgb, 100).unwrap();
        for side in [None, Some(8), Some(50)] {
            let scaler = Scaler::new(mask.clone(), side).unwrap();
            let mut buffers = ScaleBuffers::default();
            let (mut still, mut moved) = (spans.measuring(100), spans.measuring(100));
            scaler.scale(crop, &mut buffers, &mut still).unwrap();
            scaler
                .scale_moved(crop, [0.3, 0.1], &mut buffers, &mut moved)
                .unwrap();
            assert_eq!([still.finish(), moved.finish()], [wanted; 2], "{side:?}");
        }
    }

    #[test]
    fn a_crop_without_its_apron_is_refused() {
        let scaler = Scaler::new(disc(60), Some(24)).unwrap();
        let bare = RgbaImage::new(60, 60);
        let spans = MaskSpans::from_mask(&disc(60));
        let mut buffers = ScaleBuffers::default();
        let refused = scaler.scale_moved(
            CropView::whole(&bare),
            [0.0; 2],
            &mut buffers,
            &mut spans.measuring(SATURATION_LEVEL),
        );
        assert!(matches!(refused, Err(ExtractError::Refused(_))));
    }

    #[test]
    fn an_object_of_less_than_half_a_pixel_is_refused() {
        let mut mask = GrayImage::new(100, 100);
        mask.put_pixel(50, 50, Luma([255]));
        assert!(matches!(
            Scaler::new(mask, Some(8)),
            Err(ExtractError::Refused(_))
        ));
    }
}
