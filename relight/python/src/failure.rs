//! Work without Python's lock, with its errors as exceptions that have the program's sentence.

use std::error::Error;
use std::io;
use std::process;
use std::sync::OnceLock;

use pyo3::exceptions::{
    PyFileNotFoundError, PyOSError, PyPermissionError, PyRuntimeError, PyValueError,
};
use pyo3::prelude::*;
use relight_core::parallel;
use relit_data::causes::with_causes;

/// What work without Python's lock fails with. Any error becomes one.
#[derive(Debug)]
pub(crate) struct Failure(PyErr);

impl Failure {
    /// A `ValueError` with this sentence.
    pub(crate) fn value(sentence: impl Into<String>) -> Self {
        Self(PyValueError::new_err(sentence.into()))
    }
}

impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let sentence = with_causes(&error);
        Self(match io_error(&error).map(io::Error::kind) {
            None => PyValueError::new_err(sentence),
            Some(io::ErrorKind::NotFound) => PyFileNotFoundError::new_err(sentence),
            Some(io::ErrorKind::PermissionDenied) => PyPermissionError::new_err(sentence),
            Some(_) => PyOSError::new_err(sentence),
        })
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        failure.0
    }
}

/// The system's own error among the causes of an error.
fn io_error<'a>(error: &'a (dyn Error + 'static)) -> Option<&'a io::Error> {
    let mut cause = Some(error);
    while let Some(error) = cause {
        if let Some(found) = error.downcast_ref() {
            return Some(found);
        }
        cause = error.source();
    }
    None
}

/// Works without Python's lock.
///
/// The threads that work is shared with are gone in a process that was forked: it would wait for them for ever, so it is
/// refused there.
pub(crate) fn unlocked<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<R, Failure> + Send,
) -> PyResult<R> {
    static PROCESS: OnceLock<u32> = OnceLock::new();
    if *PROCESS.get_or_init(process::id) != process::id() {
        return Err(PyRuntimeError::new_err(
            "relit was used before this process was forked, and its threads are gone: start workers with \"spawn\" \
             (multiprocessing.get_context), or use relit only in them",
        ));
    }
    match py.detach(|| parallel::caught(work)) {
        Ok(done) => Ok(done?),
        Err(panic) => Err(PyRuntimeError::new_err(panic.to_string())),
    }
}

/// The value of a name.
pub(crate) fn choice<T: Copy>(what: &str, given: &str, choices: &[(&str, T)]) -> PyResult<T> {
    let found = choices.iter().find(|(name, _)| *name == given);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<_> = choices
            .iter()
            .map(|(name, _)| format!("{name:?}"))
            .collect();
        PyValueError::new_err(format!("{what} is {given:?}: give {}", names.join(" or ")))
    })
}
