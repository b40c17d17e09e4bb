//! `relight weights`: weights of networks into ONNX.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use relight_photo::nets::paper;
use relight_photo::nets::{
    Graph, NetError, WeightPrecision, Weights, decomposer_of, to_onnx, turn_network,
};
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use relit_data::file_names::has_extension;
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_folder;
use crate::photos::not_an_input;
use crate::shipped;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight weights export -o relight.onnx
      the network of relight decompose, for any ONNX engine and pictures of any size
  relight weights export net.safetensors --net normal-net -o normal-net.onnx
      the paper's Normal-Net";

/// Metadata of an ONNX file of our network of photographs, the same for all weights.
const DECOMPOSER_FACTS: [(&str, &str); 6] = [
    (
        "input",
        "batch x 7 x height x width, multiples of 32; 0 outside the mask. v: linear light over its 99th percentile (of the brightest \
         channel, under the mask), cut off at 1.5; m: mean of v. 2 v^(1/2.2) - 1 of red, green and blue; the mask, 1; \
         (ln(m + 0.01) + 2) / 2; 4 (v - m) / (3 m + 0.03) of red and green",
    ),
    (
        "maps",
        "batch x 9 x height x width: normal x, y, z, where z becomes softplus(z) + 0.02 before the length is made 1; albedo, logit of \
         red, green and blue; highlight, softplus(h - 3.5) in units of the percentile; shading, exp of a + sigmoid(b) (2 c - 2), \
         between exp(-6) and exp(3), where c is channel 4 of the input. Albedo and shading are right up to a factor",
    ),
    (
        "light",
        "batch x 9: coefficients of order 2 of the grey irradiance from all around, in units of the mean shading",
    ),
    (
        "colour_space",
        "linear light in the primaries of sRGB (Rec. 709)",
    ),
    (
        "axes",
        "x right, y up, z to the viewer; harmonics (l, m) at l (l + 1) + m, pole at z, without the Condon-Shortley phase",
    ),
    (
        "use",
        "resize the object to 128 x 128 pixels, the size of training: at 256 x 256 the normals are worse by 3 degrees and more. \
         relight decompose blends both sizes and fits light to them",
    ),
];

/// Further metadata of an ONNX file of the built-in weights.
const SHIPPED_FACTS: [(&str, &str); 2] = [
    ("licence", "MIT OR Apache-2.0"),
    (
        "attribution",
        "learned from procedural shapes, panoramas of Poly Haven, Blender and @pmndrs/assets (CC0), meshes of odedstein/meshes (public \
         domain, CC BY 3.0 and CC BY 4.0) and, for turns, furniture of Sweet Home 3D (CC0 and CC BY 3.0), whose authors \
         relight/cli/weights/README.md names",
    ),
];

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Check weights, and write them with their network as ONNX, in 16 bits.
    Export(Export),
}

#[derive(Args)]
struct Export {
    /// The weights (.safetensors) [default: built in].
    #[arg(value_name = "IN")]
    input: Option<PathBuf>,
    /// The file to write: .onnx.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The network of the weights.
    #[arg(long, value_enum, default_value_t = NetName::Decomposer)]
    net: NetName,
}

#[derive(Clone, Copy, ValueEnum)]
enum NetName {
    /// That of relight decompose, with the weights' heads.
    Decomposer,
    /// That of relight turn.
    TurnNet,
    /// The paper's Spec-Net.
    SpecNet,
    /// The paper's Normal-Net.
    NormalNet,
    /// The paper's Light-Net with a pooled head.
    LightNet,
    /// The paper's net for reflectance and smoothness.
    ReflectanceNet,
}

impl NetName {
    /// The reader of the built-in weights, if there are any.
    fn shipped(self) -> Option<fn() -> Result<Weights, NetError>> {
        match self {
            Self::Decomposer => Some(shipped::weights),
            Self::TurnNet => Some(shipped::turn_weights),
            _ => None,
        }
    }

    /// The network that these weights should be of.
    fn graph(self, weights: &Weights) -> Graph {
        match self {
            Self::Decomposer => decomposer_of(weights),
            Self::TurnNet => turn_network(),
            Self::SpecNet => paper::spec_net(),
            Self::NormalNet => paper::normal_net(),
            Self::LightNet => paper::light_net(),
            Self::ReflectanceNet => paper::reflectance_net(),
        }
    }
}

impl Arguments {
    /// The fault of the combination of arguments, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let Verb::Export(export) = &self.verb;
        if export.input.is_none() && export.net.shipped().is_none() {
            return Some("give the weights: the program contains none for this network".to_owned());
        }
        let output = export.output.display();
        let is_known = has_extension(&export.output, &["onnx"]);
        (!is_known).then(|| format!("--output {output}: give .onnx"))
    }
}

impl Export {
    /// The given weights, or the built-in ones.
    fn weights(&self) -> Result<Weights, Box<dyn Error>> {
        match (&self.input, self.net.shipped()) {
            (Some(path), _) => Ok(Weights::read(path)?),
            (None, Some(shipped)) => Ok(shipped()?),
            (None, None) => Err("give the weights".into()),
        }
    }

    /// The metadata of an ONNX file.
    fn facts(&self) -> Vec<(&'static str, &'static str)> {
        let mut facts = Vec::new();
        if matches!(self.net, NetName::Decomposer) {
            facts.extend(DECOMPOSER_FACTS);
        }
        if self.input.is_none() {
            facts.extend(SHIPPED_FACTS);
        }
        facts
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let Verb::Export(export) = &arguments.verb;
    not_an_input(&export.output, export.input.as_slice())?;
    let weights = export.weights()?;
    let graph = export.net.graph(&weights);
    let weights = weights.fitted_to(&graph).map_err(|fault| {
        let input = export.input.as_deref().unwrap_or(Path::new("the weights"));
        format!("{}: {fault}", input.display())
    })?;
    if let Some(folder) = export.output.parent() {
        make_folder(folder)?;
    }
    let bytes = to_onnx(&graph, &weights, WeightPrecision::Half, &export.facts())?;
    write_whole(&export.output, &bytes)
        .map_err(|error| format!("{}: {error}", export.output.display()))?;
    let count: usize = weights
        .iter()
        .map(|(_, tensor)| tensor.values().len())
        .sum();
    let (output, net) = (export.output.display(), graph.name());
    console.print(
        &format!("{output}: {net}, {count} parameters"),
        &json!({ "event": "exported", "output": export.output, "net": net, "parameters": count }),
    );
    Ok(Outcome::Success)
}
