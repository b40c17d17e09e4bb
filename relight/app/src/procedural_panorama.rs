//! Panoramas made by formulas, so that a scene needs no file and no licence, in linear radiance.

use relight_core::image::{Extent, Planes, Rgb};
use relight_core::light::{Direction, LightError, Panorama};
use relight_photo::relighting::DiscLamp;

/// Their size.
const EXTENT: Extent = Extent::new(1024, 512);

/// A panorama that is made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProceduralPanorama {
    /// By what the page asks for it.
    pub(crate) id: &'static str,
    /// What a person reads.
    pub(crate) name: &'static str,
    radiance: fn(Direction) -> Colour,
}

impl ProceduralPanorama {
    /// All of them: a photographer's room with two soft boxes, a room with a window on the left and a lamp, a meadow under a
    /// clouded sky and at noon, a beach before sunset, a square at night between coloured lamps.
    pub(crate) const ALL: [Self; 6] = [
        Self::new("studio", "Studio", studio),
        Self::new("room", "Room with a window", room),
        Self::new("overcast", "Clouds", |towards| outside(towards, &OVERCAST)),
        Self::new("noon", "Noon", |towards| outside(towards, &NOON)),
        Self::new("evening", "Evening sun", |towards| {
            outside(towards, &EVENING)
        }),
        Self::new("night", "Night", night),
    ];

    const fn new(id: &'static str, name: &'static str, radiance: fn(Direction) -> Colour) -> Self {
        Self { id, name, radiance }
    }

    /// That of this id.
    pub(crate) fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|scenery| scenery.id == id)
    }

    /// The panorama.
    ///
    /// # Errors
    /// None: its values are finite.
    pub(crate) fn panorama(self) -> Result<Panorama, LightError> {
        self.panorama_of(EXTENT)
    }

    /// The panorama of another size.
    ///
    /// # Errors
    /// If it has no pixels.
    pub(crate) fn panorama_of(self, extent: Extent) -> Result<Panorama, LightError> {
        let blank = Panorama::new(Rgb::new(Planes::zeros(extent)))?;
        Panorama::new(Rgb::new(Planes::from_fn(extent, |x, y| {
            // The mean of four places, so that edges are smooth.
            let places = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
            let sum = places.iter().fold([0.0; 3], |sum, (dx, dy)| {
                let towards = blank.direction(x as f64 + dx, y as f64 + dy);
                add(sum, (self.radiance)(towards))
            });
            sum.map(|value| (value / places.len() as f64) as f32)
        })))
    }
}

type Colour = [f64; 3];

fn add(a: Colour, b: Colour) -> Colour {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn mixed(a: Colour, b: Colour, part: f64) -> Colour {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * part)
}

fn times(colour: Colour, factor: f64) -> Colour {
    colour.map(|value| value * factor)
}

