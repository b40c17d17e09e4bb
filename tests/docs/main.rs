//! The documents: their commands run, and their links lead somewhere.
//!
//! A fenced block of README or of a page of the guide that begins with "```sh run" is run by bash, in an empty folder
//! with a copy of the fixtures. The blocks of a page are run in their order, in the same folder. Other blocks are not run:
//! they need hardware, a network, a GPU, or files of one's own.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod commands;
mod links;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use relit_tests::trials::{self, Trial, free_trial, trial};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn main() -> ExitCode {
    let mut found = command_trials();
    assert!(!found.is_empty(), "no page has a block that is run");
    found.push(free_trial(
        "the_links_of_all_documents_lead_somewhere",
        || {
            let broken = links::broken(&root());
            assert!(broken.is_empty(), "{}", broken.join("\n"));
        },
    ));
    trials::run(found)
}

/// A trial for each page with commands that are run, of the page's name.
fn command_trials() -> Vec<Trial> {
    let guide = fs::read_dir(root().join("docs/guide")).unwrap();
    let mut pages: Vec<PathBuf> = guide
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .collect();
    pages.push(root().join("README.md"));
    pages.sort();
    let trials = pages.into_iter().filter_map(|page| {
        let blocks = commands::blocks(&fs::read_to_string(&page).unwrap());
        let name = page.file_name().unwrap().to_string_lossy().into_owned();
        (!blocks.is_empty()).then(|| {
            trial(
                format!("the_commands_of_{name}_run"),
                commands::programs,
                move |programs| commands::run(&name, &blocks, &programs),
            )
        })
    });
    trials.collect()
}
