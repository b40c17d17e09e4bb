//! `relight insert`: objects of photographs in a new picture.

mod arguments;
mod work;

use std::iter;
use std::path::{Path, PathBuf};

use relight_photo::insert::{InsertScene, SceneDescription, SceneObject, TrustFigures};
use relit_console::{Console, Outcome};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use self::work::{Background, Work, load, read_background};
use crate::commands::CommandResult;
use crate::photos::{OutputKind, not_an_input};

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (scene, folder) = arguments.description()?;
    let file = |path: &Path| folder.join(path);
    let sources = scene
        .objects
        .iter()
        .map(|object| load(object, &folder))
        .collect::<Result<Vec<_>, _>>()?;
    let background = read_background(&file(&scene.background), &scene)?;
    let is_movie = matches!(
        OutputKind::of(&arguments.output),
        Some(OutputKind::Movie(_))
    );
    check_output(&background, is_movie, arguments)?;
    not_an_input(&arguments.output, &files_of(&scene, &folder))?;
    let mut work = Work::new(&scene, background, &folder, &arguments.network)?;
    let subjects = work.subjects(&scene, sources, console.is_json())?;
    let objects = scene.objects.iter().zip(&subjects);
    let objects = objects.map(|(object, read)| SceneObject {
        subject: &read.subject,
        placement: object.placement(),
        change: object.change(),
        exposure: object.exposure,
        shadow: object.shadow,
        relit: true,
    });
    let set = InsertScene::new(
        work.extent,
        &work.light,
        work.tilt,
        work.matching,
        objects.collect(),
    )?;
    let frames = work.write(&set, arguments, console)?;
    let output = &arguments.output;
    let trust: Vec<Option<TrustFigures>> = subjects.iter().map(|read| read.trust).collect();
    console.say(
        &format!("{}: {} object(s), {frames} frame(s)", output.display(), scene.objects.len()),
        &json!({
            "event": "inserted", "output": output, "objects": scene.objects.len(), "frames": frames,
            "trust": trust, "tilt": work.tilt, "level": work.matching.level, "balance": work.matching.balance, "grain": work.matching.grain,
        }),
    );
    Ok(Outcome::Whole)
}

/// What is read.
fn files_of(scene: &SceneDescription, folder: &Path) -> Vec<PathBuf> {
    let light = &scene.light;
    let lights = [&light.panorama, &light.coefficients, &light.object];
    let objects = scene
        .objects
        .iter()
        .flat_map(|object| iter::once(&object.photo).chain(&object.mask));
    iter::once(&scene.background)
        .chain(lights.into_iter().flatten())
        .chain(objects)
        .map(|path| folder.join(path))
        .collect()
}

/// Whether this background can become that output.
fn check_output(
    background: &Background,
    is_movie: bool,
    arguments: &Arguments,
) -> Result<(), String> {
    let output = arguments.output.display();
    match background {
        Background::Photo(_) if is_movie => Err(format!(
            "{output}: a photograph does not move; give .png or .exr"
        )),
        Background::Panorama(_) if is_movie && arguments.turn.is_none() => Err(format!(
            "{output}: a panorama moves with --turn DEGREES; give it, or .png or .exr"
        )),
        Background::Movie(_) if !is_movie => {
            Err(format!("{output}: give .mp4 or .webm for a video"))
        }
        Background::Photo(_) | Background::Movie(_) if arguments.turn.is_some() => {
            Err("--turn: only a panorama can be turned".to_owned())
        }
        _ => Ok(()),
    }
}
