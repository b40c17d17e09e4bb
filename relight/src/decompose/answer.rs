//! Maps of a picture by a network: by looks at two sizes, with a mirrored second pass, and for large pictures by tiles.

use std::ops::Range;

use rayon::prelude::*;

use super::encoding::{AnsweredMaps, EncodedPicture, LEAST_FACING};
use super::region::{self, Region, enlarged, inside, reduced};
use crate::image::{Extent, Planes};
use crate::light::Normals;
use crate::nets::{Inference, NetError};

/// What answers an encoded picture of `side` x `side` pixels with the planes that
/// [`EncodedPicture::decode`] takes.
pub(super) trait MapsNet: Send + Sync {
    fn side(&self) -> usize;
    fn answer(&self, encoded: &[f32]) -> Result<Vec<f32>, NetError>;
}

/// The network in its engine.
pub(super) struct Engine {
    pub(super) inference: Inference,
    pub(super) side: usize,
}

impl MapsNet for Engine {
    fn side(&self) -> usize {
        self.side
    }

    fn answer(&self, encoded: &[f32]) -> Result<Vec<f32>, NetError> {
        let outputs = self.inference.run(encoded)?;
        Ok(outputs
            .into_iter()
            .flat_map(crate::nets::Tensor::into_values)
            .collect())
    }
}

/// All maps of a picture as one image, in values that can be averaged and blended: normals, log albedo,
/// log shading, highlight.
pub(super) type Fields = Planes<8>;

/// The network for pictures of two sizes. An object that fills a smaller picture is nearer to those that it was trained on,
/// and is seen as a whole; the larger picture shows what is finer.
pub(super) struct Looks {
    pub(super) full: Box<dyn MapsNet>,
    /// For pictures of half the width and height.
    pub(super) half: Option<Box<dyn MapsNet>>,
}

/// The planes of fields that are normals.
const NORMAL_PLANES: Range<usize> = 0..3;
/// How much of what is coarse in the normals the smaller look tells. By measurement on photographs with truth: all of
/// it is three degrees better than none.
const SHAPE_OF_NORMALS: f32 = 1.0;
/// How much of what is coarse in albedo, shading and highlight the smaller look tells: between 0.3 and 0.5, the mean of both
/// is better than either.
const SHAPE_OF_LAYERS: f32 = 0.4;

/// Keeps logarithms of dark values finite.
const DARKEST: f32 = 1e-4;

/// Pixels by which tiles overlap, a part of their side.
const OVERLAP: f64 = 0.25;

/// The fields of a picture of the network's size; with `mirror`, the mean of those of the picture and of
/// its mirror image.
pub(super) fn fields(
    net: &dyn MapsNet,
    picture: &Planes<3>,
    mask: &Planes<1>,
    mirror: bool,
) -> Result<Fields, NetError> {
    let plain = || answered(net, picture, mask);
    if !mirror {
        return plain();
    }
    let mirrored = || answered(net, &picture.clone().mirrored(), &mask.clone().mirrored());
    let (plain, mirrored) = rayon::join(plain, mirrored);
    Ok(mean(plain?, turned_back(mirrored?)))
}

fn answered(net: &dyn MapsNet, picture: &Planes<3>, mask: &Planes<1>) -> Result<Fields, NetError> {
    let encoded = EncodedPicture::new(picture, mask);
    let answer = net.answer(encoded.values())?;
    Ok(of_maps(encoded.decode(&answer)))
}

fn of_maps(maps: AnsweredMaps) -> Fields {
    let extent = maps.shading.extent();
    let log = |value: f32| value.max(DARKEST).ln();
    let mut fields = Planes::zeros(extent);
    let [x, y, z] = maps.normals.planes().planes();
    let [red, green, blue] = maps.albedo.planes();
    let sources = [
        x,
        y,
        z,
        red,
        green,
        blue,
        maps.shading.plane(0),
        maps.highlight.plane(0),
    ];
    for (at, (to, from)) in fields.planes_mut().into_iter().zip(sources).enumerate() {
        for (to, &from) in to.iter_mut().zip(from) {
            *to = if (3..7).contains(&at) {
                log(from)
            } else {
                from
            };
        }
    }
    fields
}

