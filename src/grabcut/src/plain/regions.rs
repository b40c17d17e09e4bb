//! Background, its shadows and the object at a small size, and whether they can be trusted.
//!
//! Constants without another reason were chosen by cross-validation on synthetic objects before plain and cluttered
//! backgrounds (`docs/results/masks.md`).

use image::{RgbImage, imageops};
use relit_data::srgb::{from_linear_f32, to_linear_f32};
use relit_data::statistics::upper_median;

use super::surface::{Colour, Surface, difference};
use crate::MaskError;
use crate::bitmap::{Bitmap, Component, Connectivity};

/// The longest side of the small size, pixels.
const SIDE: u32 = 384;
/// Width of the border that shows the background, as a share of the shorter side, and at least [`MIN_RING`] pixels.
const RING: f64 = 0.05;
/// The narrowest border, pixels of the small size.
const MIN_RING: usize = 3;
/// Rounds in which the border's pixels that do not fit its surface are left out.
const ROUNDS: usize = 8;
/// Rounds in which the background grows and is fitted again.
const GROWTH: usize = 4;
/// Degree of the surface through the border, and of that through the whole background.
const DEGREES: [usize; 2] = [2, 4];
/// The border shows one surface if at least this share of it fits.
const MIN_FITTING: f64 = 0.93;
/// The largest standard deviation of a plain background from its surface, 8-bit values of the small size.
const MAX_DEVIATION: f64 = 3.0;
/// A shadow leaves at least this part of the light.
const MIN_SHADOW: f32 = 0.15;
/// A shadow is at most this bright in parts of the background: noise.
const MAX_SHADOW: f32 = 1.02;
/// A shadow's colour differs from that of the darker background by at most this, 8-bit values.
const SHADOW_COLOUR: f32 = 6.0;
/// Largest gradient of a soft shadow, 8-bit values a pixel of the small size.
const SOFT: f32 = 4.0;
/// From this saturation of the background on, what has its colour is its shadow, however sharp.
const COLOURFUL: f32 = 0.35;
/// Half-width of the gaps in an outline through which no shadow leaks, pixels of the small size.
const GAP: usize = 2;
/// Parts of at least this share of the largest one belong to the object.
const PART: f64 = 0.1;
/// Specks of up to so many pixels are noise.
const SPECK: u64 = 3;
/// Largest share of other parts, of the object's area.
const MAX_OTHERS: f64 = 0.05;
/// Largest share of the border that the object may cover.
const MAX_OF_RING: f64 = 0.04;
/// The object's share of the image.
const OBJECT_SHARE: [f64; 2] = [0.003, 0.7];
/// Shadow inside of the object's outline, as a share of its area: with more, the object itself looks like a shadow.
const MAX_INSIDE: f64 = 0.15;

/// What of an image is background and object, at a small size.
#[derive(Debug, Clone)]
pub(super) struct Regions {
    /// Width and height of the small size.
    pub(super) size: (usize, usize),
    pub(super) colours: Vec<Colour>,
    /// Background with its shadows.
    pub(super) background: Bitmap,
    pub(super) object: Bitmap,
    /// What has the background's colour, also inside of the object.
    pub(super) alike: Bitmap,
    /// What has the colour of the background in a shadow, also inside of the object.
    pub(super) shadow_like: Bitmap,
    /// Up to this difference a colour is that of the background, 8-bit values.
    pub(super) tolerance: f32,
}

/// The background's surface, and where it is seen.
struct Background {
    surface: Vec<Colour>,
    /// Difference of each pixel from the surface.
    difference: Vec<f32>,
    /// What is connected to the border.
    seen: Bitmap,
    /// Standard deviation along the border.
    deviation: f64,
    tolerance: f32,
}

impl Regions {
    /// Finds the regions of a frame.
    ///
    /// # Errors
    /// [`MaskError::NotPlain`] if the background is not plain, or what differs from it is not clearly one object.
    pub(super) fn find(frame: &RgbImage) -> Result<Self, MaskError> {
        let small = downscaled(frame);
        let (width, height) = small.dimensions();
        let size = (width as usize, height as usize);
        let colours: Vec<Colour> = small.pixels().map(|pixel| pixel.0.map(f32::from)).collect();
        let ring = ring(size);
        let background = Background::find(&colours, &ring, size)?;
        let alike = background.alike((width, height));
        let shadow_like = background.shadow_like(&colours, (width, height));
        let soft = soft(&colours, size).or(&background.colourful((width, height)));
        let shadow = shadow_like.and(&soft);
        let seen = &background.seen;
        // Opened, so that it does not leak through the gaps of an outline.
        let may_be = seen.or(&shadow).opened(GAP).or(seen);
        let ground = connected_to(&may_be, seen);
        let regions = Self {
            object: object(&ground.inverted(), &ring)?,
            size,
            colours,
            background: ground,
            alike,
            shadow_like,
            tolerance: background.tolerance,
        };
        let inside = regions
            .background
            .minus(seen)
            .and(&spanned(&regions.object));
        if inside.count() as f64 > MAX_INSIDE * regions.object.count() as f64 {
            return Err(refused("parts of the object look like its shadow"));
        }
        Ok(regions)
    }
}

