//! The views that a step draws from, as tensors on the device: a ring in which new views replace the oldest.

use tch::{Device, Kind, Tensor};

use crate::error::TrainError;
use relight_synth::{PhotoView, ViewLamp};

/// Views on a device.
#[derive(Debug)]
pub(super) struct ViewPool {
    side: i64,
    /// The type of what is computed of them.
    kind: Kind,
    /// `views x PhotoView::BASE x side x side`, as all others in half precision.
    base: Tensor,
    /// `(views x FINISHES) x FINISH_PLANES x side x side`.
    finishes: Tensor,
    /// `(views x LAMPS) x 1 x side x side`.
    visibility: Tensor,
    /// The lamps of each view.
    lamps: Vec<Vec<ViewLamp>>,
}

impl ViewPool {
    /// Room for so many views of a size; what is computed of them is of a kind.
    pub(super) fn new(
        views: usize,
        size: u32,
        (kind, device): (Kind, Device),
    ) -> Result<Self, TrainError> {
        let (count, side) = (views as i64, i64::from(size));
        let zeros = |each: usize, planes: usize| -> Result<Tensor, tch::TchError> {
            let shape = [count * each as i64, planes as i64, side, side];
            Tensor::f_zeros(shape, (Kind::Half, device))
        };
        Ok(Self {
            side,
            kind,
            base: zeros(1, PhotoView::BASE)?,
            finishes: zeros(PhotoView::FINISHES, PhotoView::FINISH_PLANES)?,
            visibility: zeros(PhotoView::LAMPS, 1)?,
            lamps: vec![Vec::new(); views],
        })
    }

    /// The number of views that fit.
    pub(super) fn len(&self) -> usize {
        self.lamps.len()
    }

    /// Width and height.
    pub(super) fn side(&self) -> i64 {
        self.side
    }

    /// The lamps of the view at each place.
    pub(super) fn lamps(&self) -> &[Vec<ViewLamp>] {
        &self.lamps
    }

    /// Puts a view at a place.
    pub(super) fn put(&mut self, place: usize, view: PhotoView) -> Result<(), TrainError> {
        let copy = |to: &Tensor, each: usize, values: &[half::f16]| -> Result<(), TrainError> {
            let mut to = to.f_narrow(0, (place * each) as i64, each as i64)?;
            to.f_copy_(&Tensor::f_from_slice(values)?.f_reshape(to.size())?)?;
            Ok(())
        };
        copy(&self.base, 1, &view.base)?;
        copy(&self.finishes, PhotoView::FINISHES, &view.finishes)?;
        copy(&self.visibility, PhotoView::LAMPS, &view.visibility)?;
        self.lamps[place] = view.lamps;
        Ok(())
    }

    /// The base planes of views, `views x BASE x side x side`.
    pub(super) fn base(&self, places: &[usize]) -> Result<Tensor, TrainError> {
        self.chosen(&self.base, places.iter().copied())
    }

    /// Materials, each by its view's place and its number.
    pub(super) fn finishes(
        &self,
        chosen: impl Iterator<Item = (usize, usize)>,
    ) -> Result<Tensor, TrainError> {
        let at = chosen.map(|(place, finish)| place * PhotoView::FINISHES + finish);
        self.chosen(&self.finishes, at)
    }

    /// The visible parts of lamps, each by its view's place and its number.
    pub(super) fn visibility(
        &self,
        chosen: impl Iterator<Item = (usize, usize)>,
    ) -> Result<Tensor, TrainError> {
        let at = chosen.map(|(place, lamp)| place * PhotoView::LAMPS + lamp);
        self.chosen(&self.visibility, at)
    }

    fn chosen(&self, of: &Tensor, at: impl Iterator<Item = usize>) -> Result<Tensor, TrainError> {
        let at: Vec<i64> = at.map(|at| at as i64).collect();
        let at = Tensor::f_from_slice(&at)?.f_to_device(of.device())?;
        Ok(of.f_index_select(0, &at)?.f_to_kind(self.kind)?)
    }
}
