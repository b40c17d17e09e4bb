//! A simulated turn and its frames, rendered and encoded.

use std::ops::Range;

use glam::Vec3;
use image::RgbImage;
use rayon::prelude::*;
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL};
use relit_data::shard::{Digest, FrameRecord, Sample, SourceVideo};
use relit_data::spec_net_gate::SPEC_NET_GATE;

use super::description::{FrameTruth, SequenceDescription, SequenceRecipe};
use super::table_pose::{TablePose, standing_object};
use crate::SynthError;
use crate::geometry::{GBuffer, Occluder};
use crate::library::Library;
use crate::lighting::{Environment, Lighting, Material, Method, Shaded, SyntheticScene};
use crate::mesh::Mesh;
use crate::random::{Random, stream};
use crate::samples::camera::CameraModel;
use crate::samples::finish::Finish;
use crate::samples::png::{Rgb16, encode_sixteen};
use crate::samples::recipe::{AMBIENT_RAYS, MESHES, Recipe};
use crate::samples::sample::{WhiteLevels, photograph};
use relight_core::light::{Direction, Order, Rotation, ShLight};

/// Frames from which the exposure is found.
const METERED: u32 = 12;
/// Frames a second of the turns that are simulated.
const RATE: f64 = 30.0;
/// The camera over the plate, degrees.
const ELEVATIONS: Range<f32> = 8.0..30.0;
/// Part of the turns whose objects are glossy.
const GLOSSY: f32 = 0.7;
/// Part of the glossy turns whose highlights clip.
const CLIPPED: f32 = 0.5;
/// How much brighter these become at most.
const MAX_EXPOSURE: f32 = 3.0;

/// A turn, ready to be rendered.
pub(super) struct SimulatedSequence<'a> {
    pub(super) session: String,
    pub(super) object: String,
    pub(super) description: SequenceDescription,
    axis: Direction,
    library: &'a Library,
    pub(super) scene: SyntheticScene,
    pub(super) material: Material,
    shadow_seed: u64,
}

/// A frame, rendered and encoded.
pub(super) struct RenderedFrame {
    pub(super) sample: Sample,
    pub(super) truth: FrameTruth,
    pub(super) shading: Vec<u8>,
    pub(super) highlight: Vec<u8>,
}

impl<'a> SimulatedSequence<'a> {
    pub(super) fn draw(turns: &SequenceRecipe, library: &'a Library, number: u64) -> Self {
        let recipe = &turns.recipe;
        let seed = stream(stream(recipe.seed, 4), number);
        let mut random = Random::new(seed);
        let (object, mesh) = standing_object(recipe, library, MESHES, &mut random);
        let stand = TablePose::draw(&mut random, ELEVATIONS);
        let scene = scene(recipe, &stand, &mesh, random.seed());
        let finish = Finish::draw(
            &mut random,
            scene.buffer(),
            library,
            GLOSSY,
            recipe.own_albedo,
        );
        let material = finish.apply(scene.buffer(), library);
        let lighting = Lighting::draw(
            &mut random,
            recipe.light,
            scene.buffer(),
            &library.panoramas,
        );
        // Nine coefficients are no room, and bright skies make them negative below: they stay as they are drawn.
        let level = |around: Environment| match around.method {
            Method::OrderTwo => around,
            Method::Smooth | Method::MonteCarlo => around.level(&mut random, stand.elevation()),
        };
        let lighting = Lighting {
            has_shadows: recipe.shadows,
            environment: lighting.environment.clone().map(level),
            ..lighting.above(stand.axis())
        };
        let [x, y, z] = stand.axis().to_array().map(f64::from);
        let axis = Direction::new(x, y, z).unwrap_or(Direction::UP);
        let level = random.uniform(0.8..1.3);
        let is_clipped = finish.gloss.is_some() && random.chance(CLIPPED);
        let clipped = is_clipped.then(|| random.uniform(0.04..0.15));
        let description = SequenceDescription {
            schema: "relight.turn/1".to_owned(),
            seed,
            number,
            object,
            pose: stand.pose,
            projection: stand.projection,
            axis: axis.components(),
            finish,
            panorama: lighting.panorama_name(&library.panoramas),
            lighting,
            camera: CameraModel::plain(),
            frames: turns.frames,
            size: recipe.size,
        };
        Self {
            session: format!("synth-{}-{number:04}", recipe.seed),
            object: description.object.name(),
            description,
            axis,
            library,
            scene,
            material,
            shadow_seed: random.seed(),
        }
        .exposed(level, clipped)
    }

