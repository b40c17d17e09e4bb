//! `--help` of a program and of all its verbs, compared with a file of the manual in `docs/reference`, so that each
//! change of the command line shows in a review.
//!
//! After a change: `make docs` writes these files; `RELIT_WRITE_HELP=1 cargo test -p relit-mask --test help` writes that of
//! one program.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// Whether the file is written instead of compared.
const WRITE: &str = "RELIT_WRITE_HELP";

/// Asserts that `--help` of the program and of its verbs is what the file holds. The verbs that are `left_out` are those
/// whose help depends on how the program was built.
///
/// # Panics
/// If it is another, or the program or the file cannot be used.
#[track_caller]
pub fn assert_help(program: &str, file: &Path, left_out: &[&str]) {
    let mut found = String::new();
    write_help(program, &[], left_out, &mut found);
    if env::var_os(WRITE).is_some() {
        return fs::write(file, found).unwrap();
    }
    let expected = fs::read_to_string(file).unwrap_or_default();
    let pairs = (1..).zip(found.lines().zip(expected.lines()));
    let differs = pairs
        .filter(|(_, (found, expected))| found != expected)
        .map(|(number, (found, expected))| format!("line {number}:\n-{expected}\n+{found}"));
    assert!(
        found == expected,
        "--help is not what {} holds; if it should be, run this test again with {WRITE}=1. {}",
        file.display(),
        differs.take(1).collect::<String>()
    );
}

/// Appends the help of a verb and of those below it.
fn write_help(program: &str, verbs: &[&str], left_out: &[&str], text: &mut String) {
    let output = Command::new(program)
        .args(verbs)
        .arg("--help")
        // As wide as where there is no terminal.
        .env("COLUMNS", "100")
        .output()
        .unwrap();
    assert!(output.status.success(), "{verbs:?}: {output:?}");
    let help = String::from_utf8(output.stdout).unwrap();
    let name = Path::new(program).file_stem().unwrap().to_string_lossy();
    writeln!(text, "$ {} --help", [&[&*name], verbs].concat().join(" ")).unwrap();
    writeln!(text, "{}\n", help.trim_end()).unwrap();
    for verb in verbs_in(&help) {
        if verb != "help" && !left_out.contains(&verb) {
            write_help(program, &[verbs, &[verb]].concat(), left_out, text);
        }
    }
}

/// The verbs that a help lists: the first words of its section of commands.
fn verbs_in(help: &str) -> impl Iterator<Item = &str> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let section = lines.take_while(|line| !line.is_empty());
    section.filter_map(|line| {
        // Lines of more text are further in.
        let verb = line.strip_prefix("  ")?;
        let begins = !verb.starts_with(' ');
        begins.then(|| verb.split(' ').next()).flatten()
    })
}
