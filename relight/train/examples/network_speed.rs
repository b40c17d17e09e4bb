//! Processor seconds of the decomposing network on one thread: `network_speed train|forward|inference|compose SIDE [BATCH [STEPS]]`.
//!
//! `train` makes steps of Adam on random pictures, `forward` computes them by libtorch without gradients, `inference`
//! as `relight decompose` does, and `compose` makes the samples of a batch that training draws from. The best of the steps
//! counts; of `compose`, whose samples differ, the mean.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::time::Duration;

use relight_photo::nets::{INPUTS, Inference, Weights, decomposer};
use relight_synth::{Folders, Library, Recipe};
use relight_train::{Adam, Composition, ComputePrecision, DataSettings, Model, RunSettings};
use tch::{Device, Kind, Tensor, no_grad};

/// The least processor time of the calls after the first, which is a warm-up.
fn least(
    steps: usize,
    mut call: impl FnMut() -> Result<(), Box<dyn Error>>,
) -> Result<f64, Box<dyn Error>> {
    call()?;
    let mut least = f64::INFINITY;
    for _ in 0..steps {
        let start = processor_time();
        call()?;
        least = least.min((processor_time() - start).as_secs_f64());
    }
    Ok(least)
}

fn processor_time() -> Duration {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.try_into().unwrap_or_default()
}

/// What `relight train` composes by default, with made shapes and panoramas.
fn composition(side: usize) -> Result<Composition, Box<dyn Error>> {
    let data = DataSettings::default();
    Ok(Composition {
        recipe: Recipe {
            size: u32::try_from(side)?,
            views: data.views,
            lightings: data.lightings,
            ..Recipe::default()
        },
        library: Library::read(&Folders::default())?,
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let what = arguments
        .next()
        .ok_or("say train, forward, inference or compose")?;
    let side: usize = arguments
        .next()
        .ok_or("give the side of a picture")?
        .parse()?;
    let batch: usize = arguments.next().as_deref().unwrap_or("1").parse()?;
    let steps: usize = arguments.next().as_deref().unwrap_or("5").parse()?;

    tch::set_num_threads(1);
    tch::manual_seed(1);
    let weights = Weights::initial(&decomposer(), 1);
    let shape = [batch, INPUTS, side, side].map(|n| n as i64);
    let pictures = Tensor::rand(shape, (Kind::Float, Device::Cpu));
    let model = || {
        Model::new(
            decomposer(),
            &weights,
            Device::Cpu,
            ComputePrecision::Single,
        )
    };
    let seconds = match what.as_str() {
        "train" => {
            let model = model()?;
            let mut adam = Adam::new(&RunSettings::default(), model.parameters())?;
            least(steps, || {
                let answer = model.forward(&pictures)?;
                answer[0].f_square()?.f_mean(None)?.f_backward()?;
                adam.step(model.parameters(), 1e-3, 1.0)?;
                Ok(())
            })?
        }
        "forward" => {
            let model = model()?;
            least(steps, || {
                no_grad(|| model.forward(&pictures))?;
                Ok(())
            })?
        }
        "inference" => {
            let inference = Inference::new(&decomposer(), &weights, (side, side))?;
            let values = Vec::<f32>::try_from(pictures.flatten(0, -1))?;
            least(steps, || {
                for picture in values.chunks_exact(INPUTS * side * side) {
                    inference.run(picture)?;
                }
                Ok(())
            })?
        }
        "compose" => {
            let views = composition(side)?;
            let samples = (batch * steps).max(1);
            let start = processor_time();
            let mut composed = 0;
            for view in 0_u64.. {
                if composed >= samples {
                    break;
                }
                composed += views.samples_of(view).len();
            }
            (processor_time() - start).as_secs_f64() * batch as f64 / composed as f64
        }
        other => {
            return Err(format!("{other}: say train, forward, inference or compose").into());
        }
    };
    println!("{{\"seconds\": {seconds}}}");
    Ok(())
}
