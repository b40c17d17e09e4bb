//! `relight relight`: objects of photographs in another light.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

use clap::{Arg, Args, ValueEnum};
use relight_core::image::Extent;
use relight_photo::files::{
    MovieFormat, MovieWriter, OutputKind, PhotoInput, PhotoReading, write_picture,
};
use relight_photo::relighting::{
    Backdrop, DiscLamp, InsertError, LightSource, PanoramaView, RelightableObject,
    RelightingSequence, WhiteBalance,
};
use relit_console::{Console, Outcome};
use relit_data::causes::with_causes;
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_folder;
use crate::lighting::{LightArguments, RotationArguments, is_own, too_coarse};
use crate::photos::{
    Network, NetworkArguments, PhotoArguments, name_lost, name_notes, not_an_input, outcome,
};
use crate::values::{WHITE_BALANCES, one_of, within};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight relight mug.jpg --mask mug-mask.png --light studio.hdr -o relit.png
      the mug in the light of a panorama, which is also the background
  relight relight mug.jpg --mask mug-mask.png --lamp 60,30,3200K --background photo -o relit.png
      in the light of a warm lamp from the right, in its own photograph
  relight relight mug.jpg --mask mug-mask.png --light studio.hdr --rotate 360 -o rotation.mp4
      a video in which the light rotates once
  relight relight photos --mask masks --lamp -45,40 -o relit
      many photographs: relit/<name>.png";

/// The default for the longest side of a video's frames.
const MOVIE_SIDE: usize = 1080;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    photos: PhotoArguments,
    /// The picture (.png, .jpg, .exr), with --rotate the video (.mp4, .webm); for several photographs a folder, created if
    /// missing.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The background [default: the light's panorama; with --light own the photograph; else grey].
    #[arg(long, value_enum)]
    background: Option<BackgroundName>,
    /// Angle of view into a panorama along the picture's longer side.
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0, value_parser = within(1.0..=150.0, "degrees"))]
    fov: f64,
    /// White balance of the result.
    #[arg(long, value_parser = one_of(WHITE_BALANCES), default_value = "adapted")]
    white_balance: WhiteBalance,
    /// Brightness in stops; at 0 the strongest light is as strong as in the photograph.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = within(-20.0_f32..=20.0, "stops"), allow_hyphen_values = true)]
    exposure: f32,
    /// The longest side of the result, pixels [default: the photograph's; a video's at most 1080].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=16_384))]
    size: Option<u32>,
    #[command(flatten, next_help_heading = "Light")]
    light: LightArguments,
    /// Ambient light, as a part of the lamp's.
    #[arg(long, value_name = "PART", default_value_t = 0.15, value_parser = within(0.0..=10.0, "a part"), requires = "lamp")]
    ambient: f64,
    #[command(flatten, next_help_heading = "Video")]
    rotation: RotationArguments,
    #[command(flatten, next_help_heading = "Network")]
    network: NetworkArguments,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BackgroundName {
    /// The photograph; the object stays in place.
    Photo,
    /// The panorama that lights the object.
    Light,
    /// 18 % grey.
    Grey,
    /// Black.
    Black,
    /// White.
    White,
}

/// `--light` as this verb takes it.
pub(crate) fn or_own(light: Arg) -> Arg {
    light.value_name("FILE|own").help(
        "The light: a panorama (.hdr, .exr; its centre is behind the object), coefficients (.txt), or own: the \
         photograph's estimated light",
    )
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.light.is_empty() {
            return Some(
                "give the new light with --light FILE or --lamp AZIMUTH,ELEVATION".to_owned(),
            );
        }
        let has_panorama = self.light.files().1.is_some() && !self.is_own_light();
        if self.background == Some(BackgroundName::Light) && !has_panorama {
            return Some("--background light needs a panorama: give one with --light".to_owned());
        }
        if let Some(fault) = self.photos.fault() {
            return Some(fault);
        }
        if self.photos.is_set() {
            let is_picture = OutputKind::from_path(&self.output).is_some();
            return (is_picture && !self.output.is_dir()).then(|| {
                format!(
                    "--output {}: give a folder for several photographs",
                    self.output.display()
                )
            });
        }
        let rotates = self.rotation.rotate.is_some();
        let wanted = match OutputKind::from_path(&self.output) {
            Some(OutputKind::Movie(_)) if !rotates => ".png, .jpg or .exr, or --rotate DEGREES",
            Some(OutputKind::Png | OutputKind::Jpeg | OutputKind::Exr) if rotates => {
                ".mp4 or .webm for --rotate"
            }
            None if rotates => ".mp4 or .webm",
            None => ".png, .jpg or .exr",
            Some(_) => return None,
        };
        Some(format!("--output {}: give {wanted}", self.output.display()))
    }

    fn is_own_light(&self) -> bool {
        self.light.light.as_deref().is_some_and(is_own)
    }

    /// The new light, unless the photograph's own is asked for.
    fn new_light(&self) -> Result<Option<LightSource>, InsertError> {
        if self.is_own_light() {
            return Ok(None);
        }
        Ok(self.light.read()?.map(|light| match light {
            LightSource::Lamp(lamp) => LightSource::Lamp(DiscLamp {
                ambient: self.ambient,
                ..lamp
            }),
            other => other,
        }))
    }

    fn longest(&self) -> Option<usize> {
        match (self.size, self.rotation.rotate) {
            (Some(size), _) => Some(size as usize),
            (None, Some(_)) => Some(MOVIE_SIDE),
            (None, None) => None,
        }
    }

    fn output_of(&self, name: &str) -> PathBuf {
        if !self.photos.is_set() {
            return self.output.clone();
        }
        let ending = match self.rotation.rotate {
            Some(_) => "mp4",
            None => "png",
        };
        self.output.join(format!("{name}.{ending}"))
    }
}

