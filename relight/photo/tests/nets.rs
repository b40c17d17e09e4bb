//! The networks held against PyTorch: the same weights and input give the same output. `fixtures/nets/make.py` made the
//! fixtures.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use relight_photo::nets::paper;
use relight_photo::nets::{Graph, Inference, Tensor, Weights, decomposer};

const SIDE: usize = 128;
/// Of each output every thirteenth pixel is kept, in both directions.
const EVERY: usize = 13;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/nets")
        .join(name)
}

/// Numbers of [-1, 1) by SplitMix64, one for each place: as in `make.py`.
fn random(seed: u64, count: usize) -> impl Iterator<Item = f64> {
    (1..=count as u64).map(move |at| {
        let mut bits = (seed << 32).wrapping_add(at.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    })
}

/// Values for a parameter of this name: as in `make.py`.
fn formula(name: &str, shape: &[usize]) -> Tensor {
    let count: usize = shape.iter().product();
    let seed = name.bytes().map(u64::from).sum();
    let value = |number: f64| match shape.len() {
        _ if name.ends_with("bias") => 0.1 * number,
        1 => 1.0 + 0.1 * number,
        _ => (6.0 / (count / shape[0]) as f64).sqrt() * number,
    };
    let values = random(seed, count).map(|number| value(number) as f32);
    Tensor::new(shape.to_vec(), values.collect()).unwrap()
}

fn picture(channels: usize) -> Vec<f32> {
    let numbers = random(0, channels * SIDE * SIDE);
    numbers.map(|number| number as f32).collect()
}

fn answers_as_pytorch(graph: &Graph) {
    let parameters = graph.parameters().into_iter();
    let weights: Weights = parameters
        .map(|parameter| {
            let tensor = formula(&parameter.name, &parameter.shape);
            (parameter.name, tensor)
        })
        .collect();
    let net = Inference::new(graph, &weights, (SIDE, SIDE)).unwrap();
    let outputs = net.run(&picture(graph.input_channels())).unwrap();
    let all = Weights::read(&fixture("outputs.safetensors")).unwrap();
    let wanted = all.get(graph.name()).unwrap();
    let found: Vec<f32> = match outputs[0].shape() {
        [_, _, height, width] => {
            let kept = |at: &usize| {
                (at % width).is_multiple_of(EVERY) && (at / width % height).is_multiple_of(EVERY)
            };
            let all = 0..outputs[0].values().len();
            all.filter(kept).map(|at| outputs[0].values()[at]).collect()
        }
        _ => outputs[0].values().to_vec(),
    };
    assert_eq!(found.len(), wanted.values().len());
    let largest = wanted
        .values()
        .iter()
        .fold(1.0_f32, |most, value| most.max(value.abs()));
    for (found, wanted) in found.iter().zip(wanted.values()) {
        assert!((found - wanted).abs() < 1e-4 * largest, "{found} {wanted}");
    }
}

#[test]
fn the_papers_networks_answer_as_in_pytorch() {
    answers_as_pytorch(&paper::spec_net());
    answers_as_pytorch(&paper::normal_net());
    answers_as_pytorch(&paper::light_net());
}

#[test]
fn our_network_answers_as_in_pytorch() {
    answers_as_pytorch(&decomposer());
}

#[test]
fn the_answer_is_the_same_on_any_number_of_threads() {
    let graph = decomposer();
    let weights = Weights::initial(&graph, 3);
    let inference = Inference::new(&graph, &weights, (SIDE, SIDE)).unwrap();
    let input = picture(graph.input_channels());
    let [one, other] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| inference.run(&input)).unwrap()
    });
    assert!(one == other);
}

/// One of rayon's threads that waited within an inference would take over the next one.
#[test]
fn many_inferences_at_once_on_eight_threads_do_not_disturb_each_other() {
    let graph = decomposer();
    let weights = Weights::initial(&graph, 3);
    let inference = Inference::new(&graph, &weights, (SIDE, SIDE)).unwrap();
    let input = picture(graph.input_channels());
    let alone = inference.run(&input).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build();
    let is_same = |_| inference.run(&input).unwrap() == alone;
    let on_rayon = pool
        .unwrap()
        .install(|| (0..150).into_par_iter().all(is_same));
    let on_others = std::thread::scope(|scope| {
        let work = || scope.spawn(|| (0..10).all(is_same));
        let threads: Vec<_> = (0..5).map(|_| work()).collect();
        threads.into_iter().all(|thread| thread.join().unwrap())
    });
    assert!(on_rayon && on_others);
}

#[test]
fn half_precision_is_read_as_single() {
    let bfloat = Weights::read(&fixture("bfloat.safetensors")).unwrap();
    let wanted = formula("bfloat", &[4, 2]);
    let near = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-2;
    let values = bfloat.get("bfloat").unwrap().values();
    assert!(wanted.values().iter().zip(values).all(near));
}
