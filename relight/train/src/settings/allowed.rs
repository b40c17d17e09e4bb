//! Settings out of range, by name.

use crate::error::TrainError;

/// The first setting that is not allowed: its name, whether it is allowed, its value, and what is allowed.
pub(super) fn all_allowed<const N: usize>(
    settings: [(&'static str, bool, String, &'static str); N],
) -> Result<(), TrainError> {
    match settings
        .into_iter()
        .find(|&(_, is_allowed, ..)| !is_allowed)
    {
        Some((name, _, value, allowed)) => Err(TrainError::Setting {
            name,
            value,
            allowed,
        }),
        None => Ok(()),
    }
}