    /// The turn with its exposure, one for all frames; `clipped` is the part of the object that clips in
    /// the frame in which most does.
    fn exposed(mut self, level: f32, clipped: Option<f32>) -> Self {
        let metered = METERED.min(self.description.frames);
        let images: Vec<Vec<Vec3>> = (0..metered)
            .into_par_iter()
            .map(|k| {
                let index = u64::from(k) * u64::from(self.description.frames) / u64::from(metered);
                let (shaded, _) = self.light(index as u32);
                shaded.image(&self.material.albedo)
            })
            .collect();
        let camera = CameraModel::plain().exposed(&images.concat(), level);
        self.description.camera = match clipped {
            Some(part) => camera.clipping(&images, part, MAX_EXPOSURE),
            None => camera,
        };
        self
    }

    fn angle_deg(&self, index: u32) -> f64 {
        360.0 * f64::from(index) / f64::from(self.description.frames)
    }

    /// The frame's light on the object, without the camera's gain.
    fn light(&self, index: u32) -> (Shaded, Lighting) {
        let turn = Rotation::about(self.axis, -self.angle_deg(index).to_radians());
        let lighting = self.description.lighting.turned(&turn);
        let panoramas = &self.library.panoramas;
        let shaded = self
            .scene
            .light(&self.material, &lighting, panoramas, self.shadow_seed);
        (shaded, lighting)
    }

    /// The description stands where the video of a recorded session does.
    pub(super) fn input(&self) -> SourceVideo {
        let bytes = self.json();
        SourceVideo {
            video: "turn.json".to_owned(),
            codec: "synthetic".to_owned(),
            frames: u64::from(self.description.frames),
            bytes: bytes.len() as u64,
            blake3: Digest::hash(&bytes),
            colour_conversion: None,
            index_blake3: None,
        }
    }

    pub(super) fn json(&self) -> Vec<u8> {
        // All numbers are finite and all keys are texts: this cannot fail.
        let mut bytes = serde_json::to_vec_pretty(&self.description).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }

    /// The light at angle 0, as a camera sees it, with all bands that a surface shows of it.
    pub(super) fn first_light(&self) -> ShLight {
        let gain = self.description.camera.gain;
        let lighting = &self.description.lighting;
        lighting.seen(Order::HIGHLIGHT, &self.library.panoramas, gain)
    }

    pub(super) fn frame(&self, index: u32, spans: &MaskSpans) -> Result<RenderedFrame, SynthError> {
        let (mut shaded, lighting) = self.light(index);
        let camera = &self.description.camera;
        shaded.scale(camera.gain);
        let buffer = self.scene.buffer();
        let image = photograph(buffer, camera, &self.material, &shaded, 0);
        let shading = Rgb16::up_to_largest(&shaded.shading);
        let highlight = Rgb16::up_to_largest(&shaded.highlight);
        Ok(RenderedFrame {
            truth: FrameTruth {
                index,
                angle_deg: self.angle_deg(index),
                white: WhiteLevels {
                    shading: shading.white,
                    highlight: highlight.white,
                },
                coefficients: lighting.seen_coefficients(&self.library.panoramas, camera.gain),
            },
            shading: encode_sixteen(buffer, &shading)?,
            highlight: encode_sixteen(buffer, &highlight)?,
            sample: Sample::encode(self.record(index, &image, spans)?, image)?,
        })
    }

    fn record(
        &self,
        index: u32,
        image: &RgbImage,
        spans: &MaskSpans,
    ) -> Result<FrameRecord, SynthError> {
        let measures = spans.measure(image, SATURATION_LEVEL)?;
        let size = self.description.size;
        let whole = Rect::new(0, 0, size, size);
        let (session, object) = (&self.session, &self.object);
        Ok(FrameRecord {
            t_us: (f64::from(index) * 1e6 / RATE).round() as i64,
            angle_deg: Some(self.angle_deg(index)),
            ..FrameRecord::new(session, object, index, whole, &measures, SPEC_NET_GATE)
        })
    }
}

/// The visible surface of an object on the plate.
fn scene(recipe: &Recipe, stand: &TablePose, mesh: &Mesh, seed: u64) -> SyntheticScene {
    let placement = stand.placement(mesh);
    let buffer = GBuffer::render(mesh, placement, stand.projection, recipe.size);
    if !recipe.shadows {
        return SyntheticScene::open(buffer);
    }
    let occluder = Occluder::with_disc(mesh, placement, &stand.plate(mesh));
    SyntheticScene::shaded(buffer, occluder, AMBIENT_RAYS, seed)
}
