//! `relit-capture devices`: what there is, for a person or a machine.

use relit_camera::{self as camera, Control, ControlKind, DeviceInfo};
use relit_data::causes::with_causes;
use relit_data::clock::Clock;
use relit_turntable::{TurntableError, find_serial};
use serde_json::{Value, json};

use relit_capture::capture::CaptureError;
use relit_console::{Console, Event, Outcome};

pub(crate) fn run(console: Console) -> Result<Outcome, CaptureError> {
    let cameras = camera::list();
    if cameras.is_empty() {
        console.warn("no camera was found: plug one in, or replay a recording (replay:PATH)");
    }
    for camera in &cameras {
        report_camera(console, camera);
    }
    report_turntable(console);
    Ok(Outcome::Success)
}

fn report_camera(console: Console, info: &DeviceInfo) {
    let opened = camera::open(&info.address, Clock::monotonic());
    let controls = opened.and_then(|mut camera| camera.controls());
    let (controls, problem) = match controls {
        Ok(controls) => (controls, None),
        Err(error) => (Vec::new(), Some(with_causes(&error))),
    };
    let problems: Vec<String> = info.problems.iter().cloned().chain(problem).collect();
    let mut text = format!(
        "{}: {} ({}, {})",
        info.address, info.name, info.driver, info.bus
    );
    for mode in &info.modes {
        text.push_str(&format!("\n  {mode}"));
    }
    for control in &controls {
        text.push_str(&format!("\n  {}", described(control)));
    }
    for problem in &problems {
        text.push_str(&format!("\n  not readable: {problem}"));
    }
    let modes: Vec<String> = info.modes.iter().map(ToString::to_string).collect();
    let controls: Vec<Value> = controls.iter().map(as_json).collect();
    console.print(
        &text,
        &Event::Camera {
            address: info.address.to_string(),
            name: info.name.clone(),
            driver: info.driver.clone(),
            bus: info.bus.clone(),
            modes,
            controls,
            problems,
        },
    );
}

fn described(control: &Control) -> String {
    let value = control
        .value
        .map_or("-".to_owned(), |value| value.to_string());
    let range = match &control.kind {
        ControlKind::Menu(items) => {
            let items: Vec<String> = items
                .iter()
                .map(|item| format!("{} {}", item.index, item.label))
                .collect();
            items.join(", ")
        }
        ControlKind::Boolean => "0 or 1".to_owned(),
        ControlKind::Button => "a button".to_owned(),
        _ => format!(
            "{} to {}, step {}",
            control.minimum, control.maximum, control.step
        ),
    };
    let note = if control.flags.inactive {
        ", set automatically"
    } else {
        ""
    };
    format!("{} = {value} ({range}{note})", control.name)
}

fn as_json(control: &Control) -> Value {
    json!({
        "name": control.name,
        "value": control.value,
        "minimum": control.minimum,
        "maximum": control.maximum,
        "step": control.step,
        "default": control.default,
        "inactive": control.flags.inactive,
        "read_only": control.flags.read_only,
    })
}

fn report_turntable(console: Console) {
    let ports = match find_serial() {
        Ok(path) => vec![path.display().to_string()],
        Err(TurntableError::SeveralCandidates(ports)) => ports,
        Err(error) => return console.warn(&with_causes(&error)),
    };
    let addresses: Vec<String> = ports.iter().map(|port| format!("serial:{port}")).collect();
    let text = match addresses.as_slice() {
        [address] => format!("{address}: possibly a turntable's controller"),
        several => several.join("\n"),
    };
    console.print(&text, &Event::Turntable { addresses });
}
