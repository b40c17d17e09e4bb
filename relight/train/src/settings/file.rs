//! Settings in TOML: a file, or the text that a checkpoint keeps.

use std::path::Path;

use relit_data::text;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::renamed::{RenamedSetting, with_new_keys};
use crate::error::TrainError;

/// Settings that a run may change when it goes on: what it learns does not depend on them.
const HOW_OFTEN: [&str; 2] = ["run.log_every", "run.checkpoint_minutes"];

/// The settings of a file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SettingsFile<S> {
    /// The settings.
    pub settings: S,
    /// The old keys in it. They are still read, and the user should hear of them.
    pub renamed: Vec<RenamedSetting>,
}

/// Settings that stand in no file.
impl<S> From<S> for SettingsFile<S> {
    fn from(settings: S) -> Self {
        Self {
            settings,
            renamed: Vec::new(),
        }
    }
}

/// Reads settings from a TOML file; what it does not name has its default, and an unknown name is an error.
///
/// # Errors
/// [`TrainError::Io`] or [`TrainError::Settings`].
pub fn read_settings<S: DeserializeOwned>(path: &Path) -> Result<SettingsFile<S>, TrainError> {
    read_with(path, |text| toml::from_str(text))
}

/// Reads a TOML file, the keys of which have their present names in the text that `parse` is given.
pub(super) fn read_with<S>(
    path: &Path,
    parse: impl FnOnce(&str) -> Result<S, toml::de::Error>,
) -> Result<SettingsFile<S>, TrainError> {
    let text = text::read(path).map_err(|source| TrainError::Io {
        path: path.to_owned(),
        doing: "read",
        source,
    })?;
    let (text, renamed) = with_new_keys(&text);
    match parse(&text) {
        Ok(settings) => Ok(SettingsFile { settings, renamed }),
        Err(fault) => Err(TrainError::Settings {
            path: path.to_owned(),
            fault: fault.to_string(),
        }),
    }
}

/// The first setting, such as `run.seed`, that another run's settings have otherwise, or why they are none; `None` where
/// all that count are the same. What their text does not name has its default, as in a file.
pub(crate) fn first_difference<S: Serialize + DeserializeOwned>(
    own: &S,
    other: &str,
) -> Option<String> {
    let table = |settings: &S| toml::Table::try_from(settings).unwrap_or_default();
    match toml::from_str::<S>(&with_new_keys(other).0) {
        Ok(other) => differing_name("", &table(own), &table(&other)),
        Err(fault) => Some(fault.message().to_owned()),
    }
}

fn differing_name(within: &str, one: &toml::Table, two: &toml::Table) -> Option<String> {
    one.keys().chain(two.keys()).find_map(|key| {
        let name = format!("{within}{key}");
        if HOW_OFTEN.contains(&name.as_str()) {
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
