//! A surface to light: the maps of an object.

use crate::image::{Extent, ImageError, Linear, Planes, Rgb, check_extent};
use crate::light::Normals;

/// How a surface shines: specular reflectance s_p, one a channel, and smoothness α, the exponent of
/// Blinn and Phong, above 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Gloss {
    reflectance: Planes<3>,
    smoothness: Planes<1>,
}

/// The least smoothness: lower values are raised to it.
const MIN_SMOOTHNESS: f32 = 0.01;

impl Gloss {
    /// The gloss of these maps.
    ///
    /// # Errors
    /// If they differ in size.
    pub fn new(reflectance: Planes<3>, smoothness: Planes<1>) -> Result<Self, ImageError> {
        check_extent(
            "map of smoothness",
            smoothness.extent(),
            reflectance.extent(),
        )?;
        Ok(Self {
            reflectance,
            smoothness: smoothness.map(|alpha| alpha.max(MIN_SMOOTHNESS)),
        })
    }

    /// The same gloss everywhere.
    pub fn even(extent: Extent, reflectance: [f32; 3], smoothness: f32) -> Self {
        Self {
            reflectance: Planes::filled(extent, reflectance),
            smoothness: Planes::filled(extent, [smoothness.max(MIN_SMOOTHNESS)]),
        }
    }

    /// s_p.
    pub const fn reflectance(&self) -> &Planes<3> {
        &self.reflectance
    }

    /// α.
    pub const fn smoothness(&self) -> &Planes<1> {
        &self.smoothness
    }

    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.reflectance.extent()
    }
}

/// The maps of an object, all of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    normals: Normals,
    albedo: Rgb<Linear>,
    gloss: Option<Gloss>,
}

impl Surface {
    /// An object of these maps; without `gloss` it is diffuse.
    ///
    /// # Errors
    /// If they differ in size.
    pub fn new(
        normals: Normals,
        albedo: Rgb<Linear>,
        gloss: Option<Gloss>,
    ) -> Result<Self, ImageError> {
        check_extent("map of albedo", albedo.planes().extent(), normals.extent())?;
        if let Some(gloss) = &gloss {
            check_extent("map of gloss", gloss.extent(), normals.extent())?;
        }
        Ok(Self {
            normals,
            albedo,
            gloss,
        })
    }

    /// The same object with another gloss.
    ///
    /// # Errors
    /// If the gloss has another size.
    pub fn with_gloss(self, gloss: Option<Gloss>) -> Result<Self, ImageError> {
        Self::new(self.normals, self.albedo, gloss)
    }

    /// The normals.
    pub const fn normals(&self) -> &Normals {
        &self.normals
    }

    /// The diffuse reflectance A, 0 to 1.
    pub const fn albedo(&self) -> &Rgb<Linear> {
        &self.albedo
    }

    /// The gloss, if there is any.
    pub const fn gloss(&self) -> Option<&Gloss> {
        self.gloss.as_ref()
    }

    /// Width and height.
    pub const fn extent(&self) -> Extent {
        self.normals.extent()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_of_different_sizes_are_refused_by_name() {
        let (small, large) = (Extent::new(2, 2), Extent::new(3, 2));
        let normals = || Normals::new(Planes::zeros(small));
        let albedo = |extent| Rgb::new(Planes::zeros(extent));
        let error = Surface::new(normals(), albedo(large), None).unwrap_err();
        for named in ["albedo", "3 x 2", "2 x 2"] {
            assert!(error.to_string().contains(named), "{named}: {error}");
        }
        let gloss = Gloss::even(large, [0.5; 3], 20.0);
        assert!(Surface::new(normals(), albedo(small), Some(gloss)).is_err());
        assert!(Gloss::new(Planes::zeros(small), Planes::zeros(large)).is_err());
    }
}
