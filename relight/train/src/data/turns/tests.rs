use std::f64::consts::PI;
use std::sync::Arc;

use relight_core::light::{Direction, basis};
use relight_core::render::cosine_lobe;
use relight_synth::{CurveTerms, made_panoramas};
use relight_turn::NetworkTurn;
use tch::Device;

use super::*;
use crate::data::direction_maps::DirectionMaps;
use crate::data::noise::NoiseTiles;
use crate::data::view_loader::{Cast, ViewLoader};
use crate::data::view_pool::ViewPool;

const SIZE: usize = 32;

/// Views and turns of them.
fn planned(count: u64) -> (OpenPool<TurnView>, Vec<PlannedTurn>, Vec<TurnView>) {
    let library = Library::read(&Folders::default()).unwrap();
    let recipe = ViewRecipe {
        seed: 4,
        size: SIZE as u32,
        rays: 64,
    };
    let views: Vec<TurnView> = (0..3)
        .map(|number| TurnView::cast(&recipe, &library, number))
        .collect();
    let place = (Kind::Float, Device::Cpu);
    let mut pool = ViewPool::new(3, recipe.size, place);
    for (place, view) in views.iter().enumerate() {
        pool.put(place, view.clone());
    }
    let made = made_panoramas().unwrap();
    let panoramas: Vec<_> = made.iter().map(|(_, panorama)| panorama).collect();
    let rooms = EnvironmentLights::new(&panoramas, 2, 1);
    let turns = (0..count)
        .map(|seed| {
            let place = seed as usize % 3;
            let plan = TurnPlan::draw(seed, views[place].elevation, &rooms);
            PlannedTurn { place, plan }
        })
        .collect();
    let cast: Cast<TurnView> = Arc::new(move |number| TurnView::cast(&recipe, &library, number));
    let resources = Resources {
        device: Device::Cpu,
        workers: 1,
        stop: Arc::default(),
    };
    let open = OpenPool {
        loader: ViewLoader::start(&cast, Rank::ONLY, 3, &resources).unwrap(),
        pool,
        maps: DirectionMaps::new(TurnView::ORDER, place),
        noise: NoiseTiles::new((36, SIZE as i64), 1, Device::Cpu),
    };
    (open, turns, views)
}

/// The curve of a pixel by the formulas, number by number; `mean` is the object's mean albedo.
fn by_formula(
    view: &TurnView,
    plan: &TurnPlan,
    pixel: usize,
    mean: [f64; 3],
) -> [[f64; 3]; CURVE_TERMS] {
    let area = SIZE * SIZE;
    let of = |plane: usize| f64::from(view.base[plane * area + pixel]);
    let finish = plan.finish * TurnView::FINISH_PLANES;
    let own = |plane: usize| f64::from(view.finishes[(finish + plane) * area + pixel]);
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let rows = TurnView::to_table(view.elevation).map(|row| row.map(f64::from));
    let harmonics_at = |towards: [f64; 3]| {
        let [x, y, z] = rows.map(|row| dot(row, towards));
        basis(TurnView::ORDER, Direction::new(x, y, z).unwrap())
    };
    let (normal, eye) = ([0, 1, 2].map(own), [1, 2, 3].map(of));
    let facing = dot(normal, eye).max(0.0);
    let mirrored = [0, 1, 2].map(|axis| 2.0 * facing * normal[axis] - eye[axis]);
    let (diffuse, gloss) = (harmonics_at(normal), harmonics_at(mirrored));
    let albedo: [f64; 3] = match plan.plain {
        Some(plain) => plain.map(f64::from),
        None => [3, 4, 5].map(|plane| own(plane) * f64::from(plan.brightness)),
    };
    let material = plan.material;
    let head_on = f64::from(material.reflectance);
    let strength = of(TurnView::MIRRORS)
        * match (material.is_fresnel, head_on > 0.0) {
            (_, false) => 0.0,
            (true, _) => head_on + (1.0 - head_on) * (1.0 - facing).powi(5),
            (false, _) => head_on * facing,
        };
    let brightest = mean.into_iter().fold(0.0, f64::max);
    let colour = [0, 1, 2].map(|c| match (material.is_metal, material.is_tinted) {
        (true, _) => albedo[c],
        (false, true) => mean[c] / brightest,
        (false, false) => 1.0,
    });
    std::array::from_fn(|term| {
        [0, 1, 2].map(|c| {
            let mut sum = 0.0;
            for (k, light) in plan.light.iter().enumerate() {
                let l = k.isqrt() as f64;
                let bounced = match k {
                    0..9 => of(TurnView::BOUNCED + k) * mean[c] * f64::from(material.bounce),
                    _ => 0.0,
                };
                let lobe = cosine_lobe(k.isqrt());
                let taken = diffuse[k] * lobe - of(TurnView::BLOCKED + k) + bounced;
                let matt = if material.is_metal {
                    0.0
                } else {
                    albedo[c] / PI * taken
                };
                let left = (-0.5 * l * (l + 1.0) * f64::from(material.blur).powi(2)).exp();
                let mirror = colour[c] * strength * gloss[k] * left;
                sum += (matt + mirror) * f64::from(light[term][c]);
            }
            sum
        })
    })
}

