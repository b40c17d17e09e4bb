//! `relit-capture calibrate`: the constants of a rig, for a person or a machine.

use relit_capture::capture::{
    CaptureError, Equipment, Settings, StopReason, StopRequest, measure_rotation, read_facts,
    write_facts,
};
use relit_console::{Console, Event, Outcome};
use relit_turntable::TurntableAddress;

use super::arguments::CalibrateArguments;
use super::environment::at_end;
use super::recording::{agreed, make_root};

pub(crate) fn run(console: Console, asked: CalibrateArguments) -> Result<Outcome, CaptureError> {
    let settings: Settings = asked.turn.rig.into();
    let root = settings.root.clone();
    let _made = make_root(&settings)?;
    let mut facts = read_facts(&root)?.unwrap_or_default();
    facts.camera_elevation_deg = asked.elevation.or(facts.camera_elevation_deg);
    if settings.turntable != TurntableAddress::None {
        if !asked.turn.yes && !agreed(console, &settings)? {
            return Ok(Outcome::Failure);
        }
        let mut equipment = Equipment::new(settings)?;
        let stop = StopRequest::new(&equipment.clock());
        let ending = stop.clone();
        at_end(move || ending.request(StopReason::Shutdown))
            .map_err(CaptureError::system("the signals", "listened to"))?;
        facts.rotation = Some(measure_rotation(&mut equipment, &stop)?);
    }
    let file = write_facts(&root, &facts)?;
    let rotation = facts.rotation.map(|rotation| rotation.to_string());
    let elevation = facts.camera_elevation_deg;
    console.print(
        &format!(
            "{}: {}; {}",
            file.display(),
            rotation.as_deref().map_or(
                "rotation direction not measured".to_owned(),
                |rotation| format!("the table turns {rotation}")
            ),
            elevation.map_or(
                "elevation of the camera not given (--elevation)".to_owned(),
                |degrees| format!("the camera looks down by {degrees} degrees")
            ),
        ),
        &Event::Calibrated {
            rotation,
            camera_elevation_deg: elevation,
        },
    );
    Ok(Outcome::Success)
}
