//! The Python module `relit._relit`: the libraries of relight, bound. The package around it, `relit`, has what Python says
//! better: defaults, docstrings, data classes, iteration, torch.
//!
//! | module | concern |
//! | --- | --- |
//! | `reader` | data sets as batches |
//! | `photographs` | photographs decomposed, relit and put into other pictures; their masks |
//! | `turns` | whole turns solved |
//! | `rendering` | the render layers |
//! | `arrays`, `light` | what Python gives and gets: arrays and paths |
//! | `networks` | the weights that come with the package |
//! | `failure` | work without Python's lock, and its errors as exceptions |

mod arrays;
mod failure;
mod light;
mod networks;
mod photographs;
mod reader;
mod rendering;
mod turns;

use pyo3::prelude::*;

/// The module `relit._relit`.
#[pymodule]
fn _relit(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<reader::Data>()?;
    module.add_class::<reader::BatchStream>()?;
    module.add_function(wrap_pyfunction!(photographs::decompose, module)?)?;
    module.add_function(wrap_pyfunction!(photographs::relight, module)?)?;
    module.add_function(wrap_pyfunction!(photographs::insert, module)?)?;
    module.add_function(wrap_pyfunction!(photographs::mask, module)?)?;
    module.add_function(wrap_pyfunction!(photographs::read_image, module)?)?;
    module.add_function(wrap_pyfunction!(turns::solve_turn, module)?)?;
    module.add_function(wrap_pyfunction!(rendering::render, module)?)?;
    module.add_function(wrap_pyfunction!(rendering::to_srgb8, module)?)?;
    module.add_function(wrap_pyfunction!(rendering::to_srgb16, module)?)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
