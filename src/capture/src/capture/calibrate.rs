//! The constants of a rig that each of its sessions carries: which way its table turns, which the camera sees
//! by the background, and how high the camera looks down, which a person gives. They are kept in the folder of
//! sessions.

use std::path::{Path, PathBuf};
use std::{fs, io};

use image::imageops;
use relit_data::durable;
use relit_data::rig::{RigFacts, RotationDirection};
use relit_video::LiveDecoder;

use super::equipment::Equipment;
use super::error::CaptureError;
use super::locked_camera::{LockedCamera, NEXT_FRAME};
use super::preflight;
use super::stop::StopRequest;
use crate::preview::whole;
use relit_camera::Frame;
use relit_turntable::TurntableError;

/// The file's name. Its leading dot keeps it apart from recordings.
const FILE: &str = ".rig.json";
/// How far the table turns for a measurement, degrees, and how fast, degrees/s.
const JOG_DEG: f64 = 10.0;
const SPEED: f64 = 5.0;
/// Width of the pictures that are compared, pixels: from one to the next the background moves by less than one.
const WIDTH: u32 = 160;
/// Least motion from a picture to the next that counts, pixels.
const MIN_SHIFT: f64 = 0.02;
/// Fewest pictures that have to show a motion, and the part of them that has to agree.
const MIN_PICTURES: usize = 8;
const AGREED: f64 = 0.8;

/// What is known of the rig whose sessions lie in `root`; `None` before the first measurement.
///
/// # Errors
/// If the file cannot be read: sessions would lack what a person has measured.
pub fn read_facts(root: &Path) -> Result<Option<RigFacts>, CaptureError> {
    let path = path(root);
    let bytes = match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        read => read,
    };
    let read = bytes.and_then(|bytes| Ok(serde_json::from_slice(&bytes)?));
    read.map(Some)
        .map_err(CaptureError::system(path.display().to_string(), "read"))
}

/// Keeps what is known of the rig for its further sessions; returns the file.
///
/// # Errors
/// What the file system answers.
pub fn write_facts(root: &Path, facts: &RigFacts) -> Result<PathBuf, CaptureError> {
    let path = path(root);
    let bytes = serde_json::to_vec_pretty(facts).map_err(io::Error::from);
    let written = bytes.and_then(|bytes| durable::write_whole(&path, &bytes));
    written.map_err(CaptureError::system(path.display().to_string(), "written"))?;
    Ok(path)
}

fn path(root: &Path) -> PathBuf {
    root.join(FILE)
}

/// Turns the table a little while the camera runs, and back: which way it turns as its angle grows.
///
/// # Errors
/// What keeps a capture from beginning, or that the background shows no motion.
pub fn measure_rotation(
    equipment: &mut Equipment,
    stop: &StopRequest,
) -> Result<RotationDirection, CaptureError> {
    let clock = equipment.clock();
    let _part = clock.participate();
    let settings = equipment.settings().clone();
    equipment.open_table()?;
    equipment.open_camera()?;
    let (Some(camera), Some(table)) = (equipment.camera.as_mut(), equipment.table.as_ref()) else {
        let none = "the direction is measured with a camera and a table: give both";
        return Err(CaptureError::Missing(none.to_owned()));
    };
    let stream = LockedCamera::lock(camera.as_mut(), &settings, stop)?.stream;
    let ready = stop.over(table, || preflight::ready_table(table));
    stop.explain(ready)?;
    let status = table.status()?;
    let (_, high_deg) = table.limits(&status);
    let sign = if status.angle_deg + JOG_DEG <= high_deg {
        1.0
    } else {
        -1.0
    };
    let decoder = LiveDecoder::new(stream.format, stream.width, stream.height);
    let mut background = Background {
        decoder: decoder.map_err(|error| {
            CaptureError::Refused(format!(
                "the camera's pictures cannot be decoded ({error}): ask for another format"
            ))
        })?,
        last: None,
        shifts: Vec::new(),
    };
    let moved = stop.over(table, || {
        clock.scope(|scope| {
            let moving = scope.spawn("relit-jog", || table.jog(sign * JOG_DEG, Some(SPEED)));
            let moving = moving.map_err(CaptureError::system("a thread", "started"))?;
            while !moving.is_finished() {
                background.add(&camera.next_frame(NEXT_FRAME)?);
            }
            let moved = moving.join();
            Ok::<_, CaptureError>(moved.unwrap_or(Err(TurntableError::NotStopped))?)
        })
    });
    stop.explain(moved)?;
    let back = stop.over(table, || table.jog(-sign * JOG_DEG, None));
    stop.explain(back)?;
    let to_the_right = background.moves_to_the_right()? == (sign > 0.0);
    Ok(if to_the_right {
        RotationDirection::CounterClockwise
    } else {
        RotationDirection::Clockwise
    })
}

