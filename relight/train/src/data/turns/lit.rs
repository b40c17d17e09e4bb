//! Views in a light that turns, on the device: the curve of each pixel as `batch x terms x 3 x side x side`, before there is a
//! camera.
//!
//! Each term of a curve is what a pixel shows of one light ([`relight_synth::TurnPlan::light`]):
//!
//! ```text
//! diffuse = albedo / π (E(n) - Σ blocked_lm L_lm + mean albedo Σ bounced_lm L_lm)
//! gloss   = s(n . e) L_blurred(mirrored direction), where that direction is not blocked
//! ```
//!
//! E is the irradiance of the light on an open surface (Ramamoorthi and Hanrahan 2001), s Schlick's reflectance, or the cosine
//! times a strength. Metal has gloss alone, in the colour of its albedo.

use std::f64::consts::PI;

use relight_synth::{CURVE_TERMS, TurnMaterial, TurnPlan, TurnView};
use tch::Tensor;

use crate::data::direction_maps::DirectionMaps;
use crate::data::view_pool::{FINISHES, Planned, ViewPool};
use crate::engine::tensors::{columns, dot, of_light, unit, upload};

/// A colour of less than this is black. Numerical.
const BLACK: f64 = 1e-3;

/// A turn to be made.
pub(super) type PlannedTurn = Planned<TurnPlan>;

/// A batch of turns.
#[derive(Debug)]
pub(super) struct LitTurns {
    /// 1 on the object, 1 channel.
    pub(super) mask: Tensor,
    /// Unit normals.
    pub(super) normals: Tensor,
    /// Linear albedo; of metal its reflectance.
    pub(super) albedo: Tensor,
    /// `batch x terms x 3 x side x side`.
    pub(super) curves: Tensor,
}

impl LitTurns {
    /// Lights turns of views.
    pub(super) fn new(
        pool: &ViewPool<TurnView>,
        maps: &DirectionMaps,
        turns: &[PlannedTurn],
    ) -> Self {
        let base = pool.base(turns);
        let part = |from: usize, count: usize| base.narrow(1, from as i64, count as i64);
        let mask = part(TurnView::MASK, 1);
        let finishes = turns.iter().map(|one| (one.place, one.plan.finish));
        let finish = pool.parts(FINISHES, finishes);
        let normals = finish.narrow(1, 0, 3);
        let albedo = painted(turns, &finish.narrow(1, 3, 3)) * &mask;
        let lights = lights(turns, &base);
        let to_table = to_table(turns, &pool.extra, &base);

        let coefficients = TurnView::ORDER.coefficients();
        let blocked = of_light(&lights, &part(TurnView::BLOCKED, coefficients));
        let open = maps.irradiance(&lights, &moved(&to_table, &normals));
        let mean = mean_over(&albedo, &mask);
        let bounced = part(TurnView::BOUNCED, TurnView::BASE - TurnView::BOUNCED);
        let bounced = of_light(&lights.narrow(1, 0, bounced.size()[1]), &bounced);
        let of = |value: fn(&TurnMaterial) -> f32| {
            let values: Vec<f32> = turns.iter().map(|one| value(&one.plan.material)).collect();
            columns(&values, turns.len(), &base)
        };
        let back = (&mean * of(|material| material.bounce)).unsqueeze(1);
        let diffuse = (by_term(&(&open - &blocked)) + by_term(&bounced) * &back)
            * (&albedo * (1.0 / PI)).unsqueeze(1);
        let is_metal = of(|material| f32::from(u8::from(material.is_metal)));
        let diffuse = &diffuse * (-&is_metal + 1.0).unsqueeze(1);

        let eye = part(TurnView::TOWARDS_EYE, 3);
        let facing = dot(&normals, &eye).clamp_min(0.0);
        let mirrored = unit(&(&normals * (&facing * 2.0) - &eye));
        let blurs: Vec<f32> = turns.iter().map(|one| one.plan.material.blur).collect();
        let seen = maps.radiance(&lights, &moved(&to_table, &mirrored), &blurs);
        let head_on = of(|material| material.reflectance);
        let is_fresnel = of(|material| f32::from(u8::from(material.is_fresnel))).gt(0.5);
        let schlick = (-&facing + 1.0).pow_tensor_scalar(5) * (-&head_on + 1.0) + &head_on;
        let is_glossy = head_on.gt(0.0);
        let strength = schlick.where_self(&is_fresnel, &(&head_on * &facing))
            * part(TurnView::MIRRORS, 1)
            * &is_glossy;
        let tint = &mean / mean.amax([1_i64], true).clamp_min(BLACK);
        let is_tinted = of(|material| f32::from(u8::from(material.is_tinted))).gt(0.5);
        let colour = tint.where_self(&is_tinted, &tint.ones_like());
        let colour = albedo.where_self(&is_metal.gt(0.5), &colour);
        let gloss = by_term(&seen) * (&colour * &strength).unsqueeze(1);
        Self {
            curves: (&diffuse + &gloss) * mask.unsqueeze(1),
            mask,
            normals,
            albedo,
        }
    }
}

/// Albedo as planned: of one colour, or darker than the view's.
fn painted(turns: &[PlannedTurn], albedo: &Tensor) -> Tensor {
    let of = |values: Vec<f32>| columns(&values, turns.len(), albedo);
    let plain = of(turns
        .iter()
        .flat_map(|one| one.plan.plain.unwrap_or_default())
        .collect());
    let is_plain = turns.iter().map(|one| one.plan.plain.is_some());
    let is_plain = of(is_plain.map(|is| f32::from(u8::from(is))).collect()).gt(0.5);
    let brightness = of(turns.iter().map(|one| one.plan.brightness).collect());
    plain.where_self(&is_plain, &(albedo * &brightness))
}

/// The light of each term, `batch x coefficients x (terms x 3)`.
fn lights(turns: &[PlannedTurn], like: &Tensor) -> Tensor {
    let values: Vec<f32> = turns
        .iter()
        .flat_map(|turn| turn.plan.light.as_flattened().as_flattened())
        .copied()
        .collect();
    let shape = [turns.len() as i64, -1, (3 * CURVE_TERMS) as i64];
    upload(&values, &shape, like)
}

/// Of each turn, the matrix that takes vectors of the viewer's frame into the table's, `batch x 3 x 3`.
fn to_table(turns: &[PlannedTurn], elevations: &[f32], like: &Tensor) -> Tensor {
    let rows = |turn: &PlannedTurn| TurnView::to_table(elevations[turn.place]);
    let values: Vec<f32> = turns.iter().flat_map(rows).flatten().collect();
    upload(&values, &[turns.len() as i64, 3, 3], like)
}

/// Vectors (`batch x 3 x side x side`) in another frame.
fn moved(matrices: &Tensor, vectors: &Tensor) -> Tensor {
    let size = vectors.size();
    let flat = vectors.reshape([size[0], 3, -1]);
    matrices.bmm(&flat).reshape(size)
}

fn by_term(of: &Tensor) -> Tensor {
    let size = of.size();
    of.reshape([size[0], CURVE_TERMS as i64, 3, size[2], size[3]])
}

/// The mean over the object, `batch x channels x 1 x 1`.
pub(super) fn mean_over(of: &Tensor, mask: &Tensor) -> Tensor {
    let over = |of: &Tensor| of.sum_dim_intlist([-2_i64, -1].as_slice(), true, None);
    over(&(of * mask)) / over(mask).clamp_min(1.0)
}
