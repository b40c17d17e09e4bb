//! An object at its size and rotation in a picture: everything that does not depend on light or place.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::height_field::HeightField;
use super::placement::{Fit, Foot};
use relight_core::image::Planes;
use relight_core::light::Normals;

/// An object as it stands, without its colours.
#[derive(Debug)]
pub(crate) struct PlacedObject {
    pub(crate) fit: Fit,
    /// How far it covers each pixel of the picture.
    pub(crate) alpha: Planes<1>,
    pub(crate) foot: Foot,
    /// Its shape, once a shadow was asked for.
    height_field: OnceLock<Option<HeightField>>,
}

impl PlacedObject {
    fn new(alpha: &Planes<1>, fit: Fit) -> Self {
        let alpha = fit.apply(alpha);
        Self {
            foot: Foot::from_alpha(&alpha),
            fit,
            alpha,
            height_field: OnceLock::new(),
        }
    }

    /// The shape of the object whose own normals these are; `None` if it covers no pixel by a half.
    pub(crate) fn height_field(&self, normals: &Normals) -> Option<&HeightField> {
        if self.height_field.get().is_none() {
            // Not within `get_or_init`: while this thread waits for others, it may take over another frame that comes here.
            let _ = self.height_field.set(self.new_height_field(normals));
        }
        self.height_field.get()?.as_ref()
    }

    fn new_height_field(&self, normals: &Normals) -> Option<HeightField> {
        let mut turned = self.fit.apply(normals.planes());
        let (sin, cos) = (self.fit.angle.sin() as f32, self.fit.angle.cos() as f32);
        let [x, y, _] = turned.planes_mut();
        for (x, y) in x.iter_mut().zip(y) {
            [*x, *y] = [cos * *x - sin * *y, sin * *x + cos * *y];
        }
        HeightField::new(&Normals::new(turned), &self.alpha)
    }
}

/// How an object stood last: while its light turns, or it is moved, it stands so again.
#[derive(Debug, Default)]
pub(crate) struct PlacedObjectCache(Mutex<Option<Arc<PlacedObject>>>);

impl PlacedObjectCache {
    /// An object that covers its own pixels so far, as it stands by this fit.
    pub(crate) fn get_or_place(&self, fit: Fit, alpha: &Planes<1>) -> Arc<PlacedObject> {
        if let Some(placed) = self.get().filter(|placed| placed.fit == fit) {
            return placed;
        }
        // Without the lock: while this thread waits for others, it may take over another frame that comes here.
        let placed = Arc::new(PlacedObject::new(alpha, fit));
        *self.lock() = Some(Arc::clone(&placed));
        placed
    }

    fn get(&self) -> Option<Arc<PlacedObject>> {
        self.lock().clone()
    }

    /// The kept value is always complete, whoever had the lock.
    fn lock(&self) -> MutexGuard<'_, Option<Arc<PlacedObject>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Clone for PlacedObjectCache {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.get()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Placement;
    use super::*;
    use relight_core::image::Extent;

    fn disc() -> Planes<1> {
        Planes::from_fn(Extent::new(40, 40), |x, y| {
            let [x, y] = [x, y].map(|at| at as f32 - 19.5);
            [f32::from(u8::from(x.hypot(y) < 16.0))]
        })
    }

    fn fit(height: f64, rotation: f64) -> Fit {
        let placement = Placement {
            at: [0.5, 0.9],
            height,
            rotation,
        };
        Fit::new(&disc(), placement, Extent::new(160, 120))
    }

    #[test]
    fn what_stands_as_before_is_not_made_again() {
        let last = PlacedObjectCache::default();
        let first = last.get_or_place(fit(0.5, 0.0), &disc());
        assert!(Arc::ptr_eq(
            &first,
            &last.get_or_place(fit(0.5, 0.0), &disc())
        ));
        let shape = first.height_field(&Normals::sphere(40)).unwrap();
        let again = first.height_field(&Normals::sphere(40)).unwrap();
        assert!(std::ptr::eq(shape, again));
    }

    #[test]
    fn what_stands_otherwise_is() {
        let last = PlacedObjectCache::default();
        let first = last.get_or_place(fit(0.5, 0.0), &disc());
        for other in [fit(0.6, 0.0), fit(0.5, 20.0)] {
            let changed = last.get_or_place(other, &disc());
            assert_eq!(changed.fit, other);
            assert_ne!(changed.alpha.extent(), first.alpha.extent());
        }
    }
}
