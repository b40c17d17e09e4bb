//! The surface from a mesh's own file: colours, pictures of them, roughness and metal, as in glTF 2.0. Knows nothing of
//! light.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::texture::{PictureKind, TextureImage};

/// Roughness where a file has none: a plain, dull surface.
pub(crate) const DULL: f32 = 1.0;

/// One material of a mesh. `I`: its pictures, or their names.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct MeshMaterial<I = Arc<TextureImage>> {
    /// Linear red, green and blue, by which the picture is multiplied.
    pub(crate) colour: Vec3,
    /// The colours from place to place.
    pub(crate) picture: Option<PlacedPicture<I>>,
    /// 0 a mirror, 1 dull.
    pub(crate) roughness: f32,
    /// 0 paint, 1 metal.
    pub(crate) metallic: f32,
    /// Factors of roughness (green) and metal (blue) from place to place.
    pub(crate) factors: Option<PlacedPicture<I>>,
}

/// A picture, and the mapping of texture coordinates onto it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct PlacedPicture<I = Arc<TextureImage>> {
    pub(crate) image: I,
    /// From texture coordinates to places of the picture, where they differ.
    pub(crate) placed: Option<Affine2>,
}

impl PlacedPicture {
    /// The value at texture coordinates; without them the mean of all.
    fn at(&self, coordinates: Option<Vec2>) -> Vec3 {
        let place = |at: Vec2| self.placed.map_or(at, |placed| placed.transform_point2(at));
        match coordinates.map(place).filter(|place| place.is_finite()) {
            Some(place) => self.image.at(place),
            None => self.image.mean(),
        }
    }
}

/// The materials of a mesh, and which triangle has which.
#[derive(Debug, Clone, Default)]
pub(crate) struct MeshMaterials {
    pub(crate) all: Vec<MeshMaterial>,
    /// For each triangle.
    pub(crate) of_triangle: Vec<u32>,
}

/// A surface's own look at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SurfaceSample {
    /// Linear red, green and blue, 0..=1: the albedo of paint, the highlights' colour of metal.
    pub colour: Vec3,
    /// 0 a mirror, 1 dull.
    pub roughness: f32,
    /// 0 paint, 1 metal.
    pub metallic: f32,
}

impl Default for MeshMaterial {
    fn default() -> Self {
        Self {
            colour: Vec3::ONE,
            picture: None,
            roughness: DULL,
            metallic: 0.0,
            factors: None,
        }
    }
}

impl<I> MeshMaterial<I> {
    /// The same with other pictures.
    ///
    /// # Errors
    /// That of `picture`.
    pub(crate) fn with_pictures<J>(
        &self,
        mut picture: impl FnMut(&I, PictureKind) -> Result<J, String>,
    ) -> Result<MeshMaterial<J>, String> {
        let mut placed = |of: &Option<PlacedPicture<I>>, kind| {
            let of = of.as_ref();
            of.map(|of| {
                Ok::<_, String>(PlacedPicture {
                    image: picture(&of.image, kind)?,
                    placed: of.placed,
                })
            })
            .transpose()
        };
        Ok(MeshMaterial {
            colour: self.colour,
            picture: placed(&self.picture, PictureKind::Colours)?,
            roughness: self.roughness,
            metallic: self.metallic,
            factors: placed(&self.factors, PictureKind::Numbers)?,
        })
    }
}

impl MeshMaterial {
    /// The look at a place of the pictures, under a colour that multiplies them; without texture coordinates,
    /// of the pictures' means.
    fn at(&self, place: Option<Vec2>, paint: Vec3) -> SurfaceSample {
        let looked_up = |picture: &PlacedPicture| picture.at(place);
        let of = |picture: &Option<PlacedPicture>| picture.as_ref().map_or(Vec3::ONE, looked_up);
        let factors = of(&self.factors);
        SurfaceSample {
            colour: (self.colour * of(&self.picture) * paint).clamp(Vec3::ZERO, Vec3::ONE),
            roughness: (self.roughness * factors.y).clamp(0.0, 1.0),
            metallic: (self.metallic * factors.z).clamp(0.0, 1.0),
        }
    }
}

