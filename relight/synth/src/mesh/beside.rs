//! Files that a mesh's file names: they lie in its folder, or below.

use std::path::{Component, Path, PathBuf};

use percent_encoding::percent_decode_str;

/// The path of a file by the address that glTF has for it; none where it would lie elsewhere.
pub(super) fn file_beside(mesh: &Path, address: &str) -> Option<PathBuf> {
    let name = percent_decode_str(address).decode_utf8().ok()?;
    below(mesh, &name)
}

/// The path of a file by the name that a Wavefront file has for it. Such names are often those of another computer: where the
/// file would lie elsewhere, it is looked for beside the mesh. None where there is no name.
pub(super) fn near(mesh: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().replace('\\', "/");
    below(mesh, &name).or_else(|| below(mesh, name.rsplit('/').next()?))
}

fn below(mesh: &Path, name: &str) -> Option<PathBuf> {
    let path = Path::new(name);
    let mut parts = path.components();
    // A colon: of a drive, or of an address on the network.
    let lies_below = parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && !name.contains([':', '\\']);
    (lies_below && path.file_name().is_some()).then(|| mesh.with_file_name(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MESH: &str = "meshes/a.obj";

    #[test]
    fn files_lie_in_the_folder_of_the_mesh_or_below() {
        let beside = |address| file_beside(Path::new(MESH), address);
        for (address, path) in [
            ("a.png", "meshes/a.png"),
            ("./maps/k%C3%A4se%20b.png", "meshes/./maps/k\u{e4}se b.png"),
        ] {
            assert_eq!(beside(address), Some(PathBuf::from(path)));
        }
        for address in [
            "",
            ".",
            "..",
            "../a.png",
            "maps/../../a.png",
            "%2e%2e/a.png",
            "/etc/passwd",
            "http://a/b.png",
            "%ff",
        ] {
            assert_eq!(beside(address), None, "{address}");
        }
    }

    #[test]
    fn files_of_another_computer_are_looked_for_beside_the_mesh() {
        let near = |name| near(Path::new(MESH), name);
        for (name, path) in [
            (" maps\\a%20b.png", "meshes/maps/a%20b.png"),
            ("C:\\Users\\me\\a.png", "meshes/a.png"),
            ("/home/me/a.png", "meshes/a.png"),
            ("../a.png", "meshes/a.png"),
        ] {
            assert_eq!(near(name), Some(PathBuf::from(path)));
        }
        for name in ["", "..", "a/.."] {
            assert_eq!(near(name), None, "{name}");
        }
    }
}
