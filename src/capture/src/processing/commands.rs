//! The programs that do the work, and how they are called.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::state::ProcessingStep;

/// Where the programs are on this machine.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ProcessingPrograms {
    /// `relit-mask`, where it is installed.
    pub mask: Option<PathBuf>,
    /// `relit-extract`, where it is installed.
    pub extract: Option<PathBuf>,
    /// What a program that nobody waits for is started by, such as `nice`; the program and its arguments follow.
    pub launcher: Vec<OsString>,
}

/// Folders that a step works on.
#[derive(Debug, Clone)]
pub(super) struct StepPlaces {
    pub(super) session: PathBuf,
    pub(super) dataset: PathBuf,
    /// Whether the capture was aborted: it may hold a part of the turn.
    pub(super) is_aborted: bool,
}

impl ProcessingPrograms {
    /// The command of a step; `None` if its program is not installed.
    pub(super) fn command(&self, step: ProcessingStep, places: &StepPlaces) -> Option<Command> {
        let (session, dataset) = (places.session.as_os_str(), places.dataset.as_os_str());
        let (program, mut arguments): (_, Vec<OsString>) = match step {
            ProcessingStep::Mask => (&self.mask, vec![session.into(), "--auto".into()]),
            ProcessingStep::Check => (&self.mask, vec!["check".into(), session.into()]),
            ProcessingStep::Extract => (
                &self.extract,
                vec![
                    session.into(),
                    "-o".into(),
                    dataset.into(),
                    "--resume".into(),
                    "--progress".into(),
                ],
            ),
        };
        if step == ProcessingStep::Extract && places.is_aborted {
            arguments.push("--partial".into());
        }
        arguments.push("--json".into());
        Some(self.launch(program.as_deref()?, arguments))
    }

    /// The program that a step needs and that is not installed.
    pub(super) fn missing(&self, step: ProcessingStep) -> Option<&'static str> {
        match step {
            ProcessingStep::Mask | ProcessingStep::Check => {
                self.mask.is_none().then_some("relit-mask")
            }
            ProcessingStep::Extract => self.extract.is_none().then_some("relit-extract"),
        }
    }

    fn launch(&self, program: &Path, arguments: Vec<OsString>) -> Command {
        let mut words = self.launcher.iter().cloned().chain([program.into()]);
        // There is at least the program.
        let mut command = Command::new(words.next().unwrap_or_default());
        command.args(words).args(arguments);
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(command: &Command) -> Vec<String> {
        let arguments = command.get_args();
        let words = [command.get_program()].into_iter().chain(arguments);
        words
            .map(|word| word.to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn a_step_whose_program_is_missing_has_no_command() {
        let places = StepPlaces {
            session: "/s/mug".into(),
            dataset: "/d".into(),
            is_aborted: true,
        };
        let programs = ProcessingPrograms {
            extract: Some("/bin/relit-extract".into()),
            launcher: vec!["ionice".into(), "-c".into(), "3".into()],
            ..ProcessingPrograms::default()
        };
        assert!(programs.command(ProcessingStep::Mask, &places).is_none());
        let command = programs.command(ProcessingStep::Extract, &places).unwrap();
        let wanted =
            "ionice -c 3 /bin/relit-extract /s/mug -o /d --resume --progress --partial --json";
        assert_eq!(words(&command).join(" "), wanted);
    }
}
