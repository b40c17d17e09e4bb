//! Weights as bytes: safetensors in and out.

use std::collections::HashMap;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use super::error::NetError;
use super::weights::{Tensor, Weights};

/// How numbers are kept in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightPrecision {
    /// 32 bits.
    Single,
    /// 16 bits, IEEE half.
    Half,
}

impl Weights {
    /// Weights out of the bytes of a safetensors file. Half precision becomes single. Integers of 8 bits (`I8`) become what they
    /// are times the scale of their output channel, which the tensor `NAME.scale` has.
    ///
    /// # Errors
    /// A sentence with the reason.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        if bytes.starts_with(b"PK") {
            return Err(
                "it is a PyTorch file: convert it to safetensors (docs/guide/photograph.md)"
                    .to_owned(),
            );
        }
        let file = SafeTensors::deserialize(bytes)
            .map_err(|error| format!("it is not a safetensors file ({error})"))?;
        let views = file.iter();
        let views = views.filter(|(name, _)| !is_of_integers(&file, name));
        views
            .map(|(name, view)| {
                let mut values = decode(view.dtype(), view.data()).ok_or_else(|| {
                    format!(
                        "{name} has the type {:?}, which is not supported",
                        view.dtype()
                    )
                })?;
                if view.dtype() == Dtype::I8 {
                    scale(&mut values, &file, name)?;
                }
                let tensor = Tensor::new(view.shape().to_vec(), values)
                    .ok_or_else(|| format!("the length of {name} does not match its shape"))?;
                Ok((name.to_owned(), tensor))
            })
            .collect()
    }

    /// The bytes of a safetensors file, with facts about them in its header.
    ///
    /// # Errors
    /// A sentence: a value is too large for the precision, or the error of the format's writer.
    pub fn to_safetensors(
        &self,
        precision: WeightPrecision,
        facts: Option<HashMap<String, String>>,
    ) -> Result<Vec<u8>, String> {
        self.check_range(precision)
            .map_err(|error| error.to_string())?;
        let encoded: Vec<_> = self
            .iter()
            .map(|(name, tensor)| (name, tensor.shape().to_vec(), encode(tensor, precision)))
            .collect();
        let kind = match precision {
            WeightPrecision::Single => Dtype::F32,
            WeightPrecision::Half => Dtype::F16,
        };
        let mut views = Vec::with_capacity(encoded.len());
        for (name, shape, bytes) in &encoded {
            let view = TensorView::new(kind, shape.clone(), bytes);
            views.push((*name, view.map_err(|error| error.to_string())?));
        }
        safetensors::serialize(views, facts).map_err(|error| error.to_string())
    }

    /// Whether every finite value stays finite at this precision.
    pub(super) fn check_range(&self, precision: WeightPrecision) -> Result<(), NetError> {
        if precision == WeightPrecision::Single {
            return Ok(());
        }
        let overflows = |value: &f32| value.is_finite() && !half::f16::from_f32(*value).is_finite();
        for (name, tensor) in self.iter() {
            if let Some(&value) = tensor.values().iter().find(|value| overflows(value)) {
                return Err(NetError::Other(format!(
                    "{name} holds {value}, beyond the 65504 of half precision: write it in single precision"
                )));
            }
        }
        Ok(())
    }
}

fn encode(tensor: &Tensor, precision: WeightPrecision) -> Vec<u8> {
    let values = tensor.values().iter();
    match precision {
        WeightPrecision::Single => values.flat_map(|value| value.to_le_bytes()).collect(),
        WeightPrecision::Half => values
            .flat_map(|&value| half::f16::from_f32(value).to_le_bytes())
            .collect(),
    }
}

/// How the name of the scales of a tensor of integers ends.
const SCALES: &str = ".scale";

/// Whether a tensor has the scales of another one, which holds integers.
fn is_of_integers(file: &SafeTensors<'_>, name: &str) -> bool {
    let integers = name.strip_suffix(SCALES);
    let integers = integers.and_then(|name| file.tensor(name).ok());
    integers.is_some_and(|view| view.dtype() == Dtype::I8)
}

