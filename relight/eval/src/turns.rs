//! Normals and albedo of whole turns in rooms that are not known, on synthetic turns with their ground truth.

use std::path::{Path, PathBuf};

use relight_core::image::{Linear, Planes, Rgb, Transfer};
use relight_core::light::{Normals, ShLight};
use relight_core::metrics::{Comparison, MetricError, ScaleFit, angle};
use relight_synth::SequenceDescription;
use relight_turn::{
    Elevation, MaterialKind, SolvedTurn, TurnError, TurnLight, TurnNetworks, TurnOptions,
    TurnVerdict, solve_turn,
};
use relit_data::rig::RotationDirection;
use relit_data::shard::Dataset;
use relit_data::statistics::median;

use super::predictions::{NO_SET, read_light};
use super::run::NOT_MEASURED;
use super::{EvalError, EvalProgress, ImageScores, MaskRule, ScoreLine, ScoreTable};

/// Expected errors for which the pixels within them are counted, degrees.
const LIMITS: [(f64, &str); 3] = [
    (10.0, "within 10"),
    (20.0, "within 20"),
    (30.0, "within 30"),
];

/// The errors of a turn.
struct TurnScore {
    /// Of its normals, degrees: mean and median of the angles, the mean of what is expected of the pixels, and what is expected
    /// of the turn; 1 if the verdict is good.
    normals: [(&'static str, f64); 5],
    /// For the pixels that are expected to be off by at most each limit: how many there are, and how many of them are.
    kept: [[usize; 2]; 3],
    /// Squared error of the albedo over its energy, after one scale a channel.
    albedo: f64,
}

/// Turns in the layout of `relight synth sequences`, with their ground truth.
struct TurnSet {
    folder: PathBuf,
    turns: Vec<(String, PathBuf)>,
}

/// A turn and its ground truth.
struct TrueTurn {
    shard: PathBuf,
    normals: Normals,
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
            normals: Normals::read(&truth.join("normal.png"))?,
            albedo: Rgb::<Linear>::read(&truth.join("albedo.png"), Transfer::Linear)?,
            elevation: Elevation::measured(out.atan2(up).to_degrees())?,
            light: read_light(&truth.join("light.txt"))?,
        })
    }
}

/// Solves every turn of a data set of `relight synth sequences`, in unknown and in known light; `split` is what the table calls
/// them. `progress` is called for each turn and method.
///
/// # Errors
/// If a turn or its ground truth cannot be read, or cannot be solved.
pub fn evaluate_turns(
    folder: &Path,
    split: &str,
    networks: &TurnNetworks,
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let set = TurnSet::open(folder)?;
    let notes = "normals: degrees, means over the turns, ±: standard error; expected: the predicted error of the pixels, turn expected: \
                 of the turn; within: the fraction of the pixels expected within so many degrees that are; good: of the \
                 turns with this verdict; albedo: squared error over energy";
    let mut table = ScoreTable::new("turns", vec![notes.to_owned()]);
    let methods = [("light unknown", false), ("light known", true)];
    let steps = methods.len() * set.turns.len();
    for (method, knows_light) in methods {
        let mut scores = Vec::new();
        for number in 0..set.turns.len() {
            let truth = set.read(number)?;
            let solved = truth.solve(knows_light, networks)?;
            let image = &set.turns[number].0;
            let score = score(&truth, &solved).map_err(EvalError::sample(image, NOT_MEASURED))?;
            let lines = lines(std::slice::from_ref(&score));
            table.images.push(ImageScores {
                method: method.to_owned(),
                image: image.clone(),
                measures: lines.into_iter().flat_map(|line| line.measures).collect(),
            });
            scores.push(score);
            progress(steps);
        }
        table.lines.extend(lines(&scores).map(|line| ScoreLine {
            method: method.to_owned(),
            images: scores.len(),
            split: split.to_owned(),
            ..line
        }));
    }
    Ok(table)
}