/// The maps that fields stand for, 0 outside the mask.
pub(super) fn to_maps(fields: &Fields, mask: &[bool]) -> AnsweredMaps {
    let extent = fields.extent();
    let planes = fields.planes();
    let masked = |channel: usize, change: fn(f32) -> f32| -> Vec<f32> {
        let values = planes[channel].iter().zip(mask);
        values
            .map(|(&value, &inside)| if inside { change(value) } else { 0.0 })
            .collect()
    };
    let plain = |channel| masked(channel, |value| value);
    let image = |planes: [Vec<f32>; 3]| of_planes(extent, planes);
    AnsweredMaps {
        // Where two answers cancel out, the neighbour's counts.
        // Details can turn a normal away: what is seen faces the viewer.
        normals: Normals::new(image([
            plain(0),
            plain(1),
            masked(2, |z| z.max(LEAST_FACING)),
        ]))
        .completed(mask),
        albedo: image([3, 4, 5].map(|channel| masked(channel, f32::exp))),
        shading: of_planes(extent, [masked(6, f32::exp)]),
        highlight: of_planes(extent, [masked(7, |value| value.max(0.0))]),
    }
}

/// Planes of which the length is known.
fn of_planes<const C: usize>(extent: Extent, planes: [Vec<f32>; C]) -> Planes<C> {
    let mut image = Planes::zeros(extent);
    for (to, from) in image.planes_mut().into_iter().zip(&planes) {
        to.copy_from_slice(from);
    }
    image
}

/// The fields of a mirror image as those of the picture: a normal's x points the other way.
fn turned_back(fields: Fields) -> Fields {
    let mut fields = fields.mirrored();
    for value in &mut *fields.planes_mut()[0] {
        *value = -*value;
    }
    fields
}

fn mean(mut a: Fields, b: Fields) -> Fields {
    for (a, b) in a.planes_mut().into_iter().zip(b.planes()) {
        for (a, &b) in a.iter_mut().zip(b) {
            *a = a.midpoint(b);
        }
    }
    a
}

/// What tiles of the picture at its own size show beyond its fields at the network's size, to be added
/// to those: 0 where no tile sees the object.
///
/// Each tile is answered as if it were a picture of its own. Of its answer only what is finer than the
/// network's pixels of the whole picture is taken: a tile knows neither how bright the object is as a whole
/// nor how it is shaped. Where tiles overlap, their details are blended by weights that fall to 0 at
/// their edges, so that no seam is seen.
pub(super) fn details(
    net: &dyn MapsNet,
    picture: &Planes<3>,
    mask: &Planes<1>,
    mirror: bool,
) -> Result<Fields, NetError> {
    let extent = picture.extent();
    let side = net.side();
    let coarse = (side * side).div_ceil(extent.width).max(1);
    let window = window(side);
    let mut sums = Fields::zeros(extent);
    let mut weights = Planes::<1>::zeros(extent);
    for y in starts(extent.height, side) {
        let row = starts(extent.width, side).into_par_iter().map(|x| {
            let tile = Region {
                x: x as i64,
                y: y as i64,
                side,
            };
            let detail = tile_detail(net, &tile, (picture, mask), coarse, mirror)?;
            Ok(detail.map(|detail| (x, detail)))
        });
        let row: Vec<Option<(usize, Fields)>> = row.collect::<Result<_, NetError>>()?;
        for (x, detail) in row.into_iter().flatten() {
            add_weighted(&mut sums, &detail, &window, [x, y]);
            let ones = Planes::filled(detail.extent(), [1.0]);
            add_weighted(&mut weights, &ones, &window, [x, y]);
        }
    }
    for plane in sums.planes_mut() {
        for (value, &weight) in plane.iter_mut().zip(weights.plane(0)) {
            *value /= weight.max(f32::MIN_POSITIVE);
        }
    }
    Ok(sums)
}

