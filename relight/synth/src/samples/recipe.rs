//! Which objects, views, materials, lights and cameras are drawn: every number of a seed. The chances are
//! those of the recipe that trained best.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::camera::CameraModel;
use super::finish::Finish;
use super::object::{ObjectSource, SyntheticView};
use super::sample::{Description, SynthSample};
use crate::SynthError;
use crate::geometry::{GBuffer, Occluder};
use crate::library::Library;
use crate::lighting::{LightKind, Lighting, Material, SyntheticScene};
use crate::mesh::Mesh;
use crate::random::{Random, stream};
use crate::shape::ShapeKind;
use crate::view::{Pose, Projection};

/// Rays a pixel by which a scene learns how much of the sky it sees.
pub(crate) const AMBIENT_RAYS: u32 = 16;
/// Part of the objects that are meshes, if there are any.
pub(crate) const MESHES: f32 = 0.25;
/// Least part of the picture that an object covers, where another view of it covers more.
const MIN_COVER: f32 = 0.12;
/// Views that are drawn at most until one covers as much.
const DRAWS: usize = 4;

/// The settings of samples. The same recipe and library give the same samples.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recipe {
    /// The seed of all draws.
    pub seed: u64,
    /// Width and height of the pictures, 16..=2048 pixels.
    pub size: u32,
    /// What light there is.
    pub light: LightKind,
    /// Whether objects block light.
    pub shadows: bool,
    /// Views of each object, 1 and above.
    pub views: u32,
    /// Materials and lightings of each view, 1 and above.
    pub lightings: u32,
    /// Whether the camera is random; else it is the plain one.
    pub random_camera: bool,
    /// Whether all objects with materials keep them; else half of them.
    pub own_albedo: bool,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            seed: 0,
            size: 256,
            light: LightKind::Mixed,
            shadows: true,
            views: 4,
            lightings: 4,
            random_camera: true,
            own_albedo: false,
        }
    }
}

