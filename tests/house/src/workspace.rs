//! The packages, as cargo describes them: no folder names stand in the check.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;

use crate::error::HouseError;

/// A package of the workspace, or one that the workspace excludes because it has its own.
#[derive(Debug, Deserialize)]
pub(crate) struct Package {
    /// The name in its manifest.
    pub(crate) name: String,
    /// The manifest's path.
    pub(crate) manifest_path: PathBuf,
    /// What is built of it.
    pub(crate) targets: Vec<Target>,
    /// All that it depends on.
    pub(crate) dependencies: Vec<Dependency>,
}

/// A library, program, test, example or benchmark.
#[derive(Debug, Deserialize)]
pub(crate) struct Target {
    /// Its name.
    pub(crate) name: String,
    kind: Vec<String>,
    /// The file of its root module.
    pub(crate) src_path: PathBuf,
}

/// A dependency in a manifest.
#[derive(Debug, Deserialize)]
pub(crate) struct Dependency {
    /// The package.
    pub(crate) name: String,
    /// `dev` or `build`, or nothing.
    kind: Option<String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Manifest {
    workspace: Option<WorkspaceTable>,
}

#[derive(Deserialize)]
struct WorkspaceTable {
    #[serde(default)]
    exclude: Vec<String>,
}

impl Package {
    /// The folder of its manifest.
    pub(crate) fn folder(&self) -> &Path {
        self.manifest_path.parent().unwrap_or(Path::new(""))
    }

    /// Its library and programs.
    pub(crate) fn shipped_targets(&self) -> impl Iterator<Item = &Target> {
        self.targets
            .iter()
            .filter(|target| target.is_library() || target.is_program())
    }
}

impl Target {
    /// Whether other crates can import it.
    pub(crate) fn is_library(&self) -> bool {
        let library = ["lib", "rlib", "dylib", "cdylib", "staticlib", "proc-macro"];
        self.kind
            .iter()
            .any(|kind| library.contains(&kind.as_str()))
    }

    fn is_program(&self) -> bool {
        self.kind.iter().any(|kind| kind == "bin")
    }
}

impl Dependency {
    /// Whether it stands under `[dependencies]`, for any system.
    pub(crate) fn is_normal(&self) -> bool {
        self.kind.is_none()
    }
}

/// The packages of the workspace at `root` and those in the folders that it excludes.
pub(crate) fn packages(root: &Path) -> Result<Vec<Package>, HouseError> {
    let manifest = root.join("Cargo.toml");
    let mut packages = packages_of(&manifest)?;
    for folder in excluded(&manifest)? {
        let manifest = root.join(folder).join("Cargo.toml");
        if manifest.exists() {
            packages.extend(packages_of(&manifest)?);
        }
    }
    Ok(packages)
}

fn packages_of(manifest: &Path) -> Result<Vec<Package>, HouseError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
    let output = Command::new(cargo)
        .args([
            "metadata",
            "--no-deps",
            "--format-version",
            "1",
            "--manifest-path",
        ])
        .arg(manifest)
        .output()
        .map_err(HouseError::StartCargo)?;
    if !output.status.success() {
        return Err(HouseError::Metadata {
            manifest: manifest.to_owned(),
            message: String::from_utf8_lossy(&output.stderr).trim().to_owned(),
        });
    }
    serde_json::from_slice::<Metadata>(&output.stdout)
        .map(|metadata| metadata.packages)
        .map_err(|source| HouseError::MetadataFormat {
            manifest: manifest.to_owned(),
            source,
        })
}

fn excluded(manifest: &Path) -> Result<Vec<String>, HouseError> {
    let text = std::fs::read_to_string(manifest).map_err(|source| HouseError::Read {
        path: manifest.to_owned(),
        source,
    })?;
    let manifest: Manifest = toml::from_str(&text).map_err(|source| HouseError::Manifest {
        path: manifest.to_owned(),
        source: Box::new(source),
    })?;
    Ok(manifest
        .workspace
        .map(|workspace| workspace.exclude)
        .unwrap_or_default())
}
