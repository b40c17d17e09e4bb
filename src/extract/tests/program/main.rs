//! `relit-extract` when it is killed, when the disk is full, when files may not be read, and when several
//! tasks share the work, and on object stores.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr
)]

mod full_disk;
mod killed;
#[cfg(feature = "object-store")]
mod objects;
mod support;
mod tasks;

use std::process::ExitCode;

use relit_test_support::trials;

fn main() -> ExitCode {
    let mut trials = trials![
        killed::a_kill_at_any_moment_leaves_only_whole_files_and_resume_ends_in_the_same_bytes,
        tasks::tasks_at_the_same_time_and_a_merge_make_the_same_data_set_as_one_run,
        tasks::a_task_that_is_missing_or_was_killed_is_named_and_nothing_is_written,
        tasks::a_merge_names_what_failed_and_refuses_tasks_of_different_inputs,
        tasks::a_session_that_no_task_made_and_a_file_that_is_gone_are_noticed,
        tasks::a_task_without_recordings_says_so,
        tasks::another_number_of_tasks_takes_over_what_the_data_set_has,
    ];
    #[cfg(not(feature = "object-store"))]
    trials.extend(trials![
        tasks::a_url_is_refused_by_a_program_without_object_stores
    ]);
    #[cfg(feature = "object-store")]
    trials.extend(trials![
        objects::a_data_set_at_a_url_is_that_of_a_folder_and_nothing_stays_on_the_way,
        objects::tasks_write_to_a_url_and_are_merged_and_summed_there,
        objects::what_is_not_there_and_credentials_in_a_url_are_refused_in_one_sentence,
    ]);
    trials.extend(full_disk::trials());
    trials::run(trials)
}