/// 0 below `from`, 1 above `to`, and smooth between.
fn step(from: f64, to: f64, value: f64) -> f64 {
    let part = ((value - from) / (to - from)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

/// Uneven values of mean 0 and size 1 over two coordinates, without a period that is seen.
fn uneven(x: f64, y: f64) -> f64 {
    let wave = |a: f64, b: f64, phase: f64| (a * x + b * y + phase).sin();
    (wave(1.0, 0.31, 0.0) + wave(-0.57, 1.13, 1.3) + wave(1.91, -1.37, 2.1) + wave(2.71, 2.23, 4.0))
        / 2.0
}

/// Where a ray from the middle meets a box of half the sides `half`: the place, and the axis of the wall.
fn wall(towards: Direction, half: [f64; 3]) -> ([f64; 3], usize) {
    let along = towards.components();
    let distance = |axis: usize| half[axis] / along[axis].abs().max(1e-9);
    let axis = (0..3).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    let axis = axis.unwrap_or(0);
    (along.map(|part| part * distance(axis)), axis)
}

/// 1 within a rectangle about a middle, with soft edges.
fn inside(at: [f64; 2], middle: [f64; 2], half: [f64; 2], soft: f64) -> f64 {
    let line = |axis: usize| {
        1.0 - step(
            half[axis] - soft,
            half[axis] + soft,
            (at[axis] - middle[axis]).abs(),
        )
    };
    line(0) * line(1)
}

/// The angle between a direction and that of a lamp or sun, degrees; azimuth and elevation as for lamps.
fn degrees_from(towards: Direction, [azimuth, elevation]: [f64; 2]) -> f64 {
    let lamp = DiscLamp {
        azimuth,
        elevation,
        ..DiscLamp::default()
    };
    let cosine = towards.dot(lamp.direction());
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

fn studio(towards: Direction) -> Colour {
    let [x, y, z] = towards.components();
    // Wall and floor are one sheet of paper, lighter where the boxes light it.
    let paper = 0.16 + 0.10 * step(-0.4, 0.5, y) + 0.07 * step(0.2, 1.0, -z);
    let paper = times([1.0, 0.99, 0.97], paper);
    let ([wx, wy, wz], axis) = wall(towards, [2.0, 1.6, 2.0]);
    let boxes = match axis {
        0 if x < 0.0 => 14.0 * inside([wz, wy], [0.5, 0.5], [0.7, 0.6], 0.04),
        0 => 5.0 * inside([wz, wy], [0.2, 0.7], [0.45, 0.5], 0.04),
        1 if y > 0.0 => 3.0 * inside([wx, wz], [0.0, 0.0], [0.8, 0.5], 0.04),
        2 if z > 0.0 => 2.0 * inside([wx, wy], [0.9, 0.3], [0.25, 0.9], 0.04),
        _ => 0.0,
    };
    add(paper, times([1.0, 0.98, 0.95], boxes))
}

fn room(towards: Direction) -> Colour {
    let ([x, y, z], axis) = wall(towards, [2.2, 1.3, 2.4]);
    let [_, up, _] = towards.components();
    // Light falls off from the window on the left.
    let near = 1.0 / (1.0 + 0.35 * (x + 2.2) * (x + 2.2));
    let plaster = times([0.80, 0.74, 0.66], 0.12 + 0.55 * near);
    match axis {
        1 if up < 0.0 => {
            let board = (x * 4.0).floor();
            let grain = 1.0
                + 0.10 * uneven(9.0 * board, 3.0 * z + board)
                + 0.05 * uneven(60.0 * x, 4.0 * z);
            let gap = 1.0
                - 0.5
                    * inside(
                        [(x * 4.0).fract() - 0.5, 0.0],
                        [0.5, 0.0],
                        [0.03, 1.0],
                        0.02,
                    );
            times([0.42, 0.24, 0.13], (0.15 + 0.75 * near) * grain * gap)
        }
        1 => {
            let lamp = 22.0 * step(0.34, 0.30, (x - 1.0).hypot(z + 0.6));
            add(times(plaster, 0.9), times([1.0, 0.72, 0.42], lamp))
        }
        0 if x < 0.0 => {
            let pane = inside([z, y], [-0.3, 0.25], [0.9, 0.7], 0.02);
            let bars = inside([z, 0.0], [-0.3, 0.0], [0.04, 1.0], 0.01).max(inside(
                [0.0, y],
                [0.0, 0.3],
                [1.0, 0.03],
                0.01,
            ));
            let sky = times([0.75, 0.88, 1.0], 13.0 + 4.0 * y);
            mixed(plaster, mixed(sky, times(plaster, 0.7), bars), pane)
        }
        _ => {
            let skirting = step(-1.17, -1.14, y);
            let wall = mixed(times([0.8, 0.8, 0.78], 0.1 + 0.5 * near), plaster, skirting);
            let frame = inside([x, y], [0.5, 0.35], [0.5, 0.38], 0.01);
            let picture = inside([x, y], [0.5, 0.35], [0.44, 0.32], 0.01);
            let painted = mixed(
                [0.10, 0.19, 0.26],
                [0.5, 0.33, 0.14],
                step(-0.1, 0.3, y - 0.35 + 0.1 * uneven(6.0 * x, 2.0)),
            );
            let painted = times(painted, 0.3 + near);
            if z < 0.0 {
                mixed(mixed(wall, [0.05, 0.04, 0.03], frame), painted, picture)
            } else {
                wall
            }
        }
    }
}

/// Sky, ground and sun.
struct Outside {
    zenith: Colour,
    horizon: Colour,
    ground: Colour,
    /// Azimuth as of lamps and elevation, degrees.
    sun: [f64; 2],
    sun_colour: Colour,
    /// How large the sun is, degrees across, and how bright.
    sun_size: f64,
    sun_radiance: f64,
    clouds: f64,
}

const OVERCAST: Outside = Outside {
    zenith: [0.95, 1.0, 1.06],
    horizon: [0.72, 0.76, 0.80],
    ground: [0.16, 0.19, 0.10],
    sun: [200.0, 55.0],
    sun_colour: [1.0, 0.98, 0.94],
    sun_size: 50.0,
    sun_radiance: 0.9,
    clouds: 0.22,
};

const NOON: Outside = Outside {
    zenith: [0.13, 0.27, 0.62],
    horizon: [0.48, 0.62, 0.82],
    ground: [0.14, 0.20, 0.06],
    sun: [140.0, 48.0],
    sun_colour: [1.0, 0.95, 0.86],
    sun_size: 3.0,
    sun_radiance: 1700.0,
    clouds: 0.10,
};

const EVENING: Outside = Outside {
    zenith: [0.10, 0.14, 0.30],
    horizon: [0.80, 0.42, 0.20],
    ground: [0.30, 0.21, 0.13],
    sun: [210.0, 9.0],
    sun_colour: [1.0, 0.50, 0.19],
    sun_size: 5.0,
    sun_radiance: 330.0,
    clouds: 0.16,
};

fn outside(towards: Direction, scene: &Outside) -> Colour {
    let [x, y, z] = towards.components();
    let from_sun = degrees_from(towards, scene.sun);
    let sky = mixed(scene.horizon, scene.zenith, y.max(0.0).powf(0.6));
    let level = (x / (y.abs() + 0.12), z / (y.abs() + 0.12));
    let cloud = step(
        0.0,
        1.6,
        uneven(1.7 * level.0, 1.7 * level.1) + 0.3 * uneven(7.0 * level.0, 6.0 * level.1),
    );
    let sky = mixed(
        sky,
        [0.95, 0.93, 0.92],
        scene.clouds * cloud * step(0.0, 0.1, y),
    );
    let glow = times(scene.sun_colour, 0.9 * (-from_sun / 14.0).exp());
    let disc = step(
        scene.sun_size / 2.0 * 1.1,
        scene.sun_size / 2.0 * 0.9,
        from_sun,
    );
    let sky = add(
        add(sky, glow),
        times(scene.sun_colour, scene.sun_radiance * disc),
    );
    let grain = 1.0
        + 0.20 * uneven(9.0 * level.0, 8.0 * level.1)
        + 0.12 * uneven(31.0 * level.0, 37.0 * level.1);
    let ground = times(scene.ground, grain);
    // What is far away is as pale as the horizon.
    let ground = mixed(ground, times(scene.horizon, 0.55), step(-0.16, 0.0, y));
    mixed(ground, sky, step(-0.006, 0.006, y))
}

/// Lamps of the square at night: azimuth, elevation and size in degrees, and radiance.
const LAMPS: [([f64; 3], Colour); 5] = [
    ([250.0, 26.0, 9.0], [70.0, 44.0, 18.0]),
    ([110.0, 20.0, 12.0], [6.0, 16.0, 44.0]),
    ([20.0, 38.0, 10.0], [40.0, 30.0, 20.0]),
    ([165.0, 12.0, 5.0], [50.0, 8.0, 26.0]),
    ([205.0, 9.0, 4.0], [10.0, 44.0, 30.0]),
];

fn night(towards: Direction) -> Colour {
    let [x, y, z] = towards.components();
    let level = (x / (y.abs() + 0.1), z / (y.abs() + 0.1));
    let paving = 1.0 + 0.25 * uneven(8.0 * level.0, 8.0 * level.1);
    let around = z.atan2(x);
    // Houses of several heights, with some windows lit.
    let house = (around * 5.0).floor();
    let roof = 0.16 + 0.08 * uneven(3.1 * house, 1.0);
    let windows = inside(
        [(around * 40.0).fract() - 0.5, (y * 24.0).fract() - 0.5],
        [0.0; 2],
        [0.24, 0.3],
        0.06,
    ) * step(
        0.9,
        1.1,
        uneven((around * 40.0).floor() * 2.7, (y * 24.0).floor() * 3.3),
    );
    let facade = add([0.030, 0.028, 0.032], times([0.9, 0.62, 0.26], windows));
    let sky = mixed([0.035, 0.036, 0.055], [0.008, 0.010, 0.022], y.max(0.0));
    let above = mixed(facade, sky, step(roof - 0.004, roof + 0.004, y));
    let mut colour = mixed(
        times([0.05, 0.05, 0.055], paving),
        above,
        step(-0.01, 0.01, y),
    );
    for ([azimuth, elevation, size], radiance) in LAMPS {
        let from = degrees_from(towards, [azimuth, elevation]);
        let disc = step(size / 2.0 * 1.1, size / 2.0 * 0.9, from);
        colour = add(colour, times(radiance, disc + 0.006 * (-from / 10.0).exp()));
    }
    colour
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Order;

    const SMALL: Extent = Extent::new(96, 48);

    #[test]
    fn each_has_a_name_of_its_own_and_is_found_by_its_id() {
        for scenery in ProceduralPanorama::ALL {
            assert_eq!(
                ProceduralPanorama::from_id(scenery.id).map(|found| found.name),
                Some(scenery.name)
            );
            let names = ProceduralPanorama::ALL
                .iter()
                .filter(|other| other.name == scenery.name);
            assert_eq!(names.count(), 1);
        }
        assert!(ProceduralPanorama::from_id("moon").is_none());
    }

    #[test]
    fn all_are_light_and_more_comes_from_above_than_from_below() {
        for scenery in ProceduralPanorama::ALL {
            let panorama = scenery.panorama_of(SMALL).unwrap();
            let planes = panorama.image().planes().planes();
            assert!(planes.into_iter().flatten().all(|value| *value >= 0.0));
            let light = panorama.project(Order::TWO);
            // Band 1, y: the second coefficient.
            assert!(light.coefficients()[1][1] > 0.0, "{scenery:?}");
        }
    }

    #[test]
    fn a_low_sun_is_warm() {
        let evening = ProceduralPanorama::from_id("evening")
            .unwrap()
            .panorama_of(SMALL)
            .unwrap()
            .project(Order::TWO);
        let [r, _, b] = evening.coefficients()[0];
        assert!(r > 1.5 * b, "{r} {b}");
    }

    #[test]
    fn a_window_lights_from_the_left() {
        let room = ProceduralPanorama::from_id("room")
            .unwrap()
            .panorama_of(SMALL)
            .unwrap()
            .project(Order::TWO);
        // Band 1, x: the fourth.
        assert!(room.coefficients()[3][1] < 0.0);
    }

    #[test]
    fn left_and_right_edge_meet() {
        for scenery in ProceduralPanorama::ALL {
            let panorama = scenery.panorama_of(Extent::new(512, 256)).unwrap();
            let planes = panorama.image().planes();
            let apart = (0..256).filter(|&y| {
                let [a, b] = [planes.pixel(0, y)[1], planes.pixel(511, y)[1]];
                (a - b).abs() > 0.2 * (a + b) + 0.02
            });
            assert!(apart.count() < 12, "{scenery:?}");
        }
    }
}
