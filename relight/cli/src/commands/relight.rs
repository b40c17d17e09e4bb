//! `relight relight`: objects of photographs in another light.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

use clap::{Args, ValueEnum};
use relight_core::image::Extent;
use relight_photo::files::{
    MovieFormat, MovieWriter, OutputKind, PhotoInput, PhotoReading, write_picture,
};
use relight_photo::relighting::{
    Backdrop, DiscLamp, InsertError, LightSource, PanoramaView, RelightableObject, Shot,
    WhiteBalance, likeness,
};
use relit_console::{Console, Outcome};
use relit_data::causes::with_causes;
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_folder;
use crate::photos::{Network, NetworkArguments, PhotoArguments, name_lost, not_an_input, outcome};
use crate::values::{WHITE_BALANCES, degrees, one_of, within};

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight relight mug.jpg --mask mug-mask.png --light studio.hdr -o relit.png
      the mug in the light of a panorama, and before it
  relight relight mug.jpg --mask mug-mask.png --lamp 60,30,3200K --keep-background -o relit.png
      in the light of a warm lamp from the right, at its own place
  relight relight mug.jpg --mask mug-mask.png --light studio.hdr --turn 360 --seconds 10 -o turn.mp4
      a video in which the light turns once
  relight relight photos --mask masks --lamp -45,40 -o relit
      many photographs: relit/<name>.png";

/// The longest side of a video's frames where nothing is said.
const MOVIE_SIDE: usize = 1080;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    photos: PhotoArguments,
    /// The picture (.png, .jpg, .exr), or for --turn a video (.mp4, .webm); of several photographs a folder. It is made where
    /// there is none.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The light: an HDR or EXR panorama, whose middle is what the viewer sees behind the object, or a text file of
    /// coefficients as relight writes them.
    #[arg(long, value_name = "FILE", conflicts_with = "lamp")]
    light: Option<PathBuf>,
    /// The light: a lamp at so many degrees about the vertical (0 at the viewer's side, 90 on the right, 180 behind) and above
    /// the horizon, in a colour (#ffd9b0 or 3200K), so many degrees large [default: white, 30].
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION[,COLOUR][,SIZE]",
        allow_hyphen_values = true
    )]
    lamp: Option<DiscLamp>,
    /// Even light beside a lamp, as a part of it.
    #[arg(long, value_name = "PART", default_value_t = 0.15, value_parser = within(0.0..=10.0, "a part"), requires = "lamp")]
    ambient: f64,
    /// Keep the photograph's own light, as it was estimated, to change its exposure or to turn it.
    #[arg(long, conflicts_with_all = ["light", "lamp"])]
    own_light: bool,
    /// Turn the light about the vertical first, from the viewer to the right.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = degrees(), allow_hyphen_values = true)]
    turned: f64,
    /// Turn the light by so many degrees, in a video.
    #[arg(long, value_name = "DEGREES", value_parser = degrees(), allow_hyphen_values = true)]
    turn: Option<f64>,
    /// How long the turn takes.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = within(0.01..=3600.0, "seconds"), requires = "turn")]
    seconds: f64,
    /// Frames a second of a video.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: u32,
    /// What is behind the object [default: the panorama that lights it; grey where there is none].
    #[arg(long, value_enum, conflicts_with = "keep_background")]
    background: Option<BackgroundName>,
    /// Leave the object where it is, before what its photograph shows.
    #[arg(long)]
    keep_background: bool,
    /// How many degrees of a panorama the picture's longer side shows.
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0, value_parser = within(1.0..=150.0, "degrees"))]
    field: f64,
    /// How the colour of the light is shown.
    #[arg(long, value_parser = one_of(WHITE_BALANCES), default_value = "light")]
    white_balance: WhiteBalance,
    /// Brightness in stops. With 0 the strongest light is as strong as in the photograph.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = within(-20.0_f32..=20.0, "stops"), allow_hyphen_values = true)]
    exposure: f32,
    /// The longest side of the result, pixels [default: the photograph's; of a video at most 1080].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=16_384))]
    size: Option<u32>,
    #[command(flatten)]
    network: NetworkArguments,
}

#[derive(Clone, Copy, ValueEnum)]
enum BackgroundName {
    /// The panorama that lights it.
    Light,
    /// Grey of 18 %.
    Grey,
    /// Black.
    Black,
    /// White.
    White,
}

impl Arguments {
    /// What is wrong with the combination of arguments, if anything is.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.light.is_none() && self.lamp.is_none() && !self.own_light {
            return Some(
                "give the new light by --light FILE or --lamp AZIMUTH,ELEVATION".to_owned(),
            );
        }
        let has_panorama = self.light.is_some();
        if matches!(self.background, Some(BackgroundName::Light)) && !has_panorama {
            return Some(
                "--background light: there is no panorama; give one by --light".to_owned(),
            );
        }
        if self.is_set() {
            return None;
        }
        let wanted = match OutputKind::from_path(&self.output) {
            Some(OutputKind::Movie(_)) if self.turn.is_none() => {
                ".png, .jpg or .exr, or --turn DEGREES"
            }
            Some(OutputKind::Png | OutputKind::Jpeg | OutputKind::Exr) if self.turn.is_some() => {
                ".mp4 or .webm for --turn"
            }
            None if self.turn.is_some() => ".mp4 or .webm",
            None => ".png, .jpg or .exr",
            Some(_) => return None,
        };
        Some(format!("--output {}: give {wanted}", self.output.display()))
    }

    /// Whether results go into a folder.
    fn is_set(&self) -> bool {
        self.photos.photos.len() > 1 || self.photos.has_set()
    }

    /// The light that is asked for, if any is.
    fn new_light(&self) -> Result<Option<LightSource>, InsertError> {
        if let Some(lamp) = self.lamp {
            let ambient = self.ambient;
            return Ok(Some(LightSource::Lamp(DiscLamp { ambient, ..lamp })));
        }
        self.light.as_deref().map(LightSource::read).transpose()
    }

    fn longest(&self) -> Option<usize> {
        match (self.size, self.turn) {
            (Some(size), _) => Some(size as usize),
            (None, Some(_)) => Some(MOVIE_SIDE),
            (None, None) => None,
        }
    }

    fn output_of(&self, name: &str) -> PathBuf {
        if !self.is_set() {
            return self.output.clone();
        }
        let ending = if self.turn.is_some() { "mp4" } else { "png" };
        self.output.join(format!("{name}.{ending}"))
    }
}

