//! `relit-capture token`: the token in the file that `serve --token-file` has.

use std::path::Path;

use relit_rig::serve::{Token, TokenFileError};
use serde_json::json;

use relit_console::{Console, Outcome};

pub(crate) fn run(console: Console, file: &Path) -> Result<Outcome, TokenFileError> {
    let token = Token::from_file(file)?;
    console.say(
        token.reveal(),
        &json!({ "event": "token", "token": token.reveal() }),
    );
    Ok(Outcome::Whole)
}
