//! Scaling a masked image to the output size without mixing background into the object.
//!
//! Light adds up linearly, sRGB values do not: the image is scaled in linear light. Before that it is
//! set to 0 outside the mask, and afterwards the filtered value is divided by the filtered mask (which
//! renormalises the filter's weights), so that the object's edge does not darken. The filter has no
//! negative weights, so that nothing rings: Hamming for scaling down, bilinear for scaling up.

use fast_image_resize::images::{TypedImage, TypedImageRef};
use fast_image_resize::pixels::{U16, U16x3};
use fast_image_resize::{FilterType, ResizeAlg, ResizeOptions, Resizer};
use image::{GrayImage, RgbImage};

use super::ExtractError;

/// The name of the method in `dataset.json`.
pub(super) const METHOD: &str = "linear light, masked before, Hamming down, bilinear up";
/// The name in `dataset.json` if nothing is scaled.
pub(super) const NO_METHOD: &str = "none";

/// Pixels that are needed around a crop to move it by part of a pixel.
pub const APRON: u32 = 3;

/// Scales the crops of one video, which share a mask.
#[derive(Debug)]
pub struct Scaler {
    crop_mask: GrayImage,
    light: Light,
    /// `None` if the source pixels are kept.
    to: Option<Target>,
}

/// From sRGB values to light and back.
#[derive(Debug)]
struct Light {
    to_linear: [u16; 256],
    to_srgb: Vec<u8>,
}

#[derive(Debug)]
struct Target {
    side: u32,
    options: ResizeOptions,
    mask: GrayImage,
    /// 1 / the filtered mask in each output pixel; 0 outside the output's mask.
    gain: Vec<f32>,
}

impl Scaler {
    /// A scaler for crops with this mask (0 or 255), to `side` x `side` pixels or without scaling.
    ///
    /// # Errors
    /// [`ExtractError::ObjectTooSmall`] if the object covers half of no output pixel.
    pub fn new(crop_mask: GrayImage, side: Option<u32>) -> Result<Self, ExtractError> {
        let to = match side {
            None => None,
            Some(side) => Some(Target::new(&crop_mask, side)?),
        };
        Ok(Self {
            crop_mask,
            light: Light::new(),
            to,
        })
    }

    /// The mask of the scaled images: 255 where the source mask covers at least half of the pixel,
    /// else 0.
    #[must_use]
    pub fn mask(&self) -> &GrayImage {
        self.to
            .as_ref()
            .map_or(&self.crop_mask, |target| &target.mask)
    }

    /// Masks and scales one crop, which has the size of the mask.
    ///
    /// # Errors
    /// [`ExtractError::Scaling`] if the crop has another size.
    pub fn scale(&self, crop: &RgbImage, resizer: &mut Resizer) -> Result<RgbImage, ExtractError> {
        if crop.dimensions() != self.crop_mask.dimensions() {
            return Err(ExtractError::Scaling(
                "the crop and its mask differ in size".to_owned(),
            ));
        }
        match &self.to {
            None => Ok(masked(crop, &self.crop_mask)),
            Some(target) => target.scale(crop, &self.crop_mask, &self.light, resizer),
        }
    }

    /// Masks and scales a crop whose object lies `part` of a pixel (-0.5..=0.5, to the right and down)
    /// beside its place in the mask, with one resampling. `around` is the crop with [`APRON`] pixels of
    /// the frame on each side. Mask and image move together: the background stays out.
    ///
    /// # Errors
    /// [`ExtractError::Scaling`] if `around` has another size.
    pub fn scale_moved(
        &self,
        around: &RgbImage,
        part: [f64; 2],
        resizer: &mut Resizer,
    ) -> Result<RgbImage, ExtractError> {
        let (width, height) = self.crop_mask.dimensions();
        let size = (width + 2 * APRON, height + 2 * APRON);
        if around.dimensions() != size {
            return Err(ExtractError::Scaling(
                "the crop and its mask differ in size".to_owned(),
            ));
        }
        let shares = self.moved_mask(part);
        let linear: Vec<U16x3> = around
            .pixels()
            .zip(&shares)
            .map(|(pixel, &share)| {
                let part = |value: u8| {
                    let light = u32::from(self.light.linear(value));
                    ((light * u32::from(share.0) + 32_767) / 65_535) as u16
                };
                U16x3::new(pixel.0.map(part))
            })
            .collect();
        let options = match &self.to {
            Some(target) => target.options,
            None => ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::CatmullRom)),
        };
        let [left, top] = part.map(|part| f64::from(APRON) + part);
        let options = options.crop(left, top, f64::from(width), f64::from(height));
        let mask = self.mask();
        let mut gathered = TypedImage::<U16x3>::new(mask.width(), mask.height());
        let source = TypedImageRef::new(size.0, size.1, &linear).map_err(scaling)?;
        resizer
            .resize_typed(&source, &mut gathered, &options)
            .map_err(scaling)?;
        let mut gathered_shares = TypedImage::<U16>::new(mask.width(), mask.height());
        let source = TypedImageRef::new(size.0, size.1, &shares).map_err(scaling)?;
        resizer
            .resize_typed(&source, &mut gathered_shares, &options)
            .map_err(scaling)?;
        let mut scaled = RgbImage::new(mask.width(), mask.height());
        let gathered = gathered.pixels().iter().zip(gathered_shares.pixels());
        for ((pixel, mask), (sum, share)) in scaled.pixels_mut().zip(mask.as_raw()).zip(gathered) {
            if *mask != 0 && share.0 > 0 {
                let gain = 65_535.0 / f32::from(share.0);
                pixel.0 = sum.0.map(|sum| self.light.srgb(f32::from(sum) * gain));
            }
        }
        Ok(scaled)
    }

    /// The mask's share in each pixel of a crop with its apron, 0..=65535, moved by part of a pixel.
    fn moved_mask(&self, [dx, dy]: [f64; 2]) -> Vec<U16> {
        let (width, height) = self.crop_mask.dimensions();
        let apron = i64::from(APRON);
        let value = |x: i64, y: i64| -> f64 {
            let inside = u32::try_from(x).ok().zip(u32::try_from(y).ok());
            let pixel = inside.and_then(|(x, y)| self.crop_mask.get_pixel_checked(x, y));
            f64::from(pixel.map_or(0, |pixel| pixel.0[0]))
        };
        let (whole_x, whole_y) = ((-dx).floor(), (-dy).floor());
        let (right, lower) = (-dx - whole_x, -dy - whole_y);
        let columns = i64::from(width) + 2 * apron;
        let rows = i64::from(height) + 2 * apron;
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x - apron, y - apron)));
        let share = |(x, y): (i64, i64)| {
            let (x, y) = (x + whole_x as i64, y + whole_y as i64);
            let row = |y| (1.0 - right) * value(x, y) + right * value(x + 1, y);
            U16::new((257.0 * ((1.0 - lower) * row(y) + lower * row(y + 1))).round() as u16)
        };
        places.map(share).collect()
    }
}

