//! `relit-house`: checks the structure that docs/architecture.md promises: which crates know which, and that no folders of a
//! crate import each other in a circle.

mod crate_table;
mod folders;

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use serde_json::Value;

use crate_table::CrateFacts;

/// The file with the table of crates.
const TABLE: &str = "docs/architecture.md";

fn main() -> ExitCode {
    let root = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from("."), PathBuf::from);
    let (lines, code) = match findings(&root) {
        Ok(findings) if findings.is_empty() => (findings, ExitCode::SUCCESS),
        Ok(findings) => (findings, ExitCode::FAILURE),
        Err(error) => (vec![error], ExitCode::FAILURE),
    };
    for line in lines {
        // Nothing can be done if standard error is closed.
        let _ = writeln!(io::stderr(), "house: {line}");
    }
    code
}

/// What is not as it should be in the workspace at `root`.
fn findings(root: &Path) -> Result<Vec<String>, String> {
    let root = root.canonicalize().map_err(unreadable(root))?;
    let packages = packages(&root)?;
    let table = root.join(TABLE);
    let document = std::fs::read_to_string(&table).map_err(unreadable(&table))?;
    let facts = facts(&root, &packages);
    let mut findings = crate_table::findings(TABLE, &crate_table::rows(&document), &facts);
    for target in packages
        .iter()
        .flat_map(|package| list(&package["targets"]))
    {
        let is_shipped = |kind: &Value| kind != "test" && kind != "bench" && kind != "example";
        if list(&target["kind"]).iter().all(is_shipped) {
            let file = Path::new(text(&target["src_path"]));
            let source = folders::Source::read(file, &|path| std::fs::read_to_string(path))?;
            let circles = source.circles().into_iter();
            findings.extend(circles.map(|circle| format!("{}: {circle}", text(&target["name"]))));
        }
    }
    Ok(findings)
}

fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> String {
    move |error| format!("{} cannot be read: {error}", path.display())
}

/// The packages of the workspace and of the folders that it excludes, as cargo describes them.
fn packages(root: &Path) -> Result<Vec<Value>, String> {
    let manifest = root.join("Cargo.toml");
    let document = std::fs::read_to_string(&manifest).map_err(unreadable(&manifest))?;
    let document: toml::Table = document
        .parse()
        .map_err(|error| format!("{}: {error}", manifest.display()))?;
    let workspace = document.get("workspace");
    let excluded = workspace.and_then(|workspace| workspace.get("exclude")?.as_array());
    let excluded = excluded
        .into_iter()
        .flatten()
        .filter_map(toml::Value::as_str);
    let mut packages = packages_of(&manifest)?;
    for folder in excluded {
        packages.extend(packages_of(&root.join(folder).join("Cargo.toml"))?);
    }
    Ok(packages)
}

fn packages_of(manifest: &Path) -> Result<Vec<Value>, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
    let output = Command::new(cargo)
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .arg("--manifest-path")
        .arg(manifest)
        .output()
        .map_err(|error| format!("cargo cannot be started: {error}"))?;
    let answer: Value = serde_json::from_slice(&output.stdout).map_err(|_| {
        let message = String::from_utf8_lossy(&output.stderr);
        format!(
            "`cargo metadata` fails for {}: {message}",
            manifest.display()
        )
    })?;
    Ok(list(&answer["packages"]).to_vec())
}

/// What the manifests say about the crates.
fn facts(root: &Path, packages: &[Value]) -> Vec<CrateFacts> {
    let is_own = |name: &str| packages.iter().any(|package| package["name"] == name);
    let facts = |package: &Value| {
        let folder = Path::new(text(&package["manifest_path"])).parent();
        let folder = folder.and_then(|folder| folder.strip_prefix(root).ok());
        // A kind is that of dependencies of tests and of the build.
        let dependencies = list(&package["dependencies"]).iter();
        let known = dependencies
            .filter(|dependency| dependency["kind"].is_null())
            .map(|dependency| text(&dependency["name"]))
            .filter(|name| is_own(name));
        CrateFacts {
            name: text(&package["name"]).to_owned(),
            folder: folder.unwrap_or(root).display().to_string(),
            knows: known.map(str::to_owned).collect(),
        }
    };
    packages.iter().map(facts).collect()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}
