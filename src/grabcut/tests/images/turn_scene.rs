//! Turns of objects whose mask is known: a camera and an object that ride on a table, a room that passes behind them,
//! and a light that turns about them.
//!
//! Geometry and shade are found once, because nothing of them moves in the picture; a frame then costs little.

use image::{GrayImage, Luma, Rgb, RgbImage};
use relit_grabcut::{TurnFrames, TurnStatistics};

/// What an object has that makes its mask difficult.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Difficulty {
    /// A handle through which the room is seen.
    Handle,
    /// A handle before the table.
    LowHandle,
    /// A hole through the middle.
    Hole,
    /// Two holes, one above the other.
    TwoHoles,
    /// A dark part in the middle.
    DarkPart,
    /// A grey part in shade, as dark as the table.
    Shade,
    /// A grey part in shade that a narrow gap opens to the table.
    OpenShade,
    /// A handle, and a camera that shakes.
    Shaken,
    /// A handle before a room that is white in every frame.
    WhiteRoom,
}

pub(crate) const TROUBLES: [Difficulty; 9] = [
    Difficulty::Handle,
    Difficulty::LowHandle,
    Difficulty::Hole,
    Difficulty::TwoHoles,
    Difficulty::DarkPart,
    Difficulty::Shade,
    Difficulty::OpenShade,
    Difficulty::Shaken,
    Difficulty::WhiteRoom,
];

/// A turn and its truth.
pub(crate) struct Scene {
    pub(crate) frames: Vec<RgbImage>,
    pub(crate) truth: GrayImage,
    /// A part of the object that is easily taken for background, or of the background that is easily taken for object.
    pub(crate) critical: GrayImage,
}

impl Scene {
    pub(crate) fn statistics(&self) -> TurnStatistics {
        let (width, height) = self.truth.dimensions();
        let mut turn = TurnFrames::new(width, height);
        self.frames.iter().for_each(|frame| turn.push(frame));
        TurnStatistics::new(&turn)
    }
}

/// Numbers that look random, from a seed.
struct Numbers(u64);

impl Numbers {
    /// 0..1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A pixel of the object: paint, normal (right, up, to the viewer) and how much light reaches it.
struct Surface {
    paint: [f64; 3],
    normal: [f64; 3],
    open: f64,
}

/// The shape in units of half the object's height, from its middle; y upwards.
struct Shape {
    trouble: Difficulty,
    paint: [f64; 3],
    side: f64,
    tall: f64,
}

impl Shape {
    fn new(trouble: Difficulty, numbers: &mut Numbers) -> Self {
        let grey = numbers.between(0.25, 0.6);
        Self {
            trouble,
            paint: std::array::from_fn(|_| grey * numbers.between(0.6, 1.0)),
            side: if numbers.next() < 0.5 { -1.0 } else { 1.0 },
            tall: numbers.between(0.75, 0.95),
        }
    }

    /// What is seen of the object at a place, if it is there.
    fn at(&self, x: f64, y: f64) -> Option<Surface> {
        let x = self.side * x;
        use Difficulty::{
            DarkPart, Handle, Hole, LowHandle, OpenShade, Shade, Shaken, TwoHoles, WhiteRoom,
        };
        let handle = match self.trouble {
            Handle | Shaken | WhiteRoom => ring(x - 0.72, y - 0.15, 0.38, 0.1),
            LowHandle => ring(x - 0.72, y + 0.5, 0.38, 0.1),
            _ => None,
        };
        let in_body = (x / 0.68).powi(2) + (y / self.tall).powi(2) <= 1.0;
        let pierced = match self.trouble {
            Hole => (x - 0.05).hypot(y - 0.1) < 0.27,
            TwoHoles => x.hypot(y - 0.42) < 0.2 || x.hypot(y + 0.42) < 0.2,
            _ => false,
        };
        if !in_body || pierced {
            let normal = handle?;
            return Some(self.surface(self.paint, normal, 1.0));
        }
        let (u, v) = (x / 0.68, y / self.tall);
        let normal = [u, v, (1.0 - u * u - v * v).max(0.0).sqrt()];
        let spot = (x / 0.3).powi(2) + ((y + 0.1) / 0.24).powi(2);
        let shaded = match self.trouble {
            Shade => spot < 1.0,
            OpenShade => spot < 1.0 || x.abs() < 0.035 && y < -0.1,
            _ => false,
        };
        Some(match self.trouble {
            DarkPart if spot < 1.0 => self.surface([0.02; 3], normal, 1.0),
            _ if shaded => {
                // A hollow: its depth grows from its rim.
                let open = 0.12
                    + 0.88 * spot.min(1.0).powi(4) * f64::from(u8::from(self.trouble == Shade));
                self.surface([0.16; 3], normal, open)
            }
            _ => self.surface(self.paint, normal, 1.0),
        })
    }

