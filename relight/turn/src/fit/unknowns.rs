//! The unknowns of a joint optimisation, and the derivative of a curve to each.

use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::gloss::{GLOSS_TERMS, GlossLight, gloss_terms};
use crate::model::harmonics::{COEFFICIENTS, HarmonicTerm};
use crate::model::known_light::KnownLight;
use crate::model::lighting::{
    LAMBERTIAN_BANDS, LAMBERTIAN_IN_GLOSS, TERMS, TableLight, lambertian_terms,
};
use crate::model::material::MaterialKind;
use crate::model::metal::mirror_terms;
use crate::model::shading::ShadingModel;

/// Parameters of the bands' attenuations.
struct AttenuationParameters {
    /// Largest attenuation of a band by gloss, over that of a smooth dielectric. By hand: light by a dark grey ball is
    /// in small units.
    most_gloss: f64,
    /// Largest attenuation of a band by metal, over that of band 0. By hand: physically 1.
    most_metal: f64,
    /// Least attenuation of band 0 by which the others of metal are divided. Numerical.
    least_first: f64,
}

const PARAMETERS: AttenuationParameters = AttenuationParameters {
    most_gloss: 20.0,
    most_metal: 1.2,
    least_first: 0.05,
};

/// How much gloss shows of the bands of a light that a Lambertian surface shows too.
pub(crate) type Attenuations = [f64; LAMBERTIAN_BANDS];

/// The unknowns of a joint optimisation.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Unknowns<'a> {
    /// How much gloss shows of the bands of a light that is known.
    Gloss(&'a KnownLight),
    /// Light, and gloss that shows so many bands of it; 0 for a Lambertian object.
    Light {
        /// Those from the fourth on are free, the others are shares of the light.
        bands: usize,
    },
    /// How much metal shows of the bands of a light that is known.
    Mirror(&'a KnownLight),
    /// What metal shows of an unknown light: all terms are free.
    Reflection,
}

/// A shading model by its unknowns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) light: TableLight,
    pub(crate) attenuations: Vec<f64>,
    /// Bands of the gloss that a Lambertian surface does not show, in an unknown light.
    pub(crate) higher: GlossLight,
}

impl Estimate {
    pub(crate) fn of(model: &ShadingModel, unknowns: Unknowns<'_>) -> Self {
        let attenuations = match unknowns {
            Unknowns::Gloss(known) | Unknowns::Mirror(known) => {
                let share = |band| model.gloss.attenuation_of(band);
                unknowns.known_bands(known).iter().map(share).collect()
            }
            Unknowns::Light { bands } => {
                attenuations(model)[..bands.min(LAMBERTIAN_BANDS)].to_vec()
            }
            Unknowns::Reflection => Vec::new(),
        };
        let layout = unknowns.layout();
        Self {
            light: model.light,
            attenuations,
            higher: model.gloss.beyond(layout.first.isqrt()),
        }
    }

    pub(crate) fn model(&self, frame: &TableFrame, unknowns: Unknowns<'_>) -> ShadingModel {
        let mut parts = unknowns.bands(self).unwrap_or_default();
        let mut factors = self.attenuations.clone();
        if unknowns.layout().higher > 0 {
            parts.truncate(factors.len());
            parts.push(self.higher);
            factors.push(1.0);
        }
        let gloss = GlossLight::sum(&parts, &factors);
        let light = match unknowns {
            Unknowns::Reflection => TableLight::of_mirror(&gloss).unwrap_or(self.light),
            _ => self.light,
        };
        let diffuse_beyond = match unknowns {
            Unknowns::Gloss(known) => known.diffuse_beyond,
            _ => GlossLight::NONE,
        };
        ShadingModel {
            frame: *frame,
            light,
            diffuse_beyond,
            gloss,
            material: unknowns.material(),
        }
    }

    pub(crate) fn moved(&self, step: &[f64], unknowns: Unknowns<'_>) -> Self {
        let layout = unknowns.layout();
        let mut terms = *self.light.terms();
        let mut higher = self.higher;
        for (channel, terms) in terms.iter_mut().enumerate() {
            let own = &step[layout.of_channel(channel)..][..layout.light + layout.higher];
            let (light, rest) = own.split_at(layout.light);
            terms
                .iter_mut()
                .zip(light)
                .for_each(|(term, by)| *term += by);
            for (at, by) in rest.iter().enumerate() {
                higher = higher.moved(channel, layout.first + at, *by);
            }
        }
        let by = &step[layout.of_channel(3)..];
        let attenuations = self.attenuations.iter().zip(by);
        let mut attenuations: Vec<f64> = attenuations
            .map(|(share, by)| (share + by).clamp(0.0, PARAMETERS.most_gloss))
            .collect();
        if let (Unknowns::Mirror(_), Some(&first)) = (unknowns, attenuations.first()) {
            // Of an even light metal shows its albedo's part, whatever its lobe is.
            let first = first.max(PARAMETERS.least_first);
            for share in &mut attenuations {
                *share = (*share / first).min(PARAMETERS.most_metal);
            }
        }
        Self {
            light: TableLight::new(terms),
            attenuations,
            higher,
        }
    }

    /// The shares of the bands of a light, which a Lambertian surface shows too.
    pub(crate) fn diffuse_attenuations(&self) -> Attenuations {
        [0, 1, 2].map(|l| self.attenuations.get(l).copied().unwrap_or(0.0))
    }
}

