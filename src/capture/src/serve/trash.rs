//! Sessions that were put away: a folder beside the others, which only a person empties.

use std::path::Path;
use std::{fs, io};

use axum::http::StatusCode;
use relit_data::durable;
use relit_data::naming::is_session_name;
use relit_web::Failure;

use super::library::{Library, SessionSummary, read_names};

/// Where deleted sessions go. Its leading dot keeps it apart from sessions.
const TRASH: &str = ".trash";

impl Library {
    /// The sessions in the trash, newest first.
    pub(super) fn trash(&self) -> Result<Vec<SessionSummary>, Failure> {
        let trash = self.root.join(TRASH);
        let mut names = match read_names(&trash) {
            Ok(names) => names,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => {
                let trash = trash.display();
                let error = format!("the trash folder {trash} cannot be read: {error}");
                return Err(Failure::internal(error));
            }
        };
        names.sort_unstable_by(|one, other| other.cmp(one));
        let summaries = names.iter().filter_map(|name| self.summary(&trash, name));
        Ok(summaries.collect())
    }

    /// Moves a session to the trash.
    pub(super) fn move_to_trash(&self, id: &str) -> Result<(), Failure> {
        let folder = self.ended(id)?;
        let trash = self.root.join(TRASH);
        fs::create_dir_all(&trash).map_err(not_moved(id))?;
        move_folder(id, &folder, &trash.join(id))
    }

    /// Moves a session back from the trash.
    pub(super) fn restore(&self, id: &str) -> Result<(), Failure> {
        let folder = self.root.join(TRASH).join(id);
        if !is_session_name(id) || !folder.is_dir() {
            let error = "no session of that name is in the trash";
            return Err(Failure::not_found(error));
        }
        move_folder(id, &folder, &self.root.join(id))
    }
}

/// Moves a session's folder to where no other one is.
fn move_folder(id: &str, from: &Path, to: &Path) -> Result<(), Failure> {
    if to.exists() {
        let error =
            format!("another session named {id} is there already: move one of them by hand");
        return Err(Failure::new(StatusCode::CONFLICT, error));
    }
    durable::publish(from, to).map_err(not_moved(id))
}

fn not_moved(id: &str) -> impl FnOnce(io::Error) -> Failure {
    move |error| Failure::internal(format!("{id} could not be moved: {error}"))
}
