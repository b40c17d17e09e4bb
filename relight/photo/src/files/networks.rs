//! Networks for a decomposer in files.

use std::path::Path;

use crate::nets::read_onnx;
use relight_core::light::NormalsFrame;

use crate::decompose::{DecomposeError, Decomposer};

impl Decomposer {
    /// Takes the normals of another network from now on: see [`Decomposer::set_normals`].
    ///
    /// # Errors
    /// Where the file cannot be read or run, or answers something else; then all stays as it was.
    pub fn read_normals(
        &mut self,
        path: &Path,
        frame: Option<NormalsFrame>,
    ) -> Result<(), DecomposeError> {
        self.set_normals(path, &read_onnx(path)?, frame)
    }
}
