//! Conventions of other networks for normals, recognised by the names of their inputs and outputs.

use crate::nets::{OnnxSignature, OnnxValue};
use relight_core::image::Extent;
use relight_core::light::NormalsFrame;
use tract_onnx::pb::tensor_proto::DataType;

/// The number of MoGe-2's tokens: the middle of its training range.
const TOKENS: i64 = 1800;
/// Width and height of Metric3D's pictures where the file leaves them open, pixels.
const METRIC3D_SIDE: usize = 518;

/// How a network for normals is used.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Convention {
    /// The kind of network, in words.
    pub(super) name: &'static str,
    /// Of its pictures.
    pub(super) extent: Extent,
    /// What the numbers of its pictures are.
    pub(super) values: Values,
    /// The numbers that its other inputs get, by their names.
    pub(super) given: Vec<(String, i64)>,
    /// Which of its outputs the normals are.
    pub(super) output: usize,
    /// Where a vector's components stand.
    pub(super) channels: Channels,
    pub(super) axes: Axes,
}

/// What the numbers of a picture are, for sRGB values of 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Values {
    /// (x - 0.5) / 0.5, 0 outside the mask.
    Centred,
    /// As they are, black outside the mask.
    Unit,
    /// 0 to 255, a middle grey outside the mask.
    Bytes,
}

/// Where a vector's components stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Channels {
    First,
    Last,
}

/// Axes of vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axes {
    /// x right, z to the viewer; the caller gives the direction of y.
    Viewer,
    /// OpenCV's: x right, y down, z away from the viewer.
    Camera,
}

impl Values {
    pub(super) fn encoded(self, value: f32) -> f32 {
        match self {
            Self::Centred => (value - 0.5) / 0.5,
            Self::Unit => value,
            Self::Bytes => 255.0 * value,
        }
    }

    /// The value outside the mask.
    pub(super) fn outside(self) -> f32 {
        match self {
            Self::Centred => 0.5,
            Self::Unit => 0.0,
            // The mean of the pictures that such networks are trained on.
            Self::Bytes => 0.45,
        }
    }
}

impl Axes {
    /// The direction of y, if the caller gives none.
    pub(super) fn frame(self) -> NormalsFrame {
        match self {
            Self::Viewer => NormalsFrame::YUp,
            Self::Camera => NormalsFrame::YDown,
        }
    }
}

impl Convention {
    /// How a network of this signature is used on pictures of `side` x `side` pixels, or why it cannot be used.
    pub(super) fn from_signature(signature: &OnnxSignature, side: usize) -> Result<Self, String> {
        if let Some(tokens) = signature.input("num_tokens") {
            return Self::moge(signature, tokens, side);
        }
        if let Some(output) = signature.output("predicted_normal") {
            return Self::metric3d(signature, output);
        }
        match &signature.inputs[..] {
            [picture] if has_other_channels(picture) => Err(other_channels(picture)),
            [] | [_] => Ok(Self {
                name: "a network of one picture, (x - 0.5) / 0.5 of sRGB",
                extent: Extent::new(side, side),
                values: Values::Centred,
                given: Vec::new(),
                output: 0,
                channels: Channels::First,
                axes: Axes::Viewer,
            }),
            inputs => Err(format!(
                "its inputs are {}: give a network of one picture, or MoGe-2 (image, num_tokens)",
                named(inputs)
            )),
        }
    }

    fn moge(signature: &OnnxSignature, tokens: &OnnxValue, side: usize) -> Result<Self, String> {
        let output = signature.output("normal").ok_or_else(|| {
            format!(
                "it looks like MoGe-2 without normals (outputs {}): give a model whose name ends in -normal",
                named(&signature.outputs)
            )
        })?;
        if tokens.element != DataType::Int64 {
            return Err("its input num_tokens is not a 64-bit integer".to_owned());
        }
        let picture = picture_of(signature, &tokens.name)?;
        Ok(Self {
            name: "MoGe-2: sRGB values from 0 to 1, normals in OpenCV's axes",
            extent: fixed_extent(picture).unwrap_or(Extent::new(side, side)),
            values: Values::Unit,
            given: vec![(tokens.name.clone(), TOKENS)],
            output,
            channels: Channels::Last,
            axes: Axes::Camera,
        })
    }

    fn metric3d(signature: &OnnxSignature, output: usize) -> Result<Self, String> {
        let picture = picture_of(signature, "")?;
        let own = Extent::new(METRIC3D_SIDE, METRIC3D_SIDE);
        Ok(Self {
            name: "Metric3D: sRGB values from 0 to 255, normals in OpenCV's axes",
            extent: fixed_extent(picture).unwrap_or(own),
            values: Values::Bytes,
            given: Vec::new(),
            output,
            channels: Channels::First,
            axes: Axes::Camera,
        })
    }
}

