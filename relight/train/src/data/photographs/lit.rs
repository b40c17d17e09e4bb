//! Views in a light, on the device: shading, highlight and albedo of each photograph of a batch, as
//! `batch x channels x side x side`, before there is a camera.
//!
//! ```text
//! shading   = (E(n) - Σ blocked_lm L_lm)  +  Σ_lamps v (n . l)  +  mean albedo Σ bounced_lm L_lm
//! highlight = s Σ_lamps v (n . h)^α  +  (8 s / (α + 1)) (n . e) L_blurred(mirrored)
//! ```
//!
//! E is the irradiance of the room on an open surface (Ramamoorthi and Hanrahan 2001), L the room, v the visible part of a lamp.

use relight_synth::{PhotoPlan, PhotoView};
use tch::Tensor;

use super::VISIBILITY;
use crate::data::direction_maps::DirectionMaps;
use crate::data::view_pool::{FINISHES, Planned, ViewPool};
use crate::engine::tensors::{columns, dot, indices, of_light, over_channels, unit, upload};

/// Albedo is kept in this range.
const ALBEDO: (f64, f64) = (0.01, 0.95);
/// How sharp the edges of a print are.
const PRINT_EDGE: f64 = 15.0;

/// A photograph to be made.
pub(super) type PlannedPhoto = Planned<PhotoPlan>;

/// A batch in its light.
#[derive(Debug)]
pub(super) struct LitBatch {
    /// 1 on the object, 1 channel.
    pub(super) mask: Tensor,
    /// Unit normals.
    pub(super) normals: Tensor,
    /// Linear albedo.
    pub(super) albedo: Tensor,
    /// Irradiance.
    pub(super) shading: Tensor,
    /// Highlight.
    pub(super) highlight: Tensor,
}

impl LitBatch {
    /// Lights photographs of views.
    pub(super) fn new(
        pool: &ViewPool<PhotoView>,
        maps: &DirectionMaps,
        photos: &[PlannedPhoto],
    ) -> Self {
        let base = pool.base(photos);
        let part = |from: usize, count: usize| base.narrow(1, from as i64, count as i64);
        let mask = part(PhotoView::MASK, 1);
        let finishes = photos.iter().map(|one| (one.place, one.plan.finish));
        let finish = pool.parts(FINISHES, finishes);
        let normals = finish.narrow(1, 0, 3);
        let own_points = part(PhotoView::OBJECT_POINTS, 3);
        let printed = printed(pool, photos, &own_points, finish.narrow(1, 3, 3));
        let albedo = recoloured(photos, &printed) * &mask;

        let rooms = lights(photos, |plan| &plan.room, &base);
        let all = lights(photos, |plan| &plan.light, &base);
        let coefficients = PhotoView::ORDER.coefficients();
        let blocked = of_light(&rooms, &part(PhotoView::BLOCKED, coefficients));
        let open = maps.irradiance(&rooms, &normals);
        let mut lit = Self {
            shading: (&open - &blocked).clamp_min(0.0),
            highlight: albedo.zeros_like(),
            mask,
            normals,
            albedo,
        };
        let points = part(PhotoView::POINTS, 3);
        let eye = part(PhotoView::TOWARDS_EYE, 3);
        lit.add_lamps(pool, photos, &points, &eye);
        let bounced = of_light(&all, &part(PhotoView::BOUNCED, all.size()[1] as usize));
        lit.add_bounce(photos, &bounced);
        lit.add_mirrored(maps, photos, &rooms, &eye, &part(PhotoView::MIRRORS, 1));
        lit.shading = &lit.shading * &lit.mask;
        lit.highlight = &lit.highlight * &lit.mask;
        lit
    }

    /// What the surface sends to the camera.
    pub(super) fn image(&self) -> Tensor {
        &self.albedo * &self.shading + &self.highlight
    }

