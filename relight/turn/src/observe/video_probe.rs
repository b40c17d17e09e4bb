//! The ball in the video of a turn that measures its light.

use std::collections::HashMap;

use relight_core::image::{ColourSpace, Extent, Planes, Rgb, Srgb};
use relight_photo::files::{FrameTiming, MovieReader};
use relit_data::geometry::Rect;
use relit_data::session::Recording;
use relit_data::statistics::median;

use crate::error::TurnError;
use crate::observe::probe::{Probe, ProbeBuilder};
use crate::observe::probe_place::ProbePlace;
use crate::observe::reading::{ReadTurn, TurnOrigin};

/// Largest share of a ball that the mask may cover, 0 to 1. By hand: edges are not exact.
const MAX_COVERED: f64 = 0.05;
/// Side of the blocks in which frames are compared, pixels of the shard. By hand: shifts of a few pixels hardly
/// change them.
const BLOCK: usize = 16;
/// Relative difference of the light of blocks from which frames show something else. Measured: those of their own
/// video differ by 0.01 to 0.02, by JPEG and scaling.
const MAX_DIFFERENT: f64 = 0.12;

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
    let mut likeness = Likeness::new(turn);
    let mut ball = ProbeBuilder::new(probe);
    let (mut number, mut done) = (0, 0);
    while let Some(frame) = movie.frame()? {
        if let Some(&angle) = angles.get(&number) {
            likeness.compare(number, &frame);
            ball.push(angle, &frame)?;
            done += 1;
            progress(done, angles.len() as u64);
        }
        number += 1;
    }
    let other = |why: &str| Err(TurnError::other_video(&recording.video, why));
    if done == 0 {
        return other(&format!("none of the turn's frames is among its {number}"));
    }
    if !likeness.is_same() {
        return other("its frames do not show what those of the shard do");
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
    Err(TurnError::BallInMask {
        given: given.to_string(),
        percent: 100.0 * part.min(1.0),
    })
}

/// How like the shard's first frames the video's are.
struct Likeness<'a> {
    turn: &'a ReadTurn,
    /// Which of the shard's first frames is which of the video.
    wanted: HashMap<u64, usize>,
    differences: Vec<f64>,
}

impl<'a> Likeness<'a> {
    fn new(turn: &'a ReadTurn) -> Self {
        let numbers = turn.sources.iter().map(|&(number, _)| number);
        Self {
            turn,
            wanted: numbers.take(turn.first.len()).zip(0..).collect(),
            differences: Vec::new(),
        }
    }

    /// Compares a frame of the video with that of the shard, if it is one of the first, in blocks of the mask.
    fn compare(&mut self, number: u64, frame: &Rgb<Srgb>) {
        let (Some(&at), Some(origin)) = (self.wanted.get(&number), &self.turn.origin) else {
            return;
        };
        let shard = self.turn.first[at].planes();
        let Extent { width, height } = shard.extent();
        let across = width.div_ceil(BLOCK);
        let mut sums = vec![[[0.0; 3]; 2]; across * height.div_ceil(BLOCK)];
        let mask = self.turn.mask.plane(0);
        for at in (0..mask.len()).filter(|&at| mask[at] >= 0.5) {
            let (x, y) = (at % width, at / width);
            let Some(seen) = light_at(frame.planes(), origin.crop, (x, y), shard.extent()) else {
                continue;
            };
            let block = &mut sums[y / BLOCK * across + x / BLOCK];
            for c in 0..3 {
                block[0][c] += shard.plane(c)[at];
                block[1][c] += seen[c];
            }
        }
        let (mut apart, mut all) = (0.0, 0.0);
        for [shard, seen] in sums {
            for c in 0..3 {
                apart += f64::from(shard[c] - seen[c]).abs();
                all += f64::from(shard[c] + seen[c]) / 2.0;
            }
        }
        if all > 0.0 {
            self.differences.push(apart / all);
        }
    }

    /// Whether at least half of the frames are alike; where none can be compared, nothing speaks against it.
    fn is_same(&self) -> bool {
        median(self.differences.iter().copied()).unwrap_or(0.0) < MAX_DIFFERENT
    }
}