impl Unknowns<'_> {
    /// What the object is taken for.
    pub(crate) const fn material(&self) -> MaterialKind {
        match self {
            Self::Gloss(_) | Self::Light { .. } => MaterialKind::Diffuse,
            Self::Mirror(_) | Self::Reflection => MaterialKind::Metal,
        }
    }

    /// What the object would show of each band of a light if it blurred nothing.
    pub(crate) fn known_bands<'a>(&self, known: &'a KnownLight) -> &'a [GlossLight] {
        match self.material() {
            MaterialKind::Diffuse => known.bands(),
            MaterialKind::Metal => known.mirror(),
        }
    }

    /// The same of each band of the light that the object has shares of.
    pub(crate) fn bands(&self, estimate: &Estimate) -> Option<Vec<GlossLight>> {
        match self {
            Self::Gloss(known) | Self::Mirror(known) => Some(self.known_bands(known).to_vec()),
            Self::Light { .. } => Some(GlossLight::bands(&estimate.light.coefficients().ok()?)),
            Self::Reflection => Some(Vec::new()),
        }
    }

    pub(crate) fn layout(&self) -> Layout {
        match *self {
            Self::Gloss(known) | Self::Mirror(known) => Layout {
                light: 0,
                first: TERMS,
                higher: 0,
                attenuations: known.bands().len(),
            },
            Self::Light { bands } => Layout {
                light: TERMS,
                first: TERMS,
                higher: (bands * bands).clamp(TERMS, GLOSS_TERMS) - TERMS,
                attenuations: bands.min(LAMBERTIAN_BANDS),
            },
            Self::Reflection => Layout {
                light: 0,
                first: 0,
                higher: GLOSS_TERMS,
                attenuations: 0,
            },
        }
    }
}

/// Where the unknowns stand: of each channel terms of the light and of the higher bands of its gloss, then the shares.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    pub(crate) light: usize,
    /// The first term of the gloss that is free, and how many are.
    pub(crate) first: usize,
    pub(crate) higher: usize,
    pub(crate) attenuations: usize,
}

impl Layout {
    pub(crate) const fn of_channel(&self, channel: usize) -> usize {
        channel * (self.light + self.higher)
    }

    pub(crate) const fn count(&self) -> usize {
        self.of_channel(3) + self.attenuations
    }
}

/// What each unknown does to the curve of a pixel.
pub(crate) struct Columns<'a> {
    pub(crate) estimate: &'a Estimate,
    pub(crate) bands: Vec<GlossLight>,
    pub(crate) layout: Layout,
    pub(crate) model: &'a ShadingModel,
}

impl Columns<'_> {
    /// The unknowns that act on a channel of a pixel, and its harmonics for each.
    pub(crate) fn of(
        &self,
        normal: [f64; 3],
        albedo: [f64; 3],
    ) -> [Vec<(usize, [f64; COEFFICIENTS])>; 3] {
        let frame = &self.model.frame;
        let diffuse = lambertian_terms(frame.to_table(normal));
        let reflected = frame.to_table(reflected(normal));
        // What gloss shows does not depend on the albedo, and what metal shows is times it.
        let (gloss, colour) = match self.model.material {
            MaterialKind::Diffuse => (gloss_terms(normal[2], reflected), [1.0; 3]),
            MaterialKind::Metal => (mirror_terms(reflected), albedo),
        };
        let diffuse_attenuations = self.estimate.diffuse_attenuations();
        let bands: Vec<_> = self.bands[..self.layout.attenuations]
            .iter()
            .map(|band| band.harmonics_of(&gloss))
            .collect();
        [0, 1, 2].map(|channel| {
            let first = self.layout.of_channel(channel);
            let mut columns = Vec::with_capacity(self.layout.count());
            let light = diffuse
                .iter()
                .zip(LAMBERTIAN_IN_GLOSS)
                .take(self.layout.light);
            for (term, (at, factor)) in light {
                let share = diffuse_attenuations[band(at)] / factor;
                let mut harmonics = spread(term, albedo[channel]);
                add(&mut harmonics, &spread(&gloss[at], share));
                columns.push((first + columns.len(), harmonics));
            }
            for term in &gloss[self.layout.first..][..self.layout.higher] {
                columns.push((first + columns.len(), spread(term, colour[channel])));
            }
            let attenuations = self.layout.of_channel(3);
            let bands = bands.iter().enumerate();
            columns.extend(bands.map(|(l, harmonics)| {
                (
                    attenuations + l,
                    harmonics[channel].map(|coefficient| colour[channel] * coefficient),
                )
            }));
            columns
        })
    }
}

/// The band of a term of gloss.
pub(crate) const fn band(at: usize) -> usize {
    at.isqrt()
}

/// How much gloss shows of the first bands of a light that was found.
pub(crate) fn attenuations(model: &ShadingModel) -> Attenuations {
    let Ok(light) = model.light.coefficients() else {
        return [0.0; LAMBERTIAN_BANDS];
    };
    let mut bands = GlossLight::bands(&light).into_iter();
    [0; LAMBERTIAN_BANDS].map(|_| {
        bands
            .next()
            .map_or(0.0, |band| model.gloss.attenuation_of(&band))
    })
}

/// A term times a factor, among all harmonics.
fn spread(term: &HarmonicTerm, factor: f64) -> [f64; COEFFICIENTS] {
    let mut harmonics = [0.0; COEFFICIENTS];
    for (coefficient, part) in harmonics[term.coefficient..].iter_mut().zip(term.parts) {
        *coefficient = factor * part;
    }
    harmonics
}

fn add(harmonics: &mut [f64; COEFFICIENTS], others: &[f64; COEFFICIENTS]) {
    harmonics.iter_mut().zip(others).for_each(|(a, b)| *a += b);
}
