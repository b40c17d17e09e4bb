//! Drives the emulated chip in lock-step: time passes only when a test says so.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::SystemTime;

/// Cycles in a microsecond of the chip's clock.
pub(crate) const CYCLES_PER_US: u64 = 16;
/// Cycles in a millisecond.
pub(crate) const MS: u64 = 16_000;
/// Steps in a degree, as `$100` has it by default.
pub(crate) const STEPS_PER_DEGREE: f64 = 88.889;

/// A rising edge at STEP.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// When.
    pub(crate) cycle: u64,
    /// Whether DIR was low, as it is for a positive turn.
    pub(crate) forward: bool,
}

/// A change at ENABLE.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Enable {
    /// When.
    pub(crate) cycle: u64,
    /// The level; low feeds the driver.
    pub(crate) level: bool,
}

/// A status report.
#[derive(Debug, Clone)]
pub(crate) struct Status {
    text: String,
}

impl Status {
    /// The state, such as `Run`.
    pub(crate) fn state(&self) -> &str {
        self.text.split('|').next().unwrap_or_default()
    }

    /// What follows `name:`.
    pub(crate) fn field(&self, name: &str) -> Option<&str> {
        self.text
            .split('|')
            .find_map(|field| field.strip_prefix(name)?.strip_prefix(':'))
    }

    /// Degrees from machine zero.
    pub(crate) fn position(&self) -> f64 {
        let axes = self.field("MPos").expect("the report has MPos");
        axes.split(',').next().unwrap().parse().unwrap()
    }

    /// Microseconds of the chip's clock.
    pub(crate) fn micros(&self) -> u64 {
        self.field("T").expect("the report has T").parse().unwrap()
    }
}

/// The firmware on an emulated chip.
pub(crate) struct Chip {
    process: Child,
    commands: ChildStdin,
    answers: BufReader<ChildStdout>,
    partial: Vec<u8>,
    lines: VecDeque<String>,
    /// The chip's clock.
    pub(crate) cycle: u64,
    /// When the last byte left the chip.
    pub(crate) sent_at: u64,
    /// Every step so far.
    pub(crate) steps: Vec<Step>,
    /// Every change at ENABLE so far.
    pub(crate) enables: Vec<Enable>,
    /// Bytes that the receiver lost because the program was late.
    pub(crate) overruns: usize,
    /// Bytes of stack that were never used, as of the last question.
    pub(crate) stack_free: Option<u32>,
}

impl Chip {
    /// Power on, up to the banner, where firmware and emulator have been built.
    pub(crate) fn start() -> Result<(Chip, String), String> {
        let (elf, emulator) = find()?;
        let mut process = Command::new(emulator)
            .arg(elf)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("the emulator starts");
        let mut chip = Chip {
            commands: process.stdin.take().unwrap(),
            answers: BufReader::new(process.stdout.take().unwrap()),
            process,
            partial: Vec::new(),
            lines: VecDeque::new(),
            cycle: 0,
            sent_at: 0,
            steps: Vec::new(),
            enables: Vec::new(),
            overruns: 0,
            stack_free: None,
        };
        let banner = chip.banner();
        Ok((chip, banner))
    }

    /// The next banner.
    pub(crate) fn banner(&mut self) -> String {
        loop {
            let line = self.line(1000 * MS).expect("a banner comes within 1 s");
            if line.starts_with("Grbl") {
                return line;
            }
        }
    }

    /// Gives a command to the emulator, and takes in what happened.
    pub(crate) fn command(&mut self, command: &str) {
        writeln!(self.commands, "{command}").expect("the emulator listens");
        self.commands.flush().unwrap();
        loop {
            let mut answer = String::new();
            let count = self.answers.read_line(&mut answer).unwrap();
            assert!(count > 0, "the emulator ended at `{command}`");
            if self.take_in(answer.trim_end()) {
                return;
            }
        }
    }

