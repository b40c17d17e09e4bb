//! The shadow that an object casts on the ground on which it stands: all light that it keeps from there, so that
//! cast shadow and contact shadow are one.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::relighting::{BLOCK, HeightField};
use relight_core::image::{Extent, Planes};
use relight_core::light::{Direction, LightSampler, Panorama};
use relit_data::statistics::above_part;

/// The size to which panoramas are brought for shadows.
const DRAWN: Extent = Extent::new(128, 64);
/// Neighbouring pixels look in different directions, in squares of this side, over which the mean is taken.
const PATTERN: usize = 4;
/// Half of such a side.
const HALF_PATTERN: i64 = PATTERN as i64 / 2;
/// Directions of one pixel, by the light and as many by the cosine.
const RAYS: usize = 12;
/// How many times its width the object's shadow is looked for to both sides, and its height above and below.
const REACH: f64 = 1.5;
/// The part of the object's height over which a shadow fades out at the end of the computed area.
const FADE: f32 = 0.125;
/// The part of the object's lowest points that may lie below the ground: normals at the rim are rough.
const BELOW_GROUND: f64 = 0.03;
/// How far a ray goes at a time, cells: less than one.
const STEP: f32 = 0.8;
/// Steps to at most a neighbouring block: taken at once if nothing can be hit there.
const LEAP: i32 = (BLOCK as f32 / STEP) as i32 - 1;
/// Single steps before the next check whether anything can be hit.
const LOOKS: i32 = 4;
/// Bits behind the point of a place in fixed point; shapes and their grounds have a few hundred cells.
const FIXED_BITS: u32 = 16;
const FIXED: f32 = (1 << FIXED_BITS) as f32;
/// The least part of the light that is missed where it is gone: less than a step of 8 bits.
const MIN_SEEN: f32 = 0.002;
/// The least part of a direction along an axis.
const MIN_LEAN: f32 = 1e-6;
/// Ground that is seen more edge-on than this is as if it were seen so, radians.
const MIN_TILT: f64 = 0.08;

/// The ground's shadow around an object, in parts of the light that arrives there without it.
#[derive(Debug, Clone)]
pub(crate) struct Shadow {
    /// What arrives, 0 to 1.
    pub(crate) arriving: Planes<3>,
    /// Column and row of the first pixel, from the relief's, cells.
    pub(crate) from: [i64; 2],
}

/// A direction with the light from there that falls on the ground.
#[derive(Clone)]
struct Ray {
    towards: [f32; 3],
    /// One over each part of the direction, so that the shape's box is found without a division.
    over: [f32; 3],
    /// The sides where it enters the shape's box, and those where it leaves it.
    sides: [[f32; 3]; 2],
    light: [f32; 3],
}

impl Ray {
    /// How far along the ray the rows and depths of the shape's box are passed, from where it starts.
    fn inside_from(&self, y: f32, z: f32) -> Range<f32> {
        self.within(2, z, self.within(1, y, 0.0..f32::INFINITY))
    }

    /// The columns from which the box is hit at such a distance.
    fn columns(&self, inside: &Range<f32>) -> Range<f32> {
        let [one, other] = self.sides.map(|side| side[0]);
        let back = [inside.start, inside.end].map(|along| -along * self.towards[0]);
        Range {
            start: one.min(other) + back[0].min(back[1]),
            end: one.max(other) + back[0].max(back[1]),
        }
    }

    /// What lies between the box's two sides across an axis too.
    fn within(&self, axis: usize, from: f32, along: Range<f32>) -> Range<f32> {
        let [enter, leave] = self.sides.map(|side| (side[axis] - from) * self.over[axis]);
        // Not by `max` and `min`, which look for what is no number.
        Range {
            start: if enter > along.start {
                enter
            } else {
                along.start
            },
            end: if leave < along.end { leave } else { along.end },
        }
    }
}

/// The ground: points p with p · up = level.
struct Ground {
    up: [f64; 3],
    level: f64,
}

