use std::fs;

use super::renamed::RENAMED;
use super::*;

fn read(text: &str) -> Result<DecomposeSettings, TrainError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("settings.toml");
    fs::write(&path, text).unwrap();
    Ok(read_settings(&path)?.settings)
}

/// The settings of a phase by this text, and the old keys in it.
fn phase_settings(
    phase: PaperPhase,
    text: &str,
) -> Result<SettingsFile<PaperSettings>, TrainError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("settings.toml");
    fs::write(&path, text).unwrap();
    PaperSettings::of_phase(phase, Some(&path))
}

#[test]
fn each_old_key_is_read_as_the_new_one_and_named() {
    for (table, old, new) in RENAMED {
        let value = if old == "window" { "77" } else { "0.625" };
        let value = if old == "warm_up" { "78" } else { value };
        let file = |key| format!("[{table}]\n{key} = {value}\n");
        let before = phase_settings(PaperPhase::Joint, &file(old)).unwrap();
        let now = phase_settings(PaperPhase::Joint, &file(new)).unwrap();
        assert_eq!(before.settings, now.settings, "{old}");
        assert_ne!(
            now.settings,
            PaperSettings::of_phase(PaperPhase::Joint, None)
                .unwrap()
                .settings,
            "{new}"
        );
        assert_eq!(now.renamed, []);
        assert_eq!(before.renamed, [RenamedSetting { table, old, new }]);
        let told = before.renamed[0].to_string();
        let expected = format!("`{old}` is now `{new}`: this file is read, rename it before 0.4");
        assert!(told.contains(&expected), "{told}");
    }
}

#[test]
fn an_old_key_is_found_however_it_is_written() {
    for text in [
        "run.rate = 0.5\n",
        "run = { rate = 0.5 }\n",
        "[run]\nsteps = 9 # rate = 1\n\"rate\" = 0.5\n",
    ] {
        let file = phase_settings(PaperPhase::Light, text).unwrap();
        assert_eq!(file.settings.run.learning_rate, 0.5, "{text}");
        assert_eq!(file.renamed.len(), 1, "{text}");
    }
}

#[test]
fn a_setting_under_both_its_names_is_refused_at_its_line() {
    let error = read("[run]\nlearning_rate = 0.1\nrate = 0.2\n")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("duplicate key") && error.contains("line 3"),
        "{error}"
    );
    let unknown = read("[run]\nrate = 0.1\nwarm_up = 5\nstep = 7\n")
        .unwrap_err()
        .to_string();
    assert!(
        unknown.contains("step") && unknown.contains("line 4"),
        "{unknown}"
    );
}

#[test]
fn what_a_file_does_not_name_has_its_default() {
    let settings = read("[run]\nsteps = 7\n[loss]\nnormals = 2.0").unwrap();
    assert_eq!(settings.run.steps, 7);
    assert_eq!(settings.run.batch, RunSettings::default().batch);
    assert_eq!(settings.loss.normals, 2.0);
    assert_eq!(settings.data, DataSettings::default());
}

#[test]
fn one_head_can_be_named_and_is_written_before_the_tables() {
    let settings = read("only = \"light\"\n[run]\nsteps = 7\n").unwrap();
    assert_eq!(settings.only, Some(DecomposeHead::Light));
    let written = toml::to_string(&settings).unwrap();
    assert_eq!(read(&written).unwrap(), settings);
    let error = read("only = \"normals\"\n").unwrap_err().to_string();
    assert!(error.contains("`paint` or `light`"), "{error}");
}

#[test]
fn a_name_that_is_none_is_told_with_its_line() {
    let error = read("[run]\nstep = 7").unwrap_err().to_string();
    assert!(
        error.contains("step") && error.contains("line 2"),
        "{error}"
    );
}

#[test]
fn a_phase_has_its_own_learning_rate_where_none_is_named() {
    let rate = |phase, text| {
        phase_settings(phase, text)
            .unwrap()
            .settings
            .run
            .learning_rate
    };
    let longer = "[run]\nsteps = 7\n";
    assert_eq!(rate(PaperPhase::Joint, longer), 1e-6);
    assert_eq!(rate(PaperPhase::Normal, longer), 1e-4);
    assert_eq!(
        rate(PaperPhase::Joint, "[run]\nlearning_rate = 1e-3\n"),
        1e-3
    );
    let without = PaperSettings::of_phase(PaperPhase::Light, None).unwrap();
    assert_eq!(without.settings.run.learning_rate, 1e-6);
}

