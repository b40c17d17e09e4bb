//! How an object shines, and what its material becomes.

use relight_core::render::mirror_reflectance;

/// How an object shines all over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectGloss {
    /// Specular reflectance s_p, red, green and blue.
    pub reflectance: [f32; 3],
    /// Smoothness α, above 0.
    pub smoothness: f32,
}

impl ObjectGloss {
    /// White gloss that reflects this part of even light towards a viewer at a right angle.
    pub fn from_part(part: f32, smoothness: f32) -> Self {
        Self {
            reflectance: [mirror_reflectance(part, smoothness); 3],
            smoothness,
        }
    }
}

/// Changes of the material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialChange {
    /// What the albedo is multiplied with.
    pub tint: [f32; 3],
    /// Gloss in place of the estimated one; a reflectance of 0 makes the object diffuse.
    pub gloss: Option<ObjectGloss>,
}

impl Default for MaterialChange {
    fn default() -> Self {
        Self {
            tint: [1.0; 3],
            gloss: None,
        }
    }
}