/// The one input besides `other`, which has to be a picture.
fn picture_of<'a>(signature: &'a OnnxSignature, other: &str) -> Result<&'a OnnxValue, String> {
    let mut rest = signature.inputs.iter().filter(|input| input.name != other);
    match (rest.next(), rest.next()) {
        (Some(picture), None) if has_other_channels(picture) => Err(other_channels(picture)),
        (Some(picture), None) if picture.element == DataType::Float => Ok(picture),
        _ => Err(format!(
            "its inputs are {}: one of them has to be a picture of 32-bit numbers",
            named(&signature.inputs)
        )),
    }
}

/// The width and height that a picture has to have, where both are fixed.
fn fixed_extent(picture: &OnnxValue) -> Option<Extent> {
    match picture.sides[..] {
        [_, _, Some(height), Some(width)] => Some(Extent::new(width, height)),
        _ => None,
    }
}

/// Whether a picture is one of other channels than red, green and blue.
fn has_other_channels(picture: &OnnxValue) -> bool {
    matches!(picture.sides[..], [_, Some(channels), _, _] if channels != 3)
}

fn other_channels(picture: &OnnxValue) -> String {
    let channels = picture.sides.get(1).copied().flatten().unwrap_or_default();
    format!(
        "its input {} has {channels} channels: give a network for normals that takes red, green and blue",
        picture.name
    )
}

fn named(values: &[OnnxValue]) -> String {
    let names: Vec<&str> = values.iter().map(|value| value.name.as_str()).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(name: &str, element: DataType, sides: &[Option<usize>]) -> OnnxValue {
        OnnxValue {
            name: name.to_owned(),
            element,
            sides: sides.to_vec(),
        }
    }

    fn picture(name: &str, height: Option<usize>, width: Option<usize>) -> OnnxValue {
        value(name, DataType::Float, &[Some(1), Some(3), height, width])
    }

    fn answers(names: &[&str]) -> Vec<OnnxValue> {
        let answer = |name: &&str| value(name, DataType::Float, &[]);
        names.iter().map(answer).collect()
    }

    #[test]
    fn the_published_files_are_told_by_their_inputs_and_outputs() {
        let tokens = value("num_tokens", DataType::Int64, &[]);
        let moge = OnnxSignature {
            inputs: vec![picture("image", None, None), tokens.clone()],
            outputs: answers(&["points", "normal", "mask", "metric_scale"]),
        };
        let found = Convention::from_signature(&moge, 256).unwrap();
        assert!(found.name.starts_with("MoGe-2"));
        assert_eq!((found.output, found.axes), (1, Axes::Camera));
        assert_eq!(found.extent, Extent::new(256, 256));
        assert_eq!(found.given[0].0, "num_tokens");

        let metric3d = OnnxSignature {
            inputs: vec![picture("pixel_values", Some(616), Some(1064))],
            outputs: answers(&["predicted_depth", "predicted_normal", "normal_confidence"]),
        };
        let found = Convention::from_signature(&metric3d, 256).unwrap();
        assert!(found.name.starts_with("Metric3D"));
        assert_eq!((found.output, found.extent), (1, Extent::new(1064, 616)));

        let ours = OnnxSignature {
            inputs: vec![picture("input", Some(256), Some(256))],
            outputs: answers(&["normal"]),
        };
        assert_eq!(
            Convention::from_signature(&ours, 256).unwrap().axes,
            Axes::Viewer
        );
    }

    #[test]
    fn what_is_neither_is_said_with_its_names() {
        let two = OnnxSignature {
            inputs: vec![picture("left", None, None), picture("right", None, None)],
            outputs: answers(&["depth"]),
        };
        let fault = Convention::from_signature(&two, 256).unwrap_err();
        assert!(fault.contains("left, right"), "{fault}");
        let ours = OnnxSignature {
            inputs: vec![value(
                "input",
                DataType::Float,
                &[None, Some(7), None, None],
            )],
            outputs: answers(&["maps", "paint", "light"]),
        };
        let fault = Convention::from_signature(&ours, 256).unwrap_err();
        assert!(fault.contains("7 channels"), "{fault}");
        let flat = OnnxSignature {
            inputs: vec![
                picture("image", None, None),
                value("num_tokens", DataType::Int64, &[]),
            ],
            outputs: answers(&["points", "mask"]),
        };
        let fault = Convention::from_signature(&flat, 256).unwrap_err();
        assert!(fault.contains("points, mask"), "{fault}");
    }
}
