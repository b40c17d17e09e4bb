//! Insertion: one photograph of an object in, the object standing in another picture out, beside a rendering of it that
//! truly stands there.

mod stage;

use super::run::{Scored, add_lines};
use super::{EvalError, EvalProgress, MaskRule, ScoreTable};
use relight_core::image::{Linear, Planes, Rgb, Srgb};
use relight_core::metrics::{Comparison, ScaleFit, Ssim, dssim};
use relight_photo::decompose::{DecomposeOptions, Decomposer};
use relight_photo::insert::{
    EdgeColours, InsertError, InsertScene, LightSource, Matching, MaterialChange, SceneObject,
    Subject,
};
use relight_synth::Library;
use stage::{Stage, StageRecipe};

/// What an evaluation of insertion consists of. The same recipe and library make the same pictures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InsertionRecipe {
    /// How many objects, each in one new picture.
    pub objects: u64,
    /// Width and height of the pictures, 32..=1024 pixels.
    pub size: u32,
    /// What all is drawn from.
    pub seed: u64,
    /// Whether a part of each object is painted black: paint that may be taken for shadow.
    pub black_paint: bool,
}

/// Ways to put an object into a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InsertionMethod {
    /// All of [`relight_photo::insert`].
    Whole,
    /// The same without the shadow on the ground.
    WithoutShadow,
    /// The same with the photograph's colours at the object's edge.
    WithoutEdgeColours,
    /// The same in the light of the photograph.
    WithoutRelighting,
    /// The same, with the decomposition taken for the truth.
    WithoutHedge,
    /// The photograph's pixels under the mask.
    Naive,
}

impl InsertionMethod {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Whole,
        Self::WithoutShadow,
        Self::WithoutEdgeColours,
        Self::WithoutRelighting,
        Self::WithoutHedge,
        Self::Naive,
    ];

    /// How a table names it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Whole => "relight insert",
            Self::WithoutShadow => "without shadow",
            Self::WithoutEdgeColours => "without edge colours",
            Self::WithoutRelighting => "without relighting",
            Self::WithoutHedge => "without hedge",
            Self::Naive => "naive insertion",
        }
    }

    /// The object in the new picture, and before the bright table.
    fn insert(self, stage: &Stage, subjects: &Subjects) -> Result<[Rgb<Linear>; 2], InsertError> {
        let subject = match self {
            Self::WithoutEdgeColours => &subjects.photographed,
            Self::WithoutHedge => &subjects.without_hedge,
            _ => &subjects.freed,
        };
        let backgrounds = [&stage.background, &stage.bright[0]];
        if self == Self::Naive {
            return Ok(backgrounds.map(|background| subject.pasted(&stage.photo, background)));
        }
        let object = SceneObject {
            subject,
            placement: subject.own_placement(),
            change: MaterialChange::default(),
            exposure: 0.0,
            shadow: if self == Self::WithoutShadow {
                0.0
            } else {
                1.0
            },
            relit: self != Self::WithoutRelighting,
        };
        let extent = stage.background.planes().extent();
        let light = LightSource::Panorama(stage.light.clone());
        let tilt = f64::from(stage::TILT).to_degrees();
        let scene = InsertScene::new(extent, &light, tilt, Matching::default(), vec![object])?;
        let layers = scene.layers(0.0)?;
        Ok(backgrounds.map(|background| scene.compose(background, &layers, 0)))
    }
}

/// An object, decomposed in each way that a method needs.
struct Subjects {
    freed: Subject,
    photographed: Subject,
    without_hedge: Subject,
}

impl Subjects {
    fn of(stage: &Stage, decomposer: &Decomposer) -> Result<Self, InsertError> {
        let mask = stage
            .coverage
            .clone()
            .map(|part| f32::from(u8::from(part >= 0.5)));
        let options = DecomposeOptions::default();
        let subject =
            |edges| Subject::with_edges(&stage.photo, (&mask, None), decomposer, &options, edges);
        let freed = subject(EdgeColours::Freed)?;
        Ok(Self {
            photographed: subject(EdgeColours::Photographed)?,
            without_hedge: freed.clone().without_hedge(),
            freed,
        })
    }
}

/// Which pixels are compared, beside the whole picture.
struct Places {
    /// Those that the object covers wholly.
    object: Vec<bool>,
    /// Those that it covers in part.
    edge: Vec<bool>,
    /// Those that it does not cover.
    ground: Vec<bool>,
}

impl Places {
    fn of(stage: &Stage) -> Self {
        let coverage = stage.coverage.plane(0);
        let places = |is: fn(f32) -> bool| coverage.iter().map(|&part| is(part)).collect();
        Self {
            object: places(|part| part >= 1.0),
            edge: places(|part| part > 0.0 && part < 1.0),
            ground: places(|part| part <= 0.0),
        }
    }
}

/// Is given each object's name and its pictures in sRGB: photograph, new picture, ground truth, and the result of each method;
/// then the same but the photograph before a nearly white table.
pub type SheetWriter<'a> = &'a mut dyn FnMut(&str, &[Planes<3>]) -> Result<(), EvalError>;