    /// The light of lamps, diffuse and as highlights.
    fn add_lamps(
        &mut self,
        pool: &ViewPool<PhotoView>,
        photos: &[PlannedPhoto],
        points: &Tensor,
        eye: &Tensor,
    ) {
        // Each lit lamp with the number of its photograph.
        let lit: Vec<(usize, &PlannedPhoto, usize)> = photos
            .iter()
            .enumerate()
            .flat_map(|(at, photo)| (0..photo.plan.lamps.len()).map(move |k| (at, photo, k)))
            .collect();
        if lit.is_empty() {
            return;
        }
        let device = points.device();
        let of = |values: Vec<f32>| columns(&values, lit.len(), points);
        let lamp = |&(_, photo, k): &(usize, &PlannedPhoto, usize)| {
            pool.extra[photo.place][photo.plan.lamps[k].lamp]
        };
        let centre = of(lit.iter().flat_map(|one| lamp(one).centre).collect());
        let irradiance = of(lit
            .iter()
            .flat_map(|(_, photo, k)| photo.plan.lamps[*k].irradiance)
            .collect());
        let seen = lit
            .iter()
            .map(|(_, photo, k)| (photo.place, photo.plan.lamps[*k].lamp));
        let visible = pool.parts(VISIBILITY, seen);
        let whose = indices(lit.iter().map(|(at, ..)| *at), device);

        let normals = self.normals.index_select(0, &whose);
        let way = &centre - points.index_select(0, &whose);
        let square = dot(&way, &way).clamp_min(1e-6);
        let towards = &way * square.rsqrt();
        let distance = dot(&centre, &centre);
        let aim = &centre * distance.rsqrt();
        // A round area that faces the origin, as bright as its irradiance there says.
        let falloff = dot(&towards, &aim).clamp_min(0.0) * &distance / &square;
        let cosine = dot(&normals, &towards).clamp_min(0.0);
        let arriving = &irradiance * (&visible * &falloff);
        let _ = self.shading.index_add_(0, &whose, &(&arriving * &cosine));

        let glossy: Vec<usize> = (0..lit.len())
            .filter(|&k| lit[k].1.plan.gloss.is_some())
            .collect();
        if glossy.is_empty() {
            return;
        }
        let lobes: Vec<(f32, [f32; 3])> = glossy
            .iter()
            .filter_map(|&k| {
                let gloss = lit[k].1.plan.gloss?;
                Some(lamp_lobe(
                    gloss.exponent,
                    gloss.reflectance,
                    lamp(&lit[k]).half_angle,
                ))
            })
            .collect();
        let exponents = lobes.iter().map(|(exponent, _)| *exponent).collect();
        let exponents: Vec<f32> = exponents;
        let exponent = columns(&exponents, glossy.len(), points);
        let strengths: Vec<f32> = lobes.iter().flat_map(|(_, strength)| *strength).collect();
        let strength = columns(&strengths, glossy.len(), points);
        let chosen = indices(glossy.iter().copied(), device);
        let pick = |of: &Tensor| of.index_select(0, &chosen);
        let whose = whose.index_select(0, &chosen);
        let half = unit(&(pick(&towards) + eye.index_select(0, &whose)));
        let lobe =
            dot(&pick(&normals), &half).clamp_min(1e-6).pow(&exponent) * pick(&cosine).gt(0.0);
        let highlight = pick(&arriving) * &lobe * &strength;
        let _ = self.highlight.index_add_(0, &whose, &highlight);
    }

    /// The light that the object throws onto itself.
    fn add_bounce(&mut self, photos: &[PlannedPhoto], bounced: &Tensor) {
        let bounce: Vec<f32> = photos.iter().flat_map(|one| one.plan.bounce).collect();
        let bounce = columns(&bounce, photos.len(), bounced);
        let over = |of: &Tensor| of.sum_dim_intlist([2_i64, 3].as_slice(), true, None);
        let mean = over(&self.albedo) / over(&self.mask).clamp_min(1.0);
        let light = bounced.clamp_min(0.0) * (&mean * &bounce);
        self.shading = &self.shading + &light;
    }

