use std::fs;

use super::*;

fn read(text: &str) -> Result<DecomposeSettings, TrainError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("settings.toml");
    fs::write(&path, text).unwrap();
    read_settings(&path)
}

/// The settings of a phase by this text.
fn phase_settings(phase: PaperPhase, text: &str) -> Result<PaperSettings, TrainError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("settings.toml");
    fs::write(&path, text).unwrap();
    PaperSettings::from_phase(phase, Some(&path))
}

#[test]
fn what_a_file_does_not_name_has_its_default() {
    let settings = read("[run]\nsteps = 7\n").unwrap();
    assert_eq!(settings.run.steps, 7);
    assert_eq!(settings.run.batch, RunSettings::default().batch);
    assert_eq!(settings.data, DataSettings::default());
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
    let rate = |phase, text| phase_settings(phase, text).unwrap().run.learning_rate;
    let longer = "[run]\nsteps = 7\n";
    assert_eq!(rate(PaperPhase::Joint, longer), 1e-6);
    assert_eq!(rate(PaperPhase::Normal, longer), 1e-4);
    assert_eq!(
        rate(PaperPhase::Joint, "[run]\nlearning_rate = 1e-3\n"),
        1e-3
    );
    let without = PaperSettings::from_phase(PaperPhase::Light, None).unwrap();
    assert_eq!(without.run.learning_rate, 1e-6);
}

#[test]
fn the_setting_that_differs_is_named() {
    let own = toml::Table::try_from(DecomposeSettings::default()).unwrap();
    let whole = own.to_string();
    assert_eq!(first_difference(&own, &whole), None);
    let other = whole.replace("seed = 1\n", "seed = 2\n");
    assert_eq!(first_difference(&own, &other).unwrap(), "run.seed");
    let meshes = whole.replace("[data]", "[data]\nmeshes = \"m\"");
    assert_eq!(first_difference(&own, &meshes).unwrap(), "data.meshes");
    let often = whole.replace("log_every = 20\n", "log_every = 5\n");
    assert_ne!(often, whole);
    assert_eq!(first_difference(&own, &often), None);
    let slower = whole.replace("learning_rate = 0.001\n", "learning_rate = 0.0001\n");
    assert_ne!(slower, whole);
    assert_eq!(first_difference(&own, &slower), None);
    let unknown = whole.replace("[run]", "[run]\nspeed = 3");
    assert_eq!(first_difference(&own, &unknown).unwrap(), "run.speed");
}

#[test]
fn a_number_out_of_range_is_named() {
    for (text, name) in [
        ("[run]\nlearning_rate = -1.0", "run.learning_rate"),
        ("[run]\nbeta2 = 1.0", "run.beta2"),
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
    let error = data.check().unwrap_err().to_string();
    assert!(error.contains("size") && error.contains("32"), "{error}");
}

#[test]
fn loss_coefficients_that_teach_nothing_are_named() {
    let coefficients = PaperLossCoefficients::default();
    let error = |loss: PaperLossCoefficients| {
        let settings = PaperSettings {
            loss,
            ..PaperSettings::default()
        };
        settings.check().map_err(|error| error.to_string())
    };
    assert_eq!(error(coefficients), Ok(()));
    for low_rank in [-1.0, f64::NAN, f64::INFINITY] {
        let told = error(PaperLossCoefficients {
            low_rank,
            ..coefficients
        });
        assert!(
            told.as_ref().unwrap_err().contains("loss.low_rank"),
            "{told:?}"
        );
    }
    let (low_rank, supervised) = (0.0, 0.0);
    let nothing = PaperLossCoefficients {
        low_rank,
        supervised,
    };
    assert!(error(nothing).unwrap_err().contains("loss"));
}