#[test]
fn the_setting_that_differs_is_named() {
    let own = DecomposeSettings::default();
    let whole = toml::to_string(&own).unwrap();
    assert_eq!(first_difference(&own, &whole), None);
    let older = whole.replace("validate_every = 250\n", "");
    assert_ne!(older, whole);
    assert_eq!(first_difference(&own, &older), None);
    let other = whole.replace("seed = 1\n", "seed = 2\n");
    assert_eq!(first_difference(&own, &other).unwrap(), "run.seed");
    let meshes = format!("{}\nmeshes = \"m\"", "[data]");
    assert_eq!(first_difference(&own, &meshes).unwrap(), "data.meshes");
    let often = whole.replace("log_every = 20\n", "log_every = 5\n");
    assert_ne!(often, whole);
    assert_eq!(first_difference(&own, &often), None);
    let unknown = "[run]\nspeed = 3";
    assert!(first_difference(&own, unknown).unwrap().contains("speed"));
}

#[test]
fn the_settings_of_a_checkpoint_may_have_old_keys() {
    let own = PaperSettings::default();
    let mut stored = toml::to_string(&own).unwrap();
    for (_, old, new) in RENAMED {
        let renamed = stored.replace(&format!("{new} = "), &format!("{old} = "));
        assert_ne!(renamed, stored, "{new}");
        stored = renamed;
    }
    assert_eq!(first_difference(&own, &stored), None);
    let other = stored.replace("\nrate = 0.001\n", "\nrate = 0.002\n");
    assert_ne!(other, stored);
    assert_eq!(first_difference(&own, &other).unwrap(), "run.learning_rate");
}

#[test]
fn a_number_out_of_range_is_named() {
    for (text, name) in [
        ("[run]\nlearning_rate = -1.0", "run.learning_rate"),
        ("[run]\nbeta1 = 1.0", "run.beta1"),
        (
            "[run]\ncheckpoint_minutes = 1e300",
            "run.checkpoint_minutes",
        ),
        ("[run]\nbatch = 1000000000000", "run.batch"),
    ] {
        let error = read(text).unwrap().run.check().unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    let data = DataSettings {
        size: 100,
        ..DataSettings::default()
    };
    assert!(
        data.check()
            .unwrap_err()
            .to_string()
            .contains("multiple of 32")
    );
}

#[test]
fn loss_coefficients_that_teach_nothing_are_named() {
    let losses = DecomposeLossCoefficients::default();
    let error = |loss: DecomposeLossCoefficients| {
        let settings = DecomposeSettings {
            loss,
            ..DecomposeSettings::default()
        };
        settings.check().map_err(|error| error.to_string())
    };
    assert_eq!(error(losses), Ok(()));
    for whole in [-1.0, f64::NAN, f64::INFINITY] {
        let told = error(DecomposeLossCoefficients { whole, ..losses }).unwrap_err();
        assert!(told.contains("loss.whole"), "{told}");
    }
    let quotient = -0.5;
    assert!(error(DecomposeLossCoefficients { quotient, ..losses }).is_err());
    let nothing = DecomposeLossCoefficients {
        whole: 0.0,
        quotient: 0.5,
        windows: 0.0,
        gradient: 0.0,
        normals: 0.0,
        highlight: 0.0,
        highlight_energy: 0.0,
        paint: 0.0,
        light: 0.0,
    };
    let told = error(nothing).unwrap_err();
    assert!(told.contains("all others"), "{told}");
}

#[test]
fn the_learning_rate_rises_and_falls() {
    let run = RunSettings {
        steps: 1000,
        ..RunSettings::default()
    };
    assert!(run.learning_rate_at(0) < 0.02 * run.learning_rate);
    assert!(run.learning_rate_at(120) > 0.9 * run.learning_rate);
    assert!((run.learning_rate_at(999) / run.learning_rate - run.min_lr_ratio).abs() < 1e-3);
}
