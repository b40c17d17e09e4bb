//! Holding a camera's settings during a turn, when only the light may change: which controls to set
//! to manual, in which order, and which are missing.
//!
//! [`ManualPlan::new`] uses only the list of controls and no camera; [`ManualPlan::apply`] sets the
//! controls and reads them back. The names are those that `v4l2-ctl` prints; the kernel renamed
//! several in 5.17, and both names are known.

use relit_data::causes::with_causes;

use super::{Camera, CameraError, Control, ControlKind};

/// A property of the picture that must not change during a turn.
struct Aspect {
    name: &'static str,
    /// Controls that switch its automatic, and how each is set to manual.
    switches: &'static [(&'static str, Manual)],
    /// Controls that hold its value; of the names in one group, the first that exists is used.
    values: &'static [&'static [&'static str]],
    /// Whether a camera without controls of it may change it by itself.
    is_needed: bool,
}

/// All of them, in the order in which they are set.
const ASPECTS: [Aspect; 7] = [
    // Some cameras lower the frame rate in the dark.
    Aspect {
        name: "frame rate",
        switches: &[
            ("exposure_dynamic_framerate", Manual::Off),
            ("exposure_auto_priority", Manual::Off),
        ],
        values: &[],
        is_needed: false,
    },
    Aspect {
        name: "exposure",
        switches: &[
            ("auto_exposure", Manual::MenuItem(1, "manual")),
            ("exposure_auto", Manual::MenuItem(1, "manual")),
        ],
        values: &[&["exposure_time_absolute", "exposure_absolute", "exposure"]],
        is_needed: true,
    },
    Aspect {
        name: "gain",
        switches: &[
            ("gain_automatic", Manual::Off),
            ("gain_auto", Manual::Off),
            ("autogain", Manual::Off),
        ],
        values: &[&["gain", "analogue_gain"]],
        is_needed: true,
    },
    Aspect {
        name: "white balance",
        switches: &[
            ("white_balance_automatic", Manual::Off),
            ("white_balance_temperature_auto", Manual::Off),
            ("auto_white_balance", Manual::Off),
        ],
        values: &[
            &["white_balance_temperature"],
            &["red_balance"],
            &["blue_balance"],
        ],
        is_needed: true,
    },
    Aspect {
        name: "focus",
        switches: &[
            ("focus_automatic_continuous", Manual::Off),
            ("focus_auto", Manual::Off),
        ],
        values: &[&["focus_absolute"]],
        // Without controls it is fixed.
        is_needed: false,
    },
    Aspect {
        name: "power-line filter",
        switches: &[],
        values: &[&["power_line_frequency"]],
        // Nothing for it to change at a fixed exposure.
        is_needed: false,
    },
    Aspect {
        name: "backlight compensation",
        switches: &[],
        values: &[&["backlight_compensation"]],
        is_needed: false,
    },
];

/// How a switch is set to manual.
#[derive(Debug, Clone, Copy)]
enum Manual {
    Off,
    /// A menu's item: its index in the kernel's interface, which must be offered, or a word in
    /// its label.
    MenuItem(i64, &'static str),
}

/// Values to hold instead of the camera's current ones, in the controls' own units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ManualValues {
    /// Exposure time; of `exposure_time_absolute`, units of 100 us.
    pub exposure: Option<i64>,
    /// Gain.
    pub gain: Option<i64>,
    /// White balance, kelvin.
    pub white_balance: Option<i64>,
    /// Focus.
    pub focus: Option<i64>,
}

impl ManualValues {
    /// The value that a control is to have.
    fn of(&self, control: &Control) -> Option<i64> {
        match control.name.as_str() {
            "exposure_time_absolute" | "exposure_absolute" | "exposure" => self.exposure,
            "gain" | "analogue_gain" => self.gain,
            "white_balance_temperature" => self.white_balance,
            "focus_absolute" => self.focus,
            // Off: with a fixed exposure the filter can only interfere.
            "power_line_frequency" => Some(0),
            "backlight_compensation" => Some(control.minimum),
            _ => None,
        }
    }
}

/// One control to set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ControlSetting {
    /// The property of the picture that it holds.
    pub aspect: &'static str,
    /// The control.
    pub id: u32,
    /// Its name.
    pub name: String,
    /// The value.
    pub value: i64,
}

/// Which controls to set so that nothing of the picture changes by itself, and which are missing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ManualPlan {
    /// In this order: first all automatics off, then the values, which automatics would refuse.
    pub steps: Vec<ControlSetting>,
    /// What the camera may change by itself during a turn, each with why.
    pub not_held: Vec<String>,
}