impl Background {
    fn find(colours: &[Colour], ring: &Bitmap, size: (usize, usize)) -> Result<Self, MaskError> {
        let not_plain = || refused("its border shows more than one soft gradient");
        let (fitting, deviation) = fit_ring(colours, ring, size).ok_or_else(not_plain)?;
        let share = fitting.count() as f64 / ring.count().max(1) as f64;
        if share < MIN_FITTING || deviation > MAX_DEVIATION {
            return Err(not_plain());
        }
        let tolerance = (4.0 * deviation as f32).max(5.0);
        let mut background = Self {
            surface: Vec::new(),
            difference: Vec::new(),
            seen: fitting,
            deviation,
            tolerance,
        };
        for round in 0..GROWTH {
            let degree = DEGREES[round.min(1)];
            let surface = Surface::fit(colours, &background.seen, size, degree);
            background.surface = surface.ok_or_else(not_plain)?.colours(size);
            background.difference = differences(colours, &background.surface);
            let alike = background.alike((size.0 as u32, size.1 as u32));
            background.seen = connected_to(&alike, &ring.and(&alike));
        }
        Ok(background)
    }

    /// What has the background's colour.
    fn alike(&self, size: (u32, u32)) -> Bitmap {
        let near = self.difference.iter();
        Bitmap::new(size, near.map(|&difference| difference < self.tolerance))
    }

    /// What has the colour of the background where less light falls on it.
    fn shadow_like(&self, colours: &[Colour], size: (u32, u32)) -> Bitmap {
        let allowed = (3.0 * self.deviation as f32).max(SHADOW_COLOUR);
        let pairs = colours.iter().zip(&self.surface);
        let is_shadow = pairs.map(|(&colour, &ground)| {
            let lit = ground.map(linear);
            let part = colour.map(linear).iter().sum::<f32>() / lit.iter().sum::<f32>().max(1e-4);
            let shaded = lit.map(|value| coded(value * part));
            part < MAX_SHADOW && part > MIN_SHADOW && difference(colour, shaded) < allowed
        });
        Bitmap::new(size, is_shadow)
    }

    /// Where the background has a distinct colour.
    fn colourful(&self, size: (u32, u32)) -> Bitmap {
        let is_colourful = self.surface.iter().map(|&[r, g, b]| {
            let (least, most) = (r.min(g).min(b), r.max(g).max(b));
            most - least >= COLOURFUL * most
        });
        Bitmap::new(size, is_colourful)
    }
}

fn refused(why: &'static str) -> MaskError {
    MaskError::NotPlain { why }
}

fn downscaled(frame: &RgbImage) -> RgbImage {
    let (width, height) = frame.dimensions();
    let longest = width.max(height);
    if longest <= SIDE {
        return frame.clone();
    }
    let scaled = |side: u32| (f64::from(side) * f64::from(SIDE) / f64::from(longest)).round();
    let [width, height] = [width, height].map(|side| scaled(side).max(1.0) as u32);
    imageops::thumbnail(frame, width, height)
}

/// The border of the image.
fn ring((width, height): (usize, usize)) -> Bitmap {
    let wide = ((RING * width.min(height) as f64).round() as usize).max(MIN_RING);
    let near = |at: usize, size: usize| at < wide || at + wide >= size;
    let bits = (0..width * height).map(|at| near(at % width, width) || near(at / width, height));
    Bitmap::new((width as u32, height as u32), bits)
}

/// The pixels of the border that fit a smooth surface, and their deviation from it.
fn fit_ring(colours: &[Colour], ring: &Bitmap, size: (usize, usize)) -> Option<(Bitmap, f64)> {
    let mut used = ring.clone();
    let mut deviation = 0.0;
    for _ in 0..ROUNDS {
        let surface = Surface::fit(colours, &used, size, DEGREES[0])?;
        let apart = differences(colours, &surface.colours(size));
        let median = upper_median(chosen(&apart, &used))?;
        let limit = (3.0 * (1.4826 * median).max(1.0)).max(4.0);
        used = ring.map(|at, bit| bit && apart[at] < limit);
        let count = used.count();
        if count == 0 {
            return None;
        }
        let squares: f64 = chosen(&apart, &used).map(|d| f64::from(d * d)).sum();
        deviation = (squares / count as f64).sqrt();
    }
    Some((used, deviation))
}

fn chosen<'a>(values: &'a [f32], at: &'a Bitmap) -> impl Iterator<Item = f32> + 'a {
    let pairs = values.iter().zip(at.bits());
    pairs.filter(|&(_, &bit)| bit).map(|(&value, _)| value)
}

