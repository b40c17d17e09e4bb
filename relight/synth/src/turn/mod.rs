//! Whole simulated turns, as `relit-extract` would leave them: camera and object ride on a table, so in the
//! pictures the object stands still and the light turns about the table's axis.
//!
//! | file | concern |
//! | --- | --- |
//! | `stand` | how an object stands on the table |
//! | `truth` | what is true of a turn, beside its shard |
//! | `page` | the turn's page |

mod page;
mod stand;
#[cfg(test)]
mod tests;
mod truth;

use std::path::Path;

use glam::Vec3;
use image::{GrayImage, RgbImage};
use rayon::prelude::*;
use relit_data::geometry::Rect;
use relit_data::image_stats::{MaskSpans, SATURATION_LEVEL, SPEC_NET_GATE};
use relit_data::shard::{
    self, Align, Dataset, Digest, ExtractionSettings, FrameRecord, ImageSize, Layout, MaskInfo,
    OutputFolder, Sample, SamplingBasis, SessionEntry, SessionQuality, ShardEntry, ShardWriter,
    SourceVideo,
};
use serde::{Deserialize, Serialize};

use super::SynthError;
use super::camera::CameraModel;
use super::finish::Finish;
use super::folder::{SynthTally, holds_samples};
use super::geometry::{GBuffer, Occluder};
use super::library::Library;
use super::lighting::{Lighting, Material, Scene, Shaded};
use super::mesh::Mesh;
use super::object::ObjectSource;
use super::png::{Sixteen, encode_sixteen};
use super::random::{Random, stream};
use super::recipe::{AMBIENT_RAYS, Recipe};
use super::sample::{Whites, mask, photograph};
use super::view::{Pose, Projection};
use page::TurnPage;
use relight_core::light::{Direction, Rotation};
use stand::{Stand, standing_object};
use truth::TruthFolder;

pub use truth::FrameTruth;

/// Frames that are made side by side before they are written.
const BATCH: u32 = 32;
/// Frames from which the exposure is found.
const METERED: u32 = 12;
/// Frames a second of the turns that are simulated.
const RATE: f64 = 30.0;
/// Part of the turns whose objects are glossy.
const GLOSSY: f32 = 0.7;
/// Part of the glossy turns whose highlights clip.
const CLIPPED: f32 = 0.5;
/// How much brighter these become at most.
const LONGEST_EXPOSURE: f32 = 3.0;

/// How turns are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TurnRecipe {
    /// Seed, size, light and shadows; its camera is sRGB without noise or compression.
    pub recipe: Recipe,
    /// Frames a turn, 1..=1 000 000.
    pub frames: u32,
}

/// What a turn is made of, as it stands in `turn.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TurnDescription {
    /// `relight.turn/1`.
    pub schema: String,
    /// What it was drawn from: the recipe's seed and the turn's number.
    pub seed: u64,
    /// The turn's number.
    pub number: u64,
    /// The object.
    pub object: ObjectSource,
    /// How it stands.
    pub pose: Pose,
    /// How it is seen.
    pub projection: Projection,
    /// The table's axis in the viewer's frame, upwards. At the table's angle `a`, the light has turned by
    /// `-a` about it (right-hand rule).
    pub axis: [f64; 3],
    /// What it is made of.
    pub finish: Finish,
    /// The name of the panorama that the lighting has.
    pub panorama: Option<String>,
    /// The light at the angle 0.
    pub lighting: Lighting,
    /// The camera.
    pub camera: CameraModel,
    /// Frames.
    pub frames: u32,
    /// Width and height.
    pub size: u32,
}

/// Writes the turns 0 to `count - 1` into the data set in the folder `out`: shards in the format of
/// `relit-extract`, and beside them `truth/<session>/`. Frames are made side by side on rayon's threads.
/// Turns that the data set already describes are kept. `progress` is told each frame that is done.
///
/// # Errors
/// Where a setting is out of range, `out` holds another data set, or a file cannot be written: turns
/// that are whole stay.
pub fn write_turns(
    turns: &TurnRecipe,
    library: &Library,
    count: u64,
    out: &Path,
    progress: &(dyn Fn() + Sync),
) -> Result<SynthTally, SynthError> {
    turns.recipe.check()?;
    if !(1..=shard::MAX_SAMPLES).contains(&turns.frames) {
        return Err(SynthError::Setting {
            name: "the number of frames",
            value: u64::from(turns.frames),
            allowed: "1 to 1000000",
        });
    }
    let folder = OutputFolder::lock(out)?;
    let mut dataset = open_dataset(out, &turns.settings())?;
    let mut written = SynthTally::default();
    for number in 0..count {
        let turn = Turn::draw(turns, library, number);
        if turn.is_whole(&dataset, out)? {
            written.kept += 1;
            (0..turns.frames).for_each(|_| progress());
            continue;
        }
        let (entry, shards) = turn.write(&folder, progress)?;
        dataset.replace(entry, shards);
        dataset.write(out)?;
        written.new += 1;
    }
    Ok(written)
}

