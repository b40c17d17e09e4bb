//! The engine: it keeps photographs, masks, a background and their results, and answers messages.
//!
//! | file | concern |
//! | --- | --- |
//! | `request` | what the page asks |
//! | `page_scene` | the page's scene as that of a file |
//! | `object` | a photograph or captured object, cut out and decomposed |
//! | `background` | what objects are put into |
//! | `renderer` | pictures of a scene |
//! | `archive` | a scene with its files in a ZIP archive |
//! | `pixels` | pictures as a page takes them |
//! | `error` | what can be wrong, as a sentence |

mod archive;
mod background;
mod error;
mod object;
mod page_scene;
mod pixels;
mod request;
mod scene_renderer;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use relight_core::image::{ColourSpace, Depth, Extent, Planes, Srgb, encode_jpeg, encode_png};
use relight_photo::compositing::SceneDescription;
use relight_photo::decompose::Decomposer;
use relight_photo::nets::Weights;
use relight_photo::relighting::RelightableObject;
use serde_json::{Value, json};

use crate::message::{pack, unpack};
use archive::SceneFiles;
use background::StudioBackground;
use error::{StudioError, refused};
use object::StudioObject;
use page_scene::{ObjectFiles, PageScene};
use request::{FileFormat, Request};
use scene_renderer::{EnvironmentCache, SceneRenderer, of_size};

/// The most objects of a scene.
const MAX_OBJECTS: usize = 12;
/// The default size of a panorama's picture.
const PANORAMA_PICTURE: [u32; 2] = [1280, 960];

/// The engine of the page: it answers messages, one after the other.
///
/// ```
/// use relight_app::{Studio, pack, unpack};
///
/// let mut studio = Studio::new();
/// let reply = studio.answer(&pack(&[br#"{"op": "decompose", "object": 1}"#]));
/// let text = String::from_utf8(unpack(&reply)?[0].to_vec()).unwrap();
/// assert_eq!(text, r#"{"error":"the networks are not loaded yet: wait a moment"}"#);
/// # Ok::<(), relight_app::MessageFault>(())
/// ```
#[derive(Default)]
pub struct Studio {
    decomposer: Option<Decomposer>,
    objects: Objects,
    background: Option<StudioBackground>,
    environment: EnvironmentCache,
}

/// By the page's numbers.
#[derive(Default)]
struct Objects(BTreeMap<u32, StudioObject>);

impl Objects {
    fn get(&mut self, number: u32) -> Result<&mut StudioObject, StudioError> {
        self.0.get_mut(&number).ok_or_else(|| no_object(number))
    }
}

/// The fields of an answer, and the pictures and files with it.
type Answer = (Value, Vec<Vec<u8>>);

impl Studio {
    /// An engine without networks, objects and background.
    pub fn new() -> Self {
        Self::default()
    }

    /// Answers a message. What cannot be done is answered by `{"error": "a sentence"}`, and nothing has changed then.
    #[must_use]
    pub fn answer(&mut self, message: &[u8]) -> Vec<u8> {
        let (says, parts) = match self.answered(message) {
            Ok(answer) => answer,
            Err(StudioError(why)) => (json!({ "error": why }), Vec::new()),
        };
        let says = says.to_string();
        let others = parts.iter().map(Vec::as_slice);
        let parts: Vec<&[u8]> = std::iter::once(says.as_bytes()).chain(others).collect();
        pack(&parts)
    }

