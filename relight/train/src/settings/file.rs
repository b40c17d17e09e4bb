//! Settings in TOML: a file, or the text that a checkpoint keeps.

use std::path::Path;

use relit_data::text;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::TrainError;

/// Settings that a resumed run may change: those that do not affect what it learns, and the learning rate, without which a
/// run that diverged could not go on.
const CHANGEABLE: [&str; 3] = [
    "run.learning_rate",
    "run.log_every",
    "run.checkpoint_minutes",
];

/// Reads settings from a TOML file; missing keys have their defaults, and unknown keys are errors.
///
/// # Errors
/// [`TrainError::Io`], [`TrainError::Refused`].
pub fn read_settings<S: Default + Serialize + DeserializeOwned>(
    path: &Path,
) -> Result<S, TrainError> {
    read_over(&S::default(), path)
}

/// The same where missing keys have other values than by default.
pub(super) fn read_over<S: Serialize + DeserializeOwned>(
    defaults: &S,
    path: &Path,
) -> Result<S, TrainError> {
    let text = text::read(path).map_err(TrainError::io(path, "read"))?;
    let read = || {
        // Faults in the text alone are reported with their line.
        toml::from_str::<S>(&text)?;
        let mut all = toml::Table::try_from(defaults).unwrap_or_default();
        put_over(&mut all, toml::from_str(&text)?);
        all.try_into()
    };
    read().map_err(|fault: toml::de::Error| {
        TrainError::Refused(format!(
            "{} is not a settings file: {fault}",
            path.display()
        ))
    })
}

fn put_over(table: &mut toml::Table, other: toml::Table) {
    for (key, value) in other {
        match (table.get_mut(&key), value) {
            (Some(toml::Value::Table(table)), toml::Value::Table(other)) => put_over(table, other),
            (_, value) => drop(table.insert(key, value)),
        }
    }
}

/// The first setting, such as `run.seed`, that the text of another run's settings has otherwise, or why it has none; `None`
/// where all that count are the same.
pub(crate) fn first_difference(own: &toml::Table, other: &str) -> Option<String> {
    match toml::from_str(other) {
        Ok(other) => differing_name("", own, &other),
        Err(fault) => Some(fault.message().to_owned()),
    }
}

fn differing_name(within: &str, one: &toml::Table, two: &toml::Table) -> Option<String> {
    one.keys().chain(two.keys()).find_map(|key| {
        let name = format!("{within}{key}");
        if CHANGEABLE.contains(&name.as_str()) {
            return None;
        }
        match (one.get(key), two.get(key)) {
            (Some(toml::Value::Table(one)), Some(toml::Value::Table(two))) => {
                differing_name(&format!("{name}."), one, two)
            }
            (one, two) => (one != two).then_some(name),
        }
    })
}