#[test]
fn tensors_light_turns_as_the_formulas_do_one_by_one() {
    let (open, turns, views) = planned(60);
    let lit = LitTurns::new(&open.pool, &open.maps, &turns);
    let means = lit::mean_over(&lit.albedo, &lit.mask);
    // Matt, glossy, metal.
    let (mut off, mut sum) = ([0.0; 3], [0.0; 3]);
    for (at, turn) in turns.iter().enumerate() {
        let view = &views[turn.place];
        let mean = [0, 1, 2].map(|c| means.double_value(&[at as i64, c, 0, 0]));
        let material = turn.plan.material;
        let kind = match (material.is_metal, material.reflectance > 0.0) {
            (true, _) => 2,
            (false, glossy) => usize::from(glossy),
        };
        for pixel in (0..SIZE * SIZE)
            .filter(|&p| f32::from(view.base[p]) > 0.5)
            .step_by(7)
        {
            let expected = by_formula(view, &turn.plan, pixel, mean);
            let (y, x) = ((pixel / SIZE) as i64, (pixel % SIZE) as i64);
            for (term, expected) in expected.iter().enumerate() {
                for (c, expected) in expected.iter().enumerate() {
                    let place = [at as i64, term as i64, c as i64, y, x];
                    off[kind] += (lit.curves.double_value(&place) - expected).powi(2);
                    sum[kind] += expected.powi(2);
                }
            }
        }
    }
    for (kind, most) in [(0, 0.01), (1, 0.02), (2, 0.08)] {
        let apart: f64 = (off[kind] / sum[kind]).sqrt();
        assert!(sum[kind] > 0.0 && apart < most, "kind {kind}: {apart}");
    }
}

/// The covered pixels of a turn of a batch, and their curves.
fn curves_of(lit: &LitTurns, at: usize) -> (Vec<u32>, Vec<CurveTerms>) {
    let pixels: Vec<u32> = (0..(SIZE * SIZE) as u32)
        .filter(|&pixel| {
            let (y, x) = (
                i64::from(pixel) / SIZE as i64,
                i64::from(pixel) % SIZE as i64,
            );
            lit.mask.double_value(&[at as i64, 0, y, x]) > 0.5
        })
        .collect();
    let curves = pixels.iter().map(|&pixel| {
        let (y, x) = (
            i64::from(pixel) / SIZE as i64,
            i64::from(pixel) % SIZE as i64,
        );
        std::array::from_fn(|term| {
            [0, 1, 2].map(|c| lit.curves.double_value(&[at as i64, term as i64, c, y, x]) as f32)
        })
    });
    (pixels.clone(), curves.collect())
}

#[test]
fn the_network_sees_the_same_in_training_as_at_work() {
    let (open, turns, _) = planned(12);
    let lit = LitTurns::new(&open.pool, &open.maps, &turns);
    let noise = open.noise.of(&[7; 12], Kind::Float);
    let seen = filmed(lit, &turns, &noise);
    let input = network_input(&seen.curves, &seen.mask, &turns);
    for (at, turn) in turns.iter().enumerate() {
        let (pixels, curves) = curves_of(&seen, at);
        let at_work = relight_turn::network_input(&NetworkTurn {
            side: SIZE,
            pixels: &pixels,
            curves: &curves,
            elevation: turn.plan.elevation,
        });
        let at_work = Tensor::from_slice(&at_work).reshape(input.get(at as i64).size());
        let apart = (input.get(at as i64) - at_work)
            .abs()
            .max()
            .double_value(&[]);
        assert!(apart < 2e-3, "turn {at}: {apart}");
    }
}

