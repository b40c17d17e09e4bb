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
      the app in a browser on this machine: open the printed address
  relight serve --listen 0.0.0.0:8430
      for a phone in the same network: scan the code; the address contains a token";

#[derive(Args)]
pub(crate) struct Arguments {
    /// Address and port; a port alone is for this machine only. Other machines need the token.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8430")]
    listen: ListenAddress,
    /// A file with the token, readable by owner and group only; created if missing [default: a random token, if other machines
    /// can connect].
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// A host name of this machine for browsers, besides its addresses.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// The page's folder [default: as built or installed with relight].
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
            text += "\nbrowsers store the page for offline use only over https or on this machine";
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
