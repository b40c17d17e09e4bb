//! The shadow that an object casts on the ground on which it stands: all light that it keeps from there, so that
//! cast shadow and contact shadow are one.

use std::f64::consts::{PI, TAU};
use std::iter::StepBy;
use std::ops::Range;

use super::relief::Relief;
use relight_core::image::{Extent, Planes};
use relight_core::light::{Direction, LightSampler, Panorama};

/// The size to which panoramas are brought for shadows.
const DRAWN: Extent = Extent::new(128, 64);
/// Neighbouring pixels look in different directions, in squares of this side, over which the mean is taken.
const PATTERN: usize = 4;
/// Directions of one pixel, by the light and as many by the cosine.
const RAYS: usize = 12;
/// How many times its width the object's shadow is looked for to both sides, and its height above and below.
const REACH: f64 = 1.5;
/// The part of the object's lowest points that may lie below the ground: normals at the rim are rough.
const BELOW_GROUND: f64 = 0.03;
/// How far a ray goes at a time, cells: less than one.
const STEP: f32 = 0.8;
/// Bits behind the point of a place in fixed point; shapes and their grounds have a few hundred cells.
const FIXED_BITS: u32 = 16;
const FIXED: f32 = (1 << FIXED_BITS) as f32;
/// The least part of a direction along an axis.
const LEAST_LEAN: f32 = 1e-6;
/// Ground that is seen more edge-on than this is as if it were seen so, radians.
const LEAST_TILT: f64 = 0.08;

/// The ground's shadow around an object, in parts of the light that arrives there without it.
#[derive(Debug, Clone)]
pub(super) struct Shadow {
    /// What arrives, 0 to 1.
    pub(super) arriving: Planes<3>,
    /// Column and row of the first pixel, from the relief's, cells.
    pub(super) from: [i64; 2],
}

/// A direction with the light from there that falls on the ground.
#[derive(Clone)]
struct Ray {
    towards: [f32; 3],
    /// One over each part of the direction, so that the shape's box is found without a division.
    over: [f32; 3],
    light: [f32; 3],
    /// Columns and rows of the ground from which it may meet the shape, from the relief's first cell.
    shaded: [Range<f32>; 2],
}

/// The ground: points p with p · up = level.
struct Ground {
    up: [f64; 3],
    level: f64,
}

impl Shadow {
    /// The shadow of a shape on ground that the camera looks down on by `tilt` radians, in the light of a panorama.
    pub(super) fn cast(relief: &Relief, tilt: f64, light: &Panorama) -> Self {
        let ground = Ground::under(relief, tilt);
        let patterns = rays(&ground, relief.around(), &light.resized(DRAWN));
        let Extent { width, height } = relief.extent;
        let (beside, beyond) = (
            (width.max(height) as f64 * REACH) as usize,
            (height as f64 * REACH) as usize,
        );
        let extent = Extent::new(width + 2 * beside, height + beyond);
        // Ground that is higher in the picture than the object's top is far behind it.
        let from = [-(beside as i64), 0];
        let mut arriving = Planes::zeros(extent);
        arriving.fill_rows(|y, mut row| {
            for column in 0..PATTERN {
                let rays = &patterns[y % PATTERN * PATTERN + column];
                let cells = (column..extent.width).step_by(PATTERN);
                ground.shade(
                    relief,
                    rays,
                    &mut row,
                    (cells, y as f64 + 0.5, from[0] as f64),
                );
            }
        });
        // Every square of the pattern holds all directions.
        let smooth = super::smooth::blurred(&arriving, PATTERN / 2);
        Self {
            arriving: smooth,
            from,
        }
    }
}