/// A control whose value is not what it should be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name} is {}, but {should} was set", value_words(*.is))]
pub struct ControlDrift {
    /// The control's name.
    pub name: String,
    /// What was set, or read before.
    pub should: i64,
    /// What was read; `None` if it can no longer be read.
    pub is: Option<i64>,
}

fn value_words(value: Option<i64>) -> String {
    value.map_or_else(|| "unreadable".to_owned(), |value| value.to_string())
}

impl ManualPlan {
    /// Makes the plan. Values are the wanted ones, otherwise the camera's current ones, which an
    /// automatic may have found; rounded to the control's range and steps.
    pub fn new(controls: &[Control], wanted: &ManualValues) -> Self {
        let mut plan = Self::default();
        let mut values = Vec::new();
        for aspect in &ASPECTS {
            let before = plan.not_held.len();
            let (switched, is_manual) = plan.switch_off(controls, aspect);
            let held = plan.hold(controls, wanted, aspect, &mut values) || is_manual;
            let is_locked = plan.not_held.len() > before;
            let has_automatic = switched && !aspect.values.is_empty();
            if (aspect.is_needed || has_automatic) && !held && !is_locked {
                let lacks = if switched { "value to set" } else { "control" };
                plan.not_held
                    .push(format!("{} (without a {lacks})", aspect.name));
            }
        }
        plan.steps.extend(values);
        plan
    }

    /// What cannot be held, in a sentence.
    pub fn warning(&self) -> Option<String> {
        let not_held = self.not_held.join(", ");
        (!not_held.is_empty()).then(|| format!("the camera may change by itself: {not_held}"))
    }

    fn note_locked(&mut self, name: &str) {
        self.not_held.push(format!("{name} (cannot be set)"));
    }

    /// Wanted values that are not in the plan, because the camera has no control for them: aspect
    /// and value of each, as text.
    pub fn without(&self, wanted: &ManualValues) -> Vec<String> {
        let asked = [
            ("exposure", wanted.exposure),
            ("gain", wanted.gain),
            ("white balance", wanted.white_balance),
            ("focus", wanted.focus),
        ];
        let planned = |aspect, value| {
            let mut steps = self.steps.iter();
            steps.any(|step| step.aspect == aspect && step.value == value)
        };
        asked
            .into_iter()
            .filter_map(|(aspect, value)| Some((aspect, value?)))
            .filter(|(aspect, value)| !planned(*aspect, *value))
            .map(|(aspect, value)| format!("{aspect} {value}"))
            .collect()
    }

    /// Plans the switches of an aspect: whether there is one that can be set, and whether there is one that is manual
    /// for good.
    fn switch_off(&mut self, controls: &[Control], aspect: &Aspect) -> (bool, bool) {
        let (mut switched, mut is_manual) = (false, false);
        for &(name, manual) in aspect.switches {
            let Some(control) = find(controls, name) else {
                continue;
            };
            match manual.value(control) {
                Some(value) if may_be_set(control) => {
                    self.steps.push(step(aspect, control, value));
                    switched = true;
                }
                manual
                    if control.flags.read_only && manual.is_some() && control.value == manual =>
                {
                    is_manual = true;
                }
                _ => self.note_locked(name),
            }
        }
        (switched, is_manual)
    }

    /// Plans the values of an aspect; true if there is one that can be set, or that cannot be another.
    fn hold(
        &mut self,
        controls: &[Control],
        wanted: &ManualValues,
        aspect: &Aspect,
        steps: &mut Vec<ControlSetting>,
    ) -> bool {
        let mut held = false;
        for names in aspect.values {
            let Some(control) = names.iter().find_map(|name| find(controls, name)) else {
                continue;
            };
            if control.flags.read_only && control.minimum == control.maximum {
                held = true;
                continue;
            }
            if !may_be_set(control) {
                self.note_locked(&control.name);
                continue;
            }
            let current = control.value.unwrap_or(control.default);
            let value = wanted.of(control).unwrap_or(current);
            steps.push(step(aspect, control, nearest(control, value)));
            held = true;
        }
        held
    }

    /// Sets all controls in order, reads them back at the end, and returns those that have other
    /// values. Controls affect each other: only the last reading counts.
    ///
    /// # Errors
    /// Those of [`Camera::set_control`] and [`Camera::controls`].
    pub fn apply(&self, camera: &mut dyn Camera) -> Result<Vec<ControlDrift>, CameraError> {
        for step in &self.steps {
            camera.set_control(step.id, step.value)?;
        }
        Ok(self.check(&camera.controls()?))
    }

