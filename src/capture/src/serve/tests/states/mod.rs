//! What headline, button and interface say in each state of the rig: one file in `states/` a row. A file that is put
//! there is tested.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde::Deserialize;
use serde_json::json;

use super::Serving;
use crate::state::{Phase, TakeSummary, Verdict};

/// One row of the table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    /// Phase as the interface calls it; the rig rests if left out.
    #[serde(default = "idle")]
    phase: String,
    #[serde(default)]
    camera: Camera,
    #[serde(default)]
    table: Table,
    #[serde(default)]
    disk: Disk,
    /// The speed that is set, degrees a second.
    #[serde(default = "usual_speed")]
    speed: f64,
    /// The last take's session, and whether it was aborted, and why.
    last: Option<(String, Option<String>)>,
    /// Whether somebody stopped it.
    #[serde(default)]
    stopped: bool,
    headline: String,
    /// Words of the explanation; none is to be given if left out.
    explanation: Option<String>,
    button: String,
    /// `null`: the button is disabled.
    action: Option<String>,
    /// Words of the refusal of each command, or `null` if it is taken.
    commands: BTreeMap<String, Option<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Camera {
    present: bool,
    fault: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Table {
    /// Its address.
    address: String,
    present: bool,
    state: String,
    /// Its highest speed, degrees a second, where it is known.
    fastest: Option<f64>,
    no_room: Option<String>,
    emergency_stop: bool,
    locked: bool,
    fault: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Disk {
    free: u64,
    needed: u64,
    fault: Option<String>,
}

fn idle() -> String {
    "idle".to_owned()
}

fn usual_speed() -> f64 {
    7.2
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            present: true,
            fault: None,
        }
    }
}

impl Default for Table {
    fn default() -> Self {
        Self {
            address: "serial:".to_owned(),
            present: true,
            state: "Idle".to_owned(),
            fastest: Some(36.0),
            no_room: None,
            emergency_stop: false,
            locked: false,
            fault: None,
        }
    }
}

impl Default for Disk {
    fn default() -> Self {
        Self {
            free: 56_000_000_000,
            needed: 900_000_000,
            fault: None,
        }
    }
}

const PHASES: [Phase; 7] = [
    Phase::Idle,
    Phase::Preflight,
    Phase::MovingBack,
    Phase::Starting,
    Phase::Recording,
    Phase::Unwinding,
    Phase::Checking,
];

fn rows() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/serve/tests/states");
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let is_row = |path: &PathBuf| path.extension().is_some_and(|name| name == "json");
    let mut rows: Vec<_> = paths.filter(is_row).collect();
    rows.sort();
    rows
}

/// Brings the pretended rig into the row's state.
fn set(serving: &Serving, row: Row) {
    let phase = |phase: &Phase| json!(phase) == json!(row.phase);
    let phase = PHASES.into_iter().find(phase).expect("a phase");
    serving.rig.monitor.update(|state| {
        state.phase = phase;
        state.settings.turntable = row.table.address;
        state.settings.degrees_per_second = row.speed;
        (state.camera.present, state.camera.fault) = (row.camera.present, row.camera.fault);
        state.table.present = row.table.present;
        state.table.state = row.table.state;
        state.table.max_degrees_per_second = row.table.fastest;
        state.table.no_room = row.table.no_room;
        state.table.emergency_stop = row.table.emergency_stop;
        state.table.locked = row.table.locked;
        state.table.fault = row.table.fault;
        (state.free_bytes, state.needed_bytes) = (row.disk.free, row.disk.needed);
        state.disk_fault = row.disk.fault;
        state.last_take = row.last.map(|(session, aborted)| TakeSummary {
            session,
            verdict: match aborted {
                Some(_) => Verdict::Aborted,
                None => Verdict::Clean,
            },
            frames: 1500,
            dropped: 0,
            is_stopped: row.stopped,
            reason: aborted,
            notes: Vec::new(),
        });
    });
}

fn command(name: &str) -> String {
    match name {
        "start" => json!({ "command": name, "object": "mug" }),
        "jog" => json!({ "command": name, "degrees": 10 }),
        _ => json!({ "command": name }),
    }
    .to_string()
}

#[test]
fn headline_button_and_interface_say_the_same_in_every_state() {
    let rows = rows();
    assert!(rows.len() > 10, "{rows:?}");
    let serving = Serving::start();
    serving.rig.minds_state.store(true, Ordering::Relaxed);
    for path in rows {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read(&path).unwrap();
        let mut row: Row =
            serde_json::from_slice(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let commands = std::mem::take(&mut row.commands);
        let wanted = (
            row.headline.clone(),
            row.explanation.clone(),
            row.button.clone(),
            row.action.clone(),
        );
        set(&serving, row);
        let version = serving.rig.monitor.state().version;
        super::wait_until("the state is served", || {
            serving.get("/api/v1/state").json()["version"] == json!(version)
        });
        let advice = serving.get("/api/v1/state").json()["advice"].clone();
        let (headline, explanation, button, action) = wanted;
        assert_eq!(advice["headline"], json!(headline), "{name}");
        assert_eq!(advice["button"]["text"], json!(button), "{name}");
        assert_eq!(advice["button"]["action"], json!(action), "{name}");
        match (explanation, advice["explanation"].as_str()) {
            (None, None) => {}
            (Some(words), Some(found)) => assert!(found.contains(&words), "{name}: {found}"),
            (wanted, found) => panic!("{name}: {wanted:?} {found:?}"),
        }
        for (given, refusal) in commands {
            let answer = serving.command(&command(&given));
            match refusal {
                None => assert_eq!(answer.status, 202, "{name}: {given}"),
                Some(words) => {
                    assert_eq!(answer.status, 503, "{name}: {given}");
                    let error = answer.error();
                    assert!(error.contains(&words), "{name}: {given}: {error}");
                }
            }
        }
    }
}
