//! `relit-extract card OUT`: what a published data set has beside it.

use std::path::Path;

use relit_console::{Console, Event, Outcome};
use relit_extract::ExtractError;
use relit_extract::card::{CardFacts, write_card};
use relit_extract::objects::{ObjectError, is_url};

pub(crate) fn run(
    console: Console,
    out: &Path,
    facts: &CardFacts,
) -> Result<Outcome, ExtractError> {
    if is_url(out) {
        let url = out.display().to_string();
        return Err(ObjectError::FolderOnly(url).into());
    }
    let bar = console.progress(0, "files");
    let files = write_card(out, facts, &|done, total| {
        bar.set_length(total);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    for file in files {
        let path = out.join(file);
        console.say(
            &path.display().to_string(),
            &Event::Described {
                output: path.to_string_lossy().into_owned(),
            },
        );
    }
    Ok(Outcome::Whole)
}