    /// Reads the controls after a take and compares them with the plan, and with their values
    /// `before` the take: the faults of the take that this shows, a sentence each. That they cannot be
    /// read is one.
    pub fn faults_after(&self, before: &[Control], camera: &mut dyn Camera) -> Vec<String> {
        let after = match camera.controls() {
            Ok(after) => after,
            Err(error) => {
                let error = with_causes(&error);
                return vec![format!(
                    "the camera's settings could not be read back after the turn: {error}"
                )];
            }
        };
        let mut drifts = self.check(&after);
        for drift in drift_between(before, &after) {
            if drifts.iter().all(|known| known.name != drift.name) {
                drifts.push(drift);
            }
        }
        let drifts = drifts.iter();
        drifts
            .map(|drift| format!("the camera's settings changed during the turn: {drift}"))
            .collect()
    }

    /// Controls whose values are not those of the plan.
    pub fn check(&self, controls: &[Control]) -> Vec<ControlDrift> {
        let steps = self.steps.iter();
        steps
            .filter_map(|step| moved(&step.name, step.id, step.value, controls))
            .collect()
    }
}

/// Controls whose values differ between two readings. Those that the hardware changes by itself are
/// only compared if the plan sets them: [`ManualPlan::check`]. Read-only ones are measurements, not
/// settings, and are not compared.
fn drift_between(before: &[Control], after: &[Control]) -> Vec<ControlDrift> {
    let settings = |control: &&Control| !control.flags.volatile && !control.flags.read_only;
    let held = before.iter().filter(settings);
    held.filter_map(|control| moved(&control.name, control.id, control.value?, after))
        .collect()
}

fn moved(name: &str, id: u32, should: i64, controls: &[Control]) -> Option<ControlDrift> {
    let control = controls.iter().find(|control| control.id == id);
    let is = control.and_then(|control| control.value);
    (is != Some(should)).then(|| ControlDrift {
        name: name.to_owned(),
        should,
        is,
    })
}

impl Manual {
    /// The control's value for manual, if it offers one.
    fn value(self, control: &Control) -> Option<i64> {
        match (self, &control.kind) {
            (Self::MenuItem(index, word), ControlKind::Menu(items)) => items
                .iter()
                .find(|item| item.label.to_ascii_lowercase().contains(word))
                .or_else(|| items.iter().find(|item| item.index == index))
                .map(|item| item.index),
            (Self::MenuItem(index, _), _) => in_range(control, index),
            // Some switches are menus whose first item is manual.
            (Self::Off, ControlKind::Menu(items)) => items
                .iter()
                .find(|item| item.index == 0)
                .map(|item| item.index),
            (Self::Off, _) => in_range(control, 0),
        }
    }
}

fn in_range(control: &Control, value: i64) -> Option<i64> {
    (control.minimum..=control.maximum)
        .contains(&value)
        .then_some(value)
}

fn find<'a>(controls: &'a [Control], name: &str) -> Option<&'a Control> {
    controls.iter().find(|control| control.name == name)
}

/// An inactive control may be set once its automatic is off.
fn may_be_set(control: &Control) -> bool {
    !control.flags.read_only && !control.flags.grabbed
}

fn step(aspect: &Aspect, control: &Control, value: i64) -> ControlSetting {
    ControlSetting {
        aspect: aspect.name,
        id: control.id,
        name: control.name.clone(),
        value,
    }
}

/// The nearest value within the control's range and steps, or in its menu.
fn nearest(control: &Control, value: i64) -> i64 {
    if let ControlKind::Menu(items) = &control.kind {
        let indices = items.iter().map(|item| item.index);
        return indices
            .min_by_key(|index| index.abs_diff(value))
            .unwrap_or(control.default);
    }
    if control.minimum >= control.maximum {
        return control.minimum;
    }
    let value = value.clamp(control.minimum, control.maximum);
    let step = i128::from(control.step.max(1));
    let above = i128::from(value) - i128::from(control.minimum);
    let steps = (above + step / 2) / step;
    let most = (i128::from(control.maximum) - i128::from(control.minimum)) / step;
    let nearest = i128::from(control.minimum) + steps.min(most) * step;
    i64::try_from(nearest).unwrap_or(value)
}

#[cfg(test)]
mod tests;