impl Shadow {
    /// The shadow of a shape on ground that the camera looks down on by `tilt` radians, in the light of a panorama.
    pub(crate) fn cast(relief: &HeightField, tilt: f64, light: &Panorama) -> Self {
        let ground = Ground::under(relief, tilt);
        let relief = &relief.standing(|below| ground.depth(below));
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
            for phase in 0..PATTERN {
                let rays = &patterns[y % PATTERN * PATTERN + phase];
                let below = y as f64 + 0.5;
                ground.shade(relief, rays, &mut row, (phase, below, from[0] as f64));
            }
        });
        let shadow = Self {
            arriving: mean_of_patterns(&arriving),
            from,
        };
        shadow.ending(FADE * height as f32).trimmed()
    }

    /// The same shadow, fading out over so many cells before each of its borders.
    fn ending(mut self, over: f32) -> Self {
        let Extent { width, height } = self.arriving.extent();
        let part = |at: usize, count: usize| (at.min(count - 1 - at) as f32 / over).min(1.0);
        self.arriving.fill_rows(|y, lines| {
            let of_row = part(y, height);
            for line in lines {
                for (x, arriving) in line.iter_mut().enumerate() {
                    *arriving = 1.0 - (1.0 - *arriving) * of_row.min(part(x, width));
                }
            }
        });
        self
    }

    /// The part of it that can be seen, with a cell around it where it ends: between cells it fades.
    fn trimmed(self) -> Self {
        let Extent { width, height } = self.arriving.extent();
        let is_seen = |x: usize, y: usize| {
            let kept = self.arriving.pixel(x, y).map(|arriving| 1.0 - arriving);
            kept.into_iter().any(|kept| kept > MIN_SEEN)
        };
        let mut seen = [width..0, height..0];
        for y in 0..height {
            for x in (0..width).filter(|&x| is_seen(x, y)) {
                seen = [(0, x), (1, y)].map(|(axis, at)| {
                    let Range { start, end } = seen[axis];
                    start.min(at)..end.max(at + 1)
                });
            }
        }
        if seen[0].is_empty() {
            return Self {
                arriving: Planes::filled(Extent::new(1, 1), [1.0; 3]),
                from: self.from,
            };
        }
        let [columns, rows] = [(0, width), (1, height)].map(|(axis, end)| {
            let Range { start, end: last } = seen[axis];
            start.saturating_sub(1)..(last + 1).min(end)
        });
        let part = Extent::new(columns.len(), rows.len());
        Self {
            arriving: Planes::from_fn(part, |x, y| {
                self.arriving.pixel(columns.start + x, rows.start + y)
            }),
            from: [
                self.from[0] + columns.start as i64,
                self.from[1] + rows.start as i64,
            ],
        }
    }
}

impl Ground {
    /// The ground that the shape stands on.
    fn under(relief: &HeightField, tilt: f64) -> Self {
        let (sin, cos) = tilt.clamp(MIN_TILT, PI / 2.0).sin_cos();
        let up = [0.0, cos, sin];
        let width = relief.extent.width;
        let lowest = (0..relief.half.len())
            .filter(|&at| relief.half[at] > 0.0)
            .map(|at| {
                // The back is lower than the front.
                let y = -((at / width) as f64 + 1.0);
                y * cos - f64::from(relief.half[at]) * sin
            });
        Self {
            up,
            level: above_part(lowest, BELOW_GROUND).unwrap_or(0.0),
        }
    }

    /// How far towards the viewer it is, so far below the relief's first row.
    fn depth(&self, below: f64) -> f64 {
        (self.level + below * self.up[1]) / self.up[2]
    }