    fn surface(&self, paint: [f64; 3], [x, y, z]: [f64; 3], open: f64) -> Surface {
        let normal = [self.side * x, y, z];
        Surface {
            paint,
            normal,
            open,
        }
    }

    /// Whether a place is one at which masks go wrong.
    fn is_critical(&self, x: f64, y: f64) -> bool {
        let x = self.side * x;
        match self.trouble {
            Difficulty::Handle | Difficulty::Shaken | Difficulty::WhiteRoom => {
                (x - 0.72).hypot(y - 0.15) < 0.2 && x > 0.72
            }
            Difficulty::LowHandle => (x - 0.72).hypot(y + 0.5) < 0.2 && x > 0.72,
            Difficulty::Hole => (x - 0.05).hypot(y - 0.1) < 0.2,
            Difficulty::TwoHoles => x.hypot(y - 0.42) < 0.14 || x.hypot(y + 0.42) < 0.14,
            _ => (x / 0.2).powi(2) + ((y + 0.1) / 0.16).powi(2) < 1.0,
        }
    }
}

/// The normal of a ring's tube, if the place is on it.
fn ring(x: f64, y: f64, radius: f64, tube: f64) -> Option<[f64; 3]> {
    let far = x.hypot(y).max(1e-9);
    let across = (far - radius) / tube;
    (across.abs() < 1.0).then(|| {
        let slope = across / far;
        [x * slope, y * slope, (1.0 - across * across).sqrt()]
    })
}

/// A room: levels by direction, in cells of several sizes.
struct Room(Vec<(f64, Vec<[f64; 3]>)>);

impl Room {
    fn new(numbers: &mut Numbers) -> Self {
        let layer = |cells: f64, strength: f64, numbers: &mut Numbers| {
            let level = |numbers: &mut Numbers| strength * numbers.between(-1.0, 1.0);
            let values = (0..4096).map(|_| {
                let grey = level(numbers);
                std::array::from_fn(|_| 0.8 * grey + 0.3 * level(numbers))
            });
            (cells, values.collect())
        };
        Self(vec![
            layer(5.0, 0.5, numbers),
            layer(13.0, 0.6, numbers),
            layer(41.0, 0.4, numbers),
        ])
    }

