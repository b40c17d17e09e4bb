//! Pictures of a scene: whole, in layers that the page can move, and in full size.

use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_photo::compositing::{
    InsertScene, SceneDescription, SceneEnvironment, SceneLayer, SceneObject,
};
use relight_photo::relighting::RelightableObject;
use serde_json::{Value, json};

use super::background::{StudioBackground, downscaled};
use super::error::StudioError;
use super::pixels::{covering, rgba, shown};

/// How much of a pixel an object covers at least where it counts as seen.
const SEEN: f32 = 0.5;
/// A clipped part of the background larger than this is reported.
const MUCH_CLIPPED: f32 = 0.25;

/// The last setting, with its inputs: a background, the scene without objects and without the
/// light's angle, and its longest side. While only those change it stays.
#[derive(Default)]
pub(super) struct EnvironmentCache(Option<((SceneDescription, Option<u32>), SceneEnvironment)>);

impl EnvironmentCache {
    /// The setting of a scene, `longest` pixels at most; the background is made ready for it.
    ///
    /// # Errors
    /// If the light is dark.
    pub(super) fn get_or_make(
        &mut self,
        scene: &SceneDescription,
        background: &mut StudioBackground,
        longest: Option<u32>,
    ) -> Result<&SceneEnvironment, StudioError> {
        background.prepare(scene, longest);
        let mut bare = scene.clone();
        bare.objects.clear();
        bare.light.angle = 0.0;
        let key = (bare, longest);
        let tilt = SceneEnvironment::ground_tilt(scene, background.for_scene());
        let kept = self.0.take().filter(|(was, _)| *was == key);
        let mut environment = match kept {
            Some((_, environment)) => environment,
            None => {
                let lamp = scene
                    .light
                    .lamp()?
                    .map(relight_photo::relighting::LightSource::Lamp);
                SceneEnvironment::new(scene, background.for_scene(), lamp)?
            }
        };
        environment.tilt = tilt;
        Ok(&self.0.insert((key, environment)).1)
    }
}

/// A scene with a panorama's picture of another size.
pub(super) fn of_size(
    mut scene: SceneDescription,
    background: &StudioBackground,
    longest: u32,
) -> SceneDescription {
    let extent = downscaled(background.extent(scene.size), Some(longest));
    scene.size = [extent.width as u32, extent.height as u32];
    scene
}

/// A scene ready to be drawn: its objects in their setting before their background.
pub(super) struct SceneRenderer<'a> {
    pub(super) environment: &'a SceneEnvironment,
    pub(super) background: &'a StudioBackground,
    scene: InsertScene<'a>,
    angle: f64,
}

impl<'a> SceneRenderer<'a> {
    /// Objects as a scene describes them; `before`: as they were photographed, without shadows.
    ///
    /// # Errors
    /// If an object cannot stand where it should.
    pub(super) fn new(
        scene: &SceneDescription,
        environment: &'a SceneEnvironment,
        background: &'a StudioBackground,
        relightables: &[&'a RelightableObject],
        before: bool,
    ) -> Result<Self, StudioError> {
        let pairs = scene.objects.iter().zip(relightables);
        let objects = pairs.map(|(described, &relightable)| {
            let object = SceneObject::described(described, relightable);
            SceneObject {
                relit: !before,
                shadow: if before { 0.0 } else { object.shadow },
                ..object
            }
        });
        Ok(Self {
            scene: environment.scene(objects.collect())?,
            environment,
            background,
            angle: scene.light.angle.to_radians(),
        })
    }

    /// Background, shadows and objects in one picture, and where each object is seen.
    ///
    /// # Errors
    /// Those of the render layers.
    pub(super) fn picture(&self) -> Result<(Rgb<Linear>, Vec<Value>), StudioError> {
        let layers = self.scene.layers(self.angle)?;
        let background = self.background.seen(self.environment, self.angle);
        let boxes = layers.iter().map(|layer| json!({ "box": seen(layer) }));
        let picture = self.scene.compose(&background, &layers, 0);
        Ok((picture, boxes.collect()))
    }

    /// The background, then for each object its colours and its shadow, with their places.
    ///
    /// # Errors
    /// Those of the render layers.
    pub(super) fn layers(&self) -> Result<(Vec<Vec<u8>>, Vec<Value>), StudioError> {
        let background = self.background.seen(self.environment, self.angle);
        let (mut parts, mut objects) = (vec![shown(&background)], Vec::new());
        for layer in &self.scene.layers(self.angle)? {
            parts.push(covering(layer.colours(), layer.alpha()));
            let mut lies = placed(layer.place(), layer.alpha().extent());
            lies["box"] = json!(seen(layer));
            lies["shadow"] = layer.shadow().map_or(Value::Null, |(place, arriving)| {
                parts.push(rgba(arriving));
                placed(place, arriving.extent())
            });
            objects.push(lies);
        }
        Ok((parts, objects))
    }

    /// What the person at the page should know of the setting.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(sun) = &self.environment.sun {
            let sure = 100.0 * sun.confidence;
            notes.push(format!(
                "lit by the sun in the picture ({sure:.0} % confidence)"
            ));
        }
        if let Some(exposure) = &self.environment.exposure
            && exposure.clipped > MUCH_CLIPPED
        {
            let part = 100.0 * exposure.clipped;
            notes.push(format!("{part:.0} % of the background is clipped to white"));
        }
        notes
    }
}

fn placed(place: [i64; 2], Extent { width, height }: Extent) -> Value {
    json!({ "place": place, "width": width, "height": height })
}

/// Where an object is seen: column and row of the first pixel, width and height.
fn seen(layer: &SceneLayer) -> [i64; 4] {
    let [x, y, width, height] = covered(layer.alpha());
    let [left, top] = layer.place();
    [left + x, top + y, width, height]
}

/// The smallest rectangle around all that is covered: column, row, width and height.
fn covered(alpha: &Planes<1>) -> [i64; 4] {
    let Some([columns, rows]) = alpha.bounds(SEEN) else {
        return [0; 4];
    };
    [columns.start, rows.start, columns.len(), rows.len()].map(|side| side as i64)
}
