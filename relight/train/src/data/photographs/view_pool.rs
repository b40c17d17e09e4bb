//! The views that a step draws from, as tensors on the device.

use tch::{Device, Kind, Tensor};

use crate::data::view_ring::ViewPlanes;
use crate::error::TrainError;
use relight_synth::{PhotoView, ViewLamp};

/// Views on a device.
#[derive(Debug)]
pub(super) struct ViewPool {
    /// [`PhotoView::BASE`] planes.
    base: ViewPlanes,
    /// [`PhotoView::FINISHES`] parts of [`PhotoView::FINISH_PLANES`] planes.
    finishes: ViewPlanes,
    /// [`PhotoView::LAMPS`] parts of one plane.
    visibility: ViewPlanes,
    /// The lamps of each view.
    lamps: Vec<Vec<ViewLamp>>,
}

impl ViewPool {
    /// Room for so many views of a size; what is computed of them is of a kind.
    pub(super) fn new(views: usize, size: u32, place: (Kind, Device)) -> Result<Self, TrainError> {
        let planes = |each: usize, planes: usize| {
            ViewPlanes::new((views, each), [planes, size as usize], place)
        };
        Ok(Self {
            base: planes(1, PhotoView::BASE)?,
            finishes: planes(PhotoView::FINISHES, PhotoView::FINISH_PLANES)?,
            visibility: planes(PhotoView::LAMPS, 1)?,
            lamps: vec![Vec::new(); views],
        })
    }

    /// The number of views that fit.
    pub(super) fn len(&self) -> usize {
        self.lamps.len()
    }

    /// Width and height.
    pub(super) fn side(&self) -> i64 {
        self.base.side()
    }

    /// The lamps of the view at each place.
    pub(super) fn lamps(&self) -> &[Vec<ViewLamp>] {
        &self.lamps
    }

    /// Puts a view at a place.
    pub(super) fn put(&mut self, place: usize, view: PhotoView) -> Result<(), TrainError> {
        self.base.put(place, &view.base)?;
        self.finishes.put(place, &view.finishes)?;
        self.visibility.put(place, &view.visibility)?;
        self.lamps[place] = view.lamps;
        Ok(())
    }

    /// The base planes of views, `views x BASE x side x side`.
    pub(super) fn base(&self, places: &[usize]) -> Result<Tensor, TrainError> {
        self.base.of(places.iter().map(|&place| (place, 0)))
    }

    /// Materials, each by its view's place and its number.
    pub(super) fn finishes(
        &self,
        chosen: impl Iterator<Item = (usize, usize)>,
    ) -> Result<Tensor, TrainError> {
        self.finishes.of(chosen)
    }

    /// The visible parts of lamps, each by its view's place and its number.
    pub(super) fn visibility(
        &self,
        chosen: impl Iterator<Item = (usize, usize)>,
    ) -> Result<Tensor, TrainError> {
        self.visibility.of(chosen)
    }
}