impl Light {
    fn new() -> Self {
        Self {
            to_linear: std::array::from_fn(|value| {
                (65535.0 * linear_from_srgb(value as f64 / 255.0)).round() as u16
            }),
            to_srgb: (0..=u16::MAX)
                .map(|value| (255.0 * srgb_from_linear(f64::from(value) / 65535.0)).round() as u8)
                .collect(),
        }
    }

    fn linear(&self, value: u8) -> u16 {
        self.to_linear[usize::from(value)]
    }

    /// The cast saturates at the brightest value.
    fn srgb(&self, light: f32) -> u8 {
        self.to_srgb[usize::from((light + 0.5) as u16)]
    }
}

fn masked(crop: &RgbImage, mask: &GrayImage) -> RgbImage {
    let mut kept = crop.clone();
    for (pixel, mask) in kept.pixels_mut().zip(mask.as_raw()) {
        if *mask == 0 {
            pixel.0 = [0; 3];
        }
    }
    kept
}

impl Target {
    fn new(crop_mask: &GrayImage, side: u32) -> Result<Self, ExtractError> {
        let (width, height) = crop_mask.dimensions();
        let filter = if width.max(height) > side {
            FilterType::Hamming
        } else {
            FilterType::Bilinear
        };
        let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(filter));
        let full: Vec<U16> = crop_mask
            .as_raw()
            .iter()
            .map(|&m| U16::new(u16::from(m) * 257))
            .collect();
        let source = TypedImageRef::new(width, height, &full).map_err(scaling)?;
        let mut share = TypedImage::new(side, side);
        Resizer::new()
            .resize_typed(&source, &mut share, &options)
            .map_err(scaling)?;
        let mut mask = GrayImage::new(side, side);
        let mut gain = vec![0.0; side as usize * side as usize];
        for ((share, mask), gain) in share.pixels().iter().zip(mask.iter_mut()).zip(&mut gain) {
            if share.0 >= 0x8000 {
                *mask = 255;
                *gain = 65535.0 / f32::from(share.0);
            }
        }
        if mask.as_raw().iter().all(|&m| m == 0) {
            return Err(ExtractError::ObjectTooSmall { side });
        }
        Ok(Self {
            side,
            options,
            mask,
            gain,
        })
    }

    fn scale(
        &self,
        crop: &RgbImage,
        crop_mask: &GrayImage,
        light: &Light,
        resizer: &mut Resizer,
    ) -> Result<RgbImage, ExtractError> {
        let linear: Vec<U16x3> = crop
            .pixels()
            .zip(crop_mask.as_raw())
            .map(|(pixel, &mask)| match mask {
                0 => U16x3::new([0; 3]),
                _ => U16x3::new(pixel.0.map(|value| light.linear(value))),
            })
            .collect();
        let source = TypedImageRef::new(crop.width(), crop.height(), &linear).map_err(scaling)?;
        let mut gathered = TypedImage::new(self.side, self.side);
        resizer
            .resize_typed(&source, &mut gathered, &self.options)
            .map_err(scaling)?;
        let mut scaled = RgbImage::new(self.side, self.side);
        let pixels = gathered
            .pixels()
            .iter()
            .zip(scaled.pixels_mut())
            .zip(&self.gain);
        for ((gathered, pixel), &gain) in pixels {
            if gain > 0.0 {
                pixel.0 = gathered.0.map(|sum| light.srgb(f32::from(sum) * gain));
            }
        }
        Ok(scaled)
    }
}

