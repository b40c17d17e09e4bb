//! Weights in files.

use std::fs;
use std::io;
use std::path::Path;

use relit_data::durable;

use super::codec::WeightPrecision;
use super::error::NetError;
use super::weights::Weights;

/// Largest file of weights that is read, bytes: the released Light-Net has 554 MB.
const MAX_BYTES: u64 = 2 << 30;

impl Weights {
    /// Reads a file; see [`Weights::from_bytes`].
    ///
    /// # Errors
    /// If it cannot be read, or holds no weights.
    pub fn read(path: &Path) -> Result<Self, NetError> {
        let bytes = fs::metadata(path).map_err(not_read(path))?.len();
        let wrong = |fault| NetError::file(path, fault);
        if bytes > MAX_BYTES {
            return Err(wrong(format!("{bytes} bytes are too many")));
        }
        let bytes = fs::read(path).map_err(not_read(path))?;
        Self::from_bytes(&bytes).map_err(wrong)
    }

    /// Writes a safetensors file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written, or a weight has no such precision.
    pub fn write(&self, path: &Path, precision: WeightPrecision) -> Result<(), NetError> {
        self.check_range(precision)?;
        let bytes = self
            .to_safetensors(precision, None)
            .map_err(|fault| NetError::file(path, fault))?;
        durable::write_whole(path, &bytes).map_err(|source| NetError::Io {
            path: path.to_owned(),
            doing: "written",
            source,
        })
    }
}

fn not_read(path: &Path) -> impl FnOnce(io::Error) -> NetError {
    let path = path.to_owned();
    move |source| NetError::Io {
        path,
        doing: "read",
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nets::paper::light_net;
    use crate::nets::weights::Tensor;

    #[test]
    fn a_file_gives_back_what_was_written() {
        let graph = light_net();
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
        assert!(error.to_string().contains("layer.bias"), "{error}");
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
