//! Reads each sample of a data set once and prints the speed: `read_turns DATA [THREADS [ROUNDS]]`.
//!
//! DATA is a shard, a folder of shards, or what else [`Turns::open`] takes.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use relight_core::reader::{Cursor, DrawPlan, Encoding, Stream, Streaming, Turns};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let data = arguments.next().ok_or("give a data set")?;
    let threads: NonZeroUsize = arguments.next().as_deref().unwrap_or("1").parse()?;
    let rounds: u64 = arguments.next().as_deref().unwrap_or("1").parse()?;

    let start = Instant::now();
    let turns = Arc::new(Turns::open(Path::new(&data), Encoding::Srgb)?);
    let opened = start.elapsed().as_secs_f64();

    let streaming = Streaming {
        plan: DrawPlan::from_turns(1),
        from: Cursor::default(),
        until_epoch: rounds,
        threads,
        ahead: 4,
    };
    let (mut samples, mut sum) = (0, 0.0);
    let mut stream = Stream::start(&turns, streaming)?;
    while let Some(drawn) = stream.next() {
        let batch = drawn?.batch;
        samples += batch.frames.len();
        sum += batch.images.first().copied().unwrap_or_default();
        stream.recycle(batch);
    }
    let seconds = start.elapsed().as_secs_f64();
    let rate = samples as f64 / seconds;
    println!(
        "{{\"samples\": {samples}, \"seconds\": {seconds:.3}, \"opening\": {opened:.4}, \
         \"per_second\": {rate:.1}, \"sum\": {sum}}}"
    );
    Ok(())
}
