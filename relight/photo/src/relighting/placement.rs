//! The place of an object in a picture, and its transformation: scaled, rotated, moved.

use std::ops::Range;

use relight_core::image::{Extent, Planes};

/// Where an object stands in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The middle of its lower edge, in parts of the picture's width and height, from the upper left corner.
    pub at: [f64; 2],
    /// Its height in parts of the picture's.
    pub height: f64,
    /// Rotation in the plane, degrees, counter-clockwise.
    pub rotation: f64,
}

impl Placement {
    /// Whether any of an object of this coverage would be seen in a picture of this size.
    pub(crate) fn is_seen(&self, alpha: &Planes<1>, scene: Extent) -> bool {
        let (width, height) = (scene.width as f64, scene.height as f64);
        let high = self.height * height;
        let wide = high * columns(alpha).len() as f64 / rows(alpha).len().max(1) as f64;
        let (sin, cos) = self.rotation.to_radians().sin_cos();
        let across = (wide * cos).abs() + (high * sin).abs();
        let down = (wide * sin).abs() + (high * cos).abs();
        let [x, y] = [self.at[0] * width, self.at[1] * height];
        x + across / 2.0 > 0.0 && x - across / 2.0 < width && y > 0.0 && y - down < height
    }
}

/// From an object's own pixels to those of a scene: scaled, and rotated about the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    downscaled: Extent,
    pub(crate) angle: f64,
}

impl Fit {
    pub(crate) fn new(alpha: &Planes<1>, placement: Placement, scene: Extent) -> Self {
        let own = alpha.extent();
        let angle = placement.rotation.to_radians();
        let wanted = placement.height * scene.height as f64;
        // Turning does not change the size.
        let height = rows(alpha).len().max(1) as f64;
        let scale = wanted / height;
        let side = |pixels: usize| ((pixels as f64 * scale).round() as usize).max(1);
        Self {
            downscaled: Extent::new(side(own.width), side(own.height)),
            angle,
        }
    }

    pub(crate) fn apply<const C: usize>(&self, image: &Planes<C>) -> Planes<C> {
        rotated(&image.resized(self.downscaled), self.angle)
    }
}

/// The image rotated counter-clockwise about its centre, in the rectangle that it needs; 0 outside.
fn rotated<const C: usize>(image: &Planes<C>, angle: f64) -> Planes<C> {
    if angle == 0.0 {
        return image.clone();
    }
    let Extent { width, height } = image.extent();
    let (sin, cos) = angle.sin_cos();
    let (w, h) = (width as f64, height as f64);
    let side = |a: f64, b: f64| (a.abs() + b.abs()).ceil() as usize;
    let extent = Extent::new(side(w * cos, h * sin), side(w * sin, h * cos));
    let mut result = Planes::zeros(extent);
    let planes = image.planes();
    result.fill_rows(|row, lines| {
        let y = row as f64 + 0.5 - extent.height as f64 / 2.0;
        for (line, plane) in lines.into_iter().zip(planes) {
            for (column, value) in line.iter_mut().enumerate() {
                let x = column as f64 + 0.5 - extent.width as f64 / 2.0;
                let place = [
                    cos * x - sin * y + w / 2.0 - 0.5,
                    sin * x + cos * y + h / 2.0 - 0.5,
                ];
                *value = between(plane, image.extent(), place);
            }
        }
    });
    result
}

/// The value at a place between pixels; 0 outside.
fn between(plane: &[f32], extent: Extent, [x, y]: [f64; 2]) -> f32 {
    let (left, top) = (x.floor(), y.floor());
    let at = |column: f64, row: f64| {
        let inside = column >= 0.0
            && row >= 0.0
            && column < extent.width as f64
            && row < extent.height as f64;
        if inside {
            plane[row as usize * extent.width + column as usize]
        } else {
            0.0
        }
    };
    let (u, v) = ((x - left) as f32, (y - top) as f32);
    let line = |row: f64| at(left, row) * (1.0 - u) + at(left + 1.0, row) * u;
    line(top) * (1.0 - v) + line(top + 1.0) * v
}

/// The rows in which an object covers at least half of a pixel.
pub(crate) fn rows(alpha: &Planes<1>) -> Range<usize> {
    alpha.bounds(0.5).map_or(0..0, |[_, rows]| rows)
}

/// The middle of an object's lower edge in its layer, pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    across: f64,
    down: f64,
}

impl Foot {
    pub(crate) fn from_alpha(alpha: &Planes<1>) -> Self {
        Self {
            across: middle(alpha),
            down: rows(alpha).end as f64,
        }
    }

    /// The place of a layer's first pixel for a wanted place of its lower edge.
    pub(crate) fn first_pixel(&self, placement: Placement, scene: Extent) -> [i64; 2] {
        [
            (placement.at[0] * scene.width as f64 - self.across).round() as i64,
            (placement.at[1] * scene.height as f64 - self.down).round() as i64,
        ]
    }
}

/// The columns in which an object covers at least half of a pixel.
fn columns(alpha: &Planes<1>) -> Range<usize> {
    let all = 0..alpha.extent().width;
    alpha.bounds(0.5).map_or(all, |[columns, _]| columns)
}

/// The middle of these columns.
fn middle(alpha: &Planes<1>) -> f64 {
    let Range { start, end } = columns(alpha);
    (start + end) as f64 / 2.0
}
