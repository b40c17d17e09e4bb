//! Why a request cannot be answered, as a sentence for the person at the page.

use std::error::Error;

use relit_data::causes::with_causes;

/// A sentence; every error becomes one.
#[derive(Debug)]
pub(super) struct StudioError(pub(super) String);

impl StudioError {
    /// With the underlying error.
    pub(super) fn with_cause(what: &str, cause: &(dyn Error + 'static)) -> Self {
        Self(format!("{what}: {}", with_causes(cause)))
    }
}

impl<E: Error + 'static> From<E> for StudioError {
    fn from(error: E) -> Self {
        Self(with_causes(&error))
    }
}

/// A refusal of this sentence.
pub(super) fn refused<T>(why: impl Into<String>) -> Result<T, StudioError> {
    Err(StudioError(why.into()))
}
