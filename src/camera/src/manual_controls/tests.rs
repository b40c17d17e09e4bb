//! Plans for the control lists of real cameras, as `v4l2-ctl --list-ctrls-menus` prints them.

use std::time::Duration;

use relit_test_support::is_named;

use crate::manual_controls::*;
use crate::{CameraMode, ControlFlags, DeviceInfo, Frame, MenuItem, Mode};

fn control(name: &str, kind: ControlKind, range: (i64, i64), value: i64) -> Control {
    // Any number will do, as long as each name has its own.
    let id = name.bytes().fold(7_u32, |id, byte| {
        id.wrapping_mul(31).wrapping_add(byte.into())
    });
    Control {
        id,
        name: name.to_owned(),
        kind,
        minimum: range.0,
        maximum: range.1,
        step: 1,
        default: range.0,
        value: Some(value),
        flags: ControlFlags::default(),
    }
}

fn number(name: &str, range: (i64, i64), value: i64) -> Control {
    control(name, ControlKind::Integer, range, value)
}

fn inactive(mut control: Control) -> Control {
    control.flags.inactive = true;
    control
}

fn switch(name: &str, value: i64) -> Control {
    control(name, ControlKind::Boolean, (0, 1), value)
}

fn menu(name: &str, items: &[(i64, &str)], value: i64) -> Control {
    let items: Vec<MenuItem> = items
        .iter()
        .map(|&(index, label)| MenuItem {
            index,
            label: label.to_owned(),
        })
        .collect();
    let range = (items[0].index, items[items.len() - 1].index);
    control(name, ControlKind::Menu(items), range, value)
}

const UVC_EXPOSURE: [(i64, &str); 2] = [(1, "Manual Mode"), (3, "Aperture Priority Mode")];
const POWER_LINE: [(i64, &str); 3] = [(0, "Disabled"), (1, "50 Hz"), (2, "60 Hz")];

/// Logitech C920 under Linux 5.10.
fn c920_old() -> Vec<Control> {
    vec![
        number("brightness", (0, 255), 128),
        switch("white_balance_temperature_auto", 1),
        number("gain", (0, 255), 64),
        menu("power_line_frequency", &POWER_LINE, 2),
        inactive(number("white_balance_temperature", (2000, 6500), 4120)),
        number("backlight_compensation", (0, 1), 1),
        menu("exposure_auto", &UVC_EXPOSURE, 3),
        inactive(number("exposure_absolute", (3, 2047), 250)),
        switch("exposure_auto_priority", 1),
        inactive(number("focus_absolute", (0, 250), 30)),
        switch("focus_auto", 1),
    ]
}

/// Logitech C920 under Linux 6.1.
fn c920_new() -> Vec<Control> {
    vec![
        switch("white_balance_automatic", 1),
        number("gain", (0, 255), 64),
        menu("power_line_frequency", &POWER_LINE, 2),
        inactive(number("white_balance_temperature", (2000, 6500), 4120)),
        number("backlight_compensation", (0, 1), 0),
        menu("auto_exposure", &UVC_EXPOSURE, 3),
        inactive(number("exposure_time_absolute", (3, 2047), 250)),
        switch("exposure_dynamic_framerate", 1),
        inactive(number("focus_absolute", (0, 250), 30)),
        switch("focus_automatic_continuous", 1),
    ]
}

/// A laptop's built-in camera: fixed focus, no gain.
fn laptop() -> Vec<Control> {
    vec![
        switch("white_balance_automatic", 1),
        number("gamma", (72, 500), 100),
        menu("power_line_frequency", &POWER_LINE[..2], 1),
        inactive(number("white_balance_temperature", (2800, 6500), 4600)),
        menu("auto_exposure", &UVC_EXPOSURE, 3),
        inactive(number("exposure_time_absolute", (1, 5000), 157)),
        switch("exposure_dynamic_framerate", 1),
    ]
}

fn steps(plan: &ManualPlan) -> Vec<(&str, i64)> {
    plan.steps
        .iter()
        .map(|step| (step.name.as_str(), step.value))
        .collect()
}

/// Asserts that there is one sentence for each of these, which names it.
#[track_caller]
fn assert_named(sentences: &[String], things: &[&[&str]]) {
    assert_eq!(sentences.len(), things.len(), "{sentences:?}");
    for (sentence, things) in sentences.iter().zip(things) {
        assert!(is_named(sentence, things), "{things:?}: {sentence}");
    }
}

