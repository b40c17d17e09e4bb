//! How values become files.

use std::path::Path;

use relight_core::image::{Linear, Planes, Rgb};
use relit_data::durable::write_whole;
use serde::Serialize;

use crate::error::TurnError;

/// A colour image of one plane.
pub(crate) fn grey(plane: &Planes<1>) -> Rgb<Linear> {
    let [values] = plane.planes();
    let width = plane.extent().width;
    Rgb::new(Planes::from_fn(plane.extent(), |x, y| {
        [values[y * width + x]; 3]
    }))
}

/// Writes a value as JSON.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), TurnError> {
    let mut json = serde_json::to_vec_pretty(value).unwrap_or_default();
    json.push(b'\n');
    write_whole(path, &json).map_err(TurnError::write(path))
}
