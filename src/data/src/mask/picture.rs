//! A picture of a mask as plain values, and how it is decided what they mean.

use image::{DynamicImage, GenericImageView};

use super::colours::Colours;
use super::levels::Levels;
use super::{MaskBasis, MaskFault, ObjectPixels, several};

/// What is opaque is a painted mask if so much of it is nearly black or nearly white.
const PAINTED: f64 = 0.95;
/// What counts as nearly black or white there, of white.
const NEARLY: f64 = 1.0 / 16.0;

/// The values of a picture that may be a mask.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskPicture {
    width: u32,
    height: u32,
    /// The largest value that is possible: that of 8 or of 16 bits.
    white: u16,
    /// Red, green and blue; grey is three equal values.
    colours: Vec<[u16; 3]>,
    /// Alpha, if it is not the same everywhere.
    alpha: Option<Vec<u16>>,
}

impl MaskPicture {
    /// The values of a decoded picture. Floating point values count from 0, black, to 1, white.
    pub fn from_image(image: &DynamicImage) -> Self {
        let (size, has_alpha) = (image.dimensions(), image.color().has_alpha());
        match image {
            DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_) => {
                let pixels = image.to_rgba8();
                let values = pixels.pixels().map(|pixel| pixel.0.map(u16::from));
                Self::from_values(size, values, u8::MAX.into(), has_alpha)
            }
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
                let pixels = image.to_rgba32f();
                let values = pixels.pixels().map(|pixel| pixel.0.map(sixteen_bits));
                Self::from_values(size, values, u16::MAX, has_alpha)
            }
            _ => {
                let pixels = image.to_rgba16();
                let values = pixels.pixels().map(|pixel| pixel.0);
                Self::from_values(size, values, u16::MAX, has_alpha)
            }
        }
    }

    /// Values from 0, black or transparent, to 1, plane by plane and each row by row. What a plane lacks is 0.
    pub fn from_planes(size: (u32, u32), colours: [&[f32]; 3], alpha: Option<&[f32]>) -> Self {
        let count = size.0 as usize * size.1 as usize;
        let at = |plane: &[f32], k: usize| plane.get(k).copied().unwrap_or_default();
        let is_eight_bits = |plane: &&[f32]| plane.iter().all(|&value| is_of_eight_bits(value));
        let white = if colours.iter().chain(&alpha).all(is_eight_bits) {
            u16::from(u8::MAX)
        } else {
            u16::MAX
        };
        let level = |value: f32| match white {
            u16::MAX => sixteen_bits(value),
            _ => (255.0 * value).round() as u16,
        };
        let values = (0..count).map(|k| {
            let [r, g, b] = colours.map(|plane| level(at(plane, k)));
            [r, g, b, alpha.map_or(white, |plane| level(at(plane, k)))]
        });
        Self::from_values(size, values, white, alpha.is_some())
    }

    fn from_values(
        (width, height): (u32, u32),
        values: impl Iterator<Item = [u16; 4]>,
        white: u16,
        has_alpha: bool,
    ) -> Self {
        let (colours, alpha): (Vec<_>, Vec<_>) = values.map(|[r, g, b, a]| ([r, g, b], a)).unzip();
        let says_something = has_alpha && alpha.windows(2).any(|pair| pair[0] != pair[1]);
        Self {
            width,
            height,
            white,
            colours,
            alpha: says_something.then_some(alpha),
        }
    }

    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Which pixels are the object's.
    ///
    /// # Errors
    /// [`MaskFault`] if it marks nothing, marks several things, or is not a mask.
    pub fn object(&self) -> Result<ObjectPixels, MaskFault> {
        match &self.alpha {
            Some(alpha) if alpha.iter().any(|&a| !self.is_bright(a)) => self.by_alpha(alpha),
            _ => self.by_colours(),
        }
    }

    /// At least half of white, or more than half opaque.
    fn is_bright(&self, value: u16) -> bool {
        value > self.white / 2
    }

    fn by_alpha(&self, alpha: &[u16]) -> Result<ObjectPixels, MaskFault> {
        if !alpha.iter().any(|&a| self.is_bright(a)) {
            let label = Levels::new(alpha, self.white, self.width).only_label();
            let label = label.ok_or(MaskFault::Transparent)?;
            return Ok(ObjectPixels {
                inside: alpha.iter().map(|&a| a == label).collect(),
                basis: MaskBasis::Label(format!("an alpha of {label}")),
            });
        }
        let opaque: Vec<bool> = alpha.iter().map(|&a| self.is_bright(a)).collect();
        let white: Vec<bool> = self
            .colours
            .iter()
            .map(|c| self.is_bright(brightest(c)))
            .collect();
        let both: Vec<bool> = opaque.iter().zip(&white).map(|(a, w)| *a && *w).collect();
        let is_painted = both == opaque || self.is_painted(&opaque);
        Ok(if is_painted && both.contains(&true) {
            ObjectPixels {
                inside: both,
                basis: MaskBasis::Brightness,
            }
        } else {
            ObjectPixels {
                inside: opaque,
                basis: MaskBasis::Alpha,
            }
        })
    }

    /// Whether what is opaque is black and white, and has both.
    fn is_painted(&self, opaque: &[bool]) -> bool {
        let near = NEARLY * f64::from(self.white);
        let (mut black, mut white, mut all) = (0u64, 0u64, 0u64);
        for (colour, _) in self
            .colours
            .iter()
            .zip(opaque)
            .filter(|(_, opaque)| **opaque)
        {
            let darkest = colour.iter().copied().min().unwrap_or_default();
            all += 1;
            black += u64::from(f64::from(brightest(colour)) <= near);
            white += u64::from(f64::from(self.white - darkest) <= near);
        }
        black > 0 && white > 0 && (black + white) as f64 >= PAINTED * all as f64
    }

    fn by_colours(&self) -> Result<ObjectPixels, MaskFault> {
        let colours = Colours::new(&self.colours, self.white);
        let levels: Vec<u16> = self.colours.iter().map(brightest).collect();
        if !colours.are_there() {
            return self.by_levels(&levels);
        }
        if let Some(label) = colours.only_label() {
            let inside: Vec<bool> = self.colours.iter().map(|c| *c == label).collect();
            // A saturated colour is also bright: nothing needs to be said of it.
            let basis = if self.is_bright(brightest(&label)) {
                MaskBasis::Brightness
            } else {
                MaskBasis::Label(format!("the colour {}", colours.name(label)))
            };
            return Ok(ObjectPixels { inside, basis });
        }
        if colours.are_of_one_hue() {
            return self.by_levels(&levels);
        }
        Err(match colours.few() {
            Some(names) => several("colours", names),
            None => MaskFault::Photograph,
        })
    }

    fn by_levels(&self, levels: &[u16]) -> Result<ObjectPixels, MaskFault> {
        let found = Levels::new(levels, self.white, self.width);
        let threshold = found.threshold()?;
        let basis = if self.is_bright(threshold) {
            MaskBasis::Brightness
        } else {
            MaskBasis::Label(format!("the value {threshold}"))
        };
        Ok(ObjectPixels {
            inside: levels.iter().map(|&level| level >= threshold).collect(),
            basis,
        })
    }
}

fn brightest(colour: &[u16; 3]) -> u16 {
    colour.iter().copied().max().unwrap_or_default()
}

/// What is not a number becomes 0.
fn sixteen_bits(value: f32) -> u16 {
    (f32::from(u16::MAX) * value.clamp(0.0, 1.0)).round() as u16
}

/// Whether a value is one of 0/255 to 255/255, as far as floating point can tell.
fn is_of_eight_bits(value: f32) -> bool {
    let level = 255.0 * value;
    (0.0..=255.0).contains(&level) && (level - level.round()).abs() < 1e-4
}
