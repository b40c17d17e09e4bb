//! Where an object's edge runs, to the pixel.
//!
//! A pixel at the edge shows a mixture of object and background. Over a turn the background, the light, or both change,
//! which makes the mixture measurable: its course lies between those of the neighbouring object and background.
//! Its share of the object decides to which of them it belongs.

use crate::bitmap::Bitmap;

use super::pixel_series::{PixelSeries, dot};

/// Object and background are looked for within so many pixels.
const REACH: usize = 3;
/// A mean needs at least so many pixels.
const MIN_PIXELS: usize = 3;
/// A pixel that shows more than this share of the object is the object's, if the network's odds are even. Less than
/// half: of a mixture with a background that is brighter than the levels go, nearly all seems to be background.
const LEAST_SHARE: f32 = 0.4;
/// Weight of the network's odds, as a logarithm, against the share of the object.
const ODDS_WEIGHT: f32 = 0.1;
/// Series that differ by less than this, as a root of the mean square, say nothing.
const NOISE: f32 = 0.01;

/// The object with its edge where the courses show it; `odds` are the logarithms of the odds that a pixel is object.
pub(crate) fn along_series(series: &PixelSeries, odds: &[f32], object: &Bitmap) -> Bitmap {
    let outside = object.inverted();
    let (inner, outer) = (object.eroded(1), outside.eroded(1));
    let band = inner.inverted().minus(&outer);
    object.map(|at, bit| {
        if !band.bits()[at] {
            return bit;
        }
        let (inside, outside) = (near(&inner, at, series), near(&outer, at, series));
        match inside.zip(outside) {
            Some((inside, outside)) => share(series, at, &inside, &outside)
                .map_or(bit, |share| share + ODDS_WEIGHT * odds[at] > LEAST_SHARE),
            None => bit,
        }
    })
}

/// How much of what a pixel shows is the inside; `None` if it hardly differs from the outside.
fn share(series: &PixelSeries, at: usize, inside: &[f32], outside: &[f32]) -> Option<f32> {
    let apart: Vec<f32> = inside.iter().zip(outside).map(|(i, o)| i - o).collect();
    let length = dot(&apart, &apart);
    if length < NOISE * NOISE * apart.len() as f32 {
        return None;
    }
    let own = series.mean(&[at]);
    let beyond: Vec<f32> = own.iter().zip(outside).map(|(own, o)| own - o).collect();
    Some(dot(&beyond, &apart) / length)
}

/// The mean course of a part near a pixel; `None` if too little of it is there.
fn near(part: &Bitmap, at: usize, series: &PixelSeries) -> Option<Vec<f32>> {
    let (width, height) = series.size();
    let (x, y) = (at % width, at / width);
    let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
    let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
    let pixels = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
    let pixels: Vec<usize> = pixels.filter(|&at| part.bits()[at]).collect();
    (pixels.len() >= MIN_PIXELS).then(|| series.mean(&pixels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};

    #[test]
    fn an_edge_that_lies_beside_the_objects_is_moved_there() {
        let frames = [30_u8, 220, 90, 150].map(|room| {
            RgbImage::from_fn(40, 20, |x, _| {
                let level = |object: f64| {
                    let mixed = object * 120.0 + (1.0 - object) * f64::from(room);
                    Rgb([mixed as u8; 3])
                };
                match x {
                    0..15 => level(0.0),
                    15 => level(0.2),
                    16 => level(0.8),
                    _ => level(1.0),
                }
            })
        });
        let series = PixelSeries::new(&frames, (40, 20));
        let from = |left: usize| Bitmap::new((40, 20), (0..800).map(move |at| at % 40 >= left));
        assert_eq!(along_series(&series, &[0.0; 800], &from(15)), from(16));
        assert_eq!(along_series(&series, &[0.0; 800], &from(17)), from(16));
        // Nearly half is enough, less is not.
        let mixed = |share: f64| {
            [30_u8, 220, 90, 150].map(|room| {
                RgbImage::from_fn(40, 20, |x, _| {
                    let object = if x < 15 { 0.0 } else { 1.0 };
                    let object = if x == 15 { share } else { object };
                    let light = |level: f64| (level / 255.0).powf(2.2);
                    let mixed = object * light(120.0) + (1.0 - object) * light(f64::from(room));
                    Rgb([(255.0 * mixed.powf(1.0 / 2.2)).round() as u8; 3])
                })
            })
        };
        let edge_at = |share: f64| {
            let series = PixelSeries::new(&mixed(share), (40, 20));
            along_series(&series, &[0.0; 800], &from(16))
        };
        assert_eq!(edge_at(0.46), from(15));
        assert_eq!(edge_at(0.34), from(16));
        // A pixel that shows a fifth of the object is the object's if the network is sure of it.
        let sure: Vec<f32> = (0..800)
            .map(|at| if at % 40 == 15 { 4.0 } else { 0.0 })
            .collect();
        assert_eq!(along_series(&series, &sure, &from(16)), from(15));
    }
}
