//! Wavefront files, by `tobj`.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::raw::RawMesh;
use crate::SynthError;

/// All models of the file as one surface. Materials are not read.
pub(super) fn read(path: &Path) -> Result<RawMesh, SynthError> {
    let file = File::open(path).map_err(SynthError::read(path))?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(file), &options, no_materials)
        .map_err(|fault| SynthError::Mesh {
            path: path.to_owned(),
            reason: fault.to_string(),
        })?;
    let mut raw = RawMesh::default();
    let mut all_textured = true;
    for model in &models {
        all_textured &= append(&mut raw, &model.mesh);
    }
    if !all_textured {
        raw.texture.clear();
    }
    Ok(raw)
}

/// Adds a model; whether it has texture coordinates for all corners.
fn append(raw: &mut RawMesh, mesh: &tobj::Mesh) -> bool {
    let first = raw.positions.len() as u32;
    let places = mesh.positions.chunks_exact(3);
    raw.positions
        .extend(places.map(|p| Vec3::new(p[0], p[1], p[2])));
    let shifted = |corner: u32| corner.saturating_add(first);
    let corners = mesh.indices.chunks_exact(3);
    raw.triangles
        .extend(corners.map(|c| [c[0], c[1], c[2]].map(shifted)));
    let coordinate = |index: u32| {
        let at = 2 * index as usize;
        let pair = mesh.texcoords.get(at..at + 2)?;
        Some(Vec2::new(pair[0], pair[1])).filter(|c| c.is_finite())
    };
    let before = raw.texture.len();
    for c in mesh.texcoord_indices.chunks_exact(3) {
        let [Some(a), Some(b), Some(c)] = [c[0], c[1], c[2]].map(coordinate) else {
            return false;
        };
        raw.texture.push([a, b, c]);
    }
    raw.texture.len() - before == mesh.indices.len() / 3
}

#[cfg(test)]
mod tests {
    use crate::{Mesh, SynthError};

    fn read(text: &str) -> Result<Mesh, SynthError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, text).unwrap();
        Mesh::read(&path)
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn polygons_become_triangles_and_keep_their_texture_coordinates() {
        let textured = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nmtllib missing.mtl\nf 1/1 2/2 3/3 4/4\n";
        let mesh = read(&format!("{SQUARE}{textured}")).unwrap();
        assert_eq!(mesh.triangles().len(), 2);
        for (corners, coordinates) in mesh.triangles().iter().zip(mesh.texture().unwrap()) {
            for (&vertex, uv) in corners.iter().zip(coordinates) {
                let position = mesh.positions()[vertex as usize];
                assert_eq!(position.x > 0.0, uv.x > 0.5);
                assert_eq!(position.y > 0.0, uv.y > 0.5);
            }
        }
    }

    #[test]
    fn parts_become_one_surface_without_texture_coordinates_where_there_are_none() {
        let mesh = read(&format!("{SQUARE}o a\nf 1 2 3\no b\nf 1 3 4\n")).unwrap();
        assert!(mesh.texture().is_none());
        assert_eq!((mesh.triangles().len(), mesh.positions().len()), (2, 4));
    }

    #[test]
    fn a_damaged_file_is_an_error_that_names_it_and_what_is_wrong() {
        for text in [
            "",
            SQUARE,
            "v 0 0 x\nf 1 1 1\n",
            "v 0 0 0\nf 1 2 3\n",
            "f 1 2 3\n",
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains("a.obj"), "{error}");
        }
        let nan = read("v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").unwrap_err();
        assert!(nan.to_string().contains("finite"), "{nan}");
    }
}