/// Multiplies integers by the scales of the same file, one for each output channel, which is the first dimension.
fn scale(integers: &mut [f32], file: &SafeTensors<'_>, name: &str) -> Result<(), String> {
    let missing = || format!("{name} holds integers without a scale for each output channel");
    let view = file.tensor(name).map_err(|error| error.to_string())?;
    let channels = view.shape().first().copied().unwrap_or_default();
    let scales = file
        .tensor(&format!("{name}{SCALES}"))
        .map_err(|_| missing())?;
    let scales = decode(scales.dtype(), scales.data()).ok_or_else(missing)?;
    if scales.len() != channels {
        return Err(missing());
    }
    let count = integers.len().checked_div(channels).unwrap_or_default();
    for (channel, scale) in integers.chunks_exact_mut(count.max(1)).zip(scales) {
        channel.iter_mut().for_each(|value| *value *= scale);
    }
    Ok(())
}

fn decode(kind: Dtype, bytes: &[u8]) -> Option<Vec<f32>> {
    let halves = || bytes.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
    Some(match kind {
        Dtype::F32 => bytes
            .chunks_exact(4)
            .map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]))
            .collect(),
        Dtype::F16 => halves()
            .map(|pair| half::f16::from_le_bytes(pair).to_f32())
            .collect(),
        Dtype::BF16 => halves()
            .map(|pair| half::bf16::from_le_bytes(pair).to_f32())
            .collect(),
        Dtype::I8 => bytes.iter().map(|&byte| f32::from(byte as i8)).collect(),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_file_of_weights_is_an_error() {
        for bytes in [&b""[..], b"hello", b"PK\x03\x04", &[0xff; 100]] {
            assert!(Weights::from_bytes(bytes).is_err());
        }
        let zip = Weights::from_bytes(b"PK\x03\x04").unwrap_err();
        assert!(zip.contains("PyTorch"), "{zip}");
    }

    /// A file of one tensor of integers with its scales.
    fn quantised(shape: &[usize], integers: &[i8], scales: &[f32]) -> Vec<u8> {
        let integers: Vec<u8> = integers.iter().map(|&value| value as u8).collect();
        let bytes: Vec<u8> = scales
            .iter()
            .flat_map(|scale| scale.to_le_bytes())
            .collect();
        let views = [
            ("a", TensorView::new(Dtype::I8, shape.to_vec(), &integers)),
            (
                "a.scale",
                TensorView::new(Dtype::F32, vec![scales.len()], &bytes),
            ),
        ];
        let views = views.map(|(name, view)| (name, view.unwrap()));
        safetensors::serialize(views, None).unwrap()
    }

    #[test]
    fn integers_are_multiplied_by_the_scale_of_their_output_channel() {
        let bytes = quantised(&[2, 1, 2], &[127, -128, 3, 0], &[0.5, 2.0]);
        let tensor = Tensor::new(vec![2, 1, 2], vec![63.5, -64.0, 6.0, 0.0]).unwrap();
        let expected: Weights = [("a".to_owned(), tensor)].into_iter().collect();
        assert_eq!(Weights::from_bytes(&bytes), Ok(expected));
    }

    #[test]
    fn integers_without_fitting_scales_are_an_error() {
        for (shape, count) in [
            (&[2, 2][..], 1),
            (&[2, 2], 4),
            (&[4], 1),
            (&[0, 4], 1),
            (&[], 1),
        ] {
            let integers = vec![1; shape.iter().product()];
            let bytes = quantised(shape, &integers, &vec![1.0; count]);
            assert!(Weights::from_bytes(&bytes).is_err(), "{shape:?}");
        }
        let empty = quantised(&[2, 0], &[], &[1.0, 1.0]);
        assert!(Weights::from_bytes(&empty).is_ok());
    }
}
