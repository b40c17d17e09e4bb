//! The manifest of a session at its start.

use std::collections::BTreeMap;

use jiff::Timestamp;
use serde_json::Value;

use super::equipment::Equipment;
use super::locked_camera::LockedCamera;
use super::settings::Settings;
use relit_camera::{Control, ControlKind};
use relit_data::rig::RigFacts;
use relit_data::session::{
    CameraFacts, Fault, Manifest, SoftwareFacts, Status, TurntableFacts, VideoFacts,
};
use relit_turntable::Table;

/// The name of a session of an object that begins at this second.
pub(super) fn session_name(begun: Timestamp, object: &str) -> String {
    format!("{}-{object}", begun.strftime("%Y%m%dT%H%M%SZ"))
}

/// The manifest of a take that is to begin `now`.
pub(super) fn manifest(
    equipment: &Equipment,
    object: &str,
    now: Timestamp,
    locked: &LockedCamera,
    rig: Option<RigFacts>,
) -> Manifest {
    let settings = equipment.settings();
    let camera = settings.camera.clone();
    let name = equipment
        .camera
        .as_ref()
        .map(|camera| camera.info().name.clone());
    Manifest {
        id: session_name(now, object),
        object: object.to_owned(),
        created: now,
        status: Status::Recording,
        camera: CameraFacts {
            backend: camera.backend().to_owned(),
            device: camera.device(),
            name: name.unwrap_or_default(),
            fourcc: locked.fourcc.to_string(),
            width: locked.stream.width,
            height: locked.stream.height,
            fps: locked.stream.fps,
            clock: locked.clock,
            controls: controls_by_name(&locked.controls),
        },
        turntable: equipment
            .table
            .as_ref()
            .map(|table| facts_of(table, settings)),
        rig,
        video: VideoFacts {
            file: String::new(),
            codec: String::new(),
            frames: None,
            bytes: None,
            blake3: None,
        },
        faults: not_held(locked),
        software: SoftwareFacts {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: settings.commit.clone(),
        },
        note: None,
        rating: None,
    }
}

/// What the camera may change by itself, which cannot be seen in the recording afterwards.
fn not_held(locked: &LockedCamera) -> Vec<Fault> {
    let warning = locked.plan.warning();
    warning
        .map(|what| Fault { t_us: 0, what })
        .into_iter()
        .collect()
}

fn facts_of(table: &Table, settings: &Settings) -> TurntableFacts {
    TurntableFacts {
        port: settings.turntable.to_string(),
        firmware: format!("Grbl {}", table.identity().firmware),
        degrees_per_second: settings.degrees_per_second,
        steps_per_degree: table.identity().steps_per_degree,
    }
}

/// Values as the manifest keeps them: a menu's as its words, a switch's as true or false.
fn controls_by_name(controls: &[Control]) -> BTreeMap<String, Value> {
    let named = controls.iter().filter_map(|control| {
        let value = control.value?;
        let kept = match &control.kind {
            ControlKind::Boolean => Value::from(value != 0),
            ControlKind::Menu(items) => items
                .iter()
                .find(|item| item.index == value)
                .map_or(Value::from(value), |item| Value::from(item.label.clone())),
            _ => Value::from(value),
        };
        Some((control.name.clone(), kept))
    });
    named.collect()
}
