//! What a card says beside what the data set itself says.

/// What a data set cannot say of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CardFacts {
    /// Its name.
    pub name: String,
    /// Its licence: an SPDX identifier, or a URL.
    pub license: String,
    /// Who made it.
    pub creators: Vec<String>,
    /// Where it is published.
    pub url: String,
    /// What it is.
    pub description: String,
    /// When it is published, YYYY-MM-DD.
    pub published: String,
    /// Its version.
    pub version: String,
    /// How to cite it.
    pub cite: Option<String>,
}

impl CardFacts {
    /// The licence as a URL.
    pub(super) fn license_url(&self) -> String {
        match self.license.contains("://") {
            true => self.license.clone(),
            false => format!("https://spdx.org/licenses/{}.html", self.license),
        }
    }
}

/// A file of the data set with its checksum.
pub(super) struct SummedFile {
    pub(super) name: String,
    pub(super) bytes: u64,
    pub(super) sha256: String,
}
