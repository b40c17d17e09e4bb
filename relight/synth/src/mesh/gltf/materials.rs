//! The materials of a glTF file with their pictures.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};

use super::document::{Material, TextureInfo};
use super::file::File;
use crate::mesh::material::{MeshMaterial, PlacedPicture};
use crate::texture::{PictureKind, TextureImage};

/// The materials that are used, and plain ones in place of the others, so that numbers stay as they are. Pictures that cannot
/// be used are left out.
pub(super) fn read(
    file: &File<'_>,
    used: &BTreeSet<usize>,
    left_out: &mut Vec<String>,
) -> Vec<MeshMaterial> {
    let mut pictures = Pictures {
        file,
        read: HashMap::new(),
        left_out,
    };
    let numbered = file.document.materials.iter().enumerate();
    let material = |(number, one)| {
        if used.contains(&number) {
            pictures.material(one)
        } else {
            MeshMaterial::default()
        }
    };
    numbered.map(material).collect()
}

/// The pictures of a file's materials, each read once.
struct Pictures<'a> {
    file: &'a File<'a>,
    /// By number and type of values; `None` for those that cannot be used.
    read: HashMap<(usize, PictureKind), Option<Arc<TextureImage>>>,
    left_out: &'a mut Vec<String>,
}

impl Pictures<'_> {
    fn material(&mut self, of: &Material) -> MeshMaterial {
        let colours = of.colours();
        let picture = colours.and_then(|info| self.picture(info, PictureKind::Colours));
        if let Some(glossy) = &of.extensions.glossy {
            return MeshMaterial {
                colour: colour(glossy.diffuse_factor),
                picture,
                roughness: 1.0 - glossy.glossiness_factor.unwrap_or(1.0),
                ..MeshMaterial::default()
            };
        }
        let surface = &of.pbr_metallic_roughness;
        let plain = MeshMaterial {
            colour: colour(surface.base_color_factor),
            picture,
            ..MeshMaterial::default()
        };
        // Its colours are those of a photograph, as scans have them.
        if of.extensions.unlit.is_some() {
            return plain;
        }
        MeshMaterial {
            roughness: surface.roughness_factor.unwrap_or(1.0),
            metallic: surface.metallic_factor.unwrap_or(1.0),
            factors: of.factors().and_then(|info| self.factors(of, info)),
            ..plain
        }
    }

    fn factors(&mut self, of: &Material, info: &TextureInfo) -> Option<PlacedPicture> {
        if info.coordinates() == of.coordinates() {
            return self.picture(info, PictureKind::Numbers);
        }
        let what = "its picture of roughness and metal lies on other texture coordinates than that of its colours, and only \
                    those are read";
        self.leave_out(what.to_owned());
        None
    }

    fn picture(&mut self, info: &TextureInfo, kind: PictureKind) -> Option<PlacedPicture> {
        let number = self.source(info.index).map_err(|what| self.leave_out(what));
        let key = (number.ok()?, kind);
        if !self.read.contains_key(&key) {
            let read = self.image(key).map(Arc::new);
            let read = read.map_err(|what| self.leave_out(what)).ok();
            self.read.insert(key, read);
        }
        let image = self.read.get(&key)?.as_ref()?;
        Some(PlacedPicture {
            image: Arc::clone(image),
            placed: placed(info),
        })
    }

    /// Each thing once, as two pictures may have one file.
    fn leave_out(&mut self, what: String) {
        if !self.left_out.contains(&what) {
            self.left_out.push(what);
        }
    }

    /// The number of a texture's picture. A PNG or JPEG comes first, which every program can read.
    fn source(&self, texture: usize) -> Result<usize, String> {
        let textures = &self.file.document.textures;
        let of = textures
            .get(texture)
            .ok_or_else(|| format!("its texture {texture} of {} is missing", textures.len()))?;
        let webp = of.extensions.webp.as_ref().and_then(|webp| webp.source);
        of.source.or(webp).ok_or_else(|| {
            let why = match of.extensions.others.keys().next() {
                Some(extension) => format!("is in an unsupported format ({extension})"),
                None => "has no picture".to_owned(),
            };
            format!("its texture {texture}, counted from 0, {why}")
        })
    }

    fn image(&self, (number, kind): (usize, PictureKind)) -> Result<TextureImage, String> {
        let unusable = |why: &str| format!("its picture {} {why}", self.name(number));
        let bytes = self.file.picture(number).map_err(|why| unusable(&why))?;
        TextureImage::decoded(&bytes, kind)
            .map_err(|fault| unusable(&format!("cannot be used: {fault}")))
    }

    /// How a picture is named to people.
    fn name(&self, number: usize) -> String {
        let image = self.file.document.images.get(number);
        match image.and_then(|image| image.name.as_ref()) {
            Some(name) => format!("{number} ({name})"),
            None => format!("{number}, counted from 0,"),
        }
    }
}

/// A colour without its opacity.
fn colour(factor: Option<[f32; 4]>) -> Vec3 {
    factor.map_or(Vec3::ONE, |factor| Vec3::from_slice(&factor))
}

/// From texture coordinates, whose v runs upwards here, to places of a picture.
fn placed(info: &TextureInfo) -> Option<Affine2> {
    let transform = info.extensions.transform.as_ref()?;
    let scale = transform.scale.map_or(Vec2::ONE, Vec2::from);
    let offset = Vec2::from(transform.offset);
    // With v downwards, the angle runs the other way; the spec's example has it reversed, programs do not.
    let placed = Affine2::from_scale_angle_translation(scale, -transform.rotation, offset);
    let upwards = Affine2::from_scale_angle_translation(Vec2::new(1.0, -1.0), 0.0, Vec2::Y);
    (placed != Affine2::IDENTITY).then(|| upwards * placed * upwards)
}
