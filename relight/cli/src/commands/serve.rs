//! `relight serve`: the app's page, handed out or written to a folder.

use std::env;
use std::path::PathBuf;

use clap::Args;
use relight_app::server::{PageFiles, PageServerOptions, installed_page, serve_page};
use relit_console::{Console, Outcome};
use relit_web::{ListenAddress, Shutdown, Token};
use serde_json::json;

use crate::commands::CommandResult;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight serve
      the app in a browser of this machine: open the address that is printed
  relight serve --listen 0.0.0.0:8430
      for a phone in the same network, which scans the code; the address holds a token
  relight serve --export site
      the same page in a folder, for any web server";

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
    /// Write the page into a folder, for any web server, and serve nothing.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["listen", "token_file", "name"])]
    export: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let folder = match &arguments.page {
        Some(folder) => folder.clone(),
        None => installed_page(&env::current_exe()?)?,
    };
    let files = PageFiles::read(&folder)?;
    if let Some(folder) = &arguments.export {
        files.export(folder)?;
        let size = files.size();
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        let text = format!(
            "{}: {} files, {:.1} MB ({:.1} MB compressed); README.txt says what the server should send",
            folder.display(),
            size.files,
            megabytes(size.bytes),
            megabytes(size.compressed)
        );
        let event = json!({ "event": "exported", "folder": folder, "files": size.files, "bytes": size.bytes,
            "compressed": size.compressed });
        console.say(&text, &event);
        return Ok(Outcome::Whole);
    }
    let token = match &arguments.token_file {
        Some(file) => Some(Token::from_file_or_new(file)?),
        None => None,
    };
    let options = PageServerOptions {
        address: arguments.listen.socket(),
        token,
        names: arguments.listen.names(&arguments.name),
    };
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
        console.say(&text, &event);
    };
    serve_page(files, options, announce, &Shutdown::new())?;
    Ok(Outcome::Whole)
}
