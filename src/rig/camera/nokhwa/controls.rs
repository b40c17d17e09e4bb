//! The library's controls that have one whole number as value.

use std::panic::{AssertUnwindSafe, catch_unwind};

use ::nokhwa::utils::{
    CameraControl, ControlValueDescription, ControlValueSetter, KnownCameraControl,
    KnownCameraControlFlag,
};
use ::nokhwa::{Camera as Library, NokhwaError};

use crate::camera::{Control, ControlFlags, ControlId, ControlKind, MenuItem, snake_case};

/// The modes of exposure, focus and white balance on macOS, by their numbers.
const MODES: [&str; 4] = ["locked", "auto", "continuous", "custom"];

/// The controls of a camera, each with the number that it keeps as long as the camera is open.
#[derive(Debug, Default)]
pub(super) struct ControlNumbers(Vec<KnownCameraControl>);

impl ControlNumbers {
    /// The library's name of a control.
    pub(super) fn known(&self, id: ControlId) -> Option<KnownCameraControl> {
        self.0.get(usize::try_from(id.0).ok()?).copied()
    }

    fn id(&mut self, known: KnownCameraControl) -> ControlId {
        let found = self.0.iter().position(|&other| other == known);
        let at = found.unwrap_or_else(|| {
            self.0.push(known);
            self.0.len() - 1
        });
        ControlId(u32::try_from(at).unwrap_or(u32::MAX))
    }

    /// The controls that have one whole number as value.
    pub(super) fn controls(&mut self, listed: &[CameraControl]) -> Vec<Control> {
        let controls = listed.iter();
        controls
            .filter_map(|control| self.control(control))
            .collect()
    }

    fn control(&mut self, listed: &CameraControl) -> Option<Control> {
        use ControlValueDescription as Described;
        let (kind, range, step, default) = match listed.description() {
            Described::Integer { step, default, .. } => {
                (ControlKind::Integer, (i64::MIN, i64::MAX), *step, *default)
            }
            Described::IntegerRange {
                min,
                max,
                step,
                default,
                ..
            } => (ControlKind::Integer, (*min, *max), *step, *default),
            Described::Boolean { default, .. } => {
                (ControlKind::Boolean, (0, 1), 1, i64::from(*default))
            }
            Described::Enum {
                possible, default, ..
            } => {
                let range = (*possible.iter().min()?, *possible.iter().max()?);
                (ControlKind::Menu(items(possible)), range, 1, *default)
            }
            _ => return None,
        };
        let flag = |flag: KnownCameraControlFlag| listed.flag().contains(&flag);
        Some(Control {
            id: self.id(listed.control()),
            name: name(listed),
            kind,
            minimum: range.0,
            maximum: range.1,
            step: step.unsigned_abs().max(1),
            default,
            value: value(listed),
            flags: ControlFlags {
                inactive: flag(KnownCameraControlFlag::Disabled),
                read_only: flag(KnownCameraControlFlag::ReadOnly),
                grabbed: false,
                volatile: flag(KnownCameraControlFlag::Volatile),
            },
        })
    }
}

fn items(possible: &[i64]) -> Vec<MenuItem> {
    let items = possible.iter().map(|&index| {
        let mode = usize::try_from(index).ok().and_then(|at| MODES.get(at));
        let label = mode.map_or_else(|| index.to_string(), |&mode| mode.to_owned());
        MenuItem { index, label }
    });
    items.collect()
}

/// The driver's name of a control; the modes of macOS have names of their own here.
fn name(listed: &CameraControl) -> String {
    let is_mode = matches!(listed.description(), ControlValueDescription::Enum { .. });
    match listed.control() {
        KnownCameraControl::Exposure if is_mode => "exposure_mode".to_owned(),
        KnownCameraControl::WhiteBalance if is_mode => "white_balance_mode".to_owned(),
        KnownCameraControl::Focus if is_mode => "focus_mode".to_owned(),
        _ => snake_case(listed.name()),
    }
}

fn value(listed: &CameraControl) -> Option<i64> {
    match listed.description() {
        ControlValueDescription::Integer { value, .. }
        | ControlValueDescription::IntegerRange { value, .. }
        | ControlValueDescription::Enum { value, .. } => Some(*value),
        ControlValueDescription::Boolean { value, .. } => Some(i64::from(*value)),
        _ => None,
    }
}

/// Lists the controls. The library panics on kinds of controls that it does not know.
pub(super) fn list(library: &Library) -> Result<Vec<CameraControl>, NokhwaError> {
    let listed = catch_unwind(AssertUnwindSafe(|| library.camera_controls()));
    listed.unwrap_or_else(|_| {
        let unknown = "it has controls of a kind that the library does not know";
        Err(NokhwaError::GeneralError(unknown.to_owned()))
    })
}

/// Sets a control, and returns the value read back.
pub(super) fn set(
    library: &mut Library,
    known: KnownCameraControl,
    value: i64,
) -> Result<Option<i64>, NokhwaError> {
    let setter = match library.camera_control(known)?.description() {
        ControlValueDescription::Boolean { .. } => ControlValueSetter::Boolean(value != 0),
        ControlValueDescription::Enum { .. } => ControlValueSetter::EnumValue(value),
        _ => ControlValueSetter::Integer(value),
    };
    library.set_camera_control(known, setter)?;
    Ok(self::value(&library.camera_control(known)?))
}
