//! Weights and networks in files.

use std::fs;
use std::path::Path;

use relit_data::durable;

use super::codec::WeightPrecision;
use super::engine::InferenceEngine;
use super::error::NetError;
use super::inference::Inference;
use super::weights::Weights;

/// Largest file of weights that is read, bytes: the released Light-Net has 554 MB.
const MOST_BYTES: u64 = 2 << 30;

impl Weights {
    /// Reads a file; see [`Weights::from_bytes`].
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
}

impl Inference {
    /// Reads an ONNX file with one input, and makes it ready for one picture of `channels` channels,
    /// `width` x `height` pixels.
    ///
    /// # Errors
    /// [`NetError::Io`], or [`NetError::Onnx`] where it is no network or cannot take such a picture.
    pub fn read_onnx(
        path: &Path,
        channels: usize,
        size: (usize, usize),
        engine: &InferenceEngine,
    ) -> Result<Self, NetError> {
        let bytes = fs::read(path).map_err(|source| NetError::Io {
            path: path.to_owned(),
            doing: "read",
            source,
        })?;
        Self::from_onnx(path, &bytes, channels, size, engine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::{Head, light_net};
    use crate::weights::Tensor;

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
}