fn scaling(error: impl std::fmt::Display) -> ExtractError {
    ExtractError::Scaling(error.to_string())
}

/// IEC 61966-2-1, from a value in 0..=1 to light in 0..=1.
fn linear_from_srgb(value: f64) -> f64 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// IEC 61966-2-1, from light in 0..=1 to a value in 0..=1.
fn srgb_from_linear(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use image::{Luma, Rgb};
    use proptest::prelude::*;

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

    fn scaled(crop: &RgbImage, mask: &GrayImage, side: Option<u32>) -> (RgbImage, GrayImage) {
        let scaler = Scaler::new(mask.clone(), side).unwrap();
        (
            scaler.scale(crop, &mut Resizer::new()).unwrap(),
            scaler.mask().clone(),
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn an_even_object_stays_even_to_its_edge_and_0_outside(
            colour in any::<[u8; 3]>(), background in any::<[u8; 3]>(),
            from in 20_u32..200, to in 8_u32..120,
        ) {
            let mask = disc(from);
            let crop = RgbImage::from_fn(from, from, |x, y| {
                Rgb(if mask.get_pixel(x, y).0[0] != 0 { colour } else { background })
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
                RgbImage::from_fn(50, 50, |x, y| {
                    Rgb(if mask.get_pixel(x, y).0[0] != 0 { object(x, y) } else { background })
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
        let board = RgbImage::from_fn(64, 64, |x, y| {
            Rgb([if (x + y) % 2 == 0 { 255 } else { 0 }; 3])
        });
        let (image, _) = scaled(&board, &mask, Some(8));
        let middle = image.get_pixel(4, 4).0[0];
        assert!(middle.abs_diff(188) <= 1, "{middle}");
    }

    #[test]
    fn native_size_keeps_every_pixel_under_the_mask() {
        let mask = disc(31);
        let crop = RgbImage::from_fn(31, 31, |x, y| Rgb([x as u8, y as u8, 200]));
        let (image, kept) = scaled(&crop, &mask, None);
        assert_eq!(kept, mask);
        for ((found, source), mask) in image.pixels().zip(crop.pixels()).zip(mask.as_raw()) {
            assert_eq!(found.0, if *mask != 0 { source.0 } else { [0; 3] });
        }
    }

    /// A crop with its apron, of an object of smooth colours that lies by `shift` beside the mask, in front
    /// of a bright background.
    fn around(mask: &GrayImage, [dx, dy]: [f64; 2]) -> RgbImage {
        let (width, height) = mask.dimensions();
        let centre = f64::from(width) / 2.0;
        RgbImage::from_fn(width + 2 * APRON, height + 2 * APRON, |x, y| {
            let x = f64::from(x) - f64::from(APRON) - dx;
            let y = f64::from(y) - f64::from(APRON) - dy;
            let far = (x + 0.5 - centre).hypot(y + 0.5 - centre);
            match far < 0.42 * f64::from(width) {
                false => Rgb([255; 3]),
                true => Rgb([
                    (120.0 + 60.0 * (0.15 * x).sin()) as u8,
                    (120.0 + 60.0 * (0.12 * y).cos()) as u8,
                    90,
                ]),
            }
        })
    }

    #[test]
    fn a_moved_object_is_brought_back_to_its_place_and_without_background() {
        let mask = disc(60);
        for side in [None, Some(24)] {
            let scaler = Scaler::new(mask.clone(), side).unwrap();
            let mut resizer = Resizer::new();
            let still = around(&mask, [0.0; 2]);
            let still = image::imageops::crop_imm(&still, APRON, APRON, 60, 60).to_image();
            let wanted = scaler.scale(&still, &mut resizer).unwrap();
            for part in [[0.5, -0.25], [-0.4, 0.5], [0.2, 0.0]] {
                let found = scaler
                    .scale_moved(&around(&mask, part), part, &mut resizer)
                    .unwrap();
                for (a, b) in found.as_raw().iter().zip(wanted.as_raw()) {
                    assert!(a.abs_diff(*b) <= 4, "{side:?} {part:?}: {a} for {b}");
                }
            }
        }
    }

    #[test]
    fn a_crop_without_its_apron_is_refused() {
        let scaler = Scaler::new(disc(60), Some(24)).unwrap();
        let refused = scaler.scale_moved(&RgbImage::new(60, 60), [0.0; 2], &mut Resizer::new());
        assert!(matches!(refused, Err(ExtractError::Scaling(_))));
    }

    #[test]
    fn an_object_of_less_than_half_a_pixel_is_refused() {
        let mut mask = GrayImage::new(100, 100);
        mask.put_pixel(50, 50, Luma([255]));
        assert!(matches!(
            Scaler::new(mask, Some(8)),
            Err(ExtractError::ObjectTooSmall { side: 8 })
        ));
    }
}
