//! Options of new light, which several verbs take.

use std::path::PathBuf;

use clap::Args;
use relight_photo::files::InsertionError;
use relight_photo::insert::{DiscLamp, LightSource};

use crate::values::within;

/// The new light.
#[derive(Args)]
pub(crate) struct NewLightArguments {
    /// The light: an HDR or EXR panorama, whose middle is what the viewer sees behind the object, or a text file of
    /// coefficients as relight writes them.
    #[arg(long, value_name = "FILE", conflicts_with = "lamp")]
    pub(crate) light: Option<PathBuf>,
    /// The light: a lamp at so many degrees about the vertical (0 at the viewer's side, 90 on the right, 180 behind) and above
    /// the horizon, in a colour (#ffd9b0 or 3200K), so many degrees large [default: white, 30].
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION[,COLOUR][,SIZE]",
        allow_hyphen_values = true
    )]
    pub(crate) lamp: Option<DiscLamp>,
    /// Even light beside a lamp, as a part of it.
    #[arg(long, value_name = "PART", default_value_t = 0.15, value_parser = within(0.0..=10.0, "a part"), requires = "lamp")]
    pub(crate) ambient: f64,
}

impl NewLightArguments {
    /// The light that is asked for, if any is.
    pub(crate) fn read(&self) -> Result<Option<LightSource>, InsertionError> {
        if let Some(lamp) = self.lamp {
            let ambient = self.ambient;
            return Ok(Some(LightSource::Lamp(DiscLamp { ambient, ..lamp })));
        }
        self.light.as_deref().map(LightSource::read).transpose()
    }
}
