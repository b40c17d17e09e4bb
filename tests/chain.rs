//! From recorded turns to networks: `relit-extract` makes shards of the bundled sessions, `relight train` learns from
//! them by the paper's phases. Runs where both programs were built, relight with the feature `train`.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use relit_tests::trials;

/// The session that is trained on, and the one that judges.
const TAUGHT: &str = "20261120T101500Z-cow-short";
const HELD_OUT: &str = "20261120T102000Z-bust-short";

/// The program relight, which cargo builds beside this test, if it was built, and with training.
fn relight() -> Result<PathBuf, String> {
    let program = relit_tests::beside_this_test("relight").unwrap();
    let answer = Command::new(&program)
        .args(["train", "normal", "--help"])
        .output();
    match answer {
        Ok(output) if output.status.success() => Ok(program),
        _ => Err(format!(
            "{} is not there, or has no training: `make setup-train` installs what that needs",
            program.display()
        )),
    }
}

#[track_caller]
fn success(output: &Output) {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
}

fn extract(session: &str, out: &Path) {
    let session = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fixtures")
        .join(session);
    let output = Command::new(relit_tests::program("relit-extract"))
        .arg(&session)
        .arg("--output")
        .arg(out)
        .arg("--mask")
        .arg(session.join("mask_gt.png"))
        .args(["--frames", "48", "--size", "64"])
        .output()
        .unwrap();
    success(&output);
}

/// A folder in which shards and runs lie, and the program that trains.
struct Bench {
    folder: tempfile::TempDir,
    relight: PathBuf,
}

impl Bench {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Trains by `phase` into the folder of its name, or into `out`.
    fn train(&self, phase: &str, out: &str, more: &str) {
        let settings =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../relight/cli/weights/fixtures.toml");
        let output = Command::new(&self.relight)
            .args(["train", phase, "--threads", "1", "-o", out, "--settings"])
            .arg(settings)
            .args(more.split_whitespace())
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        success(&output);
    }

    /// The values of a series of a run, in the order of their steps.
    fn series(&self, run: &str, name: &str) -> Vec<f64> {
        let table = fs::read_to_string(self.path(run).join("losses.csv")).unwrap();
        let values: Vec<f64> = table
            .lines()
            .filter_map(|line| match line.split(',').collect::<Vec<_>>()[..] {
                [_, series, value] if series == name => Some(value.parse().unwrap()),
                _ => None,
            })
            .collect();
        assert!(values.len() >= 2, "{run}: {name}: {values:?}");
        values
    }

    #[track_caller]
    fn falls(&self, run: &str, name: &str) {
        let values = self.series(run, name);
        assert!(values.last() < values.first(), "{run}: {name}: {values:?}");
    }
}

fn main() -> ExitCode {
    trials::run(trials![
        with relight => recorded_turns_train_the_networks_by_the_phases_of_the_paper,
    ])
}

fn recorded_turns_train_the_networks_by_the_phases_of_the_paper(relight: PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let bench = Bench { folder, relight };
    extract(TAUGHT, &bench.path("shards"));
    extract(HELD_OUT, &bench.path("held-out"));

    bench.train("normal", "normal", "");
    bench.falls("normal", "validation/normals_deg");

    bench.train("spec", "spec", "--turns shards");
    bench.falls("spec", "validation/highlight");

    let light =
        "--turns shards --validation-turns held-out --normal-net normal/normal-net.safetensors";
    bench.train("light", "light", light);
    bench.falls("light", "validation/residual");

    // The round of the paper that follows begins with the warm-up's weights.
    let joint = "--turns shards --validation-turns held-out --light-net light/light-net.safetensors \
                 --weights normal/normal-net.safetensors";
    bench.train("joint", "joint", joint);
    let (light, joint) = (
        bench.series("light", "validation/residual"),
        bench.series("joint", "validation/residual"),
    );
    assert!(joint.last() < light.first(), "{light:?} {joint:?}");

    let specular = "--turns shards --spec-net spec/spec-net.safetensors \
                    --normal-net joint/normal-net.safetensors --light-net light/light-net.safetensors";
    bench.train("specular", "specular", specular);
    assert!(bench.path("specular/reflectance-net.safetensors").exists());
}
