//! Settings that had another name in 0.1: files and checkpoints with the old one are read in 0.3, the first
//! release that has the new one, and no longer in 0.4.

use std::fmt;

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// The release that no longer reads the old names.
const READ_BEFORE: &str = "0.4";

/// Table, old key and new key.
pub(super) const RENAMED: [(&str, &str, &str); 8] = [
    ("run", "rate", "learning_rate"),
    ("run", "warm_up", "warmup_steps"),
    ("run", "final_share", "min_lr_ratio"),
    ("run", "longest_gradient", "max_grad_norm"),
    ("run", "decay", "weight_decay"),
    ("run", "average", "ema_decay"),
    ("data", "window", "shuffle_buffer"),
    ("loss", "anchor", "supervised"),
];

/// A setting under its old name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct RenamedSetting {
    /// The table that it is in.
    pub table: &'static str,
    /// Its old key.
    pub old: &'static str,
    /// Its key.
    pub new: &'static str,
}

impl fmt::Display for RenamedSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { table, old, new } = self;
        write!(
            f,
            "[{table}] `{old}` is now `{new}`: this file is read, rename it before {READ_BEFORE}"
        )
    }
}

/// The text with the present keys in place of old ones, and which ones it had. Lines stay where they are, so that faults
/// are told at their line; a text that is not TOML stays as it is.
pub(super) fn with_new_keys(text: &str) -> (String, Vec<RenamedSetting>) {
    let Ok(root) = DeTable::parse(text) else {
        return (text.to_owned(), Vec::new());
    };
    let mut found: Vec<_> = RENAMED
        .iter()
        .filter_map(|&(table, old, new)| {
            let key = key_in(root.get_ref(), table, old)?;
            Some((key.span(), RenamedSetting { table, old, new }))
        })
        .collect();
    // From the end on: what is before stays where it is.
    found.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut renewed = text.to_owned();
    for (span, setting) in &found {
        renewed.replace_range(span.clone(), setting.new);
    }
    found.reverse();
    (
        renewed,
        found.into_iter().map(|(_, setting)| setting).collect(),
    )
}

/// The key of a table as it stands in the text.
fn key_in<'a, 'i>(
    root: &'a DeTable<'i>,
    table: &str,
    key: &str,
) -> Option<&'a Spanned<DeString<'i>>> {
    let DeValue::Table(table) = root.get(table)?.get_ref() else {
        return None;
    };
    let (key, _) = table.get_key_value(key)?;
    Some(key)
}