#[test]
fn automatics_go_off_before_values_are_held() {
    let plan = ManualPlan::new(&c920_new(), &ManualValues::default());
    assert_eq!(
        steps(&plan),
        [
            ("exposure_dynamic_framerate", 0),
            ("auto_exposure", 1),
            ("white_balance_automatic", 0),
            ("focus_automatic_continuous", 0),
            ("exposure_time_absolute", 250),
            ("gain", 64),
            ("white_balance_temperature", 4120),
            ("focus_absolute", 30),
            ("power_line_frequency", 0),
            ("backlight_compensation", 0),
        ]
    );
    assert!(plan.not_held.is_empty(), "{:?}", plan.not_held);
}

#[test]
fn names_from_before_linux_5_17_are_known_too() {
    let plan = ManualPlan::new(&c920_old(), &ManualValues::default());
    let found = steps(&plan);
    for wanted in [
        ("exposure_auto_priority", 0),
        ("exposure_auto", 1),
        ("white_balance_temperature_auto", 0),
        ("focus_auto", 0),
        ("exposure_absolute", 250),
        ("backlight_compensation", 0),
    ] {
        assert!(found.contains(&wanted), "{wanted:?} in {found:?}");
    }
    assert!(plan.not_held.is_empty(), "{:?}", plan.not_held);
}

#[test]
fn missing_controls_are_named() {
    let plan = ManualPlan::new(&laptop(), &ManualValues::default());
    assert_eq!(plan.not_held, ["gain (without a control)"]);
    let none = ManualPlan::new(&[], &ManualValues::default());
    assert_eq!(none.steps, []);
    let needed = ["exposure", "gain", "white balance"];
    assert_eq!(
        none.not_held.len(),
        needed.len(),
        "what a camera without controls does not change is not missed"
    );
    assert!(is_named(&none.warning().unwrap(), &needed));
}

#[test]
fn an_automatic_focus_without_a_value_is_named_and_a_fixed_one_is_not() {
    let mut controls = c920_new();
    controls.retain(|control| control.name != "focus_absolute");
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    assert_eq!(plan.not_held, ["focus (without a value to set)"]);
    controls.retain(|control| !control.name.starts_with("focus"));
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    assert!(plan.not_held.is_empty(), "{:?}", plan.not_held);
}

#[test]
fn wanted_values_go_into_the_range_and_onto_the_steps() {
    let mut controls = c920_new();
    let coarse = controls
        .iter_mut()
        .find(|control| control.name == "focus_absolute")
        .unwrap();
    coarse.step = 5;
    let wanted = ManualValues {
        exposure: Some(1_000_000),
        gain: Some(-4),
        white_balance: Some(5000),
        focus: Some(33),
    };
    let plan = ManualPlan::new(&controls, &wanted);
    let found = steps(&plan);
    for wanted in [
        ("exposure_time_absolute", 2047),
        ("gain", 0),
        ("white_balance_temperature", 5000),
        ("focus_absolute", 35),
        ("power_line_frequency", 0),
    ] {
        assert!(found.contains(&wanted), "{wanted:?} in {found:?}");
    }
}

#[test]
fn an_exposure_without_a_manual_mode_is_named() {
    let mut controls = laptop();
    controls.retain(|control| control.name != "auto_exposure");
    controls.push(menu("auto_exposure", &[(3, "Aperture Priority Mode")], 3));
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    assert!(
        plan.not_held[0].starts_with("auto_exposure"),
        "{:?}",
        plan.not_held
    );
    assert!(
        steps(&plan)
            .iter()
            .all(|&(name, _)| name != "auto_exposure")
    );
}

#[test]
fn a_read_only_value_is_named_and_an_automatic_without_value_too() {
    let mut controls = c920_new();
    for control in &mut controls {
        control.flags.read_only = control.name == "gain";
    }
    controls.retain(|control| control.name != "white_balance_temperature");
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    assert_eq!(
        plan.not_held,
        [
            "gain (cannot be set)",
            "white balance (without a value to set)"
        ]
    );
}

