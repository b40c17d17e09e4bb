//! A buffer together with what blocks its light, under whole lightings.

use super::environment::Sky;
use super::{Lighting, Material, Panoramas, Shaded};
use crate::geometry::{GBuffer, Occluder};
use crate::random::stream;

/// What a camera sees of an object, and what can block light: made once, lit as often as one
/// likes. Slow results are kept: the buffer, the tree for rays, and how open each pixel is.
pub struct SyntheticScene {
    buffer: GBuffer,
    /// `None` if light is never blocked.
    shade: Option<Shade>,
}

struct Shade {
    occluder: Occluder,
    open: Vec<f32>,
}

impl SyntheticScene {
    /// A scene in which nothing blocks light.
    pub(crate) fn open(buffer: GBuffer) -> Self {
        Self {
            buffer,
            shade: None,
        }
    }

    /// A scene with shadows. `rays` rays a pixel measure how much of the sky it sees.
    pub(crate) fn shaded(buffer: GBuffer, occluder: Occluder, rays: u32, seed: u64) -> Self {
        let open = buffer.ambient_visibility(&occluder, rays, seed);
        Self {
            buffer,
            shade: Some(Shade { occluder, open }),
        }
    }

    /// The geometry.
    pub fn buffer(&self) -> &GBuffer {
        &self.buffer
    }

    /// Shading and highlight of a surface under a lighting. `seed` draws the rays.
    pub fn light(
        &self,
        material: &Material,
        lighting: &Lighting,
        panoramas: &Panoramas,
        seed: u64,
    ) -> Shaded {
        let shade = self.shade.as_ref().filter(|_| lighting.has_shadows);
        let open = shade.map(|shade| shade.open.as_slice());
        let mut shaded = Shaded::dark(self.buffer.len());
        for (number, lamp) in (1..).zip(&lighting.lamps) {
            let own = stream(seed, number);
            let shadows = shade.map(|shade| lamp.shadows(&self.buffer, &shade.occluder, own));
            shaded.add_lamp(&self.buffer, material, lamp, shadows.as_ref(), own);
        }
        if let Some(environment) = &lighting.environment {
            if let Some(light) = environment.smooth(panoramas) {
                shaded.add_smooth(material, &light, open);
            } else if let Some(sky) = Sky::new(environment, panoramas, stream(seed, 0)) {
                let occluder = shade.map(|shade| &shade.occluder);
                sky.light(&self.buffer, material, occluder, seed, &mut shaded);
            }
        }
        shaded.add_ambient(lighting.ambient, open);
        if let Some(open) = open {
            shaded.add_bounce(&self.buffer, &material.albedo, lighting.bounce, open);
        }
        shaded
    }
}
