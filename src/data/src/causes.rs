//! An error together with its causes, as one sentence for a person.
//!
//! Typed errors carry their cause in `source`, which `Display` leaves out. Wherever an error becomes
//! text (a terminal, `session.json`, a daemon's state, a page) it goes through [`with_causes`], so
//! that the system's own reason (EIO, ENOSPC, EBUSY) is kept. Knows nothing of any format.

use std::error::Error;

/// The error and its causes, outermost first, joined by `": "`. A cause that is already part of the
/// text is not repeated.
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
