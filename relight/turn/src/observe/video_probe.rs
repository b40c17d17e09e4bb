//! The ball in the video of a turn that measures its light.

use std::collections::HashMap;

use relight_core::image::Extent;
use relight_photo::files::{FrameTiming, MovieReader};
use relit_data::session::Recording;

use crate::error::TurnError;
use crate::observe::probe::{Probe, ProbeBuilder};
use crate::observe::probe_place::ProbePlace;
use crate::observe::reading::{ReadTurn, TurnOrigin};

/// Largest share of a ball that the mask may cover, 0 to 1. By hand: edges are not exact.
const MAX_COVERED: f64 = 0.05;
/// Reads the ball in the video of a turn. `progress` is called with the number of frames done, and of all frames.
///
/// # Errors
/// If the video cannot be read, is not that of the turn, or the ball is not in it or under the object's mask.
pub(crate) fn probe_from_video(
    recording: &Recording,
    turn: &ReadTurn,
    probe: Probe,
    progress: &dyn Fn(u64, u64),
) -> Result<ProbeBuilder, TurnError> {
    check_session(recording, turn.origin.as_ref())?;
    check_mask(probe.place, turn)?;
    let mut movie = MovieReader::open(&recording.video, FrameTiming::Each)?;
    let angles: HashMap<u64, f64> = turn.sources.iter().copied().collect();
    let mut ball = ProbeBuilder::new(probe);
    let (mut number, mut done) = (0, 0);
    while let Some(frame) = movie.frame()? {
        if let Some(&angle) = angles.get(&number) {
            ball.push(angle, &frame)?;
            done += 1;
            progress(done, angles.len() as u64);
        }
        number += 1;
    }
    let wanted = angles.len() as u64;
    if done < wanted {
        let why = format!("of the turn's {wanted} frames, {done} are among its {number}");
        return Err(TurnError::other_video(&recording.video, &why));
    }
    Ok(ball)
}

/// Checks that a session is the one named in the shard's records.
fn check_session(recording: &Recording, origin: Option<&TurnOrigin>) -> Result<(), TurnError> {
    let (Some(_), Some(origin)) = (&recording.manifest, origin) else {
        return Ok(());
    };
    // A shard can be made from a session's bare video: then its name is all that the records have.
    let is_video = recording
        .video
        .file_stem()
        .is_some_and(|stem| stem.to_string_lossy() == origin.session);
    if recording.id == origin.session || is_video {
        return Ok(());
    }
    let why = format!(
        "the shard was made from the session {}, and this is of {}",
        origin.session, recording.id
    );
    Err(TurnError::other_video(&recording.video, &why))
}

/// Whether a ball stands free of the object's mask.
fn check_mask(given: ProbePlace, turn: &ReadTurn) -> Result<(), TurnError> {
    let Some(origin) = &turn.origin else {
        return Ok(());
    };
    let Extent { width, height } = turn.mask.extent();
    let crop = origin.crop;
    let covered: f64 = turn
        .mask
        .plane(0)
        .iter()
        .enumerate()
        .filter(|(at, mask)| {
            let part = |at: usize, size: usize| (at as f64 + 0.5) / size as f64;
            let x = f64::from(crop.x) + f64::from(crop.w) * part(at % width, width);
            let y = f64::from(crop.y) + f64::from(crop.h) * part(at / width, height);
            let apart = (x - given.middle[0]).hypot(y - given.middle[1]);
            **mask >= 0.5 && apart < given.radius
        })
        .map(|_| f64::from(crop.w) * f64::from(crop.h) / (width * height) as f64)
        .sum();
    let part = covered / (std::f64::consts::PI * given.radius * given.radius);
    if part <= MAX_COVERED {
        return Ok(());
    }
    Err(TurnError::Refused(format!(
        "the object's mask covers {:.0} % of the ball at {given}: measure the ball's place again, or remove the ball from the \
         mask",
        100.0 * part.min(1.0)
    )))
}

#[cfg(test)]
mod tests {
    use relit_data::session::Manifest;

    use super::*;
    use crate::observe::curves::CurveBuilder;
    use crate::observe::reading::TableRotation;
    use relight_core::image::Planes;
    use relit_data::geometry::Rect;

    const EXTENT: Extent = Extent {
        width: 32,
        height: 32,
    };
    /// Where the shard's frames are in the video's, at half the size.
    const CROP: Rect = Rect::new(20, 8, 64, 64);

    /// A shard with a round mask.
    fn shard() -> ReadTurn {
        let mask = Planes::from_fn(EXTENT, |x, y| {
            let from = |at: usize| at as f32 - 15.5;
            [f32::from(u8::from(from(x).hypot(from(y)) < 14.0))]
        });
        let mut builder = CurveBuilder::new(EXTENT, mask.plane(0)).unwrap();
        let grey = [0.5; EXTENT.pixels()];
        for k in 0..12 {
            let angle = 30.0 * f64::from(k);
            builder.push(angle, EXTENT, [&grey; 3]).unwrap();
        }
        ReadTurn {
            name: "mug".to_owned(),
            curves: builder.finish().unwrap(),
            rotation: TableRotation::default(),
            first: Vec::new(),
            sources: Vec::new(),
            origin: Some(TurnOrigin {
                session: "20261120T093015Z-mug".to_owned(),
                crop: CROP,
            }),
            mask,
            has_angles: true,
            damage: Vec::new(),
        }
    }

    #[test]
    fn a_session_of_another_name_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("video.mkv");
        std::fs::write(&path, "").unwrap();
        let mut recording = Recording::open(&path).unwrap();
        let turn = shard();
        let check = |recording: &Recording| check_session(recording, turn.origin.as_ref());
        // Of a bare video nothing is known.
        assert!(check(&recording).is_ok());
        let manifest = br#"{
            "schema": "relit.session/1", "id": "20261120T101500Z-cup", "object": "cup",
            "created": "2026-11-20T10:15:00Z", "status": "recording",
            "camera": {"backend": "replay", "device": "", "name": "", "fourcc": "MJPG",
                       "width": 4, "height": 4, "fps": 30.0, "controls": {}},
            "turntable": null, "video": {"file": "video.mkv", "codec": "mjpeg"},
            "faults": [], "software": {"version": "1", "commit": ""}
        }"#;
        recording.manifest = Some(Manifest::from_json(manifest).unwrap());
        recording.id = "20261120T101500Z-cup".to_owned();
        let refused = check(&recording).unwrap_err().to_string();
        assert!(
            refused.contains("20261120T093015Z-mug") && refused.contains("-cup"),
            "{refused}"
        );
        recording.id = "20261120T093015Z-mug".to_owned();
        assert!(check(&recording).is_ok());
    }

    #[test]
    fn a_ball_under_the_mask_is_refused() {
        let turn = shard();
        let check = |x, y| check_mask(ProbePlace::new([x, y], 10.0).unwrap(), &turn);
        // The mask is a circle around 52, 40 of 28 pixels of the video.
        assert!(check(92.0, 40.0).is_ok());
        let refused = check(80.0, 40.0).unwrap_err().to_string();
        assert!(refused.contains(" % of the ball at 80,40,10"), "{refused}");
    }
}
