//! The camera of a recording, from its session.

use serde_json::Value;

use super::timeline::Timeline;
use crate::{
    CameraAddress, CameraMode, Control, ControlFlags, ControlKind, DeviceInfo, MenuItem, Mode,
    Rate, Rates, Sizes,
};
use relit_data::session::{Manifest, Recording};
use relit_video::Video;

/// The rate that was recorded, or the mean one.
pub(super) fn rate(manifest: Option<&Manifest>, timeline: &Timeline) -> Option<Rate> {
    let stated = manifest.and_then(|manifest| Rate::from_per_second(manifest.camera.fps));
    stated.or_else(|| Rate::from_per_second(1e6 / timeline.period_us() as f64))
}

/// The description of a recording as a camera.
pub(super) fn describe(
    address: CameraAddress,
    recording: &Recording,
    video: &Video,
    mode: &CameraMode,
) -> DeviceInfo {
    let camera = recording.manifest.as_ref().map(|manifest| &manifest.camera);
    let notices = recording
        .notices
        .iter()
        .map(|notice| notice.text().to_owned());
    let damage = video.damage().iter().cloned();
    DeviceInfo {
        address,
        name: camera.map_or_else(|| recording.id.clone(), |camera| camera.name.clone()),
        driver: "replay".to_owned(),
        bus: camera
            .map(|camera| camera.device.clone())
            .unwrap_or_default(),
        modes: vec![Mode {
            fourcc: mode.fourcc,
            sizes: Sizes::One(mode.width, mode.height),
            rates: Rates::List(vec![mode.rate]),
        }],
        problems: notices.chain(damage).collect(),
    }
}

/// The recorded controls, which cannot be set.
pub(super) fn controls(manifest: &Manifest) -> Vec<Control> {
    let recorded = manifest.camera.controls.iter().zip(1..);
    recorded
        .filter_map(|((name, value), id)| {
            let (kind, value) = match value {
                Value::Bool(value) => (ControlKind::Boolean, i64::from(*value)),
                Value::Number(number) => (ControlKind::Integer, number.as_i64()?),
                Value::String(label) => {
                    let label = label.clone();
                    (ControlKind::Menu(vec![MenuItem { index: 0, label }]), 0)
                }
                _ => return None,
            };
            Some(Control {
                id,
                name: name.clone(),
                kind,
                minimum: value,
                maximum: value,
                step: 1,
                default: value,
                value: Some(value),
                flags: ControlFlags {
                    read_only: true,
                    ..ControlFlags::default()
                },
            })
        })
        .collect()
}
