//! Planes of `f32`, one a channel.

use std::array;
use std::ops::Range;

use super::{Extent, ImageError, check_extent};
use crate::parallel;

/// `C` planes of one size, each row by row from the top. The types that hold planes, such as
/// [`Rgb`](super::Rgb), state what the values mean.
///
/// ```
/// use relight_core::image::{Extent, Planes};
///
/// let ramp = Planes::from_fn(Extent::new(4, 2), |x, y| [x as f32, y as f32]);
/// assert_eq!(ramp.pixel(3, 1), [3.0, 1.0]);
/// assert_eq!(ramp.plane(0), [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Planes<const C: usize> {
    extent: Extent,
    planes: [Vec<f32>; C],
}

impl<const C: usize> Planes<C> {
    /// An image of one value a channel.
    pub fn filled(extent: Extent, pixel: [f32; C]) -> Self {
        Self {
            extent,
            planes: pixel.map(|value| vec![value; extent.pixels()]),
        }
    }

    /// An image of zeros.
    pub fn zeros(extent: Extent) -> Self {
        Self::filled(extent, [0.0; C])
    }

    /// The planes of an image, each of `extent.pixels()` values.
    ///
    /// # Errors
    /// If a plane has another length.
    pub fn from_planes(extent: Extent, planes: [Vec<f32>; C]) -> Result<Self, ImageError> {
        match planes.iter().find(|plane| plane.len() != extent.pixels()) {
            None => Ok(Self { extent, planes }),
            Some(plane) => Err(ImageError::Other(format!(
                "a plane of {} values was given for {} x {} pixels",
                plane.len(),
                extent.width,
                extent.height
            ))),
        }
    }

    /// The image whose pixel in column `x` and row `y` is `pixel(x, y)`.
    pub fn from_fn(extent: Extent, mut pixel: impl FnMut(usize, usize) -> [f32; C]) -> Self {
        let mut image = Self::zeros(extent);
        for y in 0..extent.height {
            for x in 0..extent.width {
                image.set_pixel(x, y, pixel(x, y));
            }
        }
        image
    }

    /// Images of one size in a grid with `columns` in a row; cells beyond the last are 0.
    ///
    /// # Errors
    /// If an image has another size than the first.
    pub fn sheet(tiles: &[Self], columns: usize) -> Result<Self, ImageError> {
        let tile = tiles.first().map_or(Extent::new(0, 0), Self::extent);
        let columns = columns.max(1);
        let rows = tiles.len().div_ceil(columns);
        let mut sheet = Self::zeros(Extent::new(tile.width * columns, tile.height * rows));
        let width = sheet.extent.width;
        for (at, image) in tiles.iter().enumerate() {
            check_extent("tile of the sheet", image.extent, tile)?;
            let start = at / columns * tile.height * width + at % columns * tile.width;
            for (from, to) in image.planes.iter().zip(&mut sheet.planes) {
                for (y, row) in from.chunks_exact(tile.width.max(1)).enumerate() {
                    to[start + y * width..][..tile.width].copy_from_slice(row);
                }
            }
        }
        Ok(sheet)
    }