#[test]
fn a_turn_is_the_same_whatever_else_is_in_its_batch() {
    let (open, turns, _) = planned(12);
    let seeds: Vec<u64> = (0..12).collect();
    let all = batch_of(&open, &turns, &seeds);
    for at in 0..turns.len() {
        let one = batch_of(&open, &turns[at..=at], &seeds[at..=at]);
        for (one, all) in [(one.input, &all.input), (one.normals, &all.normals)] {
            let apart = one.get(0) - all.get(at as i64);
            assert!(apart.abs().max().double_value(&[]) < 1e-3);
        }
    }
}

#[test]
fn in_a_mirror_a_turn_is_that_of_the_mirrored_object_in_the_mirrored_light() {
    let (open, mut turns, _) = planned(6);
    let filmed_with = |turns: &[PlannedTurn]| {
        let lit = LitTurns::new(&open.pool, &open.maps, turns);
        let noise = Tensor::zeros(
            [6, 36, SIZE as i64, SIZE as i64],
            (Kind::Float, Device::Cpu),
        );
        filmed(lit, turns, &noise)
    };
    for turn in &mut turns {
        turn.plan.is_mirrored = false;
        turn.plan.timing = None;
        turn.plan.clipped = None;
    }
    let own = filmed_with(&turns);
    turns
        .iter_mut()
        .for_each(|turn| turn.plan.is_mirrored = true);
    let mirrored = filmed_with(&turns);
    // At the angle a the mirrored turn shows the mirror image of what the other shows at -a.
    for (at, angle) in [(0, 0.4), (3, 2.9), (5, -1.3)] {
        let shown = |of: &LitTurns, angle: f64| {
            let mut sum = of.curves.get(at).get(0);
            for m in 1..=6_i64 {
                let (sin, cos) = (m as f64 * angle).sin_cos();
                sum += of.curves.get(at).get(2 * m - 1) * cos - of.curves.get(at).get(2 * m) * sin;
            }
            sum
        };
        // x becomes -x: azimuths are counted from the other side, half a turn further.
        let expected = shown(&own, -angle).flip([-1]);
        let found = shown(&mirrored, angle + PI);
        let apart = (found - &expected).abs().max().double_value(&[]);
        let largest = expected.abs().max().double_value(&[]);
        assert!(apart < 1e-3 * largest, "turn {at}: {apart} of {largest}");
    }
}

#[test]
fn clipping_darkens_the_bright_pixels_of_the_turns_that_clip_and_no_others() {
    let (open, mut turns, _) = planned(6);
    for turn in &mut turns {
        turn.plan.is_mirrored = false;
        turn.plan.timing = None;
        turn.plan.clipped = None;
        turn.plan.noise = [0.0; 2];
    }
    let noise = Tensor::zeros(
        [6, 36, SIZE as i64, SIZE as i64],
        (Kind::Float, Device::Cpu),
    );
    let film = |turns: &[PlannedTurn]| {
        let lit = LitTurns::new(&open.pool, &open.maps, turns);
        filmed(lit, turns, &noise).curves
    };
    let before = film(&turns);
    turns[2].plan.clipped = Some(0.7);
    let after = film(&turns);
    for at in [0, 1, 3, 4, 5] {
        assert_eq!(before.get(at), after.get(at));
    }
    let mean = |of: &Tensor| of.get(2).get(0).amax([0_i64], false);
    let cut = mean(&before) - mean(&after);
    assert!(cut.min().double_value(&[]) > -1e-5);
    let covered = mean(&before).gt(0.0).sum(Kind::Float).double_value(&[]);
    let changed = cut.gt(1e-5).sum(Kind::Float).double_value(&[]) / covered;
    // White is where three tenths of the curves can reach at most.
    assert!((0.02..0.31).contains(&changed), "{changed}");
}
