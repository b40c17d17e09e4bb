//! `relight insert`: objects of photographs in a new picture.

mod arguments;

use std::path::{Path, PathBuf};

use relight_core::files::OutputKind;
use relight_photo::files::{BackgroundFile, InsertSource, Insertion};
use relight_photo::insert::{SceneObject, TrustFigures};
use relit_console::{Console, Outcome, ProgressBar};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use crate::commands::CommandResult;
use crate::photos::not_an_input;

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (scene, folder) = arguments.description()?;
    let file = |path: &Path| folder.join(path);
    let sources = scene
        .objects
        .iter()
        .map(|object| InsertSource::read(object, &folder))
        .collect::<Result<Vec<_>, _>>()?;
    let background = BackgroundFile::read(&file(&scene.background), &scene)?;
    check_output(&background, arguments)?;
    let inputs: Vec<PathBuf> = scene.files().map(file).collect();
    not_an_input(&arguments.output, &inputs)?;
    let network = arguments.network.read()?;
    let (decomposer, options) = (&network.decomposer, network.options);
    let mut insertion = Insertion::new(&scene, background, &folder, decomposer, options)?;
    let pairs = scene.objects.iter().zip(sources);
    let subjects = pairs
        .map(|(object, source)| insertion.subject(object, source, console.is_json()))
        .collect::<Result<Vec<_>, _>>()?;
    let pairs = scene.objects.iter().zip(&subjects);
    let objects = pairs.map(|(object, read)| SceneObject::described(object, &read.subject));
    let set = insertion.setting().scene(objects.collect())?;
    let output = arguments.written();
    let bar = match OutputKind::of(output.path) {
        Some(OutputKind::Movie(_)) => {
            console.progress(insertion.frames(&output).unwrap_or(0).into(), "frames")
        }
        _ => ProgressBar::hidden(),
    };
    let frames = insertion.write(&set, &output, || bar.inc(1))?;
    bar.finish_and_clear();
    let trust: Vec<Option<TrustFigures>> = subjects.iter().map(|read| read.trust).collect();
    let (setting, output) = (insertion.setting(), output.path);
    let matching = setting.matching;
    console.say(
        &format!("{}: {} object(s), {frames} frame(s)", output.display(), scene.objects.len()),
        &json!({
            "event": "inserted", "output": output, "objects": scene.objects.len(), "frames": frames,
            "trust": trust, "tilt": setting.tilt, "level": matching.level, "balance": matching.balance, "grain": matching.grain,
        }),
    );
    Ok(Outcome::Whole)
}

/// Whether this background can become that output.
fn check_output(background: &BackgroundFile, arguments: &Arguments) -> Result<(), String> {
    let is_movie = matches!(
        OutputKind::of(&arguments.output),
        Some(OutputKind::Movie(_))
    );
    let output = arguments.output.display();
    match background {
        BackgroundFile::Photo(_) if is_movie => Err(format!(
            "{output}: a photograph does not move; give .png or .exr"
        )),
        BackgroundFile::Panorama(_) if is_movie && arguments.turn.is_none() => Err(format!(
            "{output}: a panorama moves with --turn DEGREES; give it, or .png or .exr"
        )),
        BackgroundFile::Movie(_) if !is_movie => {
            Err(format!("{output}: give .mp4 or .webm for a video"))
        }
        BackgroundFile::Photo(_) | BackgroundFile::Movie(_) if arguments.turn.is_some() => {
            Err("--turn: only a panorama can be turned".to_owned())
        }
        _ => Ok(()),
    }
}