/// MSE and DSSIM of objects that were put into new pictures, for each method: of the whole picture, and of object,
/// edge and ground alone, and of the edge before a nearly white table.
///
/// # Errors
/// Where a picture cannot be made or measured, or the network fails.
pub fn evaluate_insertion(
    recipe: &InsertionRecipe,
    library: &Library,
    decomposer: &Decomposer,
    show: SheetWriter<'_>,
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let mut table = ScoreTable {
        protocol: "insertion".to_owned(),
        notes: vec![
            format!(
                "made by relight {}: {} objects, {} x {} pixels, seed {}, {} panoramas, Monte Carlo with cast shadows, on a table",
                env!("CARGO_PKG_VERSION"),
                recipe.objects,
                recipe.size,
                recipe.size,
                recipe.seed,
                library.panoramas.len()
            ),
            "one photograph under another panorama in; light, ground and place are given"
                .to_owned(),
            format!("SSIM by {}", Ssim::Gaussian.name()),
        ],
        lines: Vec::new(),
        images: Vec::new(),
    };
    if recipe.black_paint {
        let note = "about half of each object is painted black, with an albedo of 0.04 at most";
        table.notes.push(note.to_owned());
    }
    let mut scored: [Vec<(String, Vec<Scored>)>; InsertionMethod::ALL.len()] = Default::default();
    for number in 0..recipe.objects {
        let made = StageRecipe {
            seed: recipe.seed,
            size: recipe.size,
            black_paint: recipe.black_paint,
        };
        let stage = Stage::make(library, made, number).map_err(|source| EvalError::Unlit {
            sample: format!("{number:03}"),
            source,
        })?;
        let places = Places::of(&stage);
        let failed = |source| EvalError::Insertion {
            sample: stage.name.clone(),
            source: Box::new(source),
        };
        let subjects = Subjects::of(&stage, decomposer).map_err(failed)?;
        let truths = [shown(&stage.truth), shown(&stage.bright[1])];
        let truth = truths[0].clone();
        let mut tiles = vec![shown(&stage.photo), shown(&stage.background), truth.clone()];
        let mut bright = vec![shown(&stage.bright[0]), truths[1].clone()];
        for (method, scored) in InsertionMethod::ALL.into_iter().zip(&mut scored) {
            let found = method.insert(&stage, &subjects).map_err(failed)?;
            let found = found.map(|picture| shown(&picture));
            scored.push((
                stage.name.clone(),
                score(&stage.name, &truths, &found, &places)?,
            ));
            let [found, before_bright] = found;
            tiles.push(found);
            bright.push(before_bright);
        }
        tiles.extend(bright);
        show(&stage.name, &tiles)?;
        progress();
    }
    for (method, scored) in InsertionMethod::ALL.into_iter().zip(scored) {
        add_lines(&mut table, method.name(), "synthetic objects", 1, scored);
    }
    Ok(table)
}

fn score(
    name: &str,
    truths: &[Planes<3>; 2],
    found: &[Planes<3>; 2],
    places: &Places,
) -> Result<Vec<Scored>, EvalError> {
    let whole = vec![true; places.object.len()];
    let parts = [
        ("picture", 0, &whole, MaskRule::WholeImage),
        ("object", 0, &places.object, MaskRule::Object),
        ("edge", 0, &places.edge, MaskRule::Known),
        ("edge, bright", 1, &places.edge, MaskRule::Known),
        ("ground", 0, &places.ground, MaskRule::Known),
    ];
    let failed = |source| EvalError::Metric {
        sample: name.to_owned(),
        source,
    };
    let mut lines = Vec::new();
    for (part, picture, mask, rule) in parts {
        let (truth, found) = (&truths[picture], &found[picture]);
        let (truth_planes, found_planes) = (truth.planes(), found.planes());
        let pair =
            Comparison::new(truth.extent(), &truth_planes, &found_planes, mask).map_err(failed)?;
        let ssim = pair.ssim(Ssim::Gaussian, 1.0).map_err(failed)?;
        lines.push(Scored {
            part,
            measures: vec![("MSE", pair.mse(ScaleFit::None)), ("DSSIM", dssim(ssim))],
            colour: "sRGB, clipped to 0..1",
            scale: ScaleFit::None.name(),
            mask: rule,
        });
    }
    Ok(lines)
}

fn shown(picture: &Rgb<Linear>) -> Planes<3> {
    let clipped = Rgb::<Linear>::new(picture.planes().clone().map(|v| v.clamp(0.0, 1.0)));
    clipped.encode::<Srgb>().into_planes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_nets::{Weights, decomposer};
    use relight_synth::Folders;

    #[test]
    fn every_method_is_scored_on_every_part_and_the_same_seed_gives_the_same_scores() {
        let library = Library::read(&Folders::default()).unwrap();
        let net = Decomposer::with_side(&Weights::initial(&decomposer(), 3), 32).unwrap();
        let recipe = InsertionRecipe {
            objects: 1,
            size: 48,
            seed: 5,
            black_paint: false,
        };
        let mut sheets = Vec::new();
        let mut evaluate = || {
            let mut show = |name: &str, tiles: &[Planes<3>]| {
                sheets.push((name.to_owned(), tiles.len()));
                Ok(())
            };
            evaluate_insertion(&recipe, &library, &net, &mut show, &|| ()).unwrap()
        };
        let table = evaluate();
        assert_eq!(table, evaluate());
        assert_eq!(table.lines.len(), 5 * InsertionMethod::ALL.len());
        assert_eq!(sheets[0].1, 5 + 2 * InsertionMethod::ALL.len());
        // On the table's top, shadows are what counts.
        let ground = |method: InsertionMethod| {
            let line = table
                .lines
                .iter()
                .find(|line| line.method == method.name() && line.part == "ground");
            line.unwrap().measures[0].value
        };
        assert_ne!(
            ground(InsertionMethod::WithoutShadow),
            ground(InsertionMethod::Whole)
        );
        assert!(ground(InsertionMethod::Naive) > 0.0);
    }
}
