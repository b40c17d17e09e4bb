//! An object of a scene: its place and its appearance.

use relight_core::image::Extent;

use super::ObjectDescription;
use crate::relighting::{InsertError, MaterialChange, Placement, RelightableObject, rows};

/// How much an object may be enlarged.
const MAX_GROWTH: f64 = 64.0;

/// An object of a scene.
#[derive(Debug, Clone, Copy)]
pub struct SceneObject<'a> {
    /// The object.
    pub relightable: &'a RelightableObject,
    /// Where it stands.
    pub placement: Placement,
    /// What its material becomes.
    pub change: MaterialChange,
    /// Its brightness in stops.
    pub exposure: f32,
    /// How much of its shadow is seen, 0 to 1.
    pub shadow: f32,
    /// Whether it is relit by the scene; else it keeps the light of its photograph.
    pub relit: bool,
}

impl<'a> SceneObject<'a> {
    /// An object as it is described, in the scene's light.
    pub fn described(object: &ObjectDescription, relightable: &'a RelightableObject) -> Self {
        Self {
            relightable,
            placement: object.placement(),
            change: object.change(),
            exposure: object.exposure,
            shadow: object.shadow,
            relit: true,
        }
    }

    /// Refuses an object that does not fit into a picture of this size.
    pub(crate) fn check(&self, extent: Extent, number: usize) -> Result<(), InsertError> {
        let wrong = |fault| InsertError::Input(format!("object {number} {fault}"));
        let Placement { at, height, .. } = self.placement;
        let alpha = &self.relightable.matte.alpha;
        if !self.placement.is_seen(alpha, extent) {
            return Err(wrong(format!(
                "would lie completely outside the picture: its place is {},{} in parts of width and height",
                at[0], at[1]
            )));
        }
        let growth = height * extent.height as f64 / rows(alpha).len().max(1) as f64;
        if growth > MAX_GROWTH {
            return Err(wrong(format!(
                "would be enlarged {growth:.0} times: give a larger photograph or a smaller height"
            )));
        }
        Ok(())
    }
}