/// The light of the video's pixel in the middle of a pixel of the shard; none beyond the picture.
pub(crate) fn light_at(
    picture: &Planes<3>,
    crop: Rect,
    (x, y): (usize, usize),
    extent: Extent,
) -> Option<[f32; 3]> {
    let place = |from: i32, size: u32, at: usize, of: usize| {
        let middle = f64::from(from) + f64::from(size) * (at as f64 + 0.5) / of as f64;
        (middle >= 0.0).then_some(middle as usize)
    };
    let column = place(crop.x, crop.w, x, extent.width)?;
    let row = place(crop.y, crop.h, y, extent.height)?;
    let Extent { width, height } = picture.extent();
    (column < width && row < height).then(|| picture.pixel(column, row).map(Srgb::to_linear))
}

#[cfg(test)]
mod tests {
    use relit_data::session::Manifest;

    use super::*;
    use crate::observe::curves::CurveBuilder;
    use crate::observe::reading::TableRotation;
    use relight_core::image::Linear;

    const EXTENT: Extent = Extent {
        width: 32,
        height: 32,
    };
    /// Where the shard's frames are in the video's, at half the size.
    const CROP: Rect = Rect::new(20, 8, 64, 64);

    /// A frame of the video: a gradient that turns.
    fn picture(number: u64) -> Rgb<Srgb> {
        let angle = number as f32 / 12.0 * std::f32::consts::TAU;
        Rgb::new(Planes::from_fn(Extent::new(120, 80), |x, y| {
            let add_prior = (x as f32 - 52.0) * angle.cos() + (y as f32 - 40.0) * angle.sin();
            [0.5 + 0.01 * add_prior, 0.5, 0.5 - 0.005 * add_prior]
        }))
    }

    /// A shard of such frames, from another one on, with a round mask.
    fn shard(first: u64) -> ReadTurn {
        let mask = Planes::from_fn(EXTENT, |x, y| {
            let from = |at: usize| at as f32 - 15.5;
            [f32::from(u8::from(from(x).hypot(from(y)) < 14.0))]
        });
        let frames = (0..12).map(|number| {
            let picture = picture(first + number);
            let planes = Planes::from_fn(EXTENT, |x, y| {
                light_at(picture.planes(), CROP, (x, y), EXTENT).unwrap()
            });
            Rgb::<Linear>::new(planes)
        });
        let first: Vec<Rgb<Linear>> = frames.collect();
        let mut builder = CurveBuilder::new(EXTENT, mask.plane(0)).unwrap();
        for (number, frame) in first.iter().enumerate() {
            let angle = 30.0 * number as f64;
            builder
                .push(angle, EXTENT, frame.planes().planes())
                .unwrap();
        }
        ReadTurn {
            name: "mug".to_owned(),
            curves: builder.finish().unwrap(),
            rotation: TableRotation::default(),
            first,
            sources: (0..12)
                .map(|number| (number, 30.0 * number as f64))
                .collect(),
            origin: Some(TurnOrigin {
                session: "20261120T093015Z-mug".to_owned(),
                crop: CROP,
            }),
            mask,
            has_angles: true,
            damage: Vec::new(),
        }
    }

    fn is_same(turn: &ReadTurn) -> bool {
        let mut likeness = Likeness::new(turn);
        for number in 0..12 {
            likeness.compare(number, &picture(number));
        }
        assert_eq!(likeness.differences.len(), 12);
        likeness.is_same()
    }

    #[test]
    fn a_video_of_which_the_shard_was_not_made_is_noticed() {
        assert!(is_same(&shard(0)));
        assert!(!is_same(&shard(6)));
    }

    #[test]
    fn a_session_of_another_name_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("video.mkv");
        std::fs::write(&path, "").unwrap();
        let mut recording = Recording::open(&path).unwrap();
        let turn = shard(0);
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
        let turn = shard(0);
        let check = |x, y| check_mask(ProbePlace::new([x, y], 10.0).unwrap(), &turn);
        // The mask is a circle around 52, 40 of 28 pixels of the video.
        assert!(check(92.0, 40.0).is_ok());
        let refused = check(80.0, 40.0);
        let Err(TurnError::BallInMask { percent, .. }) = refused else {
            panic!("{refused:?}");
        };
        assert!((30.0..60.0).contains(&percent), "{percent}");
    }
}
