//! Files that a mesh's file names, in its folder or below. Names are those of the computer on which it was written,
//! whose letters may differ in case and whose folders may be others.

use std::fs;
use std::path::{Component, Path, PathBuf};

use percent_encoding::percent_decode_str;

/// The file at an address in a glTF file, relative to it; `None` if it does not exist.
pub(super) fn by_address(mesh: &Path, address: &str) -> Option<PathBuf> {
    let decoded = percent_decode_str(address).decode_utf8().ok();
    // Some programs do not encode what a file has of per cent signs.
    let names = decoded.as_deref().into_iter().chain([address]);
    names.filter_map(|name| within(mesh, name)).next()
}

/// The file at a name in a Wavefront file, relative to it; `None` if it does not exist. Such
/// names are often paths of another computer: then the file is looked for in the folder of the mesh.
pub(super) fn by_name(mesh: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim();
    within(mesh, name).or_else(|| within(mesh, name.rsplit(['/', '\\']).next()?))
}

/// The file of a name in the folder of the mesh or below.
fn within(mesh: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    // A colon: of a drive, or of an address on the network.
    if name.contains(':') {
        return None;
    }
    let mut path = mesh.parent()?.to_owned();
    for part in Path::new(&name).components() {
        match part {
            Component::CurDir => {}
            Component::Normal(part) => path = member(path, part.to_str()?)?,
            _ => return None,
        }
    }
    path.is_file().then_some(path)
}

/// What has this name in a folder, or the only one whose name differs in case only.
fn member(folder: PathBuf, name: &str) -> Option<PathBuf> {
    let exact = folder.join(name);
    if exact.exists() {
        return Some(exact);
    }
    // The folder of a mesh that is named without one.
    let listed = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        &folder
    };
    let lower = name.to_lowercase();
    let mut alike = fs::read_dir(listed)
        .ok()?
        .flatten()
        .map(|entry| entry.file_name())
        .filter(|found| found.to_string_lossy().to_lowercase() == lower);
    let found = alike.next()?;
    alike.next().is_none().then(|| folder.join(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        folder
    }

    #[test]
    fn files_lie_in_the_folder_of_the_mesh_or_below() {
        let folder = folder_with(&["m/a.png", "m/maps/k\u{e4}se b.png", "m/a%20b.png", "c.png"]);
        let mesh = folder.path().join("m/a.gltf");
        for (address, path) in [
            ("a.png", "m/a.png"),
            ("A.PNG", "m/a.png"),
            ("./maps/k%C3%A4se%20b.png", "m/maps/k\u{e4}se b.png"),
            ("maps\\k\u{e4}se b.png", "m/maps/k\u{e4}se b.png"),
            ("a%20b.png", "m/a%20b.png"),
        ] {
            let right = folder.path().join(path);
            assert_eq!(by_address(&mesh, address), Some(right), "{address}");
        }
        for address in [
            "",
            ".",
            "..",
            "maps",
            "../c.png",
            "maps/../../c.png",
            "%2e%2e/c.png",
            "/etc/passwd",
            "http://a/b.png",
            "%ff",
            "b.png",
        ] {
            assert_eq!(by_address(&mesh, address), None, "{address}");
        }
    }

    #[test]
    fn files_of_another_computer_are_looked_for_beside_the_mesh() {
        let folder = folder_with(&["a.png", "Maps/B c.PNG", "two.png", "Two.png"]);
        let mesh = folder.path().join("a.obj");
        for (name, path) in [
            (" maps\\b c.png\t", "Maps/B c.PNG"),
            ("C:\\Users\\me\\a.png", "a.png"),
            ("/home/me/a.png", "a.png"),
            ("../a.png", "a.png"),
            ("textures/a.png", "a.png"),
            ("two.png", "two.png"),
        ] {
            let right = folder.path().join(path);
            assert_eq!(by_name(&mesh, name), Some(right), "{name}");
        }
        // Either could be meant.
        for name in ["", "..", "a/..", "TWO.png", "C:", "no.png"] {
            assert_eq!(by_name(&mesh, name), None, "{name}");
        }
    }
}
