//! kill -9 at random moments. `RELIT_KILLS` sets how often (8).

use std::collections::hash_map::RandomState;
use std::fs;
use std::hash::{BuildHasher, Hasher};
use std::thread;
use std::time::{Duration, Instant};

use relit_data::shard::Dataset;

use crate::support::{SETTINGS, Workshop, files};

fn kills() -> u32 {
    let asked = std::env::var("RELIT_KILLS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(8)
}

/// 0..1.
fn random() -> f64 {
    let number = RandomState::new().build_hasher().finish();
    (number >> 11) as f64 / (1_u64 << 53) as f64
}

pub(crate) fn a_kill_at_any_moment_leaves_only_whole_files_and_resume_ends_in_the_same_bytes() {
    let workshop = Workshop::with(&["a.mkv", "b.mkv"]);
    let layouts = ["webdataset", "paper"].map(|layout| {
        let line = format!("a.mkv b.mkv {SETTINGS} --layout {layout} --resume -o");
        let start = Instant::now();
        workshop.errors(0, &format!("{line} whole-{layout}"));
        let whole = files(&workshop.path(&format!("whole-{layout}")));
        (line, start.elapsed(), whole)
    });
    let mut in_the_middle = 0;
    for round in 0..kills() {
        let (line, length, whole) = &layouts[round as usize % 2];
        let out = workshop.path("out");
        let mut child = workshop.command(&format!("{line} out")).spawn().unwrap();
        let moment = length.mul_f64(random());
        thread::sleep(moment.max(Duration::from_millis(1)));
        child.kill().unwrap();
        in_the_middle += u32::from(!child.wait().unwrap().success());
        for (name, bytes) in files(&out) {
            match name.as_str() {
                "dataset.json" => {
                    let dataset = Dataset::read(&out).unwrap();
                    for session in &dataset.sessions {
                        dataset.check_integrity(&out, &session.id).unwrap();
                    }
                }
                _ => assert!(
                    whole[&name] == bytes,
                    "{name} is torn, killed after {moment:?}"
                ),
            }
        }
        workshop.errors(0, &format!("{line} out"));
        assert!(files(&out) == *whole, "killed after {moment:?}");
        assert_eq!(hidden(&out), [""; 0], "killed after {moment:?}");
        fs::remove_dir_all(&out).unwrap();
    }
    eprintln!("{in_the_middle} of {} kills came before the end", kills());
}

/// Names in a folder that start with a dot.
fn hidden(folder: &std::path::Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.starts_with('.')).collect()
}