fn differences(colours: &[Colour], surface: &[Colour]) -> Vec<f32> {
    let pairs = colours.iter().zip(surface);
    pairs.map(|(&a, &b)| difference(a, b)).collect()
}

/// The components of a bitmap that have a pixel of another one.
fn connected_to(of: &Bitmap, start: &Bitmap) -> Bitmap {
    let components = of.components(Connectivity::Four);
    let mut kept = vec![false; components.list.len()];
    for at in (0..start.bits().len()).filter(|&at| start.bits()[at]) {
        if let Some(index) = components.at(at) {
            kept[index] = true;
        }
    }
    of.map(|at, _| components.at(at).is_some_and(|index| kept[index]))
}

/// The object among what is not background.
fn object(other: &Bitmap, ring: &Bitmap) -> Result<Bitmap, MaskError> {
    let components = other.components(Connectivity::Eight);
    let areas = || components.list.iter().map(|part| part.area);
    let largest = areas().max().unwrap_or(0) as f64;
    let is_part = |part: &Component| part.area as f64 >= PART * largest;
    let object = other.map(|at, _| {
        let index = components.at(at);
        index.is_some_and(|index| is_part(&components.list[index]))
    });
    let area = object.count() as f64;
    let share = area / other.bits().len() as f64;
    if share < OBJECT_SHARE[0] {
        return Err(refused("hardly anything differs from it"));
    }
    let others = components.list.iter().filter(|part| !is_part(part));
    let specks: u64 = others
        .map(|part| part.area)
        .filter(|&area| area > SPECK)
        .sum();
    let parts = components.list.iter().filter(|part| is_part(part)).count();
    let of_ring = object.and(ring).count() as f64 / ring.count().max(1) as f64;
    if share > OBJECT_SHARE[1] || of_ring > MAX_OF_RING {
        return Err(refused("the object reaches far along the border"));
    }
    if specks as f64 > MAX_OTHERS * area || parts > 1 {
        return Err(refused("more than one thing stands out from it"));
    }
    Ok(object)
}

/// What lies between pixels of a region both in its row and in its column.
fn spanned(region: &Bitmap) -> Bitmap {
    let (width, height) = (region.width(), region.bits().len() / region.width().max(1));
    let mut rows = vec![None::<(usize, usize)>; height];
    let mut columns = vec![None::<(usize, usize)>; width];
    let add = |span: &mut Option<(usize, usize)>, place: usize| {
        let (first, last) = span.unwrap_or((place, place));
        *span = Some((first.min(place), last.max(place)));
    };
    for at in (0..width * height).filter(|&at| region.bits()[at]) {
        add(&mut rows[at / width], at % width);
        add(&mut columns[at % width], at / width);
    }
    let within = |span: Option<(usize, usize)>, place: usize| {
        span.is_some_and(|(first, last)| (first..=last).contains(&place))
    };
    region.map(|at, _| {
        within(rows[at / width], at % width) && within(columns[at % width], at / width)
    })
}

/// Where no channel changes faster than in the edge of a soft shadow.
fn soft(colours: &[Colour], (width, height): (usize, usize)) -> Bitmap {
    let smooth = smoothed(&smoothed(colours, (width, height)), (width, height));
    let is_soft = (0..width * height).map(|at| {
        let (x, y) = (at % width, at / width);
        let left = smooth[at - usize::from(x > 0)];
        let right = smooth[at + usize::from(x + 1 < width)];
        let above = smooth[if y > 0 { at - width } else { at }];
        let below = smooth[if y + 1 < height { at + width } else { at }];
        (0..3).all(|c| (right[c] - left[c]).hypot(below[c] - above[c]) < 2.0 * SOFT)
    });
    Bitmap::new((width as u32, height as u32), is_soft)
}

/// Each pixel mixed with its neighbours, 1 : 2 : 1 along rows and columns.
fn smoothed(colours: &[Colour], (width, height): (usize, usize)) -> Vec<Colour> {
    let mix =
        |a: Colour, b: Colour, c: Colour| [0, 1, 2].map(|i| 0.25 * a[i] + 0.5 * b[i] + 0.25 * c[i]);
    let across = (0..colours.len()).map(|at| {
        let x = at % width;
        let (left, right) = (usize::from(x > 0), usize::from(x + 1 < width));
        mix(colours[at - left], colours[at], colours[at + right])
    });
    let across: Vec<Colour> = across.collect();
    let down = (0..colours.len()).map(|at| {
        let y = at / width;
        let above = if y > 0 { at - width } else { at };
        let below = if y + 1 < height { at + width } else { at };
        mix(across[above], across[at], across[below])
    });
    down.collect()
}

/// From an 8-bit value of sRGB to light, 0 to 1.
fn linear(value: f32) -> f32 {
    to_linear_f32(value.clamp(0.0, 255.0) / 255.0)
}

/// From light to an 8-bit value of sRGB.
fn coded(light: f32) -> f32 {
    255.0 * from_linear_f32(light.clamp(0.0, 1.0))
}
