//! `relit-house`: checks the structure that docs/architecture.md promises.
//!
//! - No files of a crate import each other in a circle.
//! - A public type or trait has a name of its own in the whole workspace.
//! - Crates know each other as the table of crates says.
//!
//! | module | concern |
//! | --- | --- |
//! | `workspace` | the packages, as cargo describes them |
//! | `source` | the modules of a crate and the files that they stand in |
//! | `use_tree` | a `use` declaration as the paths that it imports |
//! | `test_only` | what is built for tests alone |
//! | `names` | what each module declares, and where a path leads |
//! | `local_names` | what a function declares for itself |
//! | `ties` | which file uses what of which other file |
//! | `circles` | files that reach each other |
//! | `public_names` | types and traits that share a name |
//! | `crate_table` | the table of crates against their manifests |
//! | `house` | all of it over one workspace |
//!
//! What it cannot see: a method is called by its name alone, so an `impl` of a type in another file
//! than the type's makes no tie to that file, neither by `x.method()` nor by `Type::method()`.

mod circles;
mod crate_table;
mod error;
mod finding;
mod house;
mod local_names;
mod names;
mod public_names;
mod source;
mod test_only;
mod ties;
mod use_tree;
mod workspace;

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use error::HouseError;

fn main() -> ExitCode {
    let root = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from("."), PathBuf::from);
    match report(&root) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            // Nothing can be done if standard error is closed.
            let _ = writeln!(io::stderr(), "house: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Prints the findings and the summary; returns whether there were none.
fn report(root: &std::path::Path) -> Result<bool, HouseError> {
    let inspection = house::inspect(root)?;
    let mut out = io::stdout().lock();
    for finding in &inspection.findings {
        writeln!(out, "{finding}").map_err(HouseError::Print)?;
    }
    writeln!(out, "{}", inspection.summary()).map_err(HouseError::Print)?;
    Ok(inspection.findings.is_empty())
}