/// What a tile shows beyond its own mean over `coarse` x `coarse` areas; none where it does not see
/// the object.
fn tile_detail(
    net: &dyn MapsNet,
    tile: &Region,
    (picture, mask): (&Planes<3>, &Planes<1>),
    coarse: usize,
    mirror: bool,
) -> Result<Option<Fields>, NetError> {
    let (picture, mask) = (tile.cut(picture), tile.cut(mask));
    let known = inside(&mask);
    if !known.contains(&true) {
        return Ok(None);
    }
    let fields = fields(net, &region::cut_out(&picture, &mask), &mask, mirror)?;
    let mut fine = enlarged(&fields, &known, tile.extent());
    let low = fine
        .resized(Extent::new(coarse, coarse))
        .resized(tile.extent());
    for (fine, low) in fine.planes_mut().into_iter().zip(low.planes()) {
        for (fine, low) in fine.iter_mut().zip(low) {
            *fine -= low;
        }
    }
    Ok(Some(fine))
}

/// Where tiles begin that cover a line and overlap by a quarter at least.
fn starts(length: usize, side: usize) -> Vec<usize> {
    let last = length.saturating_sub(side);
    let step = (side as f64 * (1.0 - OVERLAP)).max(1.0);
    let count = (last as f64 / step).ceil() as usize;
    (0..=count).map(|at| last * at / count.max(1)).collect()
}

/// A tile's weights along one side: 1 in the middle, falling to nearly 0 at the ends.
fn window(side: usize) -> Vec<f32> {
    let ramp = (side as f64 * OVERLAP).max(1.0);
    let weight = |at: usize| {
        let distance = (at.min(side - 1 - at) as f64 + 0.5) / ramp;
        let angle = distance.min(1.0) * std::f64::consts::FRAC_PI_2;
        angle.sin().powi(2) as f32
    };
    (0..side).map(weight).collect()
}

fn add_weighted<const C: usize>(
    sums: &mut Planes<C>,
    tile: &Planes<C>,
    window: &[f32],
    [x, y]: [usize; 2],
) {
    let (width, side) = (sums.extent().width, tile.extent().width);
    for (to, from) in sums.planes_mut().into_iter().zip(tile.planes()) {
        for (row, down) in window.iter().enumerate() {
            let to = &mut to[(y + row) * width + x..][..side];
            let from = &from[row * side..][..side];
            for ((to, from), across) in to.iter_mut().zip(from).zip(window) {
                *to += down * across * from;
            }
        }
    }
}

/// The picture and its mask at the network's size, and their fields.
pub(super) struct Whole {
    pub(super) picture: Planes<3>,
    pub(super) mask: Planes<1>,
    pub(super) fields: Fields,
}

impl Whole {
    pub(super) fn new(
        looks: &Looks,
        picture: &Planes<3>,
        mask: &Planes<1>,
        mirror: bool,
    ) -> Result<Self, NetError> {
        let look = |net: &dyn MapsNet, mirror| {
            let extent = Extent::new(net.side(), net.side());
            let (picture, mask) = reduced(picture, mask, extent);
            let fields = fields(net, &picture, &mask, mirror)?;
            Ok::<_, NetError>(Self {
                picture,
                mask,
                fields,
            })
        };
        let Some(half) = &looks.half else {
            return look(looks.full.as_ref(), mirror);
        };
        let (full, half) = rayon::join(
            || look(looks.full.as_ref(), false),
            || look(half.as_ref(), mirror),
        );
        Ok(full?.with_shape_of(&half?))
    }

    /// Its own details on the shape of a smaller one.
    fn with_shape_of(mut self, other: &Self) -> Self {
        let extent = self.mask.extent();
        let known = inside(&self.mask);
        let low = enlarged(&self.fields, &known, other.mask.extent()).resized(extent);
        let shape = enlarged(&other.fields, &inside(&other.mask), extent);
        for (channel, plane) in self.fields.planes_mut().into_iter().enumerate() {
            let share = if NORMAL_PLANES.contains(&channel) {
                SHAPE_OF_NORMALS
            } else {
                SHAPE_OF_LAYERS
            };
            let (shape, low) = (shape.plane(channel), low.plane(channel));
            for at in (0..plane.len()).filter(|&at| known[at]) {
                plane[at] += share * (shape[at] - low[at]);
            }
        }
        self
    }
}
