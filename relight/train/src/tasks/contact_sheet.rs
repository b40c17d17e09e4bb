//! Sheets of predictions beside the ground truth, to be looked at while a network trains.

use tch::{Kind, Tensor};

use super::decompose::PredictedTensors;
use crate::data::sample::TruthBatch;
use crate::error::TrainError;

/// The first samples of a batch as PNG, a row each: the picture; albedo, shading, normals and highlight, the ground truth left of
/// each prediction. Albedo and shading in the scale that suits the ground truth best.
///
/// # Errors
/// [`TrainError::Torch`], [`TrainError::Encode`].
pub(crate) fn validation_sheet(
    batch: &TruthBatch,
    prediction: &PredictedTensors,
    rows: usize,
) -> Result<Vec<u8>, TrainError> {
    let mask = &batch.mask;
    let shown = |of: &Tensor| of.clamp(0.0, 1.0).pow_tensor_scalar(1.0 / 2.2);
    let scaled = |of: &Tensor, to: &Tensor| scaled_to(of, to, mask);
    let colours = |normals: &Tensor| normals * 0.5 + 0.5;
    let lit = |shading: &Tensor| shading * 0.4;
    let columns = [
        shown(&batch.picture),
        shown(&batch.albedo),
        shown(&scaled(&prediction.albedo, &batch.albedo)),
        shown(&lit(&batch.shading)),
        shown(&lit(&scaled(&prediction.shading, &batch.shading))),
        colours(&batch.normals),
        colours(&prediction.normals),
        shown(&batch.highlight),
        shown(&prediction.highlight),
    ];
    let (height, width) = (mask.size()[2], mask.size()[3]);
    let tiles = columns
        .iter()
        .map(|column| (column * mask).expand([-1, 3, height, width], false))
        .collect::<Vec<_>>();
    let rows = rows.min(mask.size()[0] as usize);
    let sheet = (Tensor::cat(&tiles, 3)
        .narrow(0, 0, rows as i64)
        .permute([0, 2, 3, 1])
        * 255.0)
        .round()
        .to_kind(Kind::Uint8)
        .contiguous()
        .view([-1]);
    let (width, height) = (tiles.len() * width as usize, rows * height as usize);
    let values = Vec::<u8>::try_from(sheet)?;
    let picture = image::RgbImage::from_raw(width as u32, height as u32, values);
    let picture = picture.ok_or(TrainError::Fault(
        "a sheet of answers could not be laid out",
    ))?;
    Ok(relit_data::shard::encode_rgb(&picture)?)
}

/// A map times the factor for each sample that brings it nearest to another.
fn scaled_to(of: &Tensor, to: &Tensor, mask: &Tensor) -> Tensor {
    let over = [1_i64, 2, 3];
    let sum = |a: &Tensor, b: &Tensor| (a * b * mask).sum_dim_intlist(over.as_slice(), true, None);
    of * (sum(of, to) / sum(of, of).clamp_min(1e-9))
}