    /// Fills in the part of the light that arrives at every fourth cell of a row of the ground, from cell `phase` on. The row is so
    /// far below the relief's first row, and begins at column `first` of the relief.
    fn shade(
        &self,
        relief: &HeightField,
        rays: &[Ray],
        row: &mut [&mut [f32]; 3],
        (phase, below, first): (usize, f64, f64),
    ) {
        let [y, z] = [-below as f32, self.depth(below) as f32];
        let middle = 0.5 + first as f32;
        // First all that is kept from each cell, then what is left of the light.
        for ray in rays {
            let inside = ray.inside_from(y, z);
            if inside.is_empty() {
                continue;
            }
            let columns = ray.columns(&inside);
            let end = ((columns.end - middle).floor() + 1.0) as usize;
            let from = (columns.start - middle).ceil() as usize;
            let from = from.saturating_sub(phase).next_multiple_of(PATTERN) + phase;
            for x in (from..end.min(row[0].len())).step_by(PATTERN) {
                if relief.blocks([x as f32 + middle, y, z], ray, &inside) {
                    for (line, light) in row.iter_mut().zip(ray.light) {
                        line[x] += light;
                    }
                }
            }
        }
        let all = rays.iter().fold([0.0_f32; 3], |all, ray| {
            [0, 1, 2].map(|c| all[c] + ray.light[c])
        });
        for (line, all) in row.iter_mut().zip(all) {
            for kept in line.iter_mut().skip(phase).step_by(PATTERN) {
                *kept = if all > 0.0 {
                    (1.0 - *kept / all).max(0.0)
                } else {
                    1.0
                };
            }
        }
    }
}

impl HeightField {
    /// The corners of the box around the shape.
    fn around(&self) -> [[f32; 3]; 2] {
        let Extent { width, height } = self.extent;
        [
            [0.0, -(height as f32), -self.thickest],
            [width as f32, 0.0, self.thickest],
        ]
    }

    /// Whether the shape blocks a ray from a point; `inside` is the part of the ray within the rows and depths of the box. Cells
    /// are 1 wide; rows lie below y = 0.
    fn blocks(&self, from: [f32; 3], ray: &Ray, inside: &Range<f32>) -> bool {
        let mut walk = Walk::through(ray, from, inside);
        while walk.left > 0 {
            let near = self.cell(&walk).map_or(self.thickest, |[column, row]| {
                self.thickest_near(column, row)
            });
            if walk.passes(near) {
                walk.go(LEAP);
                continue;
            }
            for _ in 0..LOOKS.min(walk.left) {
                if self.holds(&walk) {
                    return true;
                }
                walk.go(1);
            }
        }
        false
    }

    /// The column and row at which a walk is, where that is among the cells.
    fn cell(&self, walk: &Walk) -> Option<[usize; 2]> {
        // What lies left or above is a very large number.
        let [column, row] = walk.place.map(|place| (place >> FIXED_BITS) as usize);
        (column < self.extent.width && row < self.extent.height).then_some([column, row])
    }

    /// Whether a walk is inside of the shape.
    fn holds(&self, walk: &Walk) -> bool {
        self.cell(walk).is_some_and(|[column, row]| {
            let half = self.half[row * self.extent.width + column];
            half > 0.0 && (walk.z - self.middle[column]).abs() <= half
        })
    }
}

/// A way through the box around a shape, step by step.
struct Walk {
    /// Column and row in fixed point: floating point would be made whole at each step.
    place: [i32; 2],
    z: f32,
    /// What a step adds to them.
    across: [i32; 2],
    forward: f32,
    /// Steps that are left.
    left: i32,
}

impl Walk {
    /// The range in which a ray from a point is inside the box.
    fn through(ray: &Ray, from: [f32; 3], inside: &Range<f32>) -> Self {
        let Range {
            start: enter,
            end: leave,
        } = ray.within(0, from[0], inside.clone());
        // The first step is a little above the ground.
        let along = enter + 0.4;
        let [x, y, z] = [0, 1, 2].map(|axis| from[axis] + along * ray.towards[axis]);
        let [right, up, forward] = ray.towards.map(|part| STEP * part);
        let fixed = |cells: f32| (cells * FIXED) as i32;
        Self {
            place: [fixed(x), fixed(-y)],
            z,
            across: [fixed(right), fixed(-up)],
            forward,
            left: ((leave - along) / STEP).ceil() as i32,
        }
    }

    /// Whether the next steps, as many as can be leapt, meet nothing that is at most so thick to both sides.
    fn passes(&self, half: f32) -> bool {
        half <= 0.0 || self.z.abs() - LEAP as f32 * self.forward.abs() > half
    }