impl Ground {
    /// The ground that the shape stands on.
    fn under(relief: &Relief, tilt: f64) -> Self {
        let (sin, cos) = tilt.clamp(LEAST_TILT, PI / 2.0).sin_cos();
        let up = [0.0, cos, sin];
        let width = relief.extent.width;
        let mut lowest: Vec<f64> = (0..relief.half.len())
            .filter(|&at| relief.half[at] > 0.0)
            .map(|at| {
                // The back is lower than the front.
                let y = -((at / width) as f64 + 1.0);
                y * cos - f64::from(relief.half[at]) * sin
            })
            .collect();
        lowest.sort_by(f64::total_cmp);
        let place = (lowest.len() as f64 * BELOW_GROUND) as usize;
        Self {
            up,
            level: lowest.get(place).copied().unwrap_or(0.0),
        }
    }

    /// Fills in the part of the light that arrives at some cells of a row of the ground, which is so far below the relief's
    /// first row; the row begins at column `first` of the relief.
    fn shade(
        &self,
        relief: &Relief,
        rays: &[Ray],
        row: &mut [&mut [f32]; 3],
        (cells, below, first): (StepBy<Range<usize>>, f64, f64),
    ) {
        let z = (self.level + below * self.up[1]) / self.up[2];
        let all = rays.iter().fold([0.0_f32; 3], |all, ray| {
            [0, 1, 2].map(|c| all[c] + ray.light[c])
        });
        // First all that is kept from each cell, then what is left of the light.
        for ray in rays
            .iter()
            .filter(|ray| ray.shaded[1].contains(&(below as f32)))
        {
            for x in cells.clone() {
                let at = (x as f64 + 0.5 + first) as f32;
                let may_meet = ray.shaded[0].contains(&at);
                if may_meet && relief.blocks([at, -below as f32, z as f32], ray) {
                    for (line, light) in row.iter_mut().zip(ray.light) {
                        line[x] += light;
                    }
                }
            }
        }
        for (line, all) in row.iter_mut().zip(all) {
            for x in cells.clone() {
                let kept = if all > 0.0 { line[x] / all } else { 0.0 };
                line[x] = (1.0 - kept).max(0.0);
            }
        }
    }

    /// Columns and rows of the ground, rows downwards, from which a direction leads into a box.
    fn shaded(&self, [low, high]: [[f32; 3]; 2], towards: [f32; 3]) -> [Range<f32>; 2] {
        let rises: f64 = (0..3)
            .map(|axis| f64::from(towards[axis]) * self.up[axis])
            .sum();
        let mut ranges = [
            f32::INFINITY..f32::NEG_INFINITY,
            f32::INFINITY..f32::NEG_INFINITY,
        ];
        for corner in 0..8 {
            let place = [0, 1, 2].map(|axis| match corner >> axis & 1 {
                0 => f64::from(low[axis]),
                _ => f64::from(high[axis]),
            });
            let above: f64 = (0..3).map(|axis| place[axis] * self.up[axis]).sum();
            // A ray meets what is above the ground: the corner itself, or, of an edge that enters the ground, a place between
            // its ends.
            let back = ((above - self.level) / rises.max(1e-6)).max(0.0);
            for back in [0.0, back] {
                let seen = [0, 1].map(|axis| place[axis] - back * f64::from(towards[axis]));
                for (range, at) in ranges.iter_mut().zip([seen[0], -seen[1]]) {
                    range.start = range.start.min(at as f32 - 1.0);
                    range.end = range.end.max(at as f32 + 1.0);
                }
            }
        }
        ranges
    }
}

impl Relief {
    /// The corners of the box around the shape.
    fn around(&self) -> [[f32; 3]; 2] {
        let Extent { width, height } = self.extent;
        [
            [0.0, -(height as f32), -self.thickest],
            [width as f32, 0.0, self.thickest],
        ]
    }