impl TurnRecipe {
    fn settings(&self) -> ExtractionSettings {
        ExtractionSettings {
            frames: self.frames,
            size: ImageSize::NATIVE,
            margin: 0.0,
            saturation_level: SATURATION_LEVEL,
            gate: SPEC_NET_GATE,
            align: Align::Off,
            align_tolerance: None,
            layout: Layout::Webdataset,
            scaling: "none".to_owned(),
        }
    }
}

fn open_dataset(out: &Path, settings: &ExtractionSettings) -> Result<Dataset, SynthError> {
    if holds_samples(out) {
        return Err(SynthError::OtherSettings {
            path: out.to_owned(),
        });
    }
    match Dataset::read(out) {
        Ok(there) if there.settings == *settings => Ok(there),
        Ok(_) => Err(SynthError::OtherSettings {
            path: out.to_owned(),
        }),
        Err(shard::ShardError::NoDataset { .. }) => Ok(Dataset::new(settings.clone())),
        Err(error) => Err(error.into()),
    }
}

/// A turn, ready to be rendered.
struct Turn<'a> {
    session: String,
    object: String,
    description: TurnDescription,
    axis: Direction,
    library: &'a Library,
    scene: Scene,
    material: Material,
    shadow_seed: u64,
}

/// A frame, rendered and encoded.
struct Frame {
    sample: Sample,
    truth: FrameTruth,
    shading: Vec<u8>,
    highlight: Vec<u8>,
}

