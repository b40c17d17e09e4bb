//! An error together with its causes, as the one sentence that a person reads.
//!
//! Typed errors name their cause by `source`, and `Display` alone leaves it out: what becomes text
//! (a terminal, `session.json`, a daemon's state, a page) goes through [`with_causes`], so that the
//! system's own word (EIO, ENOSPC, EBUSY) is on the record. Knows nothing of any format.

use std::error::Error;

/// The error and what caused it, outermost first, joined by `": "`. A cause that an error's own text
/// already holds is not told twice.
///
/// ```
/// use std::io::{Error, ErrorKind};
///
/// #[derive(Debug, thiserror::Error)]
/// #[error("mask.png could not be written")]
/// struct Unwritten(#[source] Error);
///
/// let full = Unwritten(Error::new(ErrorKind::StorageFull, "no space left on device"));
/// let text = relit_data::causes::with_causes(&full);
/// assert_eq!(text, "mask.png could not be written: no space left on device");
/// ```
#[must_use]
pub fn with_causes(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let inner_text = inner.to_string();
        if !text.contains(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        cause = inner.source();
    }
    text
}
