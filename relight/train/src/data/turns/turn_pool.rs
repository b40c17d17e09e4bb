//! The views that a step draws from, as tensors on the device.

use tch::{Device, Kind, Tensor};

use crate::data::view_ring::ViewPlanes;
use crate::error::TrainError;
use relight_synth::TurnView;

/// Views on a device.
#[derive(Debug)]
pub(super) struct TurnPool {
    /// [`TurnView::BASE`] planes.
    base: ViewPlanes,
    /// [`TurnView::FINISHES`] parts of [`TurnView::FINISH_PLANES`] planes.
    finishes: ViewPlanes,
    /// Of each view, the camera over the table, radians.
    elevations: Vec<f32>,
}

impl TurnPool {
    /// Room for so many views of a size; what is computed of them is of a kind.
    pub(super) fn new(views: usize, size: u32, place: (Kind, Device)) -> Result<Self, TrainError> {
        let planes = |each: usize, planes: usize| {
            ViewPlanes::new((views, each), [planes, size as usize], place)
        };
        Ok(Self {
            base: planes(1, TurnView::BASE)?,
            finishes: planes(TurnView::FINISHES, TurnView::FINISH_PLANES)?,
            elevations: vec![0.0; views],
        })
    }

    /// The number of views that fit.
    pub(super) fn len(&self) -> usize {
        self.elevations.len()
    }

    /// Width and height.
    pub(super) fn side(&self) -> i64 {
        self.base.side()
    }

    /// Of the view at each place, radians.
    pub(super) fn elevations(&self) -> &[f32] {
        &self.elevations
    }

    /// Puts a view at a place.
    pub(super) fn put(&mut self, place: usize, view: &TurnView) -> Result<(), TrainError> {
        self.base.put(place, &view.base)?;
        self.finishes.put(place, &view.finishes)?;
        self.elevations[place] = view.elevation;
        Ok(())
    }

    /// The base planes of views, `views x BASE x side x side`.
    pub(super) fn base(&self, places: impl Iterator<Item = usize>) -> Result<Tensor, TrainError> {
        self.base.of(places.map(|place| (place, 0)))
    }

    /// Materials, each by its view's place and its number.
    pub(super) fn finishes(
        &self,
        chosen: impl Iterator<Item = (usize, usize)>,
    ) -> Result<Tensor, TrainError> {
        self.finishes.of(chosen)
    }
}
