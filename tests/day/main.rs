//! A day at the rig by taps on a phone: the real programs, a replayed camera, a simulated table and a headless browser.
//!
//! `make test-day PICTURES=DIR` goes through the long day, with a turn of 1500 frames, and leaves a picture of each step.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by a panic, in its helpers too"
)]

mod day;
mod phone;
mod rig;
mod trouble;

use std::path::PathBuf;
use std::process::ExitCode;

use relit_tests::chromium;
use relit_tests::trials;
use relit_tests::trials::trial;

use day::Day;
use phone::Phone;
use rig::{LONG_TURN, Rig, SHORT_TURN};

fn main() -> ExitCode {
    let mut trials = trials![with chromium::find =>
        phone::a_tap_follows_what_moved_under_the_finger_and_meets_nothing_else,
        trouble::what_is_not_there_is_named_by_headline_and_button,
        trouble::a_take_that_a_person_stopped_is_no_fault,
        trouble::a_page_goes_on_with_a_rig_that_was_started_again,
        trouble::a_second_tap_on_start_is_no_stop,
        trouble::the_emergency_stop_comes_first_and_the_aborted_object_after_it,
        where_the_programs_are_missing_the_page_says_so_and_offers_the_editor_alone,
        a_session_that_opens_offers_nothing_until_its_steps_are_known,
        a_day_goes_by_taps_from_an_empty_table_to_a_verified_data_set_and_the_next_object,
    ];
    let long = trial("a_day_of_whole_turns", chromium::find, a_day_of_whole_turns);
    trials.push(long.with_ignored_flag(true));
    trials::run(trials)
}

fn a_session_that_opens_offers_nothing_until_its_steps_are_known(browser: PathBuf) {
    let rig = Rig::start(&SHORT_TURN);
    rig.hold_recorded();
    let mut phone = Phone::open(&browser, &rig.url, "opens");
    phone.wait_for("document.querySelector('#sessions li button:enabled') !== null");
    // Its steps cannot be there before this has been carried out.
    let offered = phone.value(
        "(() => { document.querySelector('#sessions li button').click(); \
            const shown = [...document.querySelectorAll('#made button, #made a')].filter((part) => part.checkVisibility()); \
            return shown.filter((part) => !part.disabled).map(({ id }) => id).join(' '); })()",
    );
    assert_eq!(offered, "");
    phone.wait_for(
        "!document.getElementById('edit-mask').disabled || !document.getElementById('job').hidden",
    );
}

fn a_day_goes_by_taps_from_an_empty_table_to_a_verified_data_set_and_the_next_object(
    browser: PathBuf,
) {
    let rig = Rig::start(&SHORT_TURN);
    Day::begin(&rig, Phone::open(&browser, &rig.url, "short")).go_through();
}

fn a_day_of_whole_turns(browser: PathBuf) {
    let rig = Rig::start(&LONG_TURN);
    Day::begin(&rig, Phone::open(&browser, &rig.url, "day")).go_through();
}

fn where_the_programs_are_missing_the_page_says_so_and_offers_the_editor_alone(browser: PathBuf) {
    let rig = Rig::start_without_programs(&SHORT_TURN);
    rig.hold_recorded();
    let mut phone = Phone::open(&browser, &rig.url, "alone");
    phone.wait_text("#missing", "relit-mask and relit-extract are not installed");
    phone.wait_for("document.getElementById('when-done').disabled");
    phone.tap("#sessions li button");
    phone.wait_for("document.getElementById('make-mask').checkVisibility()");
    for button in ["make-mask", "make-check", "make-extract"] {
        phone.wait_for(&format!("document.getElementById('{button}').disabled"));
    }
    phone.wait_for("!document.getElementById('edit-mask').disabled");
    phone.see("without-programs");
}