impl MeshMaterials {
    /// Adds a triangle of a material.
    pub(crate) fn push(&mut self, material: Option<usize>) {
        self.of_triangle
            .push(material.map_or(u32::MAX, |number| number as u32));
    }

    /// The materials that triangles have.
    pub(crate) fn used(&self) -> BTreeSet<usize> {
        self.of_triangle.iter().map(|&one| one as usize).collect()
    }

    /// Whether they have more than one colour for all, which programs write for an object without colours.
    pub(crate) fn have_variation(&self) -> bool {
        let used = self.used();
        let mut used = used.iter().filter_map(|&one| self.all.get(one));
        let Some(first) = used.next() else {
            return false;
        };
        let mut used = used.chain([first]);
        used.any(|one| one.picture.is_some() || one.colour != first.colour)
    }

    /// The look of a triangle at a place of its pictures, under a colour that multiplies them.
    pub(crate) fn at(&self, triangle: usize, place: Option<Vec2>, paint: Vec3) -> SurfaceSample {
        let number = self.of_triangle.get(triangle).copied().unwrap_or(u32::MAX);
        match self.all.get(number as usize) {
            Some(material) => material.at(place, paint),
            None => MeshMaterial::default().at(None, paint),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(image: TextureImage) -> PlacedPicture {
        PlacedPicture {
            image: image.into(),
            placed: None,
        }
    }

    fn picture() -> PlacedPicture {
        placed(TextureImage::from_fn(2, 1, |x, _| Vec3::splat(x as f32)))
    }

    #[test]
    fn pictures_are_multiplied_by_the_colour_and_looked_up_where_there_are_coordinates() {
        let material = MeshMaterial {
            colour: Vec3::new(0.5, 1.0, 2.0),
            picture: Some(picture()),
            roughness: 0.8,
            metallic: 1.0,
            factors: Some(placed(TextureImage::from_fn(1, 1, |_, _| {
                Vec3::new(9.0, 0.5, 0.25)
            }))),
        };
        let right = material.at(Some(Vec2::new(0.75, 0.5)), Vec3::ONE);
        assert_eq!(right.colour, Vec3::new(0.5, 1.0, 1.0));
        assert_eq!((right.roughness, right.metallic), (0.4, 0.25));
        let mean = |paint| material.at(None, paint).colour;
        assert_eq!(mean(Vec3::ONE), Vec3::new(0.25, 0.5, 1.0));
        assert_eq!(mean(Vec3::new(1.0, 0.5, 0.0)), Vec3::new(0.25, 0.25, 0.0));
    }

    #[test]
    fn a_picture_that_is_moved_is_looked_up_elsewhere() {
        let moved = Affine2::from_translation(Vec2::new(0.5, 0.0));
        let material = MeshMaterial {
            picture: Some(PlacedPicture {
                placed: Some(moved),
                ..picture()
            }),
            ..MeshMaterial::default()
        };
        let right = material.at(Some(Vec2::new(0.25, 0.5)), Vec3::ONE);
        assert_eq!(right.colour, Vec3::ONE);
    }

    #[test]
    fn one_colour_for_all_tells_nothing_and_two_or_a_picture_do() {
        let with = |all: Vec<MeshMaterial>| {
            let mut materials = MeshMaterials::default();
            (0..all.len()).for_each(|number| materials.push(Some(number)));
            MeshMaterials { all, ..materials }
        };
        let colour = |colour| MeshMaterial {
            colour,
            ..MeshMaterial::default()
        };
        assert!(!MeshMaterials::default().have_variation());
        assert!(!with(vec![colour(Vec3::X), colour(Vec3::X)]).have_variation());
        assert!(with(vec![colour(Vec3::X), colour(Vec3::Y)]).have_variation());
        let painted = MeshMaterial {
            picture: Some(picture()),
            ..MeshMaterial::default()
        };
        assert!(with(vec![painted]).have_variation());
    }
}
