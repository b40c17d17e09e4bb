//! What the page says where something is in the way. All states of the rig are in `src/rig/serve/tests/states`; here a
//! browser shows those that were once hidden.

use std::fs;
use std::path::PathBuf;

use relit_turntable::simulator::{Simulator, SimulatorOptions};

use crate::phone::Phone;
use crate::rig::{Rig, SHORT_TURN, SLOW_TURN};

pub(crate) fn what_is_not_there_is_named_by_headline_and_button(browser: PathBuf) {
    let rig = Rig::start_at(&SHORT_TURN, "v4l2:/dev/no-camera", "sim:");
    let mut phone = Phone::open(&browser, &rig.url, "no-camera");
    phone.wait_text("#phase", "No camera");
    phone.wait_text("#camera-fault", "/dev/no-camera");
    phone.wait_button("No camera", false);
    phone.see("no-camera");
    drop((rig, phone));

    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("port");
    fs::write(&port, "").unwrap();
    let table = format!("serial:{}", port.display());
    let rig = Rig::start_at(&SHORT_TURN, &SHORT_TURN.camera(), &table);
    let mut phone = Phone::open(&browser, &rig.url, "no-table");
    phone.wait_text("#phase", "No turntable");
    phone.wait_text("#table-fault", "could not be opened");
    phone.wait_button("No turntable", false);
    phone.write("#object", "cow");
    phone.wait_button("No turntable", false);
    phone.see("port-that-cannot-be-opened");
    drop((rig, phone));

    let rig = Rig::start(&SHORT_TURN);
    let mut phone = Phone::open(&browser, &rig.url, "no-folder");
    phone.wait_text("#phase", "Ready");
    let away = rig.sessions().with_file_name("away");
    fs::rename(rig.sessions(), &away).unwrap();
    phone.wait_text("#phase", "No folder for sessions");
    phone.wait_text("#disk", "put the folder back");
    phone.wait_button("No folder for sessions", false);
    phone.wait_for("document.getElementById('message').hidden");
    phone.see("no-folder");
    fs::rename(&away, rig.sessions()).unwrap();
    phone.wait_text("#phase", "Ready");
    phone.wait_for("document.getElementById('message').hidden");
}

pub(crate) fn a_take_that_a_person_stopped_is_no_fault(browser: PathBuf) {
    let rig = Rig::start(&SLOW_TURN);
    let mut phone = Phone::open(&browser, &rig.url, "stopped");
    phone.write("#object", "calf");
    phone.wait_button("Start calf", true);
    phone.tap("#go");
    phone.wait_text("#phase", "Recording");
    phone.wait_for("document.getElementById('progress').value > 0.02");
    phone.tap("#go");
    phone.wait_text_so_long("#phase", "The take of calf was stopped", SLOW_TURN.longest);
    phone.wait_button("Record calf again", true);
    phone.wait_text("#last-open", "stopped");
    phone.wait_for("document.getElementById('faults').hidden");
    phone.wait_text("#sessions .day", "1 recorded");
    let red = "[...document.querySelectorAll('#work .bad, .take .bad')].filter((part) => part.checkVisibility() && part.textContent).length";
    assert_eq!(phone.value(red), 0);
    phone.see("stopped");
    phone.value("document.getElementById('sessions-title').scrollIntoView()");
    phone.see("stopped-in-the-list");
    // What there is of it is extracted only step by step.
    phone.tap("#last-open");
    phone.wait_for("!document.getElementById('edit-mask').disabled");
    assert_eq!(
        phone.value("document.getElementById('make-all').hidden"),
        true
    );
}

pub(crate) fn a_page_goes_on_with_a_rig_that_was_started_again(browser: PathBuf) {
    let longest = SHORT_TURN.longest;
    let mut rig = Rig::start(&SHORT_TURN);
    let mut phone = Phone::open(&browser, &rig.url, "restart");
    phone.write("#object", "cow");
    phone.wait_button("Start cow", true);
    phone.tap("#go");
    phone.wait_text_so_long("#last-open", "clean", longest);
    phone.wait_text_so_long("#phase", "Ready", longest);
    phone.value(
        "window.thrown = []; addEventListener('error', ({ message }) => thrown.push(message))",
    );
    rig.restart();
    // The new rig counts its states from the beginning.
    phone.wait_text("#table-fault", "cable");
    phone.wait_button("Start cow", true);
    phone.wait_text("#last-open", "cow");
    assert_eq!(phone.value("thrown.join('; ')"), "");
    // It takes its zero where a person wants it.
    phone.tap("#home");
    phone.wait_for("document.getElementById('table-fault').hidden");
    phone.see("started-again");
}

pub(crate) fn a_second_tap_on_start_is_no_stop(browser: PathBuf) {
    let rig = Rig::start(&SLOW_TURN);
    let mut phone = Phone::open(&browser, &rig.url, "double-tap");
    phone.write("#object", "calf");
    phone.wait_button("Start calf", true);
    // As soon as the button is another one.
    phone.value(
        "(() => { const go = document.getElementById('go'); \
            new MutationObserver(() => { if (window.secondTap === undefined && go.textContent === 'Stop') { window.secondTap = go.disabled; go.click(); } }).observe(go, { childList: true }); \
            go.click(); })()",
    );
    phone.wait_for("window.secondTap === true");
    phone.wait_for("document.getElementById('progress').value > 0.02");
    phone.wait_text("#phase", "Recording");
    phone.wait_button("Stop", true);
}

pub(crate) fn the_emergency_stop_comes_first_and_the_aborted_object_after_it(browser: PathBuf) {
    let longest = SLOW_TURN.longest;
    // Its emergency stop is pressed when the page is so far, however long that takes.
    let simulator = Simulator::start(&SimulatorOptions::default(), None).unwrap();
    let rig = Rig::start_with(&SLOW_TURN, &simulator);
    let mut phone = Phone::open(&browser, &rig.url, "emergency");
    phone.write("#object", "calf");
    phone.wait_button("Start calf", true);
    phone.tap("#go");
    phone.wait_button("Stop", true);
    phone.wait_so_long("document.getElementById('progress').value > 0.02", longest);
    simulator.table().press_emergency_stop(true);
    phone.wait_text_so_long("#alarm", "release it", longest);
    phone.wait_button("Release the emergency stop", false);
    phone.value("scrollTo(0, 0)");
    phone.see("pressed");
    simulator.table().press_emergency_stop(false);
    phone.wait_text_so_long("#phase", "The table is locked", longest);
    phone.wait_button("Reset and home the table", true);
    phone.see("released");
    phone.tap("#go");
    phone.wait_text_so_long("#phase", "The take of calf was aborted", longest);
    phone.wait_button("Record calf again", true);
    phone.see("again");
}
