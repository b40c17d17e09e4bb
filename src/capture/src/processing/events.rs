//! What the programs say on standard output while they work, one JSON object a line. What they made is read from
//! their files. Without I/O.

use relit_console::Event;

use super::editor::EditorTarget;

/// All that a program reported.
#[derive(Debug, Default)]
pub(super) struct ProgramEvent {
    progress: Option<(u64, u64)>,
    /// Its error, or why it left the session out.
    error: Option<String>,
    has_mask: bool,
    editor: Option<EditorTarget>,
}

impl ProgramEvent {
    /// Takes in a line. What cannot be understood is passed over: newer programs say more.
    pub(super) fn line(&mut self, line: &[u8]) {
        let Ok(event) = serde_json::from_slice(line) else {
            return;
        };
        match event {
            Event::Progress { done, of, .. } => self.progress = Some((done, of)),
            Event::Error { message, .. } | Event::LeftOut { message, .. } => {
                self.error = Some(message);
            }
            Event::Mask { .. } => self.has_mask = true,
            Event::Editor { address, url } => self.editor = EditorTarget::parse(&address, &url),
            _ => {}
        }
    }

    /// The newest word on the progress, once.
    pub(super) fn take_progress(&mut self) -> Option<(u64, u64)> {
        self.progress.take()
    }

    /// Where the editor is, once it has said so.
    pub(super) fn editor(&self) -> Option<&EditorTarget> {
        self.editor.as_ref()
    }

    /// Whether it made a mask.
    pub(super) fn has_mask(&self) -> bool {
        self.has_mask
    }

    /// Whether it ended, with an exit code, as one that made its files; without some of the input, or without losses.
    pub(super) fn is_success(&self, exit_code: Option<i32>) -> bool {
        matches!(exit_code, Some(0 | 3)) && self.error.is_none()
    }

    /// What went wrong, for a person; `error_output` is what the program wrote on standard error.
    pub(super) fn failure(&self, exit_code: Option<i32>, error_output: &str) -> String {
        let last = || {
            let mut lines = error_output.lines().map(str::trim);
            let last = lines.rfind(|line| !line.is_empty())?;
            Some(last.strip_prefix("error: ").unwrap_or(last).to_owned())
        };
        self.error
            .clone()
            .or_else(last)
            .unwrap_or_else(|| match exit_code {
                Some(code) => format!("the program ended with exit code {code}, without a message"),
                None => "the program was ended by a signal: check the machine's memory".to_owned(),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_says_nothing_is_reported_by_what_ended_it() {
        let heard = ProgramEvent::default();
        assert!(heard.failure(Some(7), "").contains("7"));
        let signal = heard.failure(None, "\n");
        assert!(!signal.trim().is_empty() && signal != heard.failure(Some(0), ""));
        assert_eq!(heard.failure(Some(1), "error: a\n\n"), "a");
    }

    #[test]
    fn a_session_that_was_left_out_has_failed() {
        let mut heard = ProgramEvent::default();
        heard.line(b"no JSON");
        assert!(heard.is_success(Some(0)) && heard.is_success(Some(3)));
        assert!(!heard.is_success(Some(1)) && !heard.is_success(None));
        heard.line(br#"{"event":"left_out","input":"a","message":"the frames cover 20"}"#);
        assert!(!heard.is_success(Some(3)));
        assert_eq!(heard.failure(Some(3), "warning: x"), "the frames cover 20");
    }
}
