//! Weights and networks in files.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Component, Path};

use relit_data::durable;

use super::codec::WeightPrecision;
use super::error::NetError;
use super::external::{ExternalPart, with_external_weights};
use super::weights::Weights;

/// Largest file of weights that is read, bytes: the released Light-Net has 554 MB.
const MAX_BYTES: u64 = 2 << 30;

impl Weights {
    /// Reads a file; see [`Weights::from_bytes`].
    ///
    /// # Errors
    /// [`NetError::Io`] or [`NetError::File`].
    pub fn read(path: &Path) -> Result<Self, NetError> {
        let bytes = fs::metadata(path).map_err(not_read(path))?.len();
        let wrong = |fault| NetError::File {
            path: path.to_owned(),
            fault,
        };
        if bytes > MAX_BYTES {
            return Err(wrong(format!("{bytes} bytes are too many")));
        }
        let bytes = fs::read(path).map_err(not_read(path))?;
        Self::from_bytes(&bytes).map_err(wrong)
    }

    /// Writes a safetensors file, whole or not at all.
    ///
    /// # Errors
    /// [`NetError::Weights`], [`NetError::Io`] or [`NetError::File`].
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

/// Reads an ONNX file with all its weights, also those in other files of its folder.
///
/// # Errors
/// [`NetError::Io`] if it cannot be read, [`NetError::File`] if such a file cannot, or what it says of them is damaged.
pub fn read_onnx(path: &Path) -> Result<Vec<u8>, NetError> {
    let bytes = fs::read(path).map_err(not_read(path))?;
    let merged = with_external_weights(&bytes, |part| read_part(path, part));
    let merged = merged.map_err(|fault| NetError::File {
        path: path.to_owned(),
        fault,
    })?;
    Ok(merged.unwrap_or(bytes))
}

/// A part of a file that lies in the folder of an ONNX file, or below.
fn read_part(onnx: &Path, part: &ExternalPart) -> Result<Vec<u8>, String> {
    let location = part.location.replace('\\', "/");
    let named = Path::new(&location);
    let wrong = |what: &str| {
        format!(
            "its weights are in the file {:?}, which {what}",
            part.location
        )
    };
    let mut parts = named.components();
    let lies_below = parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && !location.contains(':');
    if !lies_below || named.file_name().is_none() {
        return Err(wrong("is outside its folder"));
    }
    let unread = |fault: io::Error| wrong(&format!("cannot be read: {fault}"));
    let path = onnx.with_file_name(named);
    if !path.exists() {
        return Err(wrong("is missing: put it into the same folder"));
    }
    let mut file = File::open(&path).map_err(unread)?;
    let metadata = file.metadata().map_err(unread)?;
    if !metadata.is_file() {
        return Err(wrong("is not a file"));
    }
    let end = part.offset.checked_add(part.length);
    if end.is_none_or(|end| end > metadata.len()) {
        return Err(wrong("is too short: copy both again"));
    }
    let mut bytes = vec![0; part.length as usize];
    file.seek(SeekFrom::Start(part.offset))
        .and_then(|_| file.read_exact(&mut bytes))
        .map_err(unread)?;
    Ok(bytes)
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
    use crate::nets::paper::{Head, light_net};
    use crate::nets::weights::Tensor;

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
            matches!(&error, NetError::Weights(text) if text.contains("layer.bias")),
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

    /// A file that needs 24 bytes of another one from the fifth on.
    fn needing(location: &str) -> Vec<u8> {
        let message = |number: u8, content: &[u8]| {
            [&[number << 3 | 2, content.len() as u8], content].concat()
        };
        let entry = |key: &str, value: &str| {
            message(
                13,
                &[message(1, key.as_bytes()), message(2, value.as_bytes())].concat(),
            )
        };
        let tensor = [
            message(1, &[2, 3]),
            vec![2 << 3, 1],
            entry("location", location),
            entry("offset", "4"),
            vec![14 << 3, 1],
        ];
        message(7, &message(5, &tensor.concat()))
    }

    #[test]
    fn weights_are_read_from_files_beside_and_below() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.onnx");
        fs::create_dir(folder.path().join("w")).unwrap();
        let weights: Vec<u8> = (0..32).collect();
        fs::write(folder.path().join("w/b c.data"), &weights).unwrap();
        for location in ["w/b c.data", "./w/b c.data", "w\\b c.data"] {
            fs::write(&path, needing(location)).unwrap();
            let whole = read_onnx(&path).unwrap();
            assert!(whole.ends_with(&weights[4..28]), "{location}");
        }
        fs::write(&path, [8, 8]).unwrap();
        assert_eq!(read_onnx(&path).unwrap(), [8, 8]);
    }

    #[test]
    fn a_file_of_weights_that_is_not_there_or_elsewhere_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m/a.onnx");
        fs::create_dir_all(folder.path().join("m/folder")).unwrap();
        fs::write(folder.path().join("secret"), [0; 64]).unwrap();
        fs::write(folder.path().join("m/short"), [0; 27]).unwrap();
        let secret = folder.path().join("secret").display().to_string();
        for location in [
            "../secret",
            &secret,
            "c:secret",
            "",
            ".",
            "none.data",
            "short",
            "folder",
        ] {
            fs::write(&path, needing(location)).unwrap();
            let fault = match read_onnx(&path) {
                Err(NetError::File { fault, .. }) => fault,
                other => panic!("{location}: {other:?}"),
            };
            assert!(fault.contains(&format!("{location:?}")), "{fault}");
        }
        let none = read_onnx(&folder.path().join("none.onnx"));
        assert!(matches!(none, Err(NetError::Io { .. })));
    }
}
