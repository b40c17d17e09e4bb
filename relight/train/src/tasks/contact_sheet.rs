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
    let shown = |of: &Tensor| of.f_clamp(0.0, 1.0)?.f_pow_tensor_scalar(1.0 / 2.2);
    let scaled = |of: &Tensor, to: &Tensor| scaled_to(of, to, mask);
    let colours = |normals: &Tensor| normals.f_mul_scalar(0.5)?.f_add_scalar(0.5);
    let lit = |shading: &Tensor| shading.f_mul_scalar(0.4);
    let columns = [
        shown(&batch.picture)?,
        shown(&batch.albedo)?,
        shown(&scaled(&prediction.albedo, &batch.albedo)?)?,
        shown(&lit(&batch.shading)?)?,
        shown(&lit(&scaled(&prediction.shading, &batch.shading)?)?)?,
        colours(&batch.normals)?,
        colours(&prediction.normals)?,
        shown(&batch.highlight)?,
        shown(&prediction.highlight)?,
    ];
    let (height, width) = (mask.size()[2], mask.size()[3]);
    let tiles = columns
        .iter()
        .map(|column| column.f_mul(mask)?.f_expand([-1, 3, height, width], false))
        .collect::<Result<Vec<_>, _>>()?;
    let rows = rows.min(mask.size()[0] as usize);
    let sheet = Tensor::f_cat(&tiles, 3)?
        .f_narrow(0, 0, rows as i64)?
        .f_permute([0, 2, 3, 1])?
        .f_mul_scalar(255.0)?
        .f_round()?
        .f_to_kind(Kind::Uint8)?
        .f_contiguous()?
        .f_view([-1])?;
    let (width, height) = (tiles.len() * width as usize, rows * height as usize);
    let values = Vec::<u8>::try_from(sheet)?;
    let picture = image::RgbImage::from_raw(width as u32, height as u32, values);
    let picture = picture.ok_or(TrainError::Fault(
        "a sheet of answers could not be laid out",
    ))?;
    Ok(relit_data::shard::encode_rgb(&picture)?)
}

/// A map times the factor for each sample that brings it nearest to another.
fn scaled_to(of: &Tensor, to: &Tensor, mask: &Tensor) -> Result<Tensor, tch::TchError> {
    let over = [1_i64, 2, 3];
    let sum = |a: &Tensor, b: &Tensor| {
        a.f_mul(b)?
            .f_mul(mask)?
            .f_sum_dim_intlist(over.as_slice(), true, None)
    };
    of.f_mul(&sum(of, to)?.f_div(&sum(of, of)?.f_clamp_min(1e-9)?)?)
}
