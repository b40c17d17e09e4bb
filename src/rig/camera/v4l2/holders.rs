//! Which programs have a device open, as far as this user may see.

use std::fs;
use std::path::Path;

/// Most programs that are named.
const MOST_NAMED: usize = 4;

/// The other programs that have this file open, with their process numbers; `None` where none is
/// seen: those of other users are hidden from everybody but root.
pub(super) fn of(path: &Path) -> Option<String> {
    let device = path.canonicalize().ok()?;
    let own = std::process::id();
    let processes = fs::read_dir("/proc").ok()?.flatten();
    let named: Vec<String> = processes
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .filter(|&process| process != own && has_open(process, &device))
        .take(MOST_NAMED)
        .map(name)
        .collect();
    (!named.is_empty()).then(|| named.join(", "))
}

fn has_open(process: u32, device: &Path) -> bool {
    let open = fs::read_dir(format!("/proc/{process}/fd"));
    let mut open = open.into_iter().flatten().flatten();
    open.any(|entry| fs::read_link(entry.path()).is_ok_and(|target| target == device))
}

fn name(process: u32) -> String {
    match fs::read_to_string(format!("/proc/{process}/comm")) {
        Ok(name) => format!("{} (process {process})", name.trim_end()),
        Err(_) => format!("process {process}"),
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn the_program_that_has_a_file_open_is_named_and_this_one_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("device");
        let own = File::create(&path).unwrap();
        let child = Command::new("cat")
            .stdin(Stdio::piped())
            .stdout(own.try_clone().unwrap())
            .spawn();
        let mut child = child.unwrap();
        let named = of(&path).unwrap();
        assert!(
            named.contains(&format!("(process {})", child.id())),
            "{named}"
        );
        let this = format!("(process {})", std::process::id());
        assert!(!named.contains(&this), "{named}");
        // Its input ends, and with it the program.
        drop(child.stdin.take());
        child.wait().unwrap();
    }
}
