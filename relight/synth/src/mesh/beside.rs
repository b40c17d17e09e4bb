//! Files that a mesh's file names: they lie in its folder, or below.

use std::path::{Component, Path, PathBuf};

/// The path of a file that a mesh names; none where it would lie elsewhere.
pub(super) fn file_beside(mesh: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().replace('\\', "/").replace("%20", " ");
    let name = Path::new(&name);
    let mut parts = name.components();
    let lies_below = parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && !has_drive(name);
    (lies_below && name.file_name().is_some()).then(|| mesh.with_file_name(name))
}

/// `C:` and the schemes of addresses.
fn has_drive(name: &Path) -> bool {
    name.to_string_lossy().contains(':')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_lie_in_the_folder_of_the_mesh_or_below() {
        let beside = |name| file_beside(Path::new("meshes/a.obj"), name);
        for (name, path) in [
            ("a.png", "meshes/a.png"),
            ("./maps/a%20b.png", "meshes/./maps/a b.png"),
            (" maps\\a.png", "meshes/maps/a.png"),
        ] {
            assert_eq!(beside(name), Some(PathBuf::from(path)));
        }
        for name in [
            "",
            ".",
            "..",
            "../a.png",
            "maps/../../a.png",
            "/etc/passwd",
            "C:\\a.png",
            "http://a/b.png",
        ] {
            assert_eq!(beside(name), None, "{name}");
        }
    }
}
