//! Normal maps.

use std::f32::consts::FRAC_PI_2;

use crate::image::{Extent, ImageError, Planes, check_extent};

/// Vectors shorter than this stand for no surface: a map's background, however it was encoded.
const MIN_LENGTH: f32 = 0.1;

/// A map of unit normals, one a pixel; the zero vector outside the object: x to the right, y up, z to the viewer. Maps whose y
/// points down, as the paper's, are flipped:
///
/// ```
/// use relight_core::image::{Extent, Planes};
/// use relight_core::light::Normals;
///
/// let tilted = Planes::filled(Extent::new(2, 2), [0.0, 3.0, 4.0]);
/// assert_eq!(Normals::new(tilted).flipped().planes().pixel(0, 0), [0.0, -0.6, 0.8]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Normals {
    planes: Planes<3>,
}

impl Normals {
    /// The map of these vectors, each brought to length 1; those shorter than 0.1, or that are not
    /// numbers, stand for no surface.
    pub fn new(mut planes: Planes<3>) -> Self {
        let [x, y, z] = planes.planes_mut();
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            let length = (*x * *x + *y * *y + *z * *z).sqrt();
            let is_surface = length >= MIN_LENGTH && length.is_finite();
            [*x, *y, *z] = [*x, *y, *z].map(|v| if is_surface { v / length } else { 0.0 });
        }
        Self { planes }
    }

    /// The map with these colours `(n + 1) / 2`, 0 to 1; black is outside the object.
    pub fn from_colours(mut colours: Planes<3>) -> Self {
        let [red, green, blue] = colours.planes_mut();
        for ((r, g), b) in red.iter_mut().zip(green).zip(blue) {
            let is_black = *r == 0.0 && *g == 0.0 && *b == 0.0;
            [*r, *g, *b] = [*r, *g, *b].map(|v| if is_black { 0.0 } else { 2.0 * v - 1.0 });
        }
        Self::new(colours)
    }

    /// The colours `(n + 1) / 2` that a file holds; black outside the object.
    pub fn to_colours(&self) -> Planes<3> {
        let mut colours = self.planes.clone();
        let [x, y, z] = colours.planes_mut();
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            [*x, *y, *z] = colour([*x, *y, *z]);
        }
        colours
    }

    /// The colour of one pixel, by its row's number times the width, plus its column's.
    pub fn colour_at(&self, at: usize) -> [f32; 3] {
        colour(self.planes.planes().map(|plane| plane[at]))
    }

    /// The same surface with y the other way.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        let [_, y, _] = self.planes.planes_mut();
        for value in y {
            // A plain 0 stays one.
            *value = 0.0 - *value;
        }
        self
    }

    /// The same map with no surface where the mask is below one half.
    ///
    /// # Errors
    /// If the mask has another size.
    pub fn masked(mut self, mask: &Planes<1>) -> Result<Self, ImageError> {
        check_extent("mask", mask.extent(), self.extent())?;
        let keep = |value, mask| if mask < 0.5 { 0.0 } else { value };
        self.planes = self.planes.zip(mask, keep);
        Ok(self)
    }

    /// The same map; pixels of the mask without a normal get the nearest one.
    ///
    /// # Panics
    /// Where the mask is not as long as the map has pixels.
    pub fn completed(&self, mask: &[bool]) -> Self {
        let [x, y, z] = self.planes.planes();
        let known: Vec<bool> = (0..self.extent().pixels())
            .map(|at| (x[at], y[at], z[at]) != (0.0, 0.0, 0.0))
            .collect();
        Self {
            planes: self.planes.clone().extended(&known, mask),
        }
    }

    /// Whether all normals are zero.
    pub fn is_empty(&self) -> bool {
        self.planes
            .planes()
            .into_iter()
            .flatten()
            .all(|&v| v == 0.0)
    }

    /// x, y and z.
    pub const fn planes(&self) -> &Planes<3> {
        &self.planes
    }

    /// x, y and z themselves.
    pub fn into_planes(self) -> Planes<3> {
        self.planes
    }

    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.planes.extent()
    }

    /// The same map with each normal's angle to the viewer's axis times `factor`, at most a right angle. What points away from
    /// the viewer stays as it is.
    #[must_use]
    pub fn steeper(mut self, factor: f32) -> Self {
        let [x, y, z] = self.planes.planes_mut();
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            let across = x.hypot(*y);
            if across <= 0.0 || *z <= 0.0 {
                continue;
            }
            let tilt = (factor * across.atan2(*z)).min(FRAC_PI_2);
            let (sin, cos) = tilt.sin_cos();
            [*x, *y, *z] = [*x * sin / across, *y * sin / across, cos.max(0.0)];
        }
        self
    }

    /// The front of a sphere that fills a square image of `side` pixels, seen from far away.
    pub fn sphere(side: usize) -> Self {
        let place = |at: usize| (2.0 * (at as f32 + 0.5)) / side as f32 - 1.0;
        Self::new(Planes::from_fn(Extent::new(side, side), |x, y| {
            let [x, y] = [place(x), -place(y)];
            let rest = 1.0 - x * x - y * y;
            if rest >= 0.0 {
                [x, y, rest.sqrt()]
            } else {
                [0.0; 3]
            }
        }))
    }
}

