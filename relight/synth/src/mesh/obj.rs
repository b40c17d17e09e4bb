//! Wavefront files and the materials beside them, by `tobj`.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::beside::file_beside;
use super::material::{DULL, MeshMaterial};
use super::raw::RawMesh;
use crate::SynthError;
use crate::texture::TextureImage;

/// All models of the file as one surface, with the materials of the `.mtl` file that it names, if that is there.
pub(super) fn read(path: &Path) -> Result<RawMesh, SynthError> {
    let file = File::open(path).map_err(SynthError::read(path))?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let damaged = |reason: String| SynthError::Mesh {
        path: path.to_owned(),
        reason,
    };
    let beside = |named: &Path| {
        let file =
            file_beside(path, &named.to_string_lossy()).and_then(|path| File::open(path).ok());
        let file = file.ok_or(tobj::LoadError::OpenFileFailed)?;
        tobj::load_mtl_buf(&mut BufReader::new(file))
    };
    let (models, materials) = tobj::load_obj_buf(&mut BufReader::new(file), &options, beside)
        .map_err(|fault| damaged(fault.to_string()))?;
    let mut raw = RawMesh::default();
    match materials {
        Ok(materials) => {
            let all = materials.iter().map(|one| material(path, one));
            raw.materials.all = all.collect::<Result<_, _>>().map_err(damaged)?;
        }
        // Many files name materials that nobody has kept: the surface is there all the same.
        Err(tobj::LoadError::OpenFileFailed) => {}
        Err(fault) => return Err(damaged(format!("its materials are damaged: {fault}"))),
    }
    let mut all_textured = true;
    for model in &models {
        all_textured &= append(&mut raw, &model.mesh);
    }
    if !all_textured {
        raw.texture.clear();
    }
    Ok(raw)
}

/// What a material says, with its picture read.
fn material(path: &Path, of: &tobj::Material) -> Result<MeshMaterial, String> {
    let picture = match of.diffuse_texture.as_deref() {
        None => None,
        Some(name) => Some(picture(path, name)?),
    };
    let is_dull = of.specular.is_none_or(|specular| specular == [0.0; 3]);
    // From the exponent of Blinn and Phong's highlight to roughness, as a highlight is made of roughness.
    let roughness = of.shininess.filter(|_| !is_dull);
    let roughness = roughness.map_or(DULL, |exponent| {
        (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25)
    });
    // Beside a picture, programs write a colour that they do not multiply by.
    let colour = of.diffuse.filter(|_| picture.is_none());
    let colour = colour.filter(|colour| colour.iter().all(|c| c.is_finite()));
    Ok(MeshMaterial {
        colour: colour.map_or(Vec3::ONE, Vec3::from_array),
        picture,
        roughness,
        ..MeshMaterial::default()
    })
}

fn picture(path: &Path, name: &str) -> Result<TextureImage, String> {
    let unusable = |why: String| format!("its picture {name:?} {why}");
    let file = file_beside(path, name)
        .ok_or_else(|| unusable("does not lie in the folder of the mesh".to_owned()))?;
    let bytes =
        std::fs::read(file).map_err(|fault| unusable(format!("cannot be read: {fault}")))?;
    TextureImage::of_colours(&bytes).map_err(|fault| unusable(format!("is damaged: {fault}")))
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
    let material = mesh.material_id.map_or(u32::MAX, |number| number as u32);
    let count = mesh.indices.len() / 3;
    raw.materials
        .of_triangle
        .extend(std::iter::repeat_n(material, count));
    let before = raw.texture.len();
    for c in mesh.texcoord_indices.chunks_exact(3) {
        let [Some(a), Some(b), Some(c)] = [c[0], c[1], c[2]].map(coordinate) else {
            return false;
        };
        raw.texture.push([a, b, c]);
    }
    raw.texture.len() - before == count
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
    fn materials_and_their_pictures_are_read_from_the_files_beside() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("maps")).unwrap();
        let picture = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb([255 * x as u8, 0, 255]));
        picture.save(at("maps/a.png")).unwrap();
        let materials = "newmtl a\nKd 0.6 0.6 0.6\nKs 1 1 1\nNs 30\nmap_Kd maps\\a.png\nnewmtl b\nKd 0.25 0.5 1\n";
        std::fs::write(at("a.mtl"), materials).unwrap();
        let text = format!(
            "mtllib a.mtl\n{SQUARE}vt 0.25 0.5\nvt 0.75 0.5\nusemtl a\nf 1/1 2/2 3/2\nusemtl b\nf 1/1 3/1 4/1\n"
        );
        std::fs::write(at("a.obj"), &text).unwrap();
        let mesh = Mesh::read(&at("a.obj")).unwrap();
        let look = |triangle, u| {
            mesh.own_surface(triangle, Some(glam::Vec2::new(u, 0.5)))
                .unwrap()
        };
        assert_eq!(look(0, 0.25).colour, glam::Vec3::Z);
        assert_eq!(look(0, 0.75).colour, glam::Vec3::new(1.0, 0.0, 1.0));
        assert!((look(0, 0.25).roughness - 0.5).abs() < 1e-6);
        assert_eq!(look(1, 0.3).colour, glam::Vec3::new(0.25, 0.5, 1.0));
        assert_eq!(look(1, 0.3).roughness, 1.0);
        std::fs::write(at("maps/a.png"), "no picture").unwrap();
        let error = Mesh::read(&at("a.obj")).unwrap_err().to_string();
        assert!(
            error.contains("a.png") && error.contains("damaged"),
            "{error}"
        );
        for (name, told) in [("../a.png", "in the folder"), ("b.png", "cannot be read")] {
            std::fs::write(at("a.mtl"), format!("newmtl a\nmap_Kd {name}\n")).unwrap();
            let error = Mesh::read(&at("a.obj")).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(told), "{error}");
        }
        std::fs::remove_file(at("a.mtl")).unwrap();
        assert!(
            Mesh::read(&at("a.obj"))
                .unwrap()
                .own_surface(0, None)
                .is_none()
        );
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