    fn answered(&mut self, message: &[u8]) -> Result<Answer, StudioError> {
        let parts = unpack(message)?;
        let unknown =
            |fault| StudioError::with_cause("the engine does not know this request", &fault);
        let request: Request =
            serde_json::from_slice(parts[0]).map_err::<StudioError, _>(unknown)?;
        let part = |what| match parts.get(1) {
            Some(part) => Ok(*part),
            None => refused(format!("the request has no {what}")),
        };
        match request {
            Request::Load => self.load(part("weights")?),
            Request::OpenPhoto { object, name } => {
                let opened = StudioObject::open(&name, part("file")?.to_vec())?;
                self.opened(object, opened)
            }
            Request::OpenPixels {
                object,
                name,
                width,
                height,
            } => {
                let pixels = part("pixels")?;
                let opened = StudioObject::from_pixels(&name, [width, height], pixels)?;
                self.opened(object, opened)
            }
            Request::Mask {
                object,
                rect,
                auto,
                strokes,
            } => {
                let made = self.objects.get(object)?.cut_out(rect, auto, strokes)?;
                let says = json!({ "area": made.statistics.area_px, "warnings": made.warnings });
                Ok((says, vec![made.image.into_raw()]))
            }
            Request::Decompose { object } => self.decompose(object),
            Request::Close { object } => {
                self.objects.0.remove(&object);
                Ok((json!({}), Vec::new()))
            }
            Request::Background(asked) => {
                self.choose(StudioBackground::open(&asked, part("file")?)?)
            }
            Request::Render {
                scene,
                longest,
                before,
            } => self.draw(&scene, longest, before, false),
            Request::Layers { scene, longest } => self.draw(&scene, longest, false, true),
            Request::Save { scene, format } => self.save(&scene, format),
            Request::Export { scene, name } => self.export(&scene, &name),
        }
    }

    fn load(&mut self, weights: &[u8]) -> Result<Answer, StudioError> {
        let weights = Weights::from_bytes(weights).map_err(|why| {
            StudioError(format!("the weights of the networks are damaged: {why}"))
        })?;
        self.decomposer = Some(Decomposer::new(&weights)?);
        let says = json!({ "version": env!("CARGO_PKG_VERSION") });
        Ok((says, Vec::new()))
    }

    fn opened(&mut self, number: u32, object: StudioObject) -> Result<Answer, StudioError> {
        let others = self.objects.0.keys().filter(|&&key| key != number).count();
        if others >= MAX_OBJECTS {
            return refused(format!(
                "a scene has at most {MAX_OBJECTS} objects: remove one first"
            ));
        }
        let answer = told(&object);
        self.objects.0.insert(number, object);
        Ok(answer)
    }

    fn decompose(&mut self, number: u32) -> Result<Answer, StudioError> {
        let decomposer = self.decomposer.as_ref().ok_or_else(no_network)?;
        let found = self.objects.get(number)?.decomposed(decomposer)?;
        let Extent { width, height } = found.shading.extent();
        let most = most_shading(&found.shading);
        let grey = |plane: &Planes<1>, scale: f32| -> Result<Vec<u8>, StudioError> {
            let values = plane.plane(0).iter();
            let shown: Vec<f32> = values.map(|v| Srgb::from_linear(v * scale)).collect();
            let planes = [shown.clone(), shown.clone(), shown];
            Ok(pixels::rgba(&Planes::from_planes(plane.extent(), planes)?))
        };
        let parts = vec![
            pixels::shown(&found.albedo),
            grey(&found.shading, 1.0 / most)?,
            pixels::rgba(&found.normals.to_colours()),
            grey(&found.highlight, 1.0)?,
        ];
        let says = json!({
            "glossy": found.is_glossy,
            "saturated": found.saturated_fraction,
            "width": width,
            "height": height,
        });
        Ok((says, parts))
    }

    fn choose(&mut self, background: StudioBackground) -> Result<Answer, StudioError> {
        let extent = background.extent(PANORAMA_PICTURE);
        let thumbnail = background.thumbnail();
        self.environment = EnvironmentCache::default();
        self.background = Some(background);
        let says = json!({ "width": extent.width, "height": extent.height });
        Ok((says, vec![thumbnail]))
    }

