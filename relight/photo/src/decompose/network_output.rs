//! Maps of a picture by a network: at two scales, and with the mirror image.

use std::ops::Range;

use super::crop::{downscaled, enlarged, inside};
use super::encoding::{MIN_FACING, NetworkInput, PredictedMaps};
use super::light::PredictedLight;
use crate::nets::{Inference, NetError};
use relight_core::image::{Extent, ImageError, Part, Planes};
use relight_core::light::Normals;
use relight_core::parallel;

/// A network that predicts the maps of a picture of `side` x `side` pixels.
pub(super) struct MapNetwork {
    pub(super) side: usize,
    pub(super) predict: Box<Predict>,
}

/// From an encoded picture to its maps.
pub(super) type Predict = dyn Fn(&[f32]) -> Result<NetworkOutput, NetError> + Send + Sync;

/// The output of a network.
pub(super) struct NetworkOutput {
    /// The planes that [`NetworkInput::decode`] takes.
    pub(super) maps: Vec<f32>,
    /// Of a network with that head.
    pub(super) light: Option<PredictedLight>,
}

impl MapNetwork {
    /// A network in the inference engine.
    pub(super) fn new(inference: Inference, side: usize) -> Self {
        let predict = move |encoded: &[f32]| {
            let mut prediction = NetworkOutput {
                maps: Vec::new(),
                light: None,
            };
            for output in inference.run(encoded)? {
                // The heads for pixels have four sides, that for light two.
                if output.shape().len() > 2 {
                    prediction.maps.append(&mut output.into_values());
                } else {
                    prediction.light = PredictedLight::from_output(output.values());
                }
            }
            Ok(prediction)
        };
        let predict = Box::new(predict);
        Self { side, predict }
    }
}

/// All maps of a picture as one image, in values that can be averaged: normals, log albedo,
/// log shading, highlight.
pub(super) type Fields = Planes<8>;

/// The prediction for a picture.
pub(super) struct Prediction {
    pub(super) fields: Fields,
    pub(super) light: Option<PredictedLight>,
}

/// The network for pictures of two sizes. An object that fills a smaller picture is nearer to those that it was trained on,
/// and is seen as a whole; the larger picture shows what is finer.
pub(super) struct Scales {
    pub(super) fine: MapNetwork,
    /// For pictures of half the width and height.
    pub(super) coarse: Option<MapNetwork>,
}

/// The planes of fields that are normals.
const NORMAL_PLANES: Range<usize> = 0..3;
/// The share of the coarse scale in the low frequencies of the normals. Measured on photographs with ground truth: a share of 1
/// is three degrees better than 0.
const SHAPE_OF_NORMALS: f32 = 1.0;
/// The share of the coarse scale in the low frequencies of albedo, shading and highlight. Measured: chosen on synthetic
/// objects (docs/results/decomposition.md).
const SHAPE_OF_LAYERS: f32 = 0.8;

/// Keeps logarithms of dark values finite.
const DARKEST: f32 = 1e-4;

/// The prediction for a picture of the network's size; with `mirror`, averaged with the prediction for its mirror image.
pub(super) fn predict(
    net: &MapNetwork,
    picture: &Planes<3>,
    mask: &Planes<1>,
    mirror: bool,
) -> Result<Prediction, NetError> {
    let plain = || predict_once(net, picture, mask);
    if !mirror {
        return plain();
    }
    let mirrored = || predict_once(net, &picture.clone().mirrored(), &mask.clone().mirrored());
    let (plain, mirrored) = parallel::join(plain, mirrored);
    let (plain, mirrored) = (plain?, mirrored?);
    let lights = plain.light.zip(mirrored.light);
    Ok(Prediction {
        fields: mean(plain.fields, turned_back(mirrored.fields)),
        light: lights.map(|(plain, mirrored)| plain.mean(mirrored.mirrored())),
    })
}