/// How the background moves from one picture to the next.
struct Background {
    decoder: LiveDecoder,
    last: Option<image::GrayImage>,
    /// Pixels to the right.
    shifts: Vec<f64>,
}

impl Background {
    /// Takes a frame; one that cannot be decoded is passed over.
    fn add(&mut self, frame: &Frame) {
        let Ok(Some(picture)) = self.decoder.decode(&frame.data) else {
            return;
        };
        let Some(rgb) = whole(&picture) else {
            return;
        };
        let (width, height) = rgb.dimensions();
        let height = (height * WIDTH).div_ceil(width.max(1)).max(1);
        let grey = imageops::grayscale(&imageops::thumbnail(&rgb, WIDTH, height));
        if let Some(last) = self.last.replace(grey.clone()) {
            self.shifts.extend(shift(&last, &grey));
        }
    }

    fn moves_to_the_right(&self) -> Result<bool, CaptureError> {
        let shifts = self.shifts.iter().copied();
        let moving = shifts.filter(|shift| shift.abs() >= MIN_SHIFT);
        let (right, left): (Vec<f64>, Vec<f64>) = moving.partition(|shift| *shift > 0.0);
        let all = right.len() + left.len();
        let most = right.len().max(left.len());
        if all < MIN_PICTURES || (most as f64) < AGREED * all as f64 {
            let unseen = "the camera does not see which way the table turns: make a lit background visible behind the object";
            return Err(CaptureError::Refused(unseen.to_owned()));
        }
        Ok(right.len() > left.len())
    }
}

/// The least-squares shift between two pictures by their gradients (B. D. Lucas and T. Kanade, 1981), pixels to
/// the right; `None` if there is nothing to see.
fn shift(before: &image::GrayImage, after: &image::GrayImage) -> Option<f64> {
    let (mut product, mut square) = (0.0, 0.0);
    let at = |picture: &image::GrayImage, x, y| f64::from(picture.get_pixel(x, y).0[0]);
    for y in 0..before.height() {
        for x in 1..before.width().saturating_sub(1) {
            let slope = |picture| at(picture, x + 1, y) - at(picture, x - 1, y);
            let slope = (slope(before) + slope(after)) / 4.0;
            product += slope * (at(after, x, y) - at(before, x, y));
            square += slope * slope;
        }
    }
    (square > 0.0).then(|| -product / square)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

    use super::*;

    fn wave(phase: f64) -> image::GrayImage {
        image::GrayImage::from_fn(WIDTH, 40, |x, _| {
            let value = 128.0 + 90.0 * ((f64::from(x) - phase) / 9.0).sin();
            image::Luma([value.round() as u8])
        })
    }

    #[test]
    fn a_shift_is_found_with_its_sign() {
        for moved in [-0.8, -0.1, 0.1, 0.8] {
            let found = shift(&wave(0.0), &wave(moved)).unwrap();
            assert!((found - moved).abs() < 0.05, "{moved}: {found}");
        }
    }

    #[test]
    fn what_is_known_of_a_rig_is_kept_in_its_folder() {
        let root = tempfile::tempdir().unwrap();
        assert_eq!(read_facts(root.path()).unwrap(), None);
        let facts = RigFacts {
            rotation: Some(RotationDirection::Clockwise),
            camera_elevation_deg: Some(18.5),
        };
        write_facts(root.path(), &facts).unwrap();
        assert_eq!(read_facts(root.path()).unwrap(), Some(facts));
        fs::write(path(root.path()), "{").unwrap();
        assert!(read_facts(root.path()).is_err());
    }

    #[test]
    fn the_direction_of_a_recorded_turn_shows_in_its_background() {
        let root = tempfile::tempdir().unwrap();
        let turn = "replay:../../fixtures/20261120T093015Z-cow?loop=1&speed=0";
        let settings = crate::capture::Settings::new(
            root.path().to_owned(),
            turn.parse().unwrap(),
            "sim:?speed=0".parse().unwrap(),
        );
        let mut equipment = Equipment::new(settings).unwrap();
        let stop = StopRequest::new(&equipment.clock());
        let found = measure_rotation(&mut equipment, &stop).unwrap();
        assert_eq!(found, RotationDirection::CounterClockwise);
    }
}
