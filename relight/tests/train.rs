//! Training held against inference, and the optimiser against itself.
#![cfg(feature = "train")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use relight::nets::paper::{Head, light_net, normal_net};
use relight::nets::{Graph, Inference, Weights, decomposer};
use relight::train::{Adam, AdamSettings, ComputePrecision, Model};
use tch::{Device, Kind, Tensor};

const SIDE: i64 = 64;

fn input(channels: usize) -> Tensor {
    tch::manual_seed(5);
    Tensor::randn([1, channels as i64, SIDE, SIDE], (Kind::Float, Device::Cpu))
}

fn model(graph: Graph, precision: ComputePrecision) -> Model {
    let weights = Weights::initial(&graph, 3);
    Model::new(graph, &weights, Device::Cpu, precision).unwrap()
}

#[test]
fn what_is_trained_answers_as_what_is_shipped() {
    for graph in [decomposer(), normal_net(), light_net(Head::Pooled)] {
        let weights = Weights::initial(&graph, 3);
        let picture = input(graph.input_channels());
        let flat = Vec::<f32>::try_from(picture.flatten(0, -1)).unwrap();
        let side = SIDE as usize;
        let shipped = Inference::new(&graph, &weights, (side, side)).unwrap();
        let shipped = shipped.run(&flat).unwrap();
        let model = Model::new(graph, &weights, Device::Cpu, ComputePrecision::Single).unwrap();
        let trained = &model.forward(&picture).unwrap()[0];
        let trained = Vec::<f32>::try_from(trained.flatten(0, -1)).unwrap();
        let largest = trained
            .iter()
            .fold(1.0_f32, |most, value| most.max(value.abs()));
        for (a, b) in trained.iter().zip(shipped[0].values()) {
            assert!(
                (a - b).abs() < 1e-4 * largest,
                "{}: {a} {b}",
                model.graph().name()
            );
        }
        assert_eq!(model.weights().unwrap(), weights);
    }
}

/// Steps towards a constant output; the losses.
fn descend(model: &Model, adam: &mut Adam, steps: usize) -> Vec<f64> {
    let picture = input(model.graph().input_channels());
    (0..steps)
        .map(|_| {
            let output = &model.forward(&picture).unwrap()[0];
            let loss = (output - 0.5).square().mean(None);
            loss.backward();
            adam.step(model.parameters(), 1e-3, 1.0).unwrap();
            loss.double_value(&[])
        })
        .collect()
}

#[test]
fn steps_lower_the_loss_in_both_precisions() {
    for precision in [ComputePrecision::Single, ComputePrecision::Mixed] {
        let model = model(decomposer(), precision);
        let mut adam = Adam::new(AdamSettings::default(), model.parameters()).unwrap();
        let losses = descend(&model, &mut adam, 6);
        assert!(losses[5] < 0.8 * losses[0], "{losses:?}");
    }
}

#[test]
fn a_run_that_was_saved_goes_on_to_the_same_losses() {
    tch::set_num_threads(1);
    let first = model(light_net(Head::Pooled), ComputePrecision::Single);
    let mut adam = Adam::new(AdamSettings::default(), first.parameters()).unwrap();
    descend(&first, &mut adam, 3);
    let (weights, memory) = (first.weights().unwrap(), adam.memory().unwrap());
    let undisturbed = descend(&first, &mut adam, 3);

    let graph = light_net(Head::Pooled);
    let second = Model::new(graph, &weights, Device::Cpu, ComputePrecision::Single).unwrap();
    let mut adam = Adam::new(AdamSettings::default(), second.parameters()).unwrap();
    adam.recall(&memory, 3).unwrap();
    assert_eq!(descend(&second, &mut adam, 3), undisturbed);
}

#[test]
fn the_memory_of_another_network_is_refused() {
    let light = model(light_net(Head::Pooled), ComputePrecision::Single);
    let memory = Adam::new(AdamSettings::default(), light.parameters())
        .unwrap()
        .memory()
        .unwrap();
    let other = model(decomposer(), ComputePrecision::Single);
    let mut adam = Adam::new(AdamSettings::default(), other.parameters()).unwrap();
    assert!(adam.recall(&memory, 3).is_err());
}
