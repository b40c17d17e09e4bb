//! Processor seconds of the decomposing network on one thread: `network_speed train|forward|inference|light|cast SIDE [BATCH [STEPS]]`.
//!
//! `train` makes steps of Adam on random pictures, `forward` computes them by libtorch without gradients, `inference`
//! as `relight decompose` does, `light` makes a batch of photographs of views that are cast, and `cast` casts a view. The best
//! of the steps counts; of `cast`, whose views differ, the mean.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use relight_photo::nets::{INPUTS, Inference, Weights, decomposer};
use relight_synth::{Folders, Library, PhotoView, ViewRecipe};
use relight_train::{
    Adam, ComputePrecision, DataSettings, Model, Photographs, Resources, RunSettings, keep_memory,
};
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

/// What `relight train` lights by default, of made shapes and panoramas.
fn photographs(side: usize, batch: usize) -> Result<Photographs, Box<dyn Error>> {
    let data = DataSettings {
        size: u32::try_from(side)?,
        views: u64::try_from(batch)?,
        new_views: 0,
        ..DataSettings::default()
    };
    let run = RunSettings {
        batch: u64::try_from(batch)?,
        ..RunSettings::default()
    };
    let resources = Resources {
        device: Device::Cpu,
        workers: 1,
        stop: Arc::default(),
    };
    Ok(Photographs::new(&data, &run, resources)?)
}

/// One view more with each call.
fn cast(side: usize) -> Result<impl FnMut() -> usize, Box<dyn Error>> {
    let library = Library::read(&Folders::default())?;
    let recipe = ViewRecipe {
        seed: 1,
        size: u32::try_from(side)?,
        rays: DataSettings::default().rays,
    };
    let mut next = 0..;
    Ok(move || {
        let number = next.next().unwrap_or_default();
        PhotoView::cast(&recipe, &library, number).base.len()
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let what = arguments
        .next()
        .ok_or("say train, forward, inference, light or cast")?;
    let side: usize = arguments
        .next()
        .ok_or("give the side of a picture")?
        .parse()?;
    let batch: usize = arguments.next().as_deref().unwrap_or("1").parse()?;
    let steps: usize = arguments.next().as_deref().unwrap_or("5").parse()?;

    tch::set_num_threads(1);
    keep_memory();
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
                adam.step(model.parameters(), 1e-3)?;
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
        "light" => {
            let mut photographs = photographs(side, batch)?;
            let mut step = 0;
            least(steps, || {
                photographs.batch(step)?;
                step += 1;
                Ok(())
            })?
        }
        "cast" => {
            let mut cast = cast(side)?;
            let start = processor_time();
            (0..steps).for_each(|_| {
                cast();
            });
            (processor_time() - start).as_secs_f64() / steps.max(1) as f64
        }
        other => {
            return Err(format!("{other}: say train, forward, inference, light or cast").into());
        }
    };
    println!("{{\"seconds\": {seconds}}}");
    Ok(())
}
