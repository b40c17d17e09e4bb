//! Normals of another network, from an ONNX file.

use std::path::Path;

use relight_core::image::{ColourSpace, Extent, Planes, Srgb};
use relight_core::light::NormalsFrame;
use relight_core::light::{Normals, YDown, YUp};
use relight_nets::{Inference, InferenceEngine, NetError};

/// A network for normals.
///
/// It takes one picture, 1 x 3 x side x side: (x - 0.5) / 0.5 of the sRGB values x, 0 outside the mask.
/// It answers with 1 x 3 x side x side, vectors of any length; or with 1 x 2 x side x side, the slopes
/// (p, q) of which (p, q, 1) is the normal.
#[derive(Debug)]
pub(super) struct OtherNormals {
    net: Inference,
    side: usize,
    frame: NormalsFrame,
}

impl OtherNormals {
    pub(super) fn new(
        path: &Path,
        onnx: &[u8],
        side: usize,
        frame: NormalsFrame,
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        let other = Self {
            net: Inference::from_onnx(path, onnx, 3, (side, side), engine)?,
            side,
            frame,
        };
        // Its answer is checked now, and not after the first photograph.
        let extent = Extent::new(side, side);
        let grey = Planes::filled(extent, [0.5; 3]);
        let fault = |fault| NetError::Onnx {
            path: path.to_owned(),
            fault,
        };
        match other.run(&grey, &vec![true; extent.pixels()])? {
            Some(_) => Ok(other),
            None => Err(fault(format!(
                "it does not answer a picture with 2 or 3 channels of {side} x {side} pixels"
            ))),
        }
    }

    /// The normals of a linear picture of the network's size, none outside the mask; `None` where the
    /// answer is no map of normals.
    pub(super) fn run(
        &self,
        picture: &Planes<3>,
        mask: &[bool],
    ) -> Result<Option<Normals<YUp>>, NetError> {
        let encode = |(&light, &inside): (&f32, &bool)| {
            let value = Srgb::from_linear(light.clamp(0.0, 1.0));
            if inside { (value - 0.5) / 0.5 } else { 0.0 }
        };
        let planes = picture.planes().into_iter();
        let input: Vec<f32> = planes
            .flat_map(|plane| plane.iter().zip(mask).map(encode))
            .collect();
        let outputs = self.net.run(&input)?;
        let Some(answer) = outputs.first() else {
            return Ok(None);
        };
        let pixels = self.side * self.side;
        let z = match *answer.shape() {
            [1, 3, height, width] if [height, width] == [self.side; 2] => {
                answer.values()[2 * pixels..].to_vec()
            }
            [1, 2, height, width] if [height, width] == [self.side; 2] => vec![1.0; pixels],
            _ => return Ok(None),
        };
        let [x, y] = [0, 1].map(|channel| &answer.values()[channel * pixels..][..pixels]);
        let vectors = Planes::from_fn(picture.extent(), |column, row| {
            let at = row * self.side + column;
            if mask[at] {
                [x[at], y[at], z[at]]
            } else {
                [0.0; 3]
            }
        });
        Ok(Some(match self.frame {
            NormalsFrame::YUp => Normals::<YUp>::new(vectors),
            NormalsFrame::YDown => Normals::<YDown>::new(vectors).flipped(),
        }))
    }
}