    /// Whether the shape is in the way from a point in a direction. Its cells are 1 wide; rows lie below y = 0.
    fn blocks(&self, from: [f32; 3], ray: &Ray) -> bool {
        let Extent { width, height } = self.extent;
        let [low, high] = self.around();
        let (mut enter, mut leave) = (0.0_f32, f32::INFINITY);
        for axis in 0..3 {
            let ends = [low[axis], high[axis]].map(|end| (end - from[axis]) * ray.over[axis]);
            enter = enter.max(ends[0].min(ends[1]));
            leave = leave.min(ends[0].max(ends[1]));
        }
        // The first step is a little above the ground.
        let along = enter + 0.4;
        let steps = ((leave - along) / STEP).ceil().max(0.0) as usize;
        let [x, y, mut z] = [0, 1, 2].map(|axis| from[axis] + along * ray.towards[axis]);
        let [right, up, forward] = ray.towards.map(|part| STEP * part);
        // Columns and rows in fixed point: floating point would be made whole at each step.
        let fixed = |cells: f32| (cells * FIXED) as i32;
        let [mut column, mut row] = [fixed(x), fixed(-y)];
        let [right, down] = [fixed(right), fixed(-up)];
        for _ in 0..steps {
            let [at, line] = [column, row].map(|place| (place >> FIXED_BITS) as usize);
            // What lies left or above is a very large number.
            if at < width && line < height {
                let half = self.half[line * width + at];
                if half > 0.0 && z.abs() <= half {
                    return true;
                }
            }
            (column, row, z) = (column + right, row + down, z + forward);
        }
        false
    }
}

