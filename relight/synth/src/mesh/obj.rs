//! Wavefront files, by `tobj`, and the materials beside them.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::beside::near;
use super::material::MeshMaterial;
use super::mtl::{self, MtlMaterial};
use super::raw::{NO_TEXTURE, RawMesh};
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
    // `tobj` reads materials where they are named, by a function that may be called several times.
    let (materials, fault) = (RefCell::new(Vec::new()), RefCell::new(None));
    let beside = |named: &Path| {
        let mut known: Vec<MtlMaterial> = Vec::new();
        match text_of_materials(path, named) {
            Ok(text) => known = mtl::materials(&text),
            Err(why) => *fault.borrow_mut() = Some(why),
        }
        let names = (0..).zip(&known);
        let numbers = names.map(|(at, one)| (one.name.clone(), at)).collect();
        let count = known.len();
        materials.borrow_mut().extend(known);
        // `tobj` counts them, and tells which one each model has.
        Ok((vec![tobj::Material::default(); count], numbers))
    };
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(file), &options, beside)
        .map_err(|fault| damaged(fault.to_string()))?;
    if let Some(fault) = fault.take() {
        return Err(damaged(fault));
    }
    let mut raw = RawMesh::default();
    for model in &models {
        append(&mut raw, &model.mesh);
    }
    raw.materials.all = with_pictures(path, &raw, &materials.take()).map_err(damaged)?;
    Ok(raw)
}

/// The text of the materials that a mesh names; none where the file is not there: the surface is there all the same.
fn text_of_materials(path: &Path, named: &Path) -> Result<String, String> {
    let Some(file) = near(path, &named.to_string_lossy()) else {
        return Ok(String::new());
    };
    match std::fs::read(&file) {
        Ok(bytes) => Ok(String::from_utf8_lossy(&bytes).into_owned()),
        Err(fault) if fault.kind() == ErrorKind::NotFound => Ok(String::new()),
        Err(fault) => Err(format!(
            "its materials {} cannot be read: {fault}",
            file.display()
        )),
    }
}

/// The materials with the pictures of those that are used, each file read once.
fn with_pictures(
    path: &Path,
    raw: &RawMesh,
    materials: &[MtlMaterial],
) -> Result<Vec<MeshMaterial>, String> {
    let used = raw.materials.used();
    let mut pictures: HashMap<&str, Arc<TextureImage>> = HashMap::new();
    let mut all = Vec::with_capacity(materials.len());
    for (number, of) in materials.iter().enumerate() {
        let name = of.picture.as_deref().filter(|_| used.contains(&number));
        let picture = match name {
            None => None,
            Some(name) => Some(match pictures.get(name) {
                Some(picture) => Arc::clone(picture),
                None => {
                    let picture = Arc::new(picture(path, name)?);
                    pictures.insert(name, Arc::clone(&picture));
                    picture
                }
            }),
        };
        // Beside a picture, programs write a colour that they do not multiply by.
        let colour = of.colour.filter(|_| picture.is_none());
        all.push(MeshMaterial {
            colour: colour.unwrap_or(Vec3::ONE),
            picture,
            roughness: of.roughness(),
            ..MeshMaterial::default()
        });
    }
    Ok(all)
}

fn picture(path: &Path, name: &str) -> Result<TextureImage, String> {
    let unusable = |why: String| format!("its picture {name:?} {why}");
    let file = near(path, name).ok_or_else(|| unusable("is no file".to_owned()))?;
    let bytes =
        std::fs::read(file).map_err(|fault| unusable(format!("cannot be read: {fault}")))?;
    TextureImage::of_colours(&bytes).map_err(|fault| unusable(format!("cannot be used: {fault}")))
}

/// Adds a model.
fn append(raw: &mut RawMesh, mesh: &tobj::Mesh) {
    let first = raw.positions.len() as u32;
    let places = mesh.positions.chunks_exact(3);
    raw.positions
        .extend(places.map(|p| Vec3::new(p[0], p[1], p[2])));
    let shifted = |corner: u32| corner.saturating_add(first);
    let coordinate = |index: u32| {
        let at = 2 * index as usize;
        let pair = mesh.texcoords.get(at..at + 2)?;
        Some(Vec2::new(pair[0], pair[1]))
    };
    let mut coordinates = mesh.texcoord_indices.chunks_exact(3);
    for corners in mesh.indices.chunks_exact(3) {
        raw.triangles
            .push([corners[0], corners[1], corners[2]].map(shifted));
        let found = coordinates
            .next()
            .and_then(|c| Some([coordinate(c[0])?, coordinate(c[1])?, coordinate(c[2])?]));
        raw.texture.push(found.unwrap_or(NO_TEXTURE));
        raw.materials.push(mesh.material_id);
    }
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
        let look = |triangle, corner: usize| {
            let weights = std::array::from_fn(|at| f32::from(u8::from(at == corner)));
            mesh.own_surface(triangle, weights).unwrap()
        };
        assert_eq!(look(0, 0).colour, glam::Vec3::Z);
        assert_eq!(look(0, 1).colour, glam::Vec3::new(1.0, 0.0, 1.0));
        assert!((look(0, 0).roughness - 0.5).abs() < 1e-6);
        assert_eq!(look(1, 2).colour, glam::Vec3::new(0.25, 0.5, 1.0));
        assert_eq!(look(1, 2).roughness, 1.0);
        std::fs::write(at("maps/a.png"), "no picture").unwrap();
        let error = Mesh::read(&at("a.obj")).unwrap_err().to_string();
        assert!(
            error.contains("a.png") && error.contains("cannot be used"),
            "{error}"
        );
        for name in ["../../c.png", "b.png", "/etc/passwd"] {
            std::fs::write(at("a.mtl"), format!("newmtl a\nmap_Kd {name}\n")).unwrap();
            let error = Mesh::read(&at("a.obj")).unwrap_err().to_string();
            assert!(
                error.contains(name) && error.contains("cannot be read"),
                "{error}"
            );
        }
        // Of a material that no triangle has, it is not missed.
        let spare = "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\nnewmtl c\nmap_Kd b.png\n";
        std::fs::write(at("a.mtl"), spare).unwrap();
        assert!(Mesh::read(&at("a.obj")).unwrap().has_own_surface());
        std::fs::remove_file(at("a.mtl")).unwrap();
        assert!(!Mesh::read(&at("a.obj")).unwrap().has_own_surface());
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