/// The means over turns.
fn lines(turns: &[TurnScore]) -> [ScoreLine; 2] {
    let count = turns.len().max(1) as f64;
    let mean = |of: &dyn Fn(&TurnScore) -> f64| turns.iter().map(of).sum::<f64>() / count;
    let normals = |at: usize| mean(&|turn| turn.normals[at].1);
    let error = |at: usize| {
        let square = mean(&|turn| (turn.normals[at].1 - normals(at)).powi(2));
        (square / (count - 1.0)).sqrt()
    };
    let mut measures: Vec<(&str, f64)> = Vec::new();
    for at in 0..turns.first().map_or(0, |turn| turn.normals.len()) {
        measures.push((turns[0].normals[at].0, normals(at)));
        match at {
            // Of one turn, there is no standard error.
            0 if turns.len() > 1 => measures.push(("± mean", error(0))),
            1 if turns.len() > 1 => measures.push(("± median", error(1))),
            _ => {}
        }
    }
    for (at, (_, name)) in LIMITS.iter().enumerate() {
        let sum = |k: usize| turns.iter().map(|turn| turn.kept[at][k]).sum::<usize>() as f64;
        // Of no pixels, there is no fraction.
        if sum(0) > 0.0 {
            measures.push((name, sum(1) / sum(0)));
        }
    }
    let albedo = [("albedo", mean(&|turn| turn.albedo))];
    let line = |part, measures: &[(&str, f64)], values| {
        ScoreLine::of_image(part, measures, values, MaskRule::Known)
    };
    [
        line("normals", &measures, ("degrees", ScaleFit::None)),
        line("albedo", &albedo, ("linear RGB", ScaleFit::Channel)),
    ]
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

fn score(truth: &TrueTurn, solved: &SolvedTurn) -> Result<TurnScore, MetricError> {
    let (curves, solution) = (&solved.turn.curves, &solved.solution);
    let mask = &solved.turn.mask;
    let (right, found) = (truth.normals.planes().planes(), solution.normals(curves));
    let found = found.planes().planes();
    let inside: Vec<bool> = (0..mask.extent().pixels())
        .map(|at| mask.plane(0)[at] >= 0.5 && right.iter().any(|plane| plane[at] != 0.0))
        .collect();
    let expected = solution.expected_errors(curves);
    // Of each pixel what is expected, and the error.
    let pixels: Vec<(f64, f64)> = (0..inside.len())
        .filter(|&at| inside[at])
        .map(|at| {
            let [right, found] = [right, found].map(|of| of.map(|plane| f64::from(plane[at])));
            let expected = f64::from(expected.plane(0)[at]);
            (expected, angle(right, found).to_degrees())
        })
        .collect();
    let kept = LIMITS.map(|(limit, _)| {
        let chosen = pixels.iter().filter(|(expected, _)| *expected <= limit);
        chosen.fold([0, 0], |[all, kept], (_, error)| {
            [all + 1, kept + usize::from(*error <= limit)]
        })
    });
    let mean = |of: fn(&(f64, f64)) -> f64| {
        pixels.iter().map(of).sum::<f64>() / pixels.len().max(1) as f64
    };
    let is_good = solution.verdict() == TurnVerdict::Good;
    Ok(TurnScore {
        normals: [
            ("mean", mean(|pixel| pixel.1)),
            (
                "median",
                median(pixels.iter().map(|pixel| pixel.1)).unwrap_or(0.0),
            ),
            ("expected", mean(|pixel| pixel.0)),
            ("turn expected", solution.expected_error_deg()),
            ("good", f64::from(u8::from(is_good))),
        ],
        kept,
        albedo: albedo_error(&truth.albedo, &solution.albedo(curves), &inside)?,
    })
}

/// The squared error over the energy, each channel of the answer scaled to fit best.
fn albedo_error(
    truth: &Rgb<Linear>,
    found: &Rgb<Linear>,
    inside: &[bool],
) -> Result<f64, MetricError> {
    let (extent, right) = (truth.planes().extent(), truth.planes().planes());
    let nothing = Planes::<3>::zeros(extent);
    let error = Comparison::new(extent, &right, &found.planes().planes(), inside)?;
    let energy = Comparison::new(extent, &right, &nothing.planes(), inside)?;
    Ok(error.mse(ScaleFit::Channel) / energy.mse(ScaleFit::None).max(1e-12))
}