    /// The part of the image whose first pixel is in this column and row.
    ///
    /// # Panics
    /// Where it does not lie inside.
    pub fn cut(&self, [x, y]: [usize; 2], extent: Extent) -> Self {
        let mut part = Self::zeros(extent);
        for (to, from) in part.planes.iter_mut().zip(&self.planes) {
            for (row, line) in to.chunks_exact_mut(extent.width.max(1)).enumerate() {
                line.copy_from_slice(&from[(y + row) * self.extent.width + x..][..extent.width]);
            }
        }
        part
    }

    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.extent
    }

    /// One channel, row by row.
    ///
    /// # Panics
    /// Where there are not so many channels.
    pub fn plane(&self, channel: usize) -> &[f32] {
        &self.planes[channel]
    }

    /// All channels.
    pub fn planes(&self) -> [&[f32]; C] {
        self.planes.each_ref().map(Vec::as_slice)
    }

    /// All channels, to write to.
    #[must_use]
    pub fn planes_mut(&mut self) -> [&mut [f32]; C] {
        self.planes.each_mut().map(Vec::as_mut_slice)
    }

    /// The planes themselves.
    pub fn into_planes(self) -> [Vec<f32>; C] {
        self.planes
    }

    /// The channels of one pixel.
    ///
    /// # Panics
    /// Where the pixel lies outside.
    pub fn pixel(&self, x: usize, y: usize) -> [f32; C] {
        let at = self.at(x, y);
        array::from_fn(|channel| self.planes[channel][at])
    }

    /// The largest channel of each pixel.
    pub fn brightest(&self) -> impl Iterator<Item = f32> {
        (0..self.extent.pixels()).map(|at| {
            let channels = self.planes.iter().map(|plane| plane[at]);
            channels.fold(f32::NEG_INFINITY, f32::max)
        })
    }

    /// Writes the channels of one pixel.
    ///
    /// # Panics
    /// Where the pixel lies outside.
    pub fn set_pixel(&mut self, x: usize, y: usize, pixel: [f32; C]) {
        let at = self.at(x, y);
        for (plane, value) in self.planes.iter_mut().zip(pixel) {
            plane[at] = value;
        }
    }

    /// The same image with `change` applied to every value.
    pub fn map(mut self, change: impl Fn(f32) -> f32 + Sync) -> Self {
        for plane in &mut self.planes {
            let parts = plane.chunks_mut(1 << 14).collect();
            parallel::for_each(parts, |_, values: &mut [f32]| {
                values.iter_mut().for_each(|value| *value = change(*value));
            });
        }
        self
    }

    /// The same image, each value combined with that of another image at its place.
    pub fn zip(mut self, other: &Planes<1>, combine: impl Fn(f32, f32) -> f32) -> Self {
        for plane in &mut self.planes {
            for (value, &other) in plane.iter_mut().zip(other.plane(0)) {
                *value = combine(*value, other);
            }
        }
        self
    }

    /// Calls `fill(y, row)` for every row, in parallel if there are threads; `row` has one slice a
    /// channel.
    pub fn fill_rows(&mut self, fill: impl Fn(usize, [&mut [f32]; C]) + Sync) {
        let width = self.extent.width.max(1);
        let mut planes = self.planes.each_mut().map(|plane| plane.chunks_mut(width));
        let rows: Vec<[&mut [f32]; C]> = (0..self.extent.height)
            .map(|_| array::from_fn(|channel| planes[channel].next().unwrap_or_default()))
            .collect();
        parallel::for_each(rows, fill);
    }

    fn at(&self, x: usize, y: usize) -> usize {
        assert!(x < self.extent.width, "column {x} of {:?}", self.extent);
        y * self.extent.width + x
    }
}

impl Planes<1> {
    /// A grey image as three equal channels.
    pub fn in_colour(self) -> Planes<3> {
        let [plane] = self.planes;
        Planes {
            extent: self.extent,
            planes: [plane.clone(), plane.clone(), plane],
        }
    }

    /// The columns and rows in which a value is at least `least`; `None` if none is.
    pub fn bounds(&self, least: f32) -> Option<[Range<usize>; 2]> {
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        let values = self.plane(0).iter().enumerate();
        for (at, _) in values.filter(|(_, value)| **value >= least) {
            let place = [at % self.extent.width, at / self.extent.width];
            for (axis, place) in place.into_iter().enumerate() {
                low[axis] = low[axis].min(place);
                high[axis] = high[axis].max(place + 1);
            }
        }
        (high != [0; 2]).then(|| [low[0]..high[0], low[1]..high[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_of_another_length_are_refused() {
        let planes = [vec![0.0; 6], vec![0.0; 5]];
        assert!(Planes::from_planes(Extent::new(3, 2), planes).is_err());
    }

    #[test]
    fn rows_are_filled_each_in_its_place() {
        let mut image = Planes::<2>::zeros(Extent::new(5, 7));
        image.fill_rows(|y, [a, b]| {
            a.fill(y as f32);
            for (x, value) in b.iter_mut().enumerate() {
                *value = x as f32;
            }
        });
        let expected = Planes::from_fn(Extent::new(5, 7), |x, y| [y as f32, x as f32]);
        assert_eq!(image, expected);
    }

    #[test]
    fn a_sheet_has_its_tiles_row_by_row() {
        let tile = |value: f32| Planes::filled(Extent::new(2, 3), [value]);
        let sheet = Planes::sheet(&[tile(1.0), tile(2.0), tile(3.0)], 2).unwrap();
        assert_eq!(sheet.extent(), Extent::new(4, 6));
        let corners = [(0, 0), (3, 2), (1, 3), (2, 5)].map(|(x, y)| sheet.pixel(x, y)[0]);
        assert_eq!(corners, [1.0, 2.0, 3.0, 0.0]);
        let other = Planes::filled(Extent::new(1, 3), [0.0]);
        assert!(Planes::sheet(&[tile(1.0), other], 2).is_err());
        assert_eq!(Planes::<1>::sheet(&[], 3).unwrap().extent().pixels(), 0);
    }

    #[test]
    fn a_part_is_what_the_image_shows_there() {
        let image = Planes::from_fn(Extent::new(20, 30), |x, y| [x as f32, y as f32]);
        let part = image.cut([3, 4], Extent::new(15, 26));
        let expected = Planes::from_fn(part.extent(), |x, y| [(x + 3) as f32, (y + 4) as f32]);
        assert_eq!(part, expected);
    }

    #[test]
    fn an_image_without_pixels_has_no_rows_to_fill_wrongly() {
        let mut image = Planes::<1>::zeros(Extent::new(0, 3));
        image.fill_rows(|_, [row]| assert!(row.is_empty()));
    }
}