    /// True at the end of an answer.
    fn take_in(&mut self, answer: &str) -> bool {
        let mut words = answer.split(' ');
        let kind = words.next().unwrap();
        let at: u64 = words.next().unwrap().parse().unwrap();
        let value = words.next();
        match kind {
            "tx" => {
                self.sent_at = at;
                self.take_byte(u8::from_str_radix(value.unwrap(), 16).unwrap());
            }
            "step" => self.steps.push(Step {
                cycle: at,
                forward: value == Some("0"),
            }),
            "enable" => self.enables.push(Enable {
                cycle: at,
                level: value == Some("1"),
            }),
            "overrun" => self.overruns += 1,
            "stack" => self.stack_free = u32::try_from(at).ok(),
            "done" => self.cycle = at,
            _ => panic!("the emulator said `{answer}`"),
        }
        kind == "done"
    }

    fn take_byte(&mut self, byte: u8) {
        if byte == b'\n' {
            let line = String::from_utf8(std::mem::take(&mut self.partial)).unwrap();
            self.lines.push_back(line.trim_end().to_string());
        } else {
            self.partial.push(byte);
        }
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, cycles: u64) {
        self.command(&format!("run {cycles}"));
    }

    /// Puts bytes on the wire to the chip.
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        self.command(&format!("rx {hex}"));
    }

    /// The next line from the chip, within `cycles`.
    pub(crate) fn line(&mut self, cycles: u64) -> Option<String> {
        if self.lines.is_empty() {
            self.command(&format!("line {cycles}"));
        }
        self.lines.pop_front()
    }

    /// Sends a line, and returns its answer (`ok` or `error:N`) with what came before it.
    pub(crate) fn ask(&mut self, line: &str) -> (Vec<String>, String) {
        self.write(format!("{line}\n").as_bytes());
        self.answer(line)
    }

    /// Waits for the answer to a line.
    pub(crate) fn answer(&mut self, line: &str) -> (Vec<String>, String) {
        let mut before = Vec::new();
        loop {
            let got = self
                .line(120_000 * MS)
                .unwrap_or_else(|| panic!("no answer to `{line}` after {before:?}"));
            if got.starts_with("ok") || got.starts_with("error:") {
                return (before, got);
            }
            before.push(got);
        }
    }

    /// Sends a line that has to be accepted.
    pub(crate) fn accept(&mut self, line: &str) {
        let (before, answer) = self.ask(line);
        assert_eq!(answer, "ok", "to `{line}`, after {before:?}");
    }

    /// Asks for a status report.
    pub(crate) fn status(&mut self) -> Status {
        self.write(b"?");
        loop {
            let line = self.line(100 * MS).expect("a report within 100 ms");
            if let Some(text) = line.strip_prefix('<') {
                return Status {
                    text: text.trim_end_matches('>').to_string(),
                };
            }
        }
    }

    /// Lets time pass until the table rests.
    pub(crate) fn rest(&mut self) {
        while self.status().state() != "Idle" {
            self.run(20 * MS);
        }
    }

    /// Steps since power-on, forward ones less backward ones.
    pub(crate) fn net_steps(&self) -> i64 {
        self.steps
            .iter()
            .map(|step| if step.forward { 1 } else { -1 })
            .sum()
    }

    /// Bytes of stack that were never used.
    pub(crate) fn stack_free(&mut self) -> u32 {
        self.command("stack");
        self.stack_free.expect("the emulator knows the stack")
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        // It may have ended by itself; then there is nothing to end or to collect.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The program and the emulator where `make` puts them.
fn find() -> Result<(PathBuf, PathBuf), String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .parent()
        .ok_or("there is no target folder")?
        .join("firmware");
    let elf = folder.join("rig-firmware-uno.elf");
    let emulator = folder.join("rig-emulator");
    for file in [&elf, &emulator] {
        if !file.exists() {
            return Err(format!(
                "{} is not there: `make firmware emulator` builds it (`make setup` says what that \
                 needs)",
                file.display()
            ));
        }
    }
    let built = modified(&elf);
    let sources = Path::new(env!("CARGO_MANIFEST_DIR"));
    for folder in ["src", "uno/src"] {
        let newest = newest_in(&sources.join(folder));
        assert!(
            newest <= built,
            "{} is older than {folder}: run `make firmware`",
            elf.display()
        );
    }
    Ok((elf, emulator))
}

fn modified(file: &Path) -> SystemTime {
    file.metadata().unwrap().modified().unwrap()
}

fn newest_in(folder: &Path) -> SystemTime {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            if path.is_dir() {
                newest_in(&path)
            } else {
                modified(&path)
            }
        })
        .max()
        .unwrap_or(SystemTime::UNIX_EPOCH)
}
