//! A turn's frames, once through, into curves.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::thread::available_parallelism;

use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::reader::{
    Cursor, Draw, DrawPlan, Encoding, Rank, Source, Stream, Streaming, TurnBatch, TurnFrame, Turns,
};
use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_data::rig::RotationDirection;
use serde::Serialize;

use crate::error::TurnError;
use crate::model::frame::FactSource;
use crate::observe::curves::{CurveBuilder, NOTHING, TurnCurves};

/// Frames that are drawn at a time. By convention of the shards: twelve neighbours cover the whole turn.
const BATCH: u32 = 12;

/// The rotation direction, and its source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct TableRotation {
    /// Seen from above, as the table's angle grows.
    pub direction: RotationDirection,
    /// What says so.
    pub source: FactSource,
}

/// The video that a shard was made from, by its records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TurnOrigin {
    /// The session's id.
    pub(crate) session: String,
    /// The part of the video's frames that the shard's show, pixels.
    pub(crate) crop: Rect,
}

/// A turn that was read.
#[derive(Debug)]
pub struct ReadTurn {
    /// Its name: the shard's.
    pub name: String,
    /// Its curves.
    pub curves: TurnCurves,
    /// Which way its table was taken to turn.
    pub rotation: TableRotation,
    /// Its first twelve frames, which cover the whole turn.
    pub first: Vec<Rgb<Linear>>,
    /// Where the frames stand in the turn's video, from 0, and the table's angle of each, degrees.
    pub(crate) sources: Vec<(u64, f64)>,
    /// The video itself; `None` if the frames have no records.
    pub(crate) origin: Option<TurnOrigin>,
    /// 1 on the object, else 0.
    pub mask: Planes<1>,
    /// Whether frames have their angles; else they are assumed to be evenly spread over one turn.
    pub has_angles: bool,
    /// The faults of frames that are left out.
    pub damage: Vec<String>,
}

impl ReadTurn {
    /// The same of a table that turns the other way, as `source` says.
    pub(crate) fn turned_other_way(mut self, source: FactSource) -> Self {
        self.curves = self.curves.with_other_direction();
        for (_, angle) in &mut self.sources {
            *angle = -*angle;
        }
        self.rotation = TableRotation {
            direction: self.rotation.direction.other(),
            source,
        };
        self
    }
}

/// Reads the turn of a shard, or of another input of [`Turns::open`], once. `progress` is called with the
/// number of frames done, and of all frames.
///
/// # Errors
/// If it cannot be opened, holds several turns, or shows too little.
pub fn read_curves(
    path: &Path,
    rotation: TableRotation,
    progress: &dyn Fn(u64, u64),
) -> Result<ReadTurn, TurnError> {
    let turns = Arc::new(Turns::open(path, Encoding::Linear)?);
    let names: Vec<&str> = turns.names().collect();
    let [name] = names.as_slice() else {
        return Err(TurnError::Refused(format!(
            "{} holds {} turns: give the shard (.tar) of one",
            path.display(),
            names.len()
        )));
    };
    let frames = turns.turns().iter().sum::<u32>();
    let streaming = Streaming {
        plan: DrawPlan {
            batch: BATCH,
            draw: Draw::Neighbours,
            seed: None,
            rank: Rank::ONLY,
        },
        from: Cursor::default(),
        until_epoch: 1,
        threads: available_parallelism().unwrap_or(NonZeroUsize::MIN),
        ahead: 2,
    };
    let mut reader = Reader {
        frames,
        rotation,
        builder: None,
        first: Vec::new(),
        sources: Vec::new(),
        origin: None,
        mask: None,
        has_angles: None,
        last_index: 0.0,
        damage: Vec::new(),
    };
    let mut stream = Stream::start(&turns, streaming)?;
    let mut done = 0;
    while let Some(shrunk) = stream.next() {
        let shrunk = shrunk.unwrap_or_else(|damaged| {
            reader
                .damage
                .extend(damaged.damage.iter().map(|one| with_causes(one)));
            damaged.rest
        });
        reader.take(&shrunk.batch)?;
        done += u64::from(BATCH);
        progress(done.min(frames.into()), frames.into());
        stream.recycle(shrunk.batch);
    }
    let damage = reader.damage.first().cloned();
    let finished = reader.finish((*name).to_owned());
    finished.map_err(|error| match damage {
        // That frames are missing explains it better than how many are left.
        Some(damage) => TurnError::Refused(format!(
            "{} is damaged ({damage}), and the rest of it cannot be solved: {}",
            path.display(),
            with_causes(&error)
        )),
        None => error,
    })
}