    /// A scene in the preview: smaller, with the objects that are ready, in layers or as one picture.
    fn draw(
        &mut self,
        scene: &PageScene,
        longest: u32,
        before: bool,
        layered: bool,
    ) -> Result<Answer, StudioError> {
        let background = self.background.as_mut().ok_or_else(no_background)?;
        // A background alone needs no network.
        for placed in &scene.objects {
            let decomposer = self.decomposer.as_ref().ok_or_else(no_network)?;
            self.objects.get(placed.object)?.prepare(decomposer)?;
        }
        let described = of_size(in_engine(scene)?, background, longest);
        let environment = self
            .environment
            .get_or_make(&described, background, Some(longest))?;
        let ready = |placed: &page_scene::PageObject| {
            let object = self.objects.0.get(&placed.object);
            let relightable = object.and_then(StudioObject::prepared);
            relightable.ok_or_else(|| no_object(placed.object))
        };
        let relightables: Vec<&RelightableObject> =
            scene.objects.iter().map(ready).collect::<Result<_, _>>()?;
        let renderer =
            SceneRenderer::new(&described, environment, background, &relightables, before)?;
        let (parts, objects) = if layered {
            renderer.layers()?
        } else {
            let (picture, boxes) = renderer.picture()?;
            (vec![pixels::shown(&picture)], boxes)
        };
        let Extent { width, height } = environment.extent;
        let placed = scene.objects.iter().map(|placed| placed.object);
        let objects_shown = placed.filter_map(|object| self.objects.0.get(&object));
        let of_files = objects_shown
            .map(|object| (&object.name, object.notes()))
            .chain([(&background.name, background.notes.as_slice())]);
        let mut notes: Vec<String> = of_files
            .flat_map(|(name, notes)| notes.iter().map(move |note| format!("{name}: {note}")))
            .collect();
        notes.extend(renderer.notes());
        let says = json!({ "width": width, "height": height, "objects": objects, "notes": notes });
        Ok((says, parts))
    }

    fn save(&mut self, scene: &PageScene, format: FileFormat) -> Result<Answer, StudioError> {
        let decomposer = self.decomposer.as_ref().ok_or_else(no_network)?;
        let background = self.background.as_mut().ok_or_else(no_background)?;
        let described = in_engine(scene)?;
        let environment = self.environment.get_or_make(&described, background, None)?;
        let mut relightables = Vec::with_capacity(scene.objects.len());
        for (placed, described) in scene.objects.iter().zip(&described.objects) {
            let object = self.objects.get(placed.object)?;
            relightables.push(object.relightable(environment, described, decomposer)?);
        }
        let relightables: Vec<&RelightableObject> = relightables.iter().collect();
        let renderer =
            SceneRenderer::new(&described, environment, background, &relightables, false)?;
        let picture = renderer.picture()?.0.encode::<Srgb>().into_planes();
        let Extent { width, height } = picture.extent();
        let path = Path::new("the picture");
        let file = match format {
            FileFormat::Png => encode_png(path, &picture, Depth::Eight)?,
            FileFormat::Jpeg => encode_jpeg(path, &picture)?,
        };
        let says = json!({ "width": width, "height": height });
        Ok((says, vec![file]))
    }

    fn export(&mut self, scene: &PageScene, name: &str) -> Result<Answer, StudioError> {
        let background = self.background.as_ref().ok_or_else(no_background)?;
        if scene.objects.is_empty() {
            return refused("the scene has no objects yet");
        }
        let mut files = SceneFiles::default();
        let mut named = Vec::with_capacity(scene.objects.len());
        for placed in &scene.objects {
            named.push(files.add_object(self.objects.get(placed.object)?)?);
        }
        let described = scene.described(files.add_background(background), named)?;
        let says = json!({ "name": name });
        Ok((says, vec![files.packed(&described)?]))
    }
}

fn no_network() -> StudioError {
    StudioError("the networks are not loaded yet: wait a moment".to_owned())
}

fn no_background() -> StudioError {
    StudioError("choose a scene first".to_owned())
}

fn no_object(number: u32) -> StudioError {
    StudioError(format!(
        "unknown object {number}: open its photograph again"
    ))
}

/// An object for the page, with its picture and its mask.
fn told(object: &StudioObject) -> Answer {
    let (extent, picture) = object.picture();
    let mask = object.mask();
    let says = json!({
        "kind": object.kind(),
        "width": extent.width,
        "height": extent.height,
        "reduced": object.downscaled,
        "masked": mask.is_some(),
    });
    (says, std::iter::once(picture).chain(mask).collect())
}

/// A scene whose files are all in the engine.
fn in_engine(scene: &PageScene) -> Result<SceneDescription, StudioError> {
    let files = vec![ObjectFiles::default(); scene.objects.len()];
    scene.described(PathBuf::new(), files)
}

/// The 99th percentile of the shading, which is shown as white.
fn most_shading(shading: &Planes<1>) -> f32 {
    let mut values: Vec<f32> = shading
        .plane(0)
        .iter()
        .copied()
        .filter(|v| *v > 0.0)
        .collect();
    values.sort_by(f32::total_cmp);
    let most = values.get(values.len() * 99 / 100).copied().unwrap_or(1.0);
    most.max(1e-6)
}