/// All that is the same for every photograph.
struct Run<'a> {
    arguments: &'a Arguments,
    /// Read when the first photograph is there: it takes its time.
    network: OnceLock<Network>,
    light: Option<LightSource>,
    reading: PhotoReading,
    /// The files of all photographs.
    photos: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let found = arguments.photos.find(None, &arguments.output, console)?;
    let inputs = &found.inputs;
    let run = Run {
        arguments,
        light: match arguments.new_light()? {
            Some(light) => Some(arguments.white_balance.shown(light)?),
            None => None,
        },
        network: OnceLock::new(),
        reading: arguments.photos.reading(),
        photos: inputs.iter().filter_map(file_of).collect(),
    };
    if !arguments.is_set()
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
        let network = match self.network.get() {
            Some(network) => network,
            None => {
                let network = arguments.network.read()?;
                self.network.get_or_init(|| network)
            }
        };
        let start = Instant::now();
        let subject = RelightableObject::from_photo(&photo, &network.decomposer, &network.options)?;
        let decomposed = start.elapsed().as_secs_f64();
        let own = LightSource::Coefficients(subject.light.clone());
        let source = self.light.as_ref().unwrap_or(&own);
        let light = source.light()?;
        let backdrop = self.backdrop(photo.picture.planes().extent());
        let exposure = arguments.exposure.exp2();
        let shot = Shot::new(&photo.picture, &subject, &light, backdrop, exposure)?;
        let start = Instant::now();
        let frames = match OutputKind::from_path(&output) {
            Some(OutputKind::Movie(format)) => self.film(&shot, &output, format, console)?,
            _ => {
                let picture = shot.picture(arguments.turned.to_radians())?;
                write_picture(&output, &picture)?;
                1
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let note = photo.mask_note.as_ref();
        let note = note.map_or_else(String::new, |note| format!("; the mask {note}"));
        let text = format!(
            "{}: {frames} frame(s) in {seconds:.2} s, after {decomposed:.2} s of decomposing{note}",
            output.display(),
        );
        let event = json!({
            "event": "relit",
            "photo": input.place(),
            "output": output,
            "frames": frames,
            "seconds": seconds,
            "decompose_seconds": decomposed,
            "likeness": likeness(&subject.light, &light),
        });
        console.say(&text, &event);
        Ok(())
    }

    /// Nothing that is read may be overwritten, and the folders of what is written are made.
    fn check_outputs(&self, output: &Path, name: &str) -> Result<(), Box<dyn Error>> {
        let arguments = self.arguments;
        if arguments.is_set() {
            PhotoInput::check_result(output)?;
        }
        let mask = arguments
            .photos
            .mask
            .as_deref()
            .map(|mask| PhotoReading::mask_path(mask, name));
        let mut inputs: Vec<PathBuf> = mask.into_iter().collect();
        inputs.extend(self.photos.iter().cloned());
        inputs.extend(arguments.light.clone());
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
                let view = PanoramaView::new(extent, arguments.field, 0.0);
                Some(Backdrop::Panorama(view, panorama.clone()))
            }
            _ => None,
        };
        match arguments.background {
            _ if arguments.keep_background => Backdrop::Photo,
            None if arguments.own_light => Backdrop::Photo,
            None | Some(BackgroundName::Light) => panorama().unwrap_or(grey),
            Some(BackgroundName::Grey) => grey,
            Some(BackgroundName::Black) => Backdrop::Even([0.0; 3]),
            Some(BackgroundName::White) => Backdrop::Even([1.0; 3]),
        }
    }

    /// Writes the turn; how many frames it has.
    fn film(
        &self,
        shot: &Shot<'_>,
        output: &Path,
        format: MovieFormat,
        console: Console,
    ) -> Result<u32, InsertError> {
        let arguments = self.arguments;
        let frames = (arguments.seconds * f64::from(arguments.fps))
            .round()
            .max(1.0) as u32;
        let all = arguments.turn.unwrap_or(360.0);
        let bar = console.progress(frames.into(), "frames");
        let frame = |frame: u32| {
            let part = f64::from(frame) / f64::from(frames);
            let turn = (arguments.turned + all * part).to_radians();
            Ok::<_, InsertError>(shot.picture(turn)?.encode())
        };
        let encoding = (format, arguments.fps);
        MovieWriter::write_frames(output, encoding, frames, frame, || bar.inc(1))?;
        bar.finish_and_clear();
        Ok(frames)
    }
}

fn file_of(input: &PhotoInput) -> Option<PathBuf> {
    match input {
        PhotoInput::File(path) => Some(path.clone()),
        _ => None,
    }
}
