//! The weights that come with the package, ready to be used.

use std::sync::OnceLock;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use relight_photo::decompose::{Decomposer, NetworkInput};
use relight_photo::nets::{Inference, Weights, decomposer_of};
use relight_turn::{TurnNetwork, TurnNetworks};

use crate::arrays::Array;
use crate::failure::{Failure, unlocked};
use crate::photographs::PhotographInput;

/// Makes a network once, when it is first needed; each thread that needs it meanwhile waits.
fn once<T>(
    place: &'static OnceLock<Result<T, String>>,
    make: impl FnOnce() -> Result<T, String>,
) -> Result<&'static T, Failure> {
    let made = place.get_or_init(make).as_ref();
    made.map_err(|fault| Failure::value(fault.clone()))
}

fn photo_weights() -> Result<Weights, String> {
    Weights::from_bytes(include_bytes!("../../cli/weights/decompose.safetensors"))
}

/// The network of photographs.
pub(crate) fn decomposer() -> Result<&'static Decomposer, Failure> {
    static MADE: OnceLock<Result<Decomposer, String>> = OnceLock::new();
    once(&MADE, || {
        Decomposer::new(&photo_weights()?).map_err(|error| error.to_string())
    })
}

/// The networks of turns.
pub(crate) fn turn_networks() -> Result<&'static TurnNetworks, Failure> {
    static MADE: OnceLock<Result<TurnNetworks, String>> = OnceLock::new();
    once(&MADE, || {
        let turn = Weights::from_bytes(include_bytes!("../../cli/weights/turn.safetensors"))?;
        Ok(TurnNetworks {
            turn: TurnNetwork::new(&turn).map_err(|error| error.to_string())?,
            photo: photo_weights()?,
        })
    })
}

/// What the network of photographs answers for a picture as it is, whose sides are multiples of 32: one look, without the
/// cut, the second scale and the fits of a decomposition. Files of the network are held against it.
#[pyfunction]
pub(crate) fn network_maps<'py>(
    py: Python<'py>,
    photograph: PhotographInput<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let photograph = photograph.owned()?;
    let (maps, light) = unlocked(py, || {
        let photo = photograph.load()?;
        let weights = photo_weights().map_err(Failure::value)?;
        let graph = decomposer_of(&weights);
        let extent = photo.mask.extent();
        let inference = Inference::new(&graph, &weights, (extent.width, extent.height))?;
        let encoded = NetworkInput::new(photo.picture.planes(), &photo.mask);
        let outputs = inference.run(encoded.values())?;
        // The heads for pixels have four sides, that for light two.
        let (pixels, light): (Vec<_>, Vec<_>) = outputs
            .into_iter()
            .partition(|output| output.shape().len() > 2);
        let values = |outputs: Vec<relight_photo::nets::Tensor>| -> Vec<f32> {
            outputs
                .iter()
                .flat_map(|output| output.values().to_vec())
                .collect()
        };
        Ok((encoded.decode(&values(pixels)), values(light)))
    })?;
    let found = PyDict::new(py);
    for (name, map) in [
        ("normals", Array::from_planes(maps.normals.planes())),
        ("albedo", Array::from_planes(&maps.albedo)),
        ("shading", Array::from_planes(&maps.shading)),
        ("highlight", Array::from_planes(&maps.highlight)),
        ("paint", Array::from_planes(&maps.paint)),
        ("light", Array::new(vec![light.len()], light)),
    ] {
        found.set_item(name, map.into_python(py)?)?;
    }
    Ok(found)
}
