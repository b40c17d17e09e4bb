//! `relight serve`: the app's page, handed out.

use std::env;
use std::path::PathBuf;

use clap::Args;
use relight_app::server::{PageFiles, installed_page, serve_page};
use relit_console::{Console, Outcome};
use relit_web::{ListenAddress, Shutdown, Token};
use serde_json::json;

use crate::commands::CommandResult;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight serve
      the app in a browser of this machine: open the address that is printed
  relight serve --listen 0.0.0.0:8430
      for a phone in the same network, which scans the code; the address holds a token";

#[derive(Args)]
pub(crate) struct Arguments {
    /// Where to listen; a port alone is this machine's own. Browsers other than this machine's get in by a token.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8430")]
    listen: ListenAddress,
    /// A file that holds the token, which only its owner and its group can read. Where there is none, it is made with a random
    /// token [default: a random token, where other machines can reach the address].
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// A name by which this machine is known to browsers, beside its addresses.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// The folder of the page [default: the one that was built or installed with this program].
    #[arg(long, value_name = "FOLDER")]
    page: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let folder = match &arguments.page {
        Some(folder) => folder.clone(),
        None => installed_page(&env::current_exe()?)?,
    };
    let files = PageFiles::read(&folder)?;
    let token = match &arguments.token_file {
        Some(file) => Some(Token::from_file_or_new(file)?),
        None => None,
    };
    let (address, names) = (
        arguments.listen.socket(),
        arguments.listen.names(&arguments.name),
    );
    let announce = |announcement: &relit_web::Announcement| {
        let url = &announcement.url;
        let mut text = format!("open {url} (end with Ctrl+C)");
        if !announcement.address.ip().is_loopback() {
            text += "\nbrowsers keep the page for work without a network only from https or from this machine itself";
            if let Some(code) = &announcement.qr {
                text = format!("{text}\n{code}");
            }
        }
        let event = json!({ "event": "serving", "url": url, "address": announcement.address });
        console.print(&text, &event);
    };
    serve_page(files, address, token, names, announce, &Shutdown::new())?;
    Ok(Outcome::Success)
}