    /// Highlights of the room.
    fn add_mirrored(
        &mut self,
        maps: &DirectionMaps,
        photos: &[PlannedPhoto],
        rooms: &Tensor,
        eye: &Tensor,
        mirrors: &Tensor,
    ) {
        let device = rooms.device();
        let glossy: Vec<(usize, f32, [f32; 3])> = photos
            .iter()
            .enumerate()
            .filter_map(|(at, one)| {
                let gloss = one.plan.gloss?;
                Some((at, gloss.exponent, gloss.reflectance))
            })
            .collect();
        if glossy.is_empty() {
            return;
        }
        let whose = indices(glossy.iter().map(|(at, ..)| *at), device);
        let pick = |of: &Tensor| of.index_select(0, &whose);
        let (normals, eye) = (pick(&self.normals), pick(eye));
        let facing = dot(&normals, &eye).clamp_min(0.0);
        let mirrored = unit(&(&normals * (&facing * 2.0) - &eye));
        let blurs: Vec<f32> = glossy.iter().map(|(_, e, _)| 2.0 / e.sqrt()).collect();
        let strengths: Vec<f32> = glossy
            .iter()
            .flat_map(|(_, exponent, s)| s.map(|s| 8.0 * s / (exponent + 1.0)))
            .collect();
        let strength = columns(&strengths, glossy.len(), rooms);
        let seen = maps
            .radiance(&pick(rooms), &mirrored, &blurs)
            .clamp_min(0.0)
            * (&facing * pick(mirrors))
            * &strength;
        let _ = self.highlight.index_add_(0, &whose, &seen);
    }
}

/// The exponent and the strength of a highlight of a lamp that is seen under an angle: a Gaussian for the lobe and one for the
/// lamp, whose variance in the half vector is a sixteenth of the square of its half angle.
fn lamp_lobe(exponent: f32, reflectance: [f32; 3], half_angle: f32) -> (f32, [f32; 3]) {
    let broadened = 1.0 / (1.0 / exponent + half_angle * half_angle / 16.0);
    (broadened, reflectance.map(|s| s * broadened / exponent))
}

/// Albedo with the prints of those photographs that have one.
fn printed(
    pool: &ViewPool<PhotoView>,
    photos: &[PlannedPhoto],
    own_points: &Tensor,
    mut albedo: Tensor,
) -> Tensor {
    let device = albedo.device();
    let prints: Vec<_> = photos
        .iter()
        .enumerate()
        .filter_map(|(at, one)| Some((at, one.place, one.plan.print?)))
        .collect();
    if prints.is_empty() {
        return albedo;
    }
    let whose = indices(prints.iter().map(|(at, ..)| *at), device);
    let others = prints
        .iter()
        .map(|(_, place, print)| (*place, print.finish));
    let other = pool.parts(FINISHES, others).narrow(1, 3, 3);
    let count = prints.len() as i64;
    let waves: Vec<f32> = prints
        .iter()
        .flat_map(|(.., print)| print.waves.into_iter().flatten())
        .collect();
    let waves = upload(&waves, &[count, 3, 4], own_points);
    let points = own_points.index_select(0, &whose);
    let side = points.size()[2];
    let phases = waves.narrow(2, 0, 3).bmm(&points.reshape([count, 3, -1])) + waves.narrow(2, 3, 1);
    let sum = over_channels(&phases.sin()).reshape([count, 1, side, side]);
    let levels: Vec<f32> = prints.iter().map(|(.., print)| print.level).collect();
    let share = ((&sum - columns(&levels, prints.len(), own_points)) * PRINT_EDGE).sigmoid();
    let ground = albedo.index_select(0, &whose);
    let mixed = ground.lerp_tensor(&other, &share.expand_as(&other));
    albedo.index_copy_(0, &whose, &mixed)
}

/// Albedo in other colours.
fn recoloured(photos: &[PlannedPhoto], albedo: &Tensor) -> Tensor {
    let count = photos.len() as i64;
    let of = |values: Vec<f32>| columns(&values, photos.len(), albedo);
    // Column by column: the transpose of what a matrix of rows is.
    let mixes: Vec<f32> = photos
        .iter()
        .flat_map(|one| one.plan.recolour.into_iter().flatten())
        .collect();
    let mixes = upload(&mixes, &[count, 3, 3], albedo).transpose(1, 2);
    let contrast = of(photos.iter().map(|one| one.plan.contrast).collect());
    let plain = of(photos.iter().flat_map(|one| one.plan.plain).collect());
    let is_plain = photos.iter().map(|one| one.plan.plain != [0.0; 3]);
    let is_plain = of(is_plain.map(|is| f32::from(u8::from(is))).collect()).gt(0.5);
    let mixed = mixes
        .bmm(&albedo.reshape([count, 3, -1]))
        .reshape(albedo.size())
        .clamp(ALBEDO.0, ALBEDO.1)
        .pow(&contrast)
        .clamp(ALBEDO.0, ALBEDO.1);
    plain.where_self(&is_plain, &mixed)
}

