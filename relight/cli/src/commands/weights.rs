//! `relight weights`: weights of networks from one format into another.

use std::path::PathBuf;
use std::slice;

use clap::{Args, Subcommand, ValueEnum};
use relight_photo::nets::paper::{self, Head};
use relight_photo::nets::{Graph, WeightPrecision, Weights, decomposer_of, to_onnx, turn_network};
use relit_console::{Console, Outcome};
use relit_data::durable::write_whole;
use serde_json::json;

use crate::commands::CommandResult;
use crate::folder::make_folder;
use crate::photos::not_an_input;

pub(crate) const EXAMPLES: &str = "\
Examples:
  relight weights export net.safetensors -o half.safetensors --half
      in half precision
  relight weights export net.safetensors --net normal-net -o normal-net.onnx
      the paper's Normal-Net for any ONNX engine, for pictures of 256 x 256 pixels";

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Check weights against a network, and write them with it as ONNX or alone as safetensors.
    Export(Export),
}

#[derive(Args)]
struct Export {
    /// The weights (.safetensors).
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write: .onnx or .safetensors.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// The network that they are for.
    #[arg(long, value_enum, default_value_t = NetName::Decomposer)]
    net: NetName,
    /// The longest side of the pictures that an ONNX file takes, which are square, pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 256, value_parser = clap::value_parser!(u16).range(32..=8192))]
    size: u16,
    /// Write safetensors of half precision.
    #[arg(long)]
    half: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum NetName {
    /// Ours of photographs, with the heads that the weights have.
    Decomposer,
    /// Ours of turns.
    TurnNet,
    /// The paper's Spec-Net.
    SpecNet,
    /// The paper's Normal-Net.
    NormalNet,
    /// The paper's Light-Net with a pooled head.
    LightNet,
    /// The paper's Light-Net as released.
    LightNetReleased,
    /// The paper's net for specular reflectance and smoothness, with a pooled head.
    ReflectanceNet,
    /// The same with the released head.
    ReflectanceNetReleased,
}

impl NetName {
    /// The network that these weights should be of.
    fn graph(self, weights: &Weights) -> Graph {
        match self {
            Self::Decomposer => decomposer_of(weights),
            Self::TurnNet => turn_network(),
            Self::SpecNet => paper::spec_net(),
            Self::NormalNet => paper::normal_net(),
            Self::LightNet => paper::light_net(Head::Pooled),
            Self::LightNetReleased => paper::light_net(Head::Released),
            Self::ReflectanceNet => paper::reflectance_net(Head::Pooled),
            Self::ReflectanceNetReleased => paper::reflectance_net(Head::Released),
        }
    }
}

impl Arguments {
    /// What is wrong with the combination of arguments, if anything is.
    pub(crate) fn fault(&self) -> Option<String> {
        let Verb::Export(export) = &self.verb;
        let output = export.output.display();
        match export.ending() {
            Some("onnx") if export.half => Some("--half is for .safetensors".to_owned()),
            Some(_) => None,
            None => Some(format!("--output {output}: give .onnx or .safetensors")),
        }
    }
}

impl Export {
    fn ending(&self) -> Option<&'static str> {
        let ending = self.output.extension()?;
        ["onnx", "safetensors"]
            .into_iter()
            .find(|known| ending.eq_ignore_ascii_case(known))
    }
}

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let Verb::Export(export) = &arguments.verb;
    not_an_input(&export.output, slice::from_ref(&export.input))?;
    let weights = Weights::read(&export.input)?;
    let graph = export.net.graph(&weights);
    let weights = weights.fitted_to(&graph);
    let weights = weights.map_err(|fault| format!("{}: {fault}", export.input.display()))?;
    if let Some(folder) = export.output.parent() {
        make_folder(folder)?;
    }
    if export.ending() == Some("onnx") {
        let side = usize::from(export.size);
        let bytes = to_onnx(&graph, &weights, 1, (side, side))?;
        write_whole(&export.output, &bytes)
            .map_err(|error| format!("{}: {error}", export.output.display()))?;
    } else {
        let precision = if export.half {
            WeightPrecision::Half
        } else {
            WeightPrecision::Single
        };
        weights.write(&export.output, precision)?;
    }
    let count: usize = weights
        .iter()
        .map(|(_, tensor)| tensor.values().len())
        .sum();
    let (output, net) = (export.output.display(), graph.name());
    console.say(
        &format!("{output}: {net}, {count} parameters"),
        &json!({ "event": "exported", "output": export.output, "net": net, "parameters": count }),
    );
    Ok(Outcome::Success)
}
