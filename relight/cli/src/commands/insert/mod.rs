//! `relight insert`: objects of photographs in a new picture.

mod arguments;

use std::path::{Path, PathBuf};

use relight_photo::compositing::SceneObject;
use relight_photo::export::object_files;
use relight_photo::files::{BackgroundFile, InsertSource, Insertion, OutputKind};
use relight_photo::relighting::{PanoramaExposure, SeenSun};
use relit_console::{Console, Outcome, ProgressBar};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use crate::commands::CommandResult;
use crate::lighting::too_coarse;
use crate::photos::{name_notes, not_an_input};

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let (scene, folder) = arguments.description()?;
    let file = |path: &Path| folder.join(path);
    let objects = scene.objects.iter().enumerate();
    let sources = objects
        .map(|(number, object)| InsertSource::read(object, arguments.rectangle(number), &folder))
        .collect::<Result<Vec<_>, _>>()?;
    for (object, source) in scene.objects.iter().zip(&sources) {
        if let InsertSource::Photo(photo) = source {
            let path = file(&object.photo).display().to_string();
            name_notes(&path, &photo.notes, console);
        }
    }
    let path = file(&scene.background);
    let background = BackgroundFile::read(&path, &scene)?;
    name_notes(&path.display().to_string(), background.notes(), console);
    check_output(&background, arguments)?;
    if let BackgroundFile::Panorama(parts) = &background
        && let Some(warning) = too_coarse(&parts.0, &parts.1)
    {
        console.warn(&format!("{}: {warning}", path.display()));
    }
    if let Some(conversion) = background.colour_conversion() {
        console.warn(&format!(
            "{}: colours converted: {conversion}",
            path.display()
        ));
    }
    let inputs: Vec<PathBuf> = (scene.files().map(file))
        .flat_map(|path| object_files(&path))
        .collect();
    not_an_input(&arguments.output, &inputs)?;
    let network = arguments.network.read()?;
    let (decomposer, options) = (&network.decomposer, network.options);
    let mut insertion = Insertion::new(&scene, background, &folder, decomposer, options)?;
    let pairs = scene.objects.iter().zip(sources);
    let relightables = pairs
        .map(|(object, source)| insertion.relightable(object, source))
        .collect::<Result<Vec<_>, _>>()?;
    let pairs = scene.objects.iter().zip(&relightables);
    let objects = pairs.map(|(object, relightable)| SceneObject::described(object, relightable));
    let set = insertion.environment().scene(objects.collect())?;
    let output = arguments.written();
    let bar = match OutputKind::from_path(output.path) {
        Some(OutputKind::Movie(_)) => {
            console.progress(insertion.frames(&output).unwrap_or(0).into(), "frames")
        }
        _ => ProgressBar::hidden(),
    };
    let frames = insertion.write(&set, &output, || bar.inc(1))?;
    bar.finish_and_clear();
    let (environment, output) = (insertion.environment(), output.path);
    let harmonisation = environment.harmonisation;
    console.print(
        &format!(
            "{}: {} object(s), {frames} frame(s){}{}",
            output.display(),
            scene.objects.len(),
            environment.exposure.map(described).unwrap_or_default(),
            if environment.is_estimated {
                sun_described(environment.sun)
            } else {
                String::new()
            }
        ),
        &json!({
            "event": "inserted", "output": output, "objects": scene.objects.len(), "frames": frames,
            "tilt": environment.tilt, "level": harmonisation.level, "balance": harmonisation.balance, "grain": harmonisation.grain,
            "exposure": environment.exposure, "sun": environment.sun,
        }),
    );
    Ok(Outcome::Success)
}

/// The sun that is seen in a photograph, in words.
fn sun_described(sun: Option<SeenSun>) -> String {
    match sun {
        Some(sun) => format!(
            "; light estimated from the picture, sun found in it (confidence {:.1})",
            sun.confidence
        ),
        None => "; light estimated from the picture, no sun found in it, so shadows are soft: --lamp AZIMUTH,ELEVATION,2 makes them hard"
            .to_owned(),
    }
}

/// How a panorama was exposed, in words.
fn described(exposure: PanoramaExposure) -> String {
    let reason = if exposure.for_objects {
        ", so that the objects are not too dark"
    } else {
        ""
    };
    format!(
        "; exposure {:+.1} stops{reason}; {:.0} % of the picture clips",
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
        BackgroundFile::Photo(..) if is_movie => Err(format!(
            "{output}: a photograph gives a picture; give .png, .jpg or .exr"
        )),
        BackgroundFile::Panorama(_) if is_movie && arguments.rotation.rotate.is_none() => {
            Err(format!(
                "{output}: give --rotate DEGREES for a video before a panorama, or .png, .jpg or .exr"
            ))
        }
        BackgroundFile::Movie(_) if !is_movie => {
            Err(format!("{output}: give .mp4 or .webm for a video"))
        }
        BackgroundFile::Photo(..) | BackgroundFile::Movie(_)
            if arguments.rotation.rotate.is_some() =>
        {
            Err("--rotate: only a panorama can be rotated".to_owned())
        }
        _ => Ok(()),
    }
}
