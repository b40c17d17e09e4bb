//! The programs of the toolkit, as tests of several of them find them: beside the test itself, in
//! `target/debug` or `target/release`.

use std::path::{Path, PathBuf};

/// The program `name` that was built with this test, whether it is there or not.
///
/// # Errors
/// If the test's own file is not known.
pub fn beside_this_test(name: &str) -> std::io::Result<PathBuf> {
    let test = std::env::current_exe()?;
    // A test is in the folder `deps` beside the programs.
    let folder = test.parent().and_then(Path::parent);
    let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    Ok(folder.unwrap_or(Path::new("")).join(name))
}

/// The program `name` that was built with this test.
///
/// # Panics
/// If it was not built.
#[allow(clippy::panic, reason = "a test fails by a panic, in its helpers too")]
pub fn program(name: &str) -> PathBuf {
    match beside_this_test(name) {
        Ok(program) if program.is_file() => program,
        Ok(program) => panic!(
            "{} is missing: build the programs first, by `cargo build --bins`",
            program.display()
        ),
        Err(error) => panic!("the test does not know where it is: {error}"),
    }
}
