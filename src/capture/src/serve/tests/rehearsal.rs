//! A rig that goes through its phases by itself, to look at the page with a browser:
//! `cargo test --lib rehearsal -- --ignored --nocapture`, then open the address that it prints.

use std::fs;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use image::{Rgb, RgbImage};

use super::Serving;
use crate::state::{Phase, TakeSummary, Verdict};
use relit_video::Video;

const TURN: u64 = 300;

fn pictures(serving: &Serving) -> Vec<Arc<[u8]>> {
    let file = serving
        .root
        .path()
        .join("20261120T102000Z-bust-short/video.mkv");
    let video = Video::open(&file).unwrap();
    let numbers: Vec<u64> = (0..video.frames().len() as u64).collect();
    let reader = video.read(&numbers, 1).unwrap();
    reader
        .map(|pending| {
            let picture = video.picture(pending).unwrap();
            let (w, h) = picture.size();
            let mut picture = picture
                .rgb(relit_data::geometry::Rect::new(0, 0, w, h))
                .unwrap();
            clip(&mut picture);
            let mut jpeg = Vec::new();
            image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 85)
                .encode_image(&picture)
                .unwrap();
            jpeg.into()
        })
        .collect()
}

/// A lamp in the corner, so that the zebra has something to show.
fn clip(picture: &mut RgbImage) {
    for (x, y) in (20..60).flat_map(|x| (20..60).map(move |y| (x, y))) {
        if (x - 40_i32).pow(2) + (y - 40_i32).pow(2) < 300 {
            picture.put_pixel(x as u32, y as u32, Rgb([255; 3]));
        }
    }
}

fn furnish(serving: &Serving) {
    serving.rig.monitor.update(|state| {
        state.free_bytes = 41_300_000_000;
        state.needed_bytes = 910_000_000;
        state.frames_wanted = TURN;
        state.table.present = true;
        state.table.state = "Idle".to_owned();
        state.table.angle_deg = Some(0.0);
        state.table.homed = true;
        state.table.battery_v = Some(11.8);
        state.camera.present = true;
        state.camera.name = "HD Pro Webcam".to_owned();
        state.camera.mode = "MJPG 1920x1080 30/s".to_owned();
        state.camera.clipped = Some(0.0065);
        state.camera.focus = Some(412.0);
        state.camera.controls = [
            ("auto_exposure", 1),
            ("exposure_time_absolute", 156),
            ("gain", 0),
            ("focus_automatic_continuous", 0),
            ("focus_absolute", 40),
            ("white_balance_temperature", 4600),
            ("power_line_frequency", 1),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .to_vec();
    });
}

fn step(serving: &Serving, tick: u64) {
    serving.rig.monitor.update(|state| {
        state.camera.fps = Some(29.97);
        if state.phase != Phase::Recording {
            state.table.state = "Idle".to_owned();
            state.frames = 0;
            return;
        }
        state.table.state = "Run".to_owned();
        state.table.degrees_per_second = Some(7.2);
        state.frames += 1;
        state.table.angle_deg = Some(state.frames as f64 * 360.0 / TURN as f64);
        if state.frames == TURN {
            state.phase = Phase::Idle;
            state.last_take = Some(TakeSummary {
                session: "20261120T102000Z-bust-short".to_owned(),
                verdict: Verdict::Clean,
                frames: TURN,
                dropped: 0,
                is_stopped: false,
                reason: None,
            });
        }
    });
    let file = serving.root.path().join("fault");
    if let Ok(what) = fs::read_to_string(&file) {
        let _ = fs::remove_file(&file);
        serving.rig.monitor.fault(tick as i64, what);
    }
}

#[test]
#[ignore = "for a person with a browser: runs for ten minutes"]
fn a_rig_to_look_at() {
    let serving = Serving::with(|options| options.address.set_port(8420));
    serving.hold(&[
        "20261120T101500Z-cow-short",
        "20261120T102000Z-bust-short",
        "20261120T103000Z-cow-dropped",
        "20261120T104500Z-cow-cut",
        "20261120T093015Z-cow",
    ]);
    let pictures = pictures(&serving);
    furnish(&serving);
    eprintln!(
        "{}\nput a sentence into {}/fault for a fault",
        serving.told.url,
        serving.root.path().display()
    );
    for tick in 0..600 * 30 {
        let picture = &pictures[tick as usize % pictures.len()];
        serving.rig.monitor.show(tick as i64, picture.clone());
        step(&serving, tick);
        thread::sleep(Duration::from_millis(33));
    }
}
