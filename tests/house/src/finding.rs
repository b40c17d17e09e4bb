//! What the check reports.

use std::fmt;

/// One thing that is not as it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Finding {
    /// The finding, on one line.
    pub(crate) what: String,
    /// What helps to mend it, a line each.
    pub(crate) details: Vec<String>,
}

impl Finding {
    /// A finding that its line says in full.
    pub(crate) fn new(what: String) -> Self {
        Self {
            what,
            details: Vec::new(),
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "house: {}", self.what)?;
        for detail in &self.details {
            write!(f, "\n    {detail}")?;
        }
        Ok(())
    }
}