fn predict_once(
    net: &MapNetwork,
    picture: &Planes<3>,
    mask: &Planes<1>,
) -> Result<Prediction, NetError> {
    let encoded = NetworkInput::new(picture, mask);
    let output = (net.predict)(encoded.values())?;
    Ok(Prediction {
        fields: of_maps(encoded.decode(&output.maps)),
        light: output.light,
    })
}

fn of_maps(maps: PredictedMaps) -> Fields {
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

/// The maps that fields stand for, 0 outside the mask; in the memory of the fields.
pub(super) fn to_maps(mut fields: Fields, mask: &[bool]) -> Result<PredictedMaps, ImageError> {
    let extent = fields.extent();
    fields.fill_rows(|y, row| {
        let mask = &mask[y * extent.width..][..extent.width];
        for (channel, values) in row.into_iter().enumerate() {
            let change: fn(f32) -> f32 = match channel {
                // Two scales together can turn a normal away: what is seen faces the viewer.
                2 => |z| z.max(MIN_FACING),
                3..7 => f32::exp,
                7 => |value| value.max(0.0),
                _ => |value| value,
            };
            for (value, &inside) in values.iter_mut().zip(mask) {
                *value = if inside { change(*value) } else { 0.0 };
            }
        }
    });
    let [x, y, z, red, green, blue, shading, highlight] = fields.into_planes();
    let normals = Normals::new(Planes::from_planes(extent, [x, y, z])?);
    Ok(PredictedMaps {
        normals: without_gaps(normals, mask),
        albedo: Planes::from_planes(extent, [red, green, blue])?,
        shading: Planes::from_planes(extent, [shading])?,
        highlight: Planes::from_planes(extent, [highlight])?,
    })
}

/// The same normals; where two predictions cancelled out, the neighbour's.
fn without_gaps(normals: Normals, mask: &[bool]) -> Normals {
    let [x, y, z] = normals.planes().planes();
    let is_gap = |at: usize| mask[at] && (x[at], y[at], z[at]) == (0.0, 0.0, 0.0);
    if (0..mask.len()).any(is_gap) {
        normals.completed(mask)
    } else {
        normals
    }
}

/// The fields of a mirror image as those of the picture: a normal's x changes its sign.
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

/// The picture and its mask at the network's size, and their fields.
pub(super) struct PhotoPrediction {
    pub(super) picture: Planes<3>,
    pub(super) mask: Planes<1>,
    pub(super) fields: Fields,
    /// The prediction at the coarse scale, the scale of the training.
    pub(super) light: Option<PredictedLight>,
}

impl PhotoPrediction {
    /// Of a picture and its mask that are a part of the square around the object.
    pub(super) fn new(
        scales: &Scales,
        picture: &Planes<3>,
        mask: &Planes<1>,
        part: &Part,
        mirror: bool,
    ) -> Result<Self, NetError> {
        let at_scale = |net: &MapNetwork, mirror| {
            let extent = Extent::new(net.side, net.side);
            let (picture, mask) = downscaled(picture, mask, part, extent);
            let Prediction { fields, light } = predict(net, &picture, &mask, mirror)?;
            Ok::<_, NetError>(Self {
                picture,
                mask,
                fields,
                light,
            })
        };
        let Some(coarse) = &scales.coarse else {
            return at_scale(&scales.fine, mirror);
        };
        let (fine, coarse) = parallel::join(
            || at_scale(&scales.fine, false),
            || at_scale(coarse, mirror),
        );
        Ok(fine?.with_shape_of(&coarse?))
    }

    /// Its own details on the shape of a coarser scale.
    fn with_shape_of(mut self, other: &Self) -> Self {
        let (extent, small) = (self.mask.extent(), other.mask.extent());
        self.light = other.light;
        let known = inside(&self.mask);
        let low = enlarged(&self.fields, &known, &Part::all(small)).resized(extent);
        let shape = enlarged(&other.fields, &inside(&other.mask), &Part::all(extent));
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