/// All that is the same for every photograph.
struct Run<'a> {
    arguments: &'a Arguments,
    /// Read with the first photograph, since reading is slow.
    network: OnceLock<Network>,
    light: Option<LightSource>,
    reading: PhotoReading,
    /// The files of all photographs.
    photos: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let found = arguments.photos.find(&arguments.output, console)?;
    let inputs = &found.inputs;
    let run = Run {
        arguments,
        light: match arguments.new_light()? {
            Some(light) => Some(arguments.white_balance.shown(light)?),
            None => None,
        },
        network: OnceLock::new(),
        reading: arguments.photos.reading(),
        photos: inputs.iter().map(|input| input.path.clone()).collect(),
    };
    if !arguments.photos.is_set()
        && let [input] = inputs.as_slice()
    {
        run.relight(input, console)?;
        return Ok(Outcome::Success);
    }
    let mut lost = 0;
    for input in inputs {
        if let Err(error) = run.relight(input, console) {
            lost += 1;
            name_lost(input, &with_causes(error.as_ref()), console);
        }
    }
    outcome(&found, lost, "relit")
}

impl Run<'_> {
    fn relight(&self, input: &PhotoInput, console: Console) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        let photo = input.load(&self.reading)?;
        let photo = match arguments.longest() {
            Some(longest) => photo.at_most(longest),
            None => photo,
        };
        let output = arguments.output_of(&photo.name);
        self.check_outputs(&output, &photo.name)?;
        name_notes(&input.place(), &photo.notes, console);
        let network = match self.network.get() {
            Some(network) => network,
            None => {
                let network = arguments.network.read()?;
                self.network.get_or_init(|| network)
            }
        };
        let start = Instant::now();
        let relightable =
            RelightableObject::from_photo(&photo, &network.decomposer, &network.options)?;
        let decomposed = start.elapsed().as_secs_f64();
        let own = LightSource::Coefficients(relightable.light.clone());
        let source = self.light.as_ref().unwrap_or(&own);
        let light = source.light()?;
        let backdrop = self.backdrop(photo.picture.planes().extent());
        if let Backdrop::Panorama(view, panorama) = &backdrop
            && let Some(warning) = too_coarse(view, panorama)
        {
            console.warn(&format!("{}: {warning}", output.display()));
        }
        let exposure = arguments.exposure.exp2();
        let shot =
            RelightingSequence::new(&photo.picture, &relightable, &light, backdrop, exposure)?;
        let start = Instant::now();
        let frames = match OutputKind::from_path(&output) {
            Some(OutputKind::Movie(format)) => self.film(&shot, &output, format, console)?,
            _ => {
                let picture = shot.picture(arguments.light.angle())?;
                write_picture(&output, &picture)?;
                1
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let text = format!(
            "{}: {frames} frame(s) in {seconds:.2} s, after {decomposed:.2} s of decomposition",
            output.display(),
        );
        let event = json!({
            "event": "relit",
            "photo": input.place(),
            "output": output,
            "frames": frames,
            "seconds": seconds,
            "decompose_seconds": decomposed,
        });
        console.print(&text, &event);
        Ok(())
    }

    /// Refuses to overwrite inputs, and makes the folders of outputs.
    fn check_outputs(&self, output: &Path, name: &str) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        if arguments.photos.is_set() {
            PhotoInput::check_result(output)?;
        }
        let mask = arguments
            .photos
            .mask
            .as_deref()
            .map(|mask| PhotoReading::mask_path(mask, name));
        let mut inputs: Vec<PathBuf> = mask.into_iter().collect();
        inputs.extend(self.photos.iter().cloned());
        if !arguments.is_own_light() {
            inputs.extend(arguments.light.light.clone());
        }
        not_an_input(output, &inputs)?;
        // What lies in the way of a folder is told before the work.
        if let Some(folder) = output.parent()
            && !folder.as_os_str().is_empty()
        {
            make_folder(folder)?;
        }
        Ok(())
    }

    fn backdrop(&self, extent: Extent) -> Backdrop {
        let arguments = self.arguments;
        let grey = Backdrop::Even([0.18; 3]);
        let panorama = || match &self.light {
            Some(LightSource::Panorama(panorama)) => {
                let view = PanoramaView::new(extent, arguments.fov, 0.0);
                Some(Backdrop::Panorama(view, panorama.clone()))
            }
            _ => None,
        };
        match arguments.background {
            Some(BackgroundName::Photo) => Backdrop::Photo,
            None if arguments.is_own_light() => Backdrop::Photo,
            None | Some(BackgroundName::Light) => panorama().unwrap_or(grey),
            Some(BackgroundName::Grey) => grey,
            Some(BackgroundName::Black) => Backdrop::Even([0.0; 3]),
            Some(BackgroundName::White) => Backdrop::Even([1.0; 3]),
        }
    }

    /// Writes the video; how many frames it has.
    fn film(
        &self,
        shot: &RelightingSequence<'_>,
        output: &Path,
        format: MovieFormat,
        console: Console,
    ) -> Result<u32, InsertError> {
        let rotation = &self.arguments.rotation;
        let start = self.arguments.light.light_angle;
        let frames = rotation.frames();
        let bar = console.progress(frames.into(), "frames");
        let frame = |frame: u32| {
            let angle = (start + rotation.degrees_at(frame)).to_radians();
            Ok::<_, InsertError>(shot.picture(angle)?.encode())
        };
        let encoding = (format, rotation.fps);
        MovieWriter::write_frames(output, encoding, frames, frame, || bar.inc(1))?;
        bar.finish_and_clear();
        Ok(frames)
    }
}