#[test]
fn what_is_manual_for_good_needs_no_setting() {
    let mut controls = vec![
        menu("auto_exposure", &[(0, "Manual Mode")], 0),
        number("exposure_time_absolute", (156, 156), 156),
        number("gain", (7, 7), 7),
        number("white_balance_automatic", (0, 0), 0),
    ];
    for control in &mut controls {
        control.flags.read_only = true;
    }
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    assert_eq!(plan, ManualPlan::default());
    controls[0] = menu("auto_exposure", &[(0, "Aperture Priority Mode")], 0);
    controls[0].flags.read_only = true;
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    assert!(
        plan.not_held[0].starts_with("auto_exposure"),
        "{:?}",
        plan.not_held
    );
}

#[test]
fn a_value_that_moved_is_found_by_plan_and_by_comparison() {
    let before = c920_new();
    let plan = ManualPlan::new(&before, &ManualValues::default());
    let mut after = before.clone();
    for control in &mut after {
        for step in &plan.steps {
            if step.id == control.id {
                control.value = Some(step.value);
            }
        }
    }
    assert_eq!(plan.check(&after), []);
    let set = after.clone();
    let gain = after.iter_mut().find(|control| control.name == "gain");
    gain.unwrap().value = Some(70);
    let moved = ControlDrift {
        name: "gain".to_owned(),
        should: 64,
        is: Some(70),
    };
    assert_eq!(plan.check(&after), drift_between(&set, &after));
    assert_eq!(plan.check(&after), std::slice::from_ref(&moved));
    assert!(is_named(&moved.to_string(), &["gain", "70", "64"]));
}

#[test]
fn a_reading_that_nobody_can_set_may_move() {
    let mut before = c920_new();
    let mut temperature = number("sensor_temperature", (-40, 125), 31);
    temperature.flags.read_only = true;
    before.push(temperature);
    let mut after = before.clone();
    after.last_mut().unwrap().value = Some(38);
    assert_eq!(drift_between(&before, &after), []);
    let gain = after.iter_mut().find(|control| control.name == "gain");
    gain.unwrap().value = Some(70);
    assert_eq!(drift_between(&before, &after).len(), 1);
}

/// A camera that answers only about its controls.
struct Answers(Vec<Control>, bool);

impl Camera for Answers {
    fn info(&self) -> &DeviceInfo {
        panic!("only the controls are asked")
    }
    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        panic!("only the controls are asked")
    }
    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        if self.1 {
            Ok(self.0.clone())
        } else {
            Err(CameraError::Unplugged {
                device: "/dev/video9".to_owned(),
                source: Some(std::io::Error::from_raw_os_error(19)),
            })
        }
    }
    fn set_control(&mut self, _: u32, value: i64) -> Result<i64, CameraError> {
        Ok(value)
    }
    fn start(&mut self, _: &CameraMode) -> Result<CameraMode, CameraError> {
        panic!("only the controls are asked")
    }
    fn next_frame(&mut self, _: Duration) -> Result<Frame, CameraError> {
        panic!("only the controls are asked")
    }
    fn stop(&mut self) -> Result<(), CameraError> {
        panic!("only the controls are asked")
    }
}

#[test]
fn reading_back_names_what_drifted_and_what_cannot_be_read() {
    let mut held = c920_new();
    let plan = ManualPlan::new(&held, &ManualValues::default());
    for setting in &plan.steps {
        let control = held.iter_mut().find(|control| control.id == setting.id);
        control.unwrap().value = Some(setting.value);
    }
    let read = |controls: &[Control], answers| {
        plan.faults_after(&held, &mut Answers(controls.to_vec(), answers))
    };
    assert_eq!(read(&held, true), [] as [&str; 0]);
    let mut drifted = held.clone();
    for control in &mut drifted {
        match control.name.as_str() {
            "gain" => control.value = Some(70),
            "focus_absolute" => control.value = None,
            _ => {}
        }
    }
    assert_named(
        &read(&drifted, true),
        &[&["gain", "70", "64"], &["focus_absolute", "30"]],
    );
    let faults = read(&held, false);
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].contains("/dev/video9"), "{faults:?}");
    assert!(faults[0].ends_with("(os error 19)"), "{faults:?}");
}

#[test]
fn no_range_makes_the_plan_panic() {
    for (minimum, maximum, step) in [(5, 5, 0), (9, 2, 3), (i64::MIN, i64::MAX, u64::MAX)] {
        let mut odd = number("gain", (minimum, maximum), 7);
        odd.step = step;
        let plan = ManualPlan::new(&[odd], &ManualValues::default());
        assert_eq!(plan.steps.len(), 1);
    }
}
