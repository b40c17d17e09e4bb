//! `relight insert`: objects of photographs in a new picture.

mod arguments;

use std::path::{Path, PathBuf};

use relight_photo::compositing::{
    LightDescription, SceneDescription, SceneEnvironment, SceneObject,
};
use relight_photo::files::{BackgroundFile, InsertSource, Insertion, OutputKind};
use relight_photo::relighting::{PanoramaExposure, SeenSun};
use relit_console::{Console, Outcome, ProgressBar};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use crate::commands::CommandResult;
use crate::lighting::too_coarse;
use crate::photos::not_an_input;

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (scene, folder) = arguments.description()?;
    let file = |path: &Path| folder.join(path);
    let sources = scene
        .objects
        .iter()
        .map(|object| InsertSource::read(object, &folder))
        .collect::<Result<Vec<_>, _>>()?;
    for source in &sources {
        if let InsertSource::Photo(photo) = source
            && let Some(note) = &photo.mask_note
        {
            console.warn(&format!("{}: the mask {note}", photo.name));
        }
    }
    let background = BackgroundFile::read(&file(&scene.background), &scene)?;
    check_output(&background, arguments)?;
    if let BackgroundFile::Panorama(parts) = &background
        && let Some(warning) = too_coarse(&parts.0, &parts.1)
    {
        let path = file(&scene.background);
        console.warn(&format!("{}: {warning}", path.display()));
    }
    if let Some(conversion) = background.colour_conversion() {
        let path = file(&scene.background);
        console.warn(&format!(
            "{}: the colours are converted: {conversion}",
            path.display()
        ));
    }
    let inputs: Vec<PathBuf> = scene.files().map(file).collect();
    not_an_input(&arguments.output, &inputs)?;
    let network = arguments.network.read()?;
    let (decomposer, options) = (&network.decomposer, network.options);
    let mut insertion = Insertion::new(&scene, background, &folder, decomposer, options)?;
    let pairs = scene.objects.iter().zip(sources);
    let subjects = pairs
        .map(|(object, source)| insertion.subject(object, source))
        .collect::<Result<Vec<_>, _>>()?;
    let pairs = scene.objects.iter().zip(&subjects);
    let objects = pairs.map(|(object, subject)| SceneObject::described(object, subject));
    let set = insertion.setting().scene(objects.collect())?;
    let output = arguments.written();
    let bar = match OutputKind::from_path(output.path) {
        Some(OutputKind::Movie(_)) => {
            console.progress(insertion.frames(&output).unwrap_or(0).into(), "frames")
        }
        _ => ProgressBar::hidden(),
    };
    let frames = insertion.write(&set, &output, || bar.inc(1))?;
    bar.finish_and_clear();
    let (setting, output) = (insertion.setting(), output.path);
    let matching = setting.matching;
    console.say(
        &format!(
            "{}: {} object(s), {frames} frame(s){}{}",
            output.display(),
            scene.objects.len(),
            setting.exposure.map(described).unwrap_or_default(),
            if takes_light(&scene, setting) {
                sun_described(setting.sun)
            } else {
                String::new()
            }
        ),
        &json!({
            "event": "inserted", "output": output, "objects": scene.objects.len(), "frames": frames,
            "tilt": setting.tilt, "level": matching.level, "balance": matching.balance, "grain": matching.grain,
            "exposure": setting.exposure, "sun": setting.sun,
        }),
    );
    Ok(Outcome::Success)
}

/// Whether the light was taken from a photograph.
fn takes_light(scene: &SceneDescription, setting: &SceneEnvironment) -> bool {
    setting.exposure.is_none() && scene.light == LightDescription::default()
}

/// The sun that is seen in a photograph, in words.
fn sun_described(sun: Option<SeenSun>) -> String {
    match sun {
        Some(sun) => format!(
            "; the sun is seen in the picture, with a confidence of {:.1}",
            sun.confidence
        ),
        None => "; no sun is seen in the picture, so that shadows are soft: --lamp \
                 AZIMUTH,ELEVATION,2 makes them hard"
            .to_owned(),
    }
}

/// How a panorama was exposed, in words.
fn described(exposure: PanoramaExposure) -> String {
    let reason = if exposure.for_objects {
        ", as its objects ask for"
    } else {
        ""
    };
    format!(
        "; exposed by {:+.1} stops{reason}, {:.0} % of the picture clip",
        exposure.stops,
        100.0 * exposure.clipped
    )
}

/// Whether this background can become that output.
fn check_output(background: &BackgroundFile, arguments: &Arguments) -> Result<(), String> {
    let is_movie = matches!(
        OutputKind::from_path(&arguments.output),
        Some(OutputKind::Movie(_))
    );
    let output = arguments.output.display();
    match background {
        BackgroundFile::Photo(_) if is_movie => Err(format!(
            "{output}: a photograph does not move; give .png, .jpg or .exr"
        )),
        BackgroundFile::Panorama(_) if is_movie && arguments.rotation.rotate.is_none() => {
            Err(format!(
                "{output}: a panorama moves with --rotate DEGREES; give it, or .png, .jpg or .exr"
            ))
        }
        BackgroundFile::Movie(_) if !is_movie => {
            Err(format!("{output}: give .mp4 or .webm for a video"))
        }
        BackgroundFile::Photo(_) | BackgroundFile::Movie(_)
            if arguments.rotation.rotate.is_some() =>
        {
            Err("--rotate: only a panorama can be rotated".to_owned())
        }
        _ => Ok(()),
    }
}
