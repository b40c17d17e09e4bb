//! Tests that need something of the machine, and are shown as ignored, with the reason, where it is missing: for
//! test targets with `harness = false`.

use std::process::ExitCode;

use libtest_mimic::{Arguments, Completion};

pub use libtest_mimic::Trial;

/// A test of what `need` returns. Where `need` fails, the test is shown as ignored for that reason.
pub fn trial<T: 'static>(
    name: impl Into<String>,
    need: impl FnOnce() -> Result<T, String> + Send + 'static,
    test: impl FnOnce(T) + Send + 'static,
) -> Trial {
    Trial::ignorable_test(name, move || match need() {
        Ok(found) => {
            test(found);
            Ok(Completion::Completed)
        }
        Err(reason) => Ok(Completion::ignored_with(reason)),
    })
}

/// A test that needs nothing.
pub fn free_trial(name: impl Into<String>, test: impl FnOnce() + Send + 'static) -> Trial {
    trial(name, || Ok(()), |()| test())
}

/// Runs the trials as `cargo test` asks on the command line.
pub fn run(trials: Vec<Trial>) -> ExitCode {
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

/// Trials of test functions, by their names: `trials![with need => first, second]`, each of which takes what `need`
/// returns; `trials![if need => first, second]`, where `need` returns nothing; and `trials![first, second]`. A function
/// that is in no list is dead code, of which the compiler warns.
#[macro_export]
macro_rules! trials {
    (with $need:expr => $($test:path),+ $(,)?) => {
        vec![$($crate::trials::trial(stringify!($test), $need, $test)),+]
    };
    (if $need:expr => $($test:path),+ $(,)?) => {
        vec![$($crate::trials::trial(stringify!($test), $need, |()| $test())),+]
    };
    ($($test:path),+ $(,)?) => {
        vec![$($crate::trials::free_trial(stringify!($test), $test)),+]
    };
}