struct Reader {
    frames: u32,
    rotation: TableRotation,
    builder: Option<CurveBuilder>,
    first: Vec<Rgb<Linear>>,
    sources: Vec<(u64, f64)>,
    origin: Option<TurnOrigin>,
    mask: Option<Planes<1>>,
    /// As the first frame has it.
    has_angles: Option<bool>,
    last_index: f64,
    damage: Vec<String>,
}

impl Reader {
    fn take(&mut self, batch: &TurnBatch) -> Result<(), TurnError> {
        let (extent, pixels) = (batch.extent, batch.extent.pixels());
        for (at, frame) in batch.frames.iter().enumerate() {
            let image = &batch.images[3 * pixels * at..][..3 * pixels];
            let planes = [0, 1, 2].map(|c| &image[c * pixels..][..pixels]);
            let mask = &batch.masks[pixels * at..][..pixels];
            if frame.record.as_ref().is_some_and(|record| record.duplicate) {
                continue;
            }
            let Some(angle) = self.angle(frame) else {
                continue;
            };
            if let Some(record) = &frame.record {
                self.sources.push((record.source_frame, angle));
                self.origin.get_or_insert_with(|| TurnOrigin {
                    session: record.session.clone(),
                    crop: record.crop,
                });
            }
            self.builder(extent, mask)?.push(angle, extent, planes)?;
            if self.first.len() < BATCH as usize {
                let planes = planes.map(<[f32]>::to_vec);
                self.first
                    .push(Rgb::new(Planes::from_planes(extent, planes)?));
            }
        }
        Ok(())
    }

    /// The builder for the mask of the first frame.
    fn builder(&mut self, extent: Extent, mask: &[f32]) -> Result<&mut CurveBuilder, TurnError> {
        if self.builder.is_none() {
            self.mask = Some(Planes::from_planes(extent, [mask.to_vec()])?);
            self.builder = Some(CurveBuilder::new(extent, mask)?);
        }
        self.builder.as_mut().ok_or_else(nothing)
    }

    /// The angle of a frame in degrees; `None` if others have one and it has none, or the other way around.
    fn angle(&mut self, frame: &TurnFrame) -> Option<f64> {
        let recorded = frame.record.as_ref().and_then(|record| record.angle_deg);
        if *self.has_angles.get_or_insert(recorded.is_some()) != recorded.is_some() {
            let key = &frame.key;
            self.damage.push(match recorded {
                Some(_) => format!("{key} has an angle, others have none: it is left out"),
                None => format!("{key} has no angle, others have one: it is left out"),
            });
            return None;
        }
        self.last_index = self.last_index.max(index(frame));
        let degrees =
            recorded.unwrap_or_else(|| 360.0 * index(frame) / f64::from(self.frames.max(1)));
        Some(match self.rotation.direction {
            RotationDirection::CounterClockwise => degrees,
            RotationDirection::Clockwise => -degrees,
        })
    }

    fn finish(self, name: String) -> Result<ReadTurn, TurnError> {
        let has_angles = self.has_angles.unwrap_or(true);
        let indices = self.last_index as u64 + 1;
        if !has_angles && indices > self.frames.into() {
            return Err(TurnError::Refused(format!(
                "the frames have no angles, and only {} of at least {indices} are there: without angles, a turn has to be \
                 complete",
                self.frames
            )));
        }
        let builder = self.builder.ok_or_else(nothing)?;
        Ok(ReadTurn {
            name,
            curves: builder.finish()?,
            rotation: self.rotation,
            first: self.first,
            sources: self.sources,
            origin: self.origin,
            mask: self.mask.ok_or_else(nothing)?,
            has_angles,
            damage: self.damage,
        })
    }
}

fn nothing() -> TurnError {
    TurnError::Refused(NOTHING.to_owned())
}

/// Which frame of its turn it is: by its record, or by its key, which ends in the index.
fn index(frame: &TurnFrame) -> f64 {
    match &frame.record {
        Some(record) => f64::from(record.index),
        None => {
            let last = frame.key.rsplit('/').next().unwrap_or_default();
            last.parse().unwrap_or_default()
        }
    }
}
