//! Normals of another network, from an ONNX file.

use std::path::Path;

use super::convention::{Axes, Channels, Convention};
use crate::nets::{Inference, NetError, OnnxSignature};
use relight_core::image::{ColourSpace, Extent, Part, Planes, Srgb};
use relight_core::light::{Normals, NormalsFrame, YDown, YUp};

/// A network for normals, and what its pictures and vectors mean.
#[derive(Debug)]
pub(super) struct ExternalNormals {
    net: Inference,
    /// Of the pictures that it is asked about.
    side: usize,
    convention: Convention,
    /// As the caller says; none: as the network is known to have it.
    frame: Option<NormalsFrame>,
}

impl ExternalNormals {
    pub(super) fn new(
        path: &Path,
        onnx: &[u8],
        side: usize,
        frame: Option<NormalsFrame>,
    ) -> Result<Self, NetError> {
        let fault = |fault| NetError::File {
            path: path.to_owned(),
            fault,
        };
        let signature = OnnxSignature::read(onnx).unwrap_or_default();
        let convention = Convention::from_signature(&signature, side).map_err(fault)?;
        let Extent { width, height } = convention.extent;
        let size = (width, height);
        let net = Inference::from_onnx(path, onnx, 3, size, &convention.given)?;
        let other = Self {
            net,
            side,
            convention,
            frame,
        };
        // Its answer is checked now, and not after the first photograph.
        let extent = Extent::new(side, side);
        let grey = Planes::filled(extent, [0.5; 3]);
        match other.run(&grey, &vec![true; extent.pixels()])? {
            Some(_) => Ok(other),
            None => Err(fault(format!(
                "it does not answer a picture with 2 or 3 channels of {width} x {height} pixels"
            ))),
        }
    }

    /// The kind of network, in words.
    pub(super) fn name(&self) -> &'static str {
        self.convention.name
    }

    /// The normals of a linear picture of the network's size, none outside the mask; `None` if the
    /// answer is not a map of normals.
    pub(super) fn run(
        &self,
        picture: &Planes<3>,
        mask: &[bool],
    ) -> Result<Option<Normals<YUp>>, NetError> {
        let outputs = self.net.run(&self.input(picture, mask))?;
        let Some(answer) = outputs.get(self.convention.output) else {
            return Ok(None);
        };
        let Some(vectors) = self.vectors(answer.shape(), answer.values()) else {
            return Ok(None);
        };
        let mut vectors = self.own_square(vectors);
        let [x, y, z] = vectors.planes_mut();
        for at in (0..mask.len()).filter(|&at| !mask[at]) {
            [x[at], y[at], z[at]] = [0.0; 3];
        }
        Ok(Some(self.in_our_axes(vectors)))
    }

    /// The picture as the network takes it: in the middle, as large as fits.
    fn input(&self, picture: &Planes<3>, mask: &[bool]) -> Vec<f32> {
        let values = self.convention.values;
        let encode = |(&light, &inside): (&f32, &bool)| {
            let value = Srgb::from_linear(light.clamp(0.0, 1.0));
            values.encoded(if inside { value } else { values.outside() })
        };
        let planes = picture.planes();
        let encoded = planes.map(|plane| plane.iter().zip(mask).map(encode).collect());
        let extent = self.convention.extent;
        if extent == Extent::new(self.side, self.side) {
            return encoded.concat();
        }
        let Ok(encoded) = Planes::from_planes(picture.extent(), encoded) else {
            return Vec::new();
        };
        let (square, [left, above]) = self.placed();
        let square_of = encoded.resized(Extent::new(square, square));
        let around = values.encoded(values.outside());
        let mut whole = Planes::filled(extent, [around; 3]);
        for y in 0..square {
            for x in 0..square {
                whole.set_pixel(left + x, above + y, square_of.pixel(x, y));
            }
        }
        whole.into_planes().concat()
    }

    /// The side of the square in which the picture lies, and its first column and row.
    fn placed(&self) -> (usize, [usize; 2]) {
        let Extent { width, height } = self.convention.extent;
        let square = width.min(height);
        (square, [(width - square) / 2, (height - square) / 2])
    }

    /// The vectors of an answer, in the size of the network's input.
    fn vectors(&self, shape: &[usize], values: &[f32]) -> Option<Planes<3>> {
        let extent = self.convention.extent;
        let Extent { width, height } = extent;
        let pixels = extent.pixels();
        match (shape, self.convention.channels) {
            (&[1, 3, h, w], Channels::First) if (w, h) == (width, height) => {
                let plane = |channel: usize| values[channel * pixels..][..pixels].to_vec();
                Planes::from_planes(extent, [0, 1, 2].map(plane)).ok()
            }
            (&[1, 2, h, w], Channels::First) if (w, h) == (width, height) => {
                let plane = |channel: usize| values[channel * pixels..][..pixels].to_vec();
                Planes::from_planes(extent, [plane(0), plane(1), vec![1.0; pixels]]).ok()
            }
            (&[1, h, w, 3], Channels::Last) if (w, h) == (width, height) => {
                let channel = |channel: usize| values.iter().skip(channel).step_by(3).copied();
                Planes::from_planes(extent, [0, 1, 2].map(|c| channel(c).collect())).ok()
            }
            _ => None,
        }
    }

    /// What of the vectors belongs to the picture, at its size.
    fn own_square(&self, vectors: Planes<3>) -> Planes<3> {
        let own = Extent::new(self.side, self.side);
        if vectors.extent() == own {
            return vectors;
        }
        let (square, [left, above]) = self.placed();
        let extent = Extent::new(square, square);
        let cut = Planes::from_fn(extent, |x, y| vectors.pixel(left + x, above + y));
        cut.resized_part(&Part::all(extent), &Part::all(own))
    }

    fn in_our_axes(&self, mut vectors: Planes<3>) -> Normals<YUp> {
        if self.convention.axes == Axes::Camera {
            // x right, y down, z away from the viewer: what is seen has a negative z. Some networks' vectors point inwards.
            let depth: f64 = vectors.plane(2).iter().map(|&z| f64::from(z)).sum();
            let sign = if depth > 0.0 { -1.0 } else { 1.0 };
            let [x, y, z] = vectors.planes_mut();
            for at in 0..z.len() {
                [x[at], y[at], z[at]] = [sign * x[at], sign * y[at], -sign * z[at]];
            }
        }
        match self.frame.unwrap_or(self.convention.axes.frame()) {
            NormalsFrame::YUp => Normals::<YUp>::new(vectors),
            NormalsFrame::YDown => Normals::<YDown>::new(vectors).flipped(),
        }
    }
}
