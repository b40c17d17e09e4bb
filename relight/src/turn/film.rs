//! What the video of a turn shows beside the object: the room, and a ball that measures its light.

use std::collections::HashMap;
use std::path::Path;

use relit_data::session::Recording;

use super::{Probe, ProbeBuilder, ProbeLight, ReadTurn, RoomStrip, StripBuilder, TurnError};
use crate::movie::MovieReader;

/// What was seen beside the object.
#[derive(Debug)]
pub struct Filmed {
    strip: Option<RoomStrip>,
    probe: Option<ProbeBuilder>,
}

/// Reads the video of a turn: a session's folder, or the video file. `progress` is told how many of the turn's frames are
/// done, and how many there are.
///
/// # Errors
/// Where the video cannot be read, holds none of the turn's frames, or the ball is not in it.
pub fn film(
    path: &Path,
    turn: &ReadTurn,
    probe: Option<Probe>,
    progress: &dyn Fn(u64, u64),
) -> Result<Filmed, TurnError> {
    let recording = Recording::open(path)?;
    let mut movie = MovieReader::open(&recording.video)?;
    let angles: HashMap<u64, f64> = turn.sources.iter().copied().collect();
    let mut strip = StripBuilder::new(movie.extent())?;
    let mut probe = probe.map(ProbeBuilder::new).transpose()?;
    let (mut number, mut done) = (0, 0);
    while let Some(frame) = movie.frame()? {
        if let Some(&angle) = angles.get(&number) {
            strip.push(angle, &frame)?;
            if let Some(probe) = &mut probe {
                probe.push(angle, &frame)?;
            }
            done += 1;
            progress(done, angles.len() as u64);
        }
        number += 1;
    }
    if done == 0 {
        return Err(TurnError::OtherVideo {
            path: recording.video,
            frames: number,
        });
    }
    Ok(Filmed {
        strip: strip.finish(),
        probe,
    })
}

impl Filmed {
    /// The room around the table; none where its sides do not show the same room one after the other.
    #[must_use]
    pub const fn strip(&self) -> Option<&RoomStrip> {
        self.strip.as_ref()
    }

    /// The light by the ball, where there is one.
    ///
    /// # Errors
    /// Where the ball's frames tell too little.
    pub fn light(&mut self) -> Result<Option<ProbeLight>, TurnError> {
        self.probe.take().map(ProbeBuilder::finish).transpose()
    }
}
