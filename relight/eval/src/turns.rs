//! Normals and albedo of whole turns in rooms that are not known, on synthetic turns with their ground truth.

use std::fmt;
use std::path::{Path, PathBuf};

use relight_core::image::{Linear, Rgb, Transfer};
use relight_core::light::{Normals, ShLight, YUp};
use relight_synth::SequenceDescription;
use relight_turn::{
    Elevation, MaterialKind, SolvedTurn, TurnError, TurnLight, TurnNetworks, TurnOptions,
    TurnVerdict, solve_turn,
};
use relit_data::rig::RotationDirection;
use relit_data::shard::Dataset;
use relit_data::statistics::median;
use serde::Serialize;

use super::predictions::{NO_SET, read_light};
use super::{EvalError, EvalProgress};

/// Expected errors for which the pixels within them are counted, degrees.
const LIMITS_DEG: [f64; 3] = [10.0, 20.0, 30.0];

/// The methods for turns, as named in the table, and whether they get the true light.
const METHODS: [(&str, bool); 2] = [("light unknown", false), ("light known", true)];

/// The errors of a turn by a method.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct TurnScore {
    turn: String,
    /// Mean and median angle between found and true normals, degrees.
    mean_deg: f64,
    median_deg: f64,
    /// Squared error of the albedo over its energy, after one scale a channel.
    albedo: f64,
    /// For the pixels that are expected to be off by at most 10, 20 and 30 degrees: how many there are, and how many
    /// of them are.
    kept: [[usize; 2]; 3],
    /// Mean and median of what is expected of the pixels, degrees.
    expected_mean_deg: f64,
    expected_deg: f64,
    /// The verdict on the turn.
    verdict: TurnVerdict,
}

/// A method on all turns.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct TurnLine {
    method: &'static str,
    turns: Vec<TurnScore>,
}

/// All methods on all turns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TurnScores {
    /// What the turns are called.
    split: String,
    lines: [TurnLine; METHODS.len()],
}

/// Turns in the layout of `relight synth sequences`, with their ground truth.
struct TurnSet {
    folder: PathBuf,
    turns: Vec<(String, PathBuf)>,
}

/// A turn and its ground truth.
struct TrueTurn {
    shard: PathBuf,
    normals: Normals<YUp>,
    albedo: Rgb<Linear>,
    elevation: Elevation,
    light: ShLight,
}

impl TurnSet {
    fn open(folder: &Path) -> Result<Self, EvalError> {
        let fault = "holds no turns of relight synth sequences";
        let dataset = Dataset::read(folder).map_err(EvalError::file(folder, fault))?;
        let shard = |id: &str| {
            dataset
                .shards_of(id)
                .next()
                .map(|shard| folder.join(&shard.file))
        };
        let sessions = dataset.sessions.iter();
        let turns = sessions
            .filter_map(|session| Some((session.id.clone(), shard(&session.id)?)))
            .collect();
        Ok(Self {
            folder: folder.to_owned(),
            turns,
        })
    }

    fn read(&self, number: usize) -> Result<TrueTurn, EvalError> {
        let (id, shard) = &self.turns[number];
        let truth = self.folder.join("truth").join(id);
        let path = truth.join("turn.json");
        let json = std::fs::read(&path).map_err(EvalError::read(&path))?;
        let description: SequenceDescription =
            serde_json::from_slice(&json).map_err(EvalError::file(&path, NO_SET))?;
        let [_, up, out] = description.axis;
        Ok(TrueTurn {
            shard: shard.clone(),
            normals: Normals::<YUp>::read(&truth.join("normal.png"))?,
            albedo: Rgb::<Linear>::read(&truth.join("albedo.png"), Transfer::Linear)?,
            elevation: Elevation::measured(out.atan2(up).to_degrees())?,
            light: read_light(&truth.join("light.txt"))?,
        })
    }
}

/// Solves every turn of a data set of `relight synth sequences` by every method; `split` is what the table calls them. `progress`
/// is called for each turn and method.
///
/// # Errors
/// If a turn or its ground truth cannot be read, or cannot be solved.
pub fn evaluate_turns(
    folder: &Path,
    split: &str,
    networks: &TurnNetworks,
    progress: EvalProgress<'_>,
) -> Result<TurnScores, EvalError> {
    let set = TurnSet::open(folder)?;
    let mut lines = METHODS.map(|(method, _)| TurnLine {
        method,
        turns: Vec::new(),
    });
    let steps = METHODS.len() * set.turns.len();
    for number in 0..set.turns.len() {
        let truth = set.read(number)?;
        for (line, (_, knows_light)) in lines.iter_mut().zip(METHODS) {
            let solved = truth.solve(knows_light, networks)?;
            line.turns
                .push(score(&set.turns[number].0, &truth, &solved));
            progress(steps);
        }
    }
    Ok(TurnScores {
        split: split.to_owned(),
        lines,
    })
}

impl TrueTurn {
    fn solve(&self, knows_light: bool, networks: &TurnNetworks) -> Result<SolvedTurn, TurnError> {
        let options = TurnOptions {
            rotation: Some(RotationDirection::CounterClockwise),
            elevation: Some(self.elevation),
            light: if knows_light {
                TurnLight::Given(self.light.clone())
            } else {
                TurnLight::Unknown
            },
            material: MaterialKind::Diffuse,
        };
        solve_turn(&self.shard, &options, networks, &|_, _| {})
    }
}

