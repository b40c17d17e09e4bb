//! The weights that come with the package, ready to be used.

use std::sync::OnceLock;

use relight_photo::decompose::Decomposer;
use relight_photo::nets::Weights;
use relight_turn::{TurnNetwork, TurnNetworks};

use crate::failure::Failure;

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