/// Directions for each place of the pattern, half of them drawn by the light and half by the cosine to the ground, weighted by
/// Veach's balance heuristic.
fn rays(ground: &Ground, around: [[f32; 3]; 2], light: &Panorama) -> Vec<Vec<Ray>> {
    let positive = light.image().planes().clone().map(|v| v.max(0.0));
    let light =
        Panorama::new(relight_core::image::Rgb::new(positive)).unwrap_or_else(|_| light.clone());
    let sampler = LightSampler::new(&light);
    let [right, forward] = [[1.0, 0.0, 0.0], [0.0, ground.up[2], -ground.up[1]]];
    let of = |direction: Direction| {
        let towards = direction.components();
        let cosine: f64 = (0..3).map(|axis| towards[axis] * ground.up[axis]).sum();
        if cosine <= 1e-3 {
            return None;
        }
        let density = sampler.density(direction) + cosine / PI;
        let light = sampler.panorama().radiance(direction);
        // A ray along a side of the box leans a little: nothing is divided by 0.
        let leaning = towards.map(|part| {
            let part = part as f32;
            if part.abs() < LEAST_LEAN {
                LEAST_LEAN
            } else {
                part
            }
        });
        Some(Ray {
            towards: leaning,
            over: leaning.map(|part| 1.0 / part),
            shaded: ground.shaded(around, leaning),
            light: light.map(|l| l * (cosine / density) as f32),
        })
    };
    let pattern = |number: usize| {
        let (mut drawn, count) = (Vec::with_capacity(2 * RAYS), RAYS * PATTERN * PATTERN);
        for ray in 0..RAYS {
            // A lattice of all pixels of the pattern, whose parts are spread over it.
            let at = (ray * PATTERN * PATTERN + number * 7 % (PATTERN * PATTERN)) as f64 + 0.5;
            let place = [at / count as f64, (at * 0.618_033_988_75).fract()];
            drawn.extend(of(sampler.draw(place).direction));
            let (radius, height) = (place[0].sqrt(), (1.0 - place[0]).sqrt());
            let (sin, cos) = (TAU * place[1]).sin_cos();
            let [x, y, z] = [0, 1, 2].map(|axis| {
                radius * (cos * right[axis] + sin * forward[axis]) + height * ground.up[axis]
            });
            drawn.extend(Direction::new(x, y, z).and_then(of));
        }
        drawn
    };
    (0..PATTERN * PATTERN).map(pattern).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insert::DiscLamp;
    use relight_core::light::Normals;

    fn ball() -> Relief {
        let normals = Normals::sphere(60);
        let alpha = Planes::from_fn(normals.extent(), |x, y| {
            [f32::from(u8::from(normals.planes().pixel(x, y)[2] > 0.0))]
        });
        Relief::new(&normals, &alpha).unwrap()
    }

    fn lamp(azimuth: f64, ambient: f64) -> Panorama {
        let lamp = DiscLamp {
            azimuth,
            elevation: 40.0,
            ambient,
            size: 10.0,
            ..DiscLamp::default()
        };
        lamp.panorama(Extent::new(128, 64))
    }

    /// The mean of what arrives on the left and on the right of the object.
    fn sides(shadow: &Shadow, relief: &Relief) -> [f32; 2] {
        let extent = shadow.arriving.extent();
        let first = (-shadow.from[0]) as usize;
        let mut sums = [0.0_f32; 2];
        for y in 0..extent.height {
            for x in 0..first {
                sums[0] += 1.0 - shadow.arriving.pixel(x, y)[0];
                sums[1] += 1.0 - shadow.arriving.pixel(first + relief.extent.width + x, y)[0];
            }
        }
        sums
    }

    #[test]
    fn a_shadow_lies_on_the_side_away_from_the_lamp() {
        let relief = ball();
        let [left, right] = sides(&Shadow::cast(&relief, 0.4, &lamp(90.0, 0.0)), &relief);
        assert!(left > 50.0 && right < 0.1 * left, "{left} {right}");
        let [left, right] = sides(&Shadow::cast(&relief, 0.4, &lamp(-90.0, 0.0)), &relief);
        assert!(right > 50.0 && left < 0.1 * right, "{left} {right}");
    }

    #[test]
    fn even_light_leaves_a_shadow_at_the_contact_and_hardly_any_far_away() {
        let relief = ball();
        let even = Panorama::of_light(
            &relight_core::light::ShLight::even(relight_core::light::Order::TWO, [1.0; 3]),
            Extent::new(64, 32),
        );
        let shadow = Shadow::cast(&relief, 0.4, &even);
        let first = (-shadow.from[0]) as usize;
        let below = shadow
            .arriving
            .pixel(first + relief.extent.width / 2, relief.extent.height)[0];
        let beside = shadow.arriving.pixel(4, relief.extent.height)[0];
        assert!(below < 0.8 && beside > 0.95, "{below} {beside}");
        let [left, right] = sides(&shadow, &relief);
        assert!((left / right - 1.0).abs() < 0.15, "{left} {right}");
    }

    #[test]
    fn rays_meet_the_shape_only_from_where_they_may() {
        let relief = ball();
        let ground = Ground::under(&relief, 0.4);
        let patterns = rays(&ground, relief.around(), &lamp(60.0, 0.3));
        let mut met = 0;
        let rays: Vec<&Ray> = patterns.iter().flatten().collect();
        for number in 0..4 * rays.len() {
            let ray = rays[number % rays.len()];
            let x = (number * 37 % 200) as f32 - 70.0;
            let below = (number * 53 % 110) as f32;
            let z = ((ground.level + f64::from(below) * ground.up[1]) / ground.up[2]) as f32;
            if relief.blocks([x, -below, z], ray) {
                met += 1;
                let [columns, rows] = &ray.shaded;
                assert!(columns.contains(&x) && rows.contains(&below), "{x} {below}");
            }
        }
        assert!(met > 30, "{met}");
    }

    #[test]
    fn without_any_light_there_is_no_shadow() {
        let dark = Panorama::of_light(
            &relight_core::light::ShLight::dark(relight_core::light::Order::TWO),
            Extent::new(64, 32),
        );
        let shadow = Shadow::cast(&ball(), 0.4, &dark);
        assert!(
            shadow
                .arriving
                .plane(1)
                .iter()
                .all(|&v| (v - 1.0).abs() < 1e-6)
        );
    }
}