impl<'a> Turn<'a> {
    fn draw(turns: &TurnRecipe, library: &'a Library, number: u64) -> Self {
        let recipe = &turns.recipe;
        let seed = stream(stream(recipe.seed, 4), number);
        let mut random = Random::new(seed);
        let (object, mesh) = standing_object(recipe, library, &mut random);
        let stand = Stand::draw(&mut random);
        let scene = scene(recipe, &stand, &mesh, random.seed());
        let finish = Finish::draw(&mut random, scene.buffer(), library, GLOSSY);
        let material = finish.apply(scene.buffer(), library);
        let lighting = Lighting::draw(
            &mut random,
            recipe.light,
            scene.buffer(),
            &library.panoramas,
        );
        let lighting = Lighting {
            has_shadows: recipe.shadows,
            ..lighting.above(stand.axis())
        };
        let [x, y, z] = stand.axis().to_array().map(f64::from);
        let axis = Direction::new(x, y, z).unwrap_or(Direction::UP);
        let level = random.uniform(0.8..1.3);
        let is_clipped = finish.gloss.is_some() && random.chance(CLIPPED);
        let clipped = is_clipped.then(|| random.uniform(0.04..0.15));
        let description = TurnDescription {
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
            Some(part) => camera.clipping(&images, part, LONGEST_EXPOSURE),
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

    /// Whether the data set holds this very turn, whole.
    fn is_whole(&self, dataset: &Dataset, out: &Path) -> Result<bool, SynthError> {
        let Some(entry) = dataset.session(&self.session) else {
            return Ok(false);
        };
        if entry.input != self.input() {
            return Err(SynthError::OtherSettings {
                path: out.to_owned(),
            });
        }
        Ok(truth::place(out, &self.session).is_dir()
            && dataset.check_integrity(out, &self.session).is_ok())
    }

    /// The description stands where the video of a recorded session does.
    fn input(&self) -> SourceVideo {
        let bytes = self.json();
        SourceVideo {
            video: "turn.json".to_owned(),
            codec: "synthetic".to_owned(),
            frames: u64::from(self.description.frames),
            bytes: bytes.len() as u64,
            blake3: Digest::of(&bytes),
            index_blake3: None,
        }
    }

    fn json(&self) -> Vec<u8> {
        // All numbers are finite and all keys are texts: this cannot fail.
        let mut bytes = serde_json::to_vec_pretty(&self.description).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }

    /// Writes shard, table, page and truth.
    fn write(
        &self,
        folder: &OutputFolder,
        progress: &(dyn Fn() + Sync),
    ) -> Result<(SessionEntry, Vec<ShardEntry>), SynthError> {
        let mask = mask(self.scene.buffer());
        let spans = MaskSpans::of(&mask);
        let frames = self.description.frames;
        let layout = Layout::Webdataset;
        let mut writer = ShardWriter::create(folder.path(), layout, &self.session, frames, &mask)?;
        let truth = TruthFolder::create(folder.path(), &self.session)?;
        truth.write_object(self)?;
        let mut page = TurnPage::new(frames);
        let mut lines = Vec::new();
        for first in (0..frames).step_by(BATCH as usize) {
            let batch: Result<Vec<Frame>, SynthError> = (first..frames.min(first + BATCH))
                .into_par_iter()
                .map(|index| {
                    let frame = self.frame(index, &spans);
                    progress();
                    frame
                })
                .collect();
            for frame in batch? {
                truth.write_frame(&frame)?;
                lines.extend(serde_json::to_vec(&frame.truth).unwrap_or_default());
                lines.push(b'\n');
                page.keep(&frame.sample);
                writer.push(frame.sample)?;
            }
        }
        truth.write("frames.jsonl", &lines)?;
        let html = page.render(self)?;
        let files = writer.finish()?;
        let report = folder.write(&format!("{}.html", self.session), html.as_bytes())?;
        truth.publish()?;
        let spec_net = page.records.iter().filter(|record| record.spec_net).count();
        let entry = SessionEntry {
            id: self.session.clone(),
            object: self.object.clone(),
            input: self.input(),
            mask: MaskInfo {
                blake3: Digest::of(&shard::encode_mask(&mask)?),
                px: spans.pixels(),
                bounding_box: bounding_box(&mask),
            },
            selection: SamplingBasis::Angle,
            samples: frames,
            covered_deg: None,
            duplicates: 0,
            spec_net: spec_net as u32,
            lossy: false,
            quality: Some(SessionQuality::of(&page.records, false, None)),
            warnings: Vec::new(),
            table: files.table,
            report: Some(report),
        };
        Ok((entry, files.shards))
    }

    fn frame(&self, index: u32, spans: &MaskSpans) -> Result<Frame, SynthError> {
        let (mut shaded, lighting) = self.light(index);
        let camera = &self.description.camera;
        shaded.scale(camera.gain);
        let buffer = self.scene.buffer();
        let image = photograph(buffer, camera, &self.material, &shaded, 0);
        let shading = Sixteen::up_to_largest(&shaded.shading);
        let highlight = Sixteen::up_to_largest(&shaded.highlight);
        Ok(Frame {
            truth: FrameTruth {
                index,
                angle_deg: self.angle_deg(index),
                white: Whites {
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
        let record = FrameRecord::new(session, object, index, whole, &measures, SPEC_NET_GATE)
            .of_frame(
                u64::from(index),
                (f64::from(index) * 1e6 / RATE).round() as i64,
                Some(self.angle_deg(index)),
            );
        Ok(record)
    }
}

/// What is seen of an object on the plate.
fn scene(recipe: &Recipe, stand: &Stand, mesh: &Mesh, seed: u64) -> Scene {
    let placement = stand.placement(mesh);
    let buffer = GBuffer::render(mesh, placement, stand.projection, recipe.size);
    if !recipe.shadows {
        return Scene::open(buffer);
    }
    let occluder = Occluder::with_disc(mesh, placement, &stand.plate(mesh));
    Scene::shaded(buffer, occluder, AMBIENT_RAYS, seed)
}

/// The smallest rectangle around the object; empty where there is none.
fn bounding_box(mask: &GrayImage) -> Rect {
    let inside = mask
        .enumerate_pixels()
        .filter(|(_, _, pixel)| pixel.0[0] > 0);
    let bounds = inside.fold(None, |bounds: Option<[u32; 4]>, (x, y, _)| {
        Some(match bounds {
            None => [x, y, x, y],
            Some([left, top, right, bottom]) => {
                [left.min(x), top.min(y), right.max(x), bottom.max(y)]
            }
        })
    });
    let Some([left, top, right, bottom]) = bounds else {
        return Rect::new(0, 0, 0, 0);
    };
    Rect::new(left as i32, top as i32, right - left + 1, bottom - top + 1)
}