    fn go(&mut self, steps: i32) {
        self.place = [0, 1].map(|axis| self.place[axis] + steps * self.across[axis]);
        self.z += steps as f32 * self.forward;
        self.left -= steps;
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
            if part.abs() < MIN_LEAN {
                MIN_LEAN
            } else {
                part
            }
        });
        Some(Ray {
            towards: leaning,
            over: leaning.map(|part| 1.0 / part),
            sides: sides(around, leaning),
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

/// The mean over squares that hold each place of the pattern equally: a cell more to each side than half a pattern, where the
/// outermost count half.
fn mean_of_patterns(arriving: &Planes<3>) -> Planes<3> {
    let Extent { width, height } = arriving.extent();
    let along = |source: &Planes<3>, across: bool| {
        let mut mean = Planes::zeros(source.extent());
        let planes = source.planes();
        mean.fill_rows(|y, lines| {
            for (line, plane) in lines.into_iter().zip(planes) {
                for (x, value) in line.iter_mut().enumerate() {
                    let at = |step: i64| {
                        let [x, y] = if across {
                            [step_from(x, step, width), y]
                        } else {
                            [x, step_from(y, step, height)]
                        };
                        plane[y * width + x]
                    };
                    let ends = (at(-HALF_PATTERN) + at(HALF_PATTERN)) / 2.0;
                    let inner: f32 = (1 - HALF_PATTERN..HALF_PATTERN).map(at).sum();
                    *value = (ends + inner) / PATTERN as f32;
                }
            }
        });
        mean
    };
    along(&along(arriving, true), false)
}

/// The place so many steps further, within the limits.
fn step_from(at: usize, steps: i64, count: usize) -> usize {
    (at as i64 + steps).clamp(0, count as i64 - 1) as usize
}

/// The sides where a direction enters a box with these corners, and those where it leaves it.
fn sides([low, high]: [[f32; 3]; 2], towards: [f32; 3]) -> [[f32; 3]; 2] {
    let of = |enters: bool| {
        [0, 1, 2].map(|axis| {
            if (towards[axis] > 0.0) == enters {
                low[axis]
            } else {
                high[axis]
            }
        })
    };
    [of(true), of(false)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relighting::DiscLamp;
    use relight_core::light::Normals;

    fn ball() -> HeightField {
        let normals = Normals::sphere(60);
        let alpha = Planes::from_fn(normals.extent(), |x, y| {
            [f32::from(u8::from(normals.planes().pixel(x, y)[2] > 0.0))]
        });
        HeightField::new(&normals, &alpha).unwrap()
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

    /// The light that arrives at a cell of the relief's columns and rows, or outside them.
    fn arriving(shadow: &Shadow, x: i64, y: i64) -> f32 {
        let Extent { width, height } = shadow.arriving.extent();
        let [x, y] = [x - shadow.from[0], y - shadow.from[1]];
        if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
            shadow.arriving.pixel(x as usize, y as usize)[0]
        } else {
            1.0
        }
    }

    /// What is missing on the left and on the right of the object.
    fn missing_beside(shadow: &Shadow, relief: &HeightField) -> [f32; 2] {
        let Extent { width, height } = relief.extent;
        let missing = |columns: Range<i64>| {
            let cells = columns.flat_map(|x| (0..4 * height as i64).map(move |y| [x, y]));
            cells.map(|[x, y]| 1.0 - arriving(shadow, x, y)).sum()
        };
        let width = width as i64;
        [missing(-3 * width..0), missing(width..4 * width)]
    }

    #[test]
    fn a_shadow_lies_on_the_side_away_from_the_lamp() {
        let relief = ball();
        let [left, right] = missing_beside(&Shadow::cast(&relief, 0.4, &lamp(90.0, 0.0)), &relief);
        assert!(left > 50.0 && right < 0.1 * left, "{left} {right}");
        let [left, right] = missing_beside(&Shadow::cast(&relief, 0.4, &lamp(-90.0, 0.0)), &relief);
        assert!(right > 50.0 && left < 0.1 * right, "{left} {right}");
    }

    #[test]
    fn even_light_leaves_a_shadow_at_the_contact_and_hardly_any_far_away() {
        let relief = ball();
        let even = Panorama::from_light(
            &relight_core::light::ShLight::even(relight_core::light::Order::TWO, [1.0; 3]),
            Extent::new(64, 32),
        );
        let shadow = Shadow::cast(&relief, 0.4, &even);
        let Extent { width, height } = relief.extent;
        let [width, height] = [width, height].map(|side| side as i64);
        let below = arriving(&shadow, width / 2, height);
        let beside = arriving(&shadow, 4 - 3 * width / 2, height);
        assert!(below < 0.8 && beside > 0.95, "{below} {beside}");
        let [left, right] = missing_beside(&shadow, &relief);
        assert!((left / right - 1.0).abs() < 0.15, "{left} {right}");
    }

    /// Whether a ray is inside of the shape in any of its steps, all looked at.
    fn is_met(relief: &HeightField, from: [f32; 3], ray: &Ray) -> bool {
        let mut walk = Walk::through(ray, from, &ray.inside_from(from[1], from[2]));
        while walk.left > 0 {
            if relief.holds(&walk) {
                return true;
            }
            walk.go(1);
        }
        false
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
            let inside = ray.inside_from(-below, z);
            let blocked = relief.blocks([x, -below, z], ray, &inside);
            assert_eq!(blocked, is_met(&relief, [x, -below, z], ray), "{x} {below}");
            if blocked {
                met += 1;
                let columns = ray.columns(&inside);
                assert!(!inside.is_empty() && columns.contains(&x), "{x} {below}");
            }
        }
        assert!(met > 30, "{met}");
    }

    #[test]
    fn a_shadow_ends_where_all_light_arrives_and_shows_no_pattern() {
        let relief = ball();
        let shadow = Shadow::cast(&relief, 0.4, &lamp(60.0, 0.3));
        let Extent { width, height } = shadow.arriving.extent();
        let border = (0..height)
            .flat_map(|y| [[0, y], [width - 1, y]])
            .chain((0..width).flat_map(|x| [[x, 0], [x, height - 1]]));
        for [x, y] in border {
            let kept = 1.0 - shadow.arriving.pixel(x, y)[0];
            assert!(kept <= MIN_SEEN, "{x} {y} {kept}");
        }
        let pattern = Planes::from_fn(Extent::new(40, 40), |x, y| {
            [(x % PATTERN + PATTERN * (y % PATTERN)) as f32; 3]
        });
        let even = mean_of_patterns(&pattern);
        for place in [[20, 20], [21, 20], [22, 23], [19, 17]] {
            assert!((even.pixel(place[0], place[1])[1] - 7.5).abs() < 1e-4);
        }
    }

    #[test]
    fn without_any_light_there_is_no_shadow() {
        let dark = Panorama::from_light(
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

    #[test]
    fn a_leg_that_ends_higher_in_the_picture_does_not_float() {
        let extent = Extent::new(60, 60);
        let flat = Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]));
        let alpha = Planes::from_fn(extent, |x, y| {
            let ends = [(8..20, 58), (40..52, 50)];
            let is_leg = ends.iter().any(|(leg, end)| leg.contains(&x) && y < *end);
            [f32::from(u8::from(
                is_leg || (y < 12 && (8..52).contains(&x)),
            ))]
        });
        let relief = HeightField::new(&flat, &alpha).unwrap();
        let even = Panorama::from_light(
            &relight_core::light::ShLight::even(relight_core::light::Order::TWO, [1.0; 3]),
            Extent::new(64, 32),
        );
        let shadow = Shadow::cast(&relief, 0.5, &even);
        let [lower, higher] = [(14, 58), (46, 50)].map(|(x, y)| 1.0 - arriving(&shadow, x, y));
        assert!(lower > 0.1 && higher > 0.6 * lower, "{lower} {higher}");
    }
}