/// Lights as `batch x coefficients x 3`.
fn lights<'a>(
    photos: &'a [PlannedPhoto],
    of: impl Fn(&'a PhotoPlan) -> &'a [[f32; 3]],
    like: &Tensor,
) -> Tensor {
    let values: Vec<f32> = photos
        .iter()
        .flat_map(|photo| of(&photo.plan).as_flattened().iter().copied())
        .collect();
    upload(&values, &[photos.len() as i64, -1, 3], like)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::{Direction, basis};
    use relight_core::render::cosine_lobe;
    use tch::{Device, Kind};

    use relight_synth::{EnvironmentLights, Folders, Library, ViewRecipe, made_panoramas};

    const SIZE: usize = 32;

    /// Three views and six photographs, two of each.
    fn photographs() -> (ViewPool<PhotoView>, Vec<PlannedPhoto>, Vec<PhotoView>) {
        let library = Library::read(&Folders::default()).unwrap();
        let recipe = ViewRecipe {
            seed: 4,
            size: SIZE as u32,
            rays: 64,
        };
        let views: Vec<PhotoView> = (0..3)
            .map(|number| PhotoView::cast(&recipe, &library, number))
            .collect();
        let mut pool = ViewPool::new(3, recipe.size, (Kind::Float, Device::Cpu));
        for (place, view) in views.iter().enumerate() {
            pool.put(place, view.clone());
        }
        let made = made_panoramas().unwrap();
        let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
        let rooms = EnvironmentLights::new(&panoramas, 2, 1);
        let photos = (0..24)
            .map(|seed| {
                let place = seed as usize % 3;
                let plan = PhotoPlan::draw(seed, &views[place].lamps, &rooms);
                PlannedPhoto { place, plan }
            })
            .collect();
        (pool, photos, views)
    }

    /// Shading and highlight of one pixel, by the formulas, number by number.
    fn by_formula(view: &PhotoView, plan: &PhotoPlan, pixel: usize) -> ([f64; 3], [f64; 3]) {
        let area = SIZE * SIZE;
        let of = |plane: usize| f64::from(view.base[plane * area + pixel]);
        let three = |plane: usize| [0, 1, 2].map(|c| of(plane + c));
        let finish = plan.finish * PhotoView::FINISH_PLANES;
        let normal = [0, 1, 2].map(|c| f64::from(view.finishes[(finish + c) * area + pixel]));
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let unit = |a: [f64; 3]| a.map(|x| x / dot(a, a).sqrt());
        let at = |direction: [f64; 3]| {
            let [x, y, z] = direction;
            basis(PhotoView::ORDER, Direction::new(x, y, z).unwrap())
        };
        let (eye, harmonics) = (three(PhotoView::TOWARDS_EYE), at(normal));
        let (mut shading, mut highlight) = ([0.0; 3], [0.0; 3]);
        for (k, room) in plan.room.iter().enumerate() {
            let part = harmonics[k] * cosine_lobe(k.isqrt()) - of(PhotoView::BLOCKED + k);
            (0..3).for_each(|c| shading[c] += part * f64::from(room[c]));
        }
        shading = shading.map(|value| value.max(0.0));
        for lit in &plan.lamps {
            let lamp = view.lamps[lit.lamp];
            let centre = lamp.centre.map(f64::from);
            let way = [0, 1, 2].map(|c| centre[c] - of(PhotoView::POINTS + c));
            let (towards, square) = (unit(way), dot(way, way));
            let falloff = dot(towards, unit(centre)).max(0.0) * dot(centre, centre) / square;
            let visible = f64::from(view.visibility[lit.lamp * area + pixel]) * falloff;
            let cosine = dot(normal, towards).max(0.0);
            for (c, highlight) in highlight.iter_mut().enumerate() {
                let arriving = f64::from(lit.irradiance[c]) * visible;
                shading[c] += arriving * cosine;
                let Some(gloss) = plan.gloss.filter(|_| cosine > 0.0) else {
                    continue;
                };
                let (exponent, strength) =
                    lamp_lobe(gloss.exponent, gloss.reflectance, lamp.half_angle);
                let half = unit([0, 1, 2].map(|c| towards[c] + eye[c]));
                let lobe = dot(normal, half).max(1e-6).powf(f64::from(exponent));
                *highlight += arriving * lobe * f64::from(strength[c]);
            }
        }
        if let Some(gloss) = plan.gloss {
            let facing = dot(normal, eye).max(0.0);
            let mirrored = at(unit([0, 1, 2].map(|c| 2.0 * facing * normal[c] - eye[c])));
            let blur = 4.0 / f64::from(gloss.exponent);
            for (c, highlight) in highlight.iter_mut().enumerate() {
                let seen: f64 = (0..plan.room.len())
                    .map(|k| {
                        let l = k.isqrt() as f64;
                        let left = (-0.5 * l * (l + 1.0) * blur).exp();
                        left * mirrored[k] * f64::from(plan.room[k][c])
                    })
                    .sum();
                let strength =
                    8.0 * f64::from(gloss.reflectance[c]) / f64::from(gloss.exponent + 1.0);
                *highlight += seen.max(0.0) * facing * of(PhotoView::MIRRORS) * strength;
            }
        }
        (shading, highlight)
    }

    #[test]
    fn tensors_light_views_as_the_formulas_do_one_by_one() {
        let (pool, mut photos, views) = photographs();
        for photo in &mut photos {
            photo.plan.bounce = [0.0; 3];
        }
        let maps = DirectionMaps::new(PhotoView::ORDER, (Kind::Float, Device::Cpu));
        let lit = LitBatch::new(&pool, &maps, &photos);
        let (mut off, mut sum) = ([0.0; 2], [0.0; 2]);
        for (at, photo) in photos.iter().enumerate() {
            let view = &views[photo.place];
            for pixel in (0..SIZE * SIZE)
                .filter(|&p| f32::from(view.base[p]) > 0.5)
                .step_by(5)
            {
                let expected = by_formula(view, &photo.plan, pixel);
                for (kind, (tensor, expected)) in
                    [(&lit.shading, expected.0), (&lit.highlight, expected.1)]
                        .into_iter()
                        .enumerate()
                {
                    for (c, expected) in expected.into_iter().enumerate() {
                        let (y, x) = ((pixel / SIZE) as i64, (pixel % SIZE) as i64);
                        let found = tensor.double_value(&[at as i64, c as i64, y, x]);
                        off[kind] += (found - expected).abs();
                        sum[kind] += expected;
                    }
                }
            }
        }
        assert!(off[0] < 0.01 * sum[0], "shading: {off:?} of {sum:?}");
        assert!(off[1] < 0.03 * sum[1], "highlight: {off:?} of {sum:?}");
    }

    #[test]
    fn a_photograph_is_lit_alike_whatever_else_is_in_its_batch() {
        let (pool, photos, _) = photographs();
        let maps = DirectionMaps::new(PhotoView::ORDER, (Kind::Float, Device::Cpu));
        let all = LitBatch::new(&pool, &maps, &photos);
        for (at, photo) in photos.iter().enumerate() {
            let one = LitBatch::new(&pool, &maps, std::slice::from_ref(photo));
            for (one, all) in [
                (one.image(), all.image()),
                (one.shading, all.shading.shallow_clone()),
            ] {
                let apart = one.get(0) - all.get(at as i64);
                assert!(apart.abs().max().double_value(&[]) < 1e-4);
            }
        }
    }

    #[test]
    fn light_that_bounces_makes_hollows_brighter_and_nothing_darker() {
        let (pool, mut photos, _) = photographs();
        let maps = DirectionMaps::new(PhotoView::ORDER, (Kind::Float, Device::Cpu));
        let shading = |photos: &[PlannedPhoto]| LitBatch::new(&pool, &maps, photos).shading;
        photos
            .iter_mut()
            .for_each(|photo| photo.plan.bounce = [0.0; 3]);
        let without = shading(&photos);
        photos
            .iter_mut()
            .for_each(|photo| photo.plan.bounce = [1.0; 3]);
        let more = shading(&photos) - without;
        assert!(more.min().double_value(&[]) > -1e-5 && more.max().double_value(&[]) > 0.01);
    }
}