fn score(name: &str, truth: &TrueTurn, solved: &SolvedTurn) -> TurnScore {
    let (curves, solution) = (&solved.turn.curves, &solved.solution);
    let mask = &solved.turn.mask;
    let true_normals = truth.normals.planes().planes();
    let inside: Vec<usize> = (0..mask.extent().pixels())
        .filter(|&at| mask.plane(0)[at] >= 0.5)
        .filter(|&at| true_normals.iter().any(|plane| plane[at] != 0.0))
        .collect();
    let vectors = |normals: &Normals<YUp>| -> Vec<[f64; 3]> {
        let planes = normals.planes().planes();
        let at = |&at: &usize| planes.map(|plane| f64::from(plane[at]));
        inside.iter().map(at).collect()
    };
    let (right, found) = (vectors(&truth.normals), vectors(&solution.normals(curves)));
    let errors: Vec<f64> = right
        .iter()
        .zip(&found)
        .map(|(a, b)| angle_deg(*a, *b))
        .collect();
    let expected = solution.expected_errors(curves);
    let expected: Vec<f64> = (inside.iter())
        .map(|&at| f64::from(expected.plane(0)[at]))
        .collect();
    let pairs = || expected.iter().copied().zip(errors.iter().copied());
    let kept = LIMITS_DEG.map(|limit| {
        let chosen = pairs().filter(|(expected, _)| *expected <= limit);
        chosen.fold([0, 0], |[all, kept], (_, error)| {
            [all + 1, kept + usize::from(error <= limit)]
        })
    });
    TurnScore {
        turn: name.to_owned(),
        mean_deg: mean(&errors),
        median_deg: median(errors.iter().copied()).unwrap_or(0.0),
        albedo: albedo_error(&truth.albedo, &solution.albedo(curves), &inside),
        kept,
        expected_mean_deg: mean(&expected),
        expected_deg: solution.expected_error_deg(),
        verdict: solution.verdict(),
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let cosine = dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(1e-12);
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

/// The squared error over the energy, each channel of the answer scaled to fit best.
fn albedo_error(truth: &Rgb<Linear>, found: &Rgb<Linear>, inside: &[usize]) -> f64 {
    let (mut error, mut energy) = (0.0, 0.0);
    for (a, b) in truth
        .planes()
        .planes()
        .into_iter()
        .zip(found.planes().planes())
    {
        let pairs = || {
            inside
                .iter()
                .map(|&at| (f64::from(a[at]), f64::from(b[at])))
        };
        let product: f64 = pairs().map(|(a, b)| a * b).sum();
        let square: f64 = pairs().map(|(_, b)| b * b).sum();
        let scale = product / square.max(1e-12);
        error += pairs().map(|(a, b)| (a - scale * b).powi(2)).sum::<f64>();
        energy += pairs().map(|(a, _)| a * a).sum::<f64>();
    }
    error / energy.max(1e-12)
}

impl TurnLine {
    /// The mean of a figure over the turns, and its standard error.
    fn mean_of(&self, figure: impl Fn(&TurnScore) -> f64) -> (f64, f64) {
        let values: Vec<f64> = self.turns.iter().map(figure).collect();
        let mean = mean(&values);
        let count = values.len() as f64;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let error = (square / (count - 1.0).max(1.0) / count.max(1.0)).sqrt();
        (mean, error)
    }

    /// The part of the pixels expected within a limit that are.
    fn kept(&self, limit: usize) -> Option<f64> {
        let sum = |k: usize| {
            self.turns
                .iter()
                .map(|turn| turn.kept[limit][k])
                .sum::<usize>()
        };
        (sum(0) > 0).then(|| sum(1) as f64 / sum(0) as f64)
    }
}

impl fmt::Display for TurnScores {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let turns = self.lines.first().map_or(0, |line| line.turns.len());
        writeln!(f, "turns, {turns} of {}", self.split)?;
        writeln!(
            f,
            "  errors of normals in degrees, averaged over the turns ± standard error: mean, median; expected: the \
             predicted error; albedo: squared error over energy; 10, 20, 30: how many pixels expected within so many degrees are"
        )?;
        writeln!(
            f,
            "{:24}  {:>12}  {:>12}  {:>8}  {:>6}  {:>5} {:>5} {:>5}",
            "method", "mean", "median", "expected", "albedo", "10", "20", "30"
        )?;
        for line in &self.lines {
            let (mean, error) = line.mean_of(|turn| turn.mean_deg);
            let (median, median_error) = line.mean_of(|turn| turn.median_deg);
            let (expected, _) = line.mean_of(|turn| turn.expected_mean_deg);
            let (albedo, _) = line.mean_of(|turn| turn.albedo);
            write!(
                f,
                "{:24}  {:>12}  {:>12}  {expected:>8.1}  {albedo:>6.3} ",
                line.method,
                format!("{mean:.1} ± {error:.1}"),
                format!("{median:.1} ± {median_error:.1}"),
            )?;
            for limit in 0..LIMITS_DEG.len() {
                let kept = line.kept(limit);
                let kept = kept.map_or("-".to_owned(), |kept| format!("{:.0} %", 100.0 * kept));
                write!(f, " {kept:>5}")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