    /// The light from an angle (turns) and a height (frame heights).
    fn light(&self, angle: f64, height: f64) -> [f64; 3] {
        let mut log = [-1.6; 3];
        for (cells, values) in &self.0 {
            let (x, y) = (angle.rem_euclid(1.0) * cells, height * cells * 0.5);
            let (column, row) = (x.floor(), y.floor());
            let (fx, fy) = (smooth(x - column), smooth(y - row));
            let value = |dx: f64, dy: f64, channel: usize| {
                let at = (column + dx).rem_euclid(*cells) + 64.0 * (row + dy + 8.0);
                values[at as usize % values.len()][channel]
            };
            for (channel, log) in log.iter_mut().enumerate() {
                let above = value(0.0, 0.0, channel) * (1.0 - fx) + value(1.0, 0.0, channel) * fx;
                let below = value(0.0, 1.0, channel) * (1.0 - fx) + value(1.0, 1.0, channel) * fx;
                *log += above * (1.0 - fy) + below * fy;
            }
        }
        log.map(f64::exp)
    }
}

fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

fn level(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    255.0
        * if light <= 0.003_130_8 {
            12.92 * light
        } else {
            1.055 * light.powf(1.0 / 2.4) - 0.055
        }
}

/// A turn of `count` frames.
pub(crate) fn scene(
    trouble: Difficulty,
    (width, height): (u32, u32),
    count: usize,
    seed: u64,
) -> Scene {
    let mut numbers = Numbers(seed);
    let shape = Shape::new(trouble, &mut numbers);
    let room = Room::new(&mut numbers);
    let lamp = (numbers.next(), numbers.between(0.2, 0.7));
    let unit = f64::from(height) * numbers.between(0.33, 0.37);
    let middle = (
        f64::from(width) * numbers.between(0.47, 0.53),
        f64::from(height) * 0.52,
    );
    let horizon = f64::from(height) * numbers.between(0.56, 0.62);
    let place = |x: f64, y: f64| ((x + 0.5 - middle.0) / unit, (middle.1 - y - 0.5) / unit);
    let frames = (0..count).map(|number| {
        let turn = number as f64 / count as f64;
        // The truth is that of the first frame.
        let shaken = trouble == Difficulty::Shaken && number > 0;
        let mut shake = || {
            if shaken {
                numbers.between(-0.6, 0.6)
            } else {
                0.0
            }
        };
        let by = (shake(), shake());
        let lamp_angle = std::f64::consts::TAU * (turn + lamp.0);
        let lit = |normal: [f64; 3]| {
            let lamp_light = normal[0] * lamp_angle.sin() * 0.8
                + normal[1] * lamp.1
                + normal[2] * lamp_angle.cos() * 0.8;
            0.25 + 0.15 * normal[1] + 0.75 * lamp_light.max(0.0)
        };
        let colour = |x: f64, y: f64| {
            let (u, v) = place(x, y);
            match shape.at(u, v) {
                Some(surface) => {
                    let light = lit(surface.normal) * surface.open;
                    surface.paint.map(|paint| paint * light)
                }
                None if y > horizon => {
                    let near = (u / 0.9).powi(2) + ((v + 0.95) / 0.25).powi(2);
                    let open = 1.0 - 0.6 * (-near).exp();
                    [0.03 * open * lit([0.0, 1.0, 0.0]); 3]
                }
                None if trouble == Difficulty::WhiteRoom => [1.2; 3],
                None => room.light(turn + 0.13 * x / f64::from(width), y / f64::from(height)),
            }
        };
        let mut frame = RgbImage::new(width, height);
        let mut grain = Numbers(seed ^ (number as u64 + 1).wrapping_mul(77));
        for (x, y, pixel) in frame.enumerate_pixels_mut() {
            let mut sum = [0.0; 3];
            for (dx, dy) in [(-0.25, -0.125), (0.25, 0.125)] {
                let light = colour(f64::from(x) + dx + by.0, f64::from(y) + dy + by.1);
                sum.iter_mut()
                    .zip(light)
                    .for_each(|(sum, light)| *sum += light / 2.0);
            }
            *pixel = Rgb(sum.map(|light| {
                let noise = 3.0 * (grain.next() + grain.next() - 1.0);
                (level(light) + noise).round().clamp(0.0, 255.0) as u8
            }));
        }
        frame
    });
    let frames = frames.collect();
    let set = |is: &dyn Fn(f64, f64) -> bool| {
        GrayImage::from_fn(width, height, |x, y| {
            let (u, v) = place(f64::from(x), f64::from(y));
            Luma([if is(u, v) { 255 } else { 0 }])
        })
    };
    Scene {
        frames,
        truth: set(&|u, v| shape.at(u, v).is_some()),
        critical: set(&|u, v| shape.is_critical(u, v)),
    }
}
