//! The reader of data sets, `relight_core::reader`. Decoding runs in threads of Rust without Python's lock. A batch is copied
//! into NumPy arrays once.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use numpy::{PyArray4, PyArrayMethods, ToPyArray};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use relight_core::reader::{
    Cursor, Draw, DrawPlan, Encoding, Rank, ReadError, Source, Stream, Streaming, TurnBatch, Turns,
};
use relit_data::causes::with_causes;

/// Finished batches that each thread holds ready.
const AHEAD: usize = 4;

/// A batch for Python: images, masks, keys, records as JSON (none for folders of images), damaged samples as text, and
/// the epoch and sample after it.
type PythonBatch<'py> = (
    Bound<'py, PyArray4<f32>>,
    Bound<'py, PyArray4<f32>>,
    Vec<String>,
    Vec<Option<String>>,
    Vec<String>,
    (u64, u64),
);

/// An opened data set.
#[pyclass(frozen)]
pub(crate) struct Data {
    turns: Arc<Turns>,
}

#[pymethods]
impl Data {
    #[new]
    fn new(py: Python<'_>, path: PathBuf, linear: bool) -> PyResult<Self> {
        let encoding = if linear {
            Encoding::Linear
        } else {
            Encoding::Srgb
        };
        let turns = py.detach(|| Turns::open(&path, encoding));
        Ok(Self {
            turns: Arc::new(turns.map_err(|error| open_error(&error))?),
        })
    }

    /// Names of the turns, in order.
    fn names(&self) -> Vec<String> {
        self.turns.names().map(str::to_owned).collect()
    }

    /// How many samples each turn has, damaged ones included.
    fn samples(&self) -> Vec<u32> {
        self.turns.turns()
    }

    /// Starts reading.
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn stream(
        &self,
        batch: u32,
        mixed: bool,
        seed: Option<u64>,
        rank: (u32, u32),
        from: (u64, u64),
        until_epoch: u64,
        threads: usize,
    ) -> PyResult<BatchStream> {
        let value = |what: &str| PyValueError::new_err(what.to_owned());
        let streaming = Streaming {
            plan: DrawPlan {
                batch: match batch {
                    0 => return Err(value("batch is 0: give 1 or more")),
                    batch => batch,
                },
                draw: if mixed { Draw::Mixed } else { Draw::Neighbours },
                seed,
                rank: Rank::new(rank.0, rank.1)
                    .ok_or_else(|| value("rank has to be below world_size"))?,
            },
            from: Cursor {
                epoch: from.0,
                sample: from.1,
            },
            until_epoch,
            threads: NonZeroUsize::new(threads)
                .ok_or_else(|| value("threads is 0: give 1 or more"))?,
            ahead: AHEAD,
        };
        let stream = Stream::start(&self.turns, streaming).map_err(|error| open_error(&error))?;
        Ok(BatchStream {
            stream: Mutex::new(stream),
        })
    }
}

/// Batches in the order of the plan.
#[pyclass(frozen)]
pub(crate) struct BatchStream {
    stream: Mutex<Stream<Turns>>,
}

#[pymethods]
impl BatchStream {
    /// The next batch; none at the end.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<PythonBatch<'py>>> {
        // A lock is poisoned where a thread of Rust broke off.
        let drawn = py.detach(|| self.stream.lock().ok().map(|mut stream| stream.next()));
        let drawn = drawn.ok_or_else(|| PyRuntimeError::new_err("reading failed"))?;
        let (drawn, damage) = match drawn {
            None => return Ok(None),
            Some(Ok(drawn)) => (drawn, Vec::new()),
            Some(Err(damaged)) => {
                let damage = damaged.damage.iter().map(ToString::to_string);
                (damaged.rest, damage.collect())
            }
        };
        let next = (drawn.next.epoch, drawn.next.sample);
        let batch = drawn.batch;
        let images = array(py, &batch, &batch.images, 3)?;
        let masks = array(py, &batch, &batch.masks, 1)?;
        let keys = batch.frames.iter().map(|frame| frame.key.clone()).collect();
        let records = batch
            .frames
            .iter()
            .map(|frame| frame.record.as_ref().map(serde_json::to_string).transpose())
            .collect::<Result<_, _>>()
            .map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        if let Ok(stream) = self.stream.lock() {
            stream.recycle(batch);
        }
        Ok(Some((images, masks, keys, records, damage, next)))
    }
}

/// Values of a batch as an array: frames, channels, rows, columns.
fn array<'py>(
    py: Python<'py>,
    batch: &TurnBatch,
    values: &[f32],
    channels: usize,
) -> PyResult<Bound<'py, PyArray4<f32>>> {
    let (rows, columns) = (batch.extent.height, batch.extent.width);
    let shape = [batch.frames.len(), channels, rows, columns];
    values.to_pyarray(py).reshape(shape)
}

fn open_error(error: &ReadError) -> PyErr {
    PyOSError::new_err(with_causes(error))
}