/// Which way y points in a file of normals, where that is known only at run time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalsFrame {
    /// What relight writes.
    #[default]
    YUp,
    /// As in the paper's colour figure and its released data.
    YDown,
}

/// The colour `(n + 1) / 2` of a normal; black outside the object.
fn colour(normal: [f32; 3]) -> [f32; 3] {
    let is_surface = normal.iter().any(|&v| v != 0.0);
    normal.map(|v| if is_surface { v.midpoint(1.0) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three() -> Normals {
        let vectors = [[0.0, 0.6, 0.8], [0.0; 3], [-1.0, 0.0, 0.0]];
        Normals::new(Planes::from_fn(Extent::new(3, 1), |x, _| vectors[x]))
    }

    #[test]
    fn a_written_map_is_read_back_and_its_background_stays_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("normal.png");
        three()
            .write_png(&path, crate::image::Depth::Sixteen)
            .unwrap();
        let back = Normals::read(&path).unwrap();
        assert_eq!(back.planes().pixel(1, 0), [0.0; 3]);
        let pairs = back
            .planes()
            .planes()
            .into_iter()
            .zip(three().planes.into_planes());
        for (a, b) in pairs {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 3e-5));
        }
    }

    #[test]
    fn steeper_normals_are_tilted_by_a_factor_and_never_beyond_the_outline() {
        let (sin, cos) = 0.4_f32.sin_cos();
        let vectors = [[sin, 0.0, cos], [0.0, 0.6, 0.8], [0.0; 3], [0.0, 0.0, -1.0]];
        let flat = Normals::new(Planes::from_fn(Extent::new(4, 1), |x, _| vectors[x]));
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        let steep = flat.clone().steeper(1.5);
        assert!(near(
            steep.planes().pixel(0, 0),
            [0.6_f32.sin(), 0.0, 0.6_f32.cos()]
        ));
        assert!(near(
            flat.steeper(10.0).planes().pixel(1, 0),
            [0.0, 1.0, 0.0]
        ));
        for x in [2, 3] {
            assert!(near(steep.planes().pixel(x, 0), vectors[x]));
        }
    }

    #[test]
    fn a_map_of_vectors_is_read_as_it_stands() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("normal.exr");
        crate::files::write_exr(&path, three().planes()).unwrap();
        assert_eq!(Normals::read(&path).unwrap(), three());
    }

    #[test]
    fn turned_over_twice_it_is_the_same() {
        assert_eq!(three().flipped().flipped(), three());
    }

    #[test]
    fn mid_grey_and_not_a_number_are_background() {
        let grey = Normals::from_colours(Planes::filled(Extent::new(1, 1), [0.502; 3]));
        assert_eq!(grey.planes().pixel(0, 0), [0.0; 3]);
        let nan = Normals::new(Planes::filled(Extent::new(1, 1), [f32::NAN; 3]));
        assert_eq!(nan.planes().pixel(0, 0), [0.0; 3]);
    }
}