impl Recipe {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`SynthError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), SynthError> {
        let refused = |name: &str, value: u32, allowed: &str| {
            Err(SynthError::Refused(format!(
                "{name} is {value}: give {allowed}"
            )))
        };
        match (self.size, self.views, self.lightings) {
            (size @ (..16 | 2049..), ..) => refused("the size", size, "16 to 2048 pixels"),
            (_, 0, _) => refused("the number of views", 0, "at least 1"),
            (_, _, 0) => refused("the number of lightings", 0, "at least 1"),
            _ => Ok(()),
        }
    }

    /// How many samples each object gives.
    pub fn samples_an_object(&self) -> u64 {
        u64::from(self.views) * u64::from(self.lightings)
    }

    /// The object of a number.
    pub fn object<'a>(&self, library: &'a Library, number: u64) -> (ObjectSource, Cow<'a, Mesh>) {
        self.object_with(library, number, MESHES)
    }

    /// The same where another part of the objects are meshes.
    pub(crate) fn object_with<'a>(
        &self,
        library: &'a Library,
        number: u64,
        meshes: f32,
    ) -> (ObjectSource, Cow<'a, Mesh>) {
        let mut random = Random::new(stream(stream(self.seed, 1), number));
        if random.chance(meshes)
            && let Some((file, mesh)) = library.meshes.get(random.index(library.meshes.len()))
        {
            return (
                ObjectSource::Mesh { file: file.clone() },
                Cow::Borrowed(mesh),
            );
        }
        let kind = random.weighted(ShapeKind::WEIGHTS);
        let seed = random.seed();
        (
            ObjectSource::Shape { kind, seed },
            Cow::Owned(kind.build(seed)),
        )
    }

    /// The view of a number of an object: of several draws the first that covers enough of the picture.
    pub fn view(&self, object: &ObjectSource, mesh: &Mesh, number: u64) -> SyntheticView {
        let mut random = Random::new(stream(stream(self.seed, 3), number));
        let (pose, projection, buffer) = self.framed(object, mesh, &mut random);
        let scene = if self.shadows {
            let occluder = Occluder::new(mesh, pose.place(mesh, projection));
            SyntheticScene::shaded(buffer, occluder, AMBIENT_RAYS, random.seed())
        } else {
            SyntheticScene::open(buffer)
        };
        SyntheticView {
            object: object.clone(),
            pose,
            projection,
            scene,
        }
    }

    /// Of several draws of a pose and a camera the first in which the object covers enough of the picture.
    pub(crate) fn framed(
        &self,
        object: &ObjectSource,
        mesh: &Mesh,
        random: &mut Random,
    ) -> (Pose, Projection, GBuffer) {
        let kind = match object {
            ObjectSource::Mesh { .. } => None,
            ObjectSource::Shape { kind, .. } => Some(*kind),
        };
        let least = (MIN_COVER * (self.size * self.size) as f32) as usize;
        let mut draw = || {
            let pose = Pose::draw(random, kind);
            let projection = Projection::draw(random);
            let placement = pose.place(mesh, projection);
            let buffer = GBuffer::render(mesh, placement, projection, self.size);
            (pose, projection, buffer)
        };
        let mut best = draw();
        for _ in 1..DRAWS {
            if best.2.len() >= least {
                break;
            }
            let other = draw();
            if other.2.len() > best.2.len() {
                best = other;
            }
        }
        best
    }

    /// The material of a number on what a view shows: paint, relief on a third, gloss on a third.
    pub fn material(&self, library: &Library, view: &SyntheticView, number: u64) -> Material {
        self.finished(library, view, number).1
    }

    fn finished(&self, library: &Library, view: &SyntheticView, number: u64) -> (Finish, Material) {
        let mut random = Random::new(stream(stream(self.seed, 5), number));
        let finish = Finish::draw(
            &mut random,
            view.scene.buffer(),
            library,
            0.35,
            self.own_albedo,
        );
        let material = finish.apply(view.scene.buffer(), library);
        (finish, material)
    }

    /// The sample of a number: a view in a random material, under a random light, by a random camera.
    pub fn sample<'a>(
        &self,
        library: &Library,
        view: &'a SyntheticView,
        number: u64,
    ) -> SynthSample<'a> {
        let seed = stream(stream(self.seed, 2), number);
        let mut random = Random::new(seed);
        let (finish, material) = self.finished(library, view, number);
        let buffer = view.scene.buffer();
        let lighting = Lighting {
            has_shadows: self.shadows,
            ..Lighting::draw(&mut random, self.light, buffer, &library.panoramas)
        };
        let shaded = view
            .scene
            .light(&material, &lighting, &library.panoramas, random.seed());
        let (camera, level) = self.camera(&mut random);
        let camera = camera.exposed(&shaded.image(&material.albedo), level);
        let description = Description {
            number,
            seed,
            object: view.object.clone(),
            pose: view.pose,
            projection: view.projection,
            finish,
            panorama: lighting.panorama_name(&library.panoramas),
            coefficients: lighting.seen_coefficients(&library.panoramas, camera.gain),
            lighting,
            camera,
        };
        SynthSample::new(view, material, shaded, description, random.seed())
    }

    /// A camera without its exposure, and the level to which bright pixels are to be exposed: some
    /// pictures clip.
    fn camera(&self, random: &mut Random) -> (CameraModel, f32) {
        let level = random.uniform(0.6..1.1);
        if !self.random_camera {
            return (CameraModel::plain(), level);
        }
        let level = if random.chance(0.15) {
            random.uniform(1.1..1.8)
        } else {
            level
        };
        (CameraModel::draw(random), level)
    }
}

impl Projection {
    fn draw(random: &mut Random) -> Self {
        if random.chance(0.5) {
            Self::Orthographic
        } else {
            Self::Perspective {
                distance: random.log_uniform(3.0..12.0),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::Folders;

    fn small() -> Recipe {
        Recipe {
            size: 48,
            ..Recipe::default()
        }
    }

    #[test]
    fn a_number_out_of_range_is_named() {
        let recipe = Recipe {
            size: 8,
            ..Recipe::default()
        };
        assert!(recipe.check().unwrap_err().to_string().contains("size"));
        let recipe = Recipe {
            views: 0,
            ..Recipe::default()
        };
        assert!(recipe.check().unwrap_err().to_string().contains("views"));
        assert!(Recipe::default().check().is_ok());
    }

    #[test]
    fn every_view_shows_its_object() {
        let library = Library::default();
        for number in 0..12 {
            let (object, mesh) = small().object(&library, number);
            let view = small().view(&object, &mesh, number);
            assert!(view.scene.buffer().len() > 48 * 48 / 20, "{object:?}");
        }
    }

    #[test]
    fn meshes_are_drawn_where_there_are_any() {
        let mesh = ShapeKind::Plane.build(0);
        let library = Library {
            meshes: vec![("plane.obj".to_owned(), mesh)],
            ..Library::default()
        };
        let is_mesh = |&number: &u64| {
            let (object, _) = small().object(&library, number);
            matches!(object, ObjectSource::Mesh { .. })
        };
        let count = (0..60).filter(is_mesh).count();
        assert!((5..30).contains(&count), "{count}");
    }

    #[test]
    fn pictures_are_well_exposed_and_not_all_alike() {
        let library = Library::read(&Folders::default()).unwrap();
        let mut means = Vec::new();
        for number in 0..10 {
            let (object, mesh) = small().object(&library, number);
            let view = small().view(&object, &mesh, number);
            let sample = small().sample(&library, &view, number);
            let bright = sample
                .image
                .pixels()
                .filter(|p| p.0.iter().any(|&v| v > 120));
            assert!(bright.count() > 8, "{number}");
            let sum: u64 = sample.image.as_raw().iter().map(|&v| u64::from(v)).sum();
            means.push(sum);
        }
        means.dedup();
        assert_eq!(means.len(), 10);
    }
}
