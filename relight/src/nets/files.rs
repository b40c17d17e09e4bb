//! Weights in files: safetensors to read and write, PyTorch's `.pth` to read.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use relit_data::durable;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use super::error::NetError;
use super::pickle;
use super::weights::{Tensor, Weights};

/// Largest file of weights that is read, bytes: the released Light-Net has 554 MB.
const MOST_BYTES: u64 = 2 << 30;

/// How numbers are kept in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightPrecision {
    /// 32 bits.
    Single,
    /// 16 bits, IEEE half.
    Half,
}

impl Weights {
    /// Reads a safetensors file, or a state dict that PyTorch saved (`.pth`, `.pt`); their first bytes show
    /// which of them it is. Half precision becomes single.
    ///
    /// # Errors
    /// [`NetError::Io`] or [`NetError::File`].
    pub fn read(path: &Path) -> Result<Self, NetError> {
        let io = |source| NetError::Io {
            path: path.to_owned(),
            doing: "read",
            source,
        };
        let bytes = fs::metadata(path).map_err(io)?.len();
        let wrong = |fault| NetError::File {
            path: path.to_owned(),
            fault,
        };
        if bytes > MOST_BYTES {
            return Err(wrong(format!("{bytes} bytes are too many")));
        }
        let bytes = fs::read(path).map_err(io)?;
        Self::from_bytes(&bytes).map_err(wrong)
    }

    /// Weights out of the bytes of such a file.
    ///
    /// # Errors
    /// A sentence that says what is wrong.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        match bytes {
            [b'P', b'K', ..] => pickle::read_state_dict(bytes),
            _ => from_safetensors(bytes),
        }
    }

    /// The bytes of a safetensors file, with facts about them in its header.
    ///
    /// # Errors
    /// A sentence: where a value is too large for the precision, or what the format's writer answers.
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

    /// Writes a safetensors file, whole or not at all.
    ///
    /// # Errors
    /// [`NetError::TooLarge`], [`NetError::Io`] or [`NetError::File`].
    pub fn write(&self, path: &Path, precision: WeightPrecision) -> Result<(), NetError> {
        self.check_range(precision)?;
        let bytes = self
            .to_safetensors(precision, None)
            .map_err(|fault| NetError::File {
                path: path.to_owned(),
                fault,
            })?;
        durable::write_whole(path, &bytes).map_err(|source| NetError::Io {
            path: path.to_owned(),
            doing: "written",
            source,
        })
    }

    /// Whether every finite value stays finite at this precision.
    fn check_range(&self, precision: WeightPrecision) -> Result<(), NetError> {
        if precision == WeightPrecision::Single {
            return Ok(());
        }
        let overflows = |value: &f32| value.is_finite() && !half::f16::from_f32(*value).is_finite();
        for (name, tensor) in self.iter() {
            if let Some(&value) = tensor.values().iter().find(|value| overflows(value)) {
                return Err(NetError::TooLarge {
                    name: name.to_owned(),
                    value,
                });
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

fn from_safetensors(bytes: &[u8]) -> Result<Weights, String> {
    let file = SafeTensors::deserialize(bytes)
        .map_err(|error| format!("it is no safetensors file and no state dict ({error})"))?;
    file.iter()
        .map(|(name, view)| {
            let values = decode(view.dtype(), view.data())
                .ok_or_else(|| format!("{name} holds {:?}, which is not read", view.dtype()))?;
            let tensor = Tensor::new(view.shape().to_vec(), values)
                .ok_or_else(|| format!("{name} is not as long as its shape says"))?;
            Ok((name.to_owned(), tensor))
        })
        .collect()
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
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::paper::{Head, light_net};
    use super::*;

    #[test]
    fn a_file_gives_back_what_was_written() {
        let graph = light_net(Head::Pooled);
        let weights = Weights::initial(&graph, 3);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.safetensors");
        weights.write(&path, WeightPrecision::Single).unwrap();
        assert_eq!(Weights::read(&path).unwrap(), weights);
        weights.write(&path, WeightPrecision::Half).unwrap();
        let halves = Weights::read(&path).unwrap();
        for (name, tensor) in weights.iter() {
            let read = halves.get(name).unwrap().values();
            let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-3 * a.abs() + 1e-7;
            assert!(tensor.values().iter().zip(read).all(close), "{name}");
        }
    }

    #[test]
    fn a_value_beyond_half_precision_is_an_error_that_names_its_parameter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large.safetensors");
        let weights = |value: f32| -> Weights {
            let tensor = Tensor::new(vec![2], vec![0.5, value]).unwrap();
            [("layer.bias".to_owned(), tensor)].into_iter().collect()
        };
        let error = weights(-1e5).write(&path, WeightPrecision::Half);
        let error = error.unwrap_err();
        assert!(
            matches!(&error, NetError::TooLarge { name, .. } if name == "layer.bias"),
            "{error}"
        );
        assert!(!path.exists());
        let text = weights(1e5).to_safetensors(WeightPrecision::Half, None);
        assert!(text.unwrap_err().contains("layer.bias"));
        weights(65504.0)
            .write(&path, WeightPrecision::Half)
            .unwrap();
        assert_eq!(Weights::read(&path).unwrap(), weights(65504.0));
        weights(1e5).write(&path, WeightPrecision::Single).unwrap();
    }

    #[test]
    fn what_is_no_file_of_weights_is_an_error() {
        for bytes in [&b""[..], b"hello", b"PK\x03\x04", &[0xff; 100]] {
            assert!(Weights::from_bytes(bytes).is_err());
        }
    }
}
