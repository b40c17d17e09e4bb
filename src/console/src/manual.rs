//! Man pages and completions out of a program's own command line: what a package has beside the program.

use std::env::args_os;
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::Path;
use std::process::ExitCode;

use clap::Command;
use clap_complete::{Shell, generate_to};

use crate::Console;

/// The one argument that is taken, with a folder behind it. It is for who makes packages, and stands in no help.
const OPTION: &str = "--write-manual";

/// Does what `PROGRAM --write-manual FOLDER` asks for, where that is the command line: the exit code. Otherwise none.
pub fn written_manual(program: Command) -> Option<ExitCode> {
    let mut arguments = args_os().skip(1);
    let asked = (arguments.next(), arguments.next(), arguments.next());
    let (Some(option), Some(folder), None) = asked else {
        return None;
    };
    if option != OsStr::new(OPTION) {
        return None;
    }
    let folder = Path::new(&folder);
    Some(match write_manual(program, folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let what = format!(
                "the manual cannot be written to {}: {error}",
                folder.display()
            );
            Console::new(false).warn(&what);
            ExitCode::FAILURE
        }
    })
}

/// Writes a man page for the program and each of its verbs, and completions for bash, zsh and fish.
fn write_manual(program: Command, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let name = program.get_name().to_owned();
    clap_mangen::generate_to(program.clone(), folder)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        generate_to(shell, &mut program.clone(), &name, folder)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_with_verbs_has_a_page_for_each_and_completions_for_three_shells() {
        let folder = tempfile::tempdir().unwrap();
        let program = Command::new("relit-try")
            .about("Tries.")
            .subcommand(Command::new("once"));
        write_manual(program, folder.path()).unwrap();
        let mut names: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        let expected = [
            "_relit-try",
            "relit-try-once.1",
            "relit-try.1",
            "relit-try.bash",
            "relit-try.fish",
        ];
        for name in expected {
            assert!(
                names.iter().any(|found| found == name),
                "{name} of {names:?}"
            );
        }
    }
}
