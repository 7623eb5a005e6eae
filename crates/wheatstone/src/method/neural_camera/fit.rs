//! From known points and their pixels in one camera to its lens, its correction and what is not known
//! about them.

use super::{
    corrected::CorrectedCamera,
    evidence::{LENGTH, NOISE, PARALLAX, Posterior, SETTINGS, Settings, Sums, WAVES},
    field::Field,
    lens::{FIRST_OF_LENS, FIRST_TANGENTIAL, Layout, Lens, PARAMETERS},
};
use crate::{
    Error, Result,
    geometry::{Pixel, Point3, ProjectionMatrix},
    numeric::levenberg_marquardt::{Patience, minimise},
    progress::Progress,
};
use nalgebra::{DMatrix, DVector, SMatrix};

/// Waves that cover a picture down to lengths of a ninth of its width, below which lenses are smooth;
/// twice as many change no figure of the study.
const MOST_WAVES: usize = 120;

/// Times that settings and linearisation take turns; the third changes the fourth digit.
const ROUNDS: usize = 3;

/// A camera on its way to be fitted.
struct State<'a> {
    pairs: &'a [(Point3, Pixel)],
    lens: Lens,
    field: Field,
    weights: Vec<[f64; 2]>,
}

/// Fits one camera to the points that it saw, from its projection matrix.
pub(super) fn fit_camera(
    pairs: &[(Point3, Pixel)],
    start: &ProjectionMatrix,
    progress: &dyn Progress,
) -> Result<CorrectedCamera> {
    let undetermined = || Error::Degenerate {
        problem: "the known points do not determine a camera".into(),
        hint: "show it points at two or more distances that fill the picture".into(),
    };
    let plain = Lens::from_projection(start).ok_or_else(undetermined)?;
    let mut best: Option<(Lens, Posterior)> = None;
    for layout in [Layout::Perspective, Layout::Equidistant] {
        let candidate = bare(pairs, &plain, layout, progress)?;
        if let Some((lens, posterior)) = candidate
            && best.as_ref().is_none_or(|(_, other)| posterior.evidence > other.evidence)
        {
            best = Some((lens, posterior));
        }
    }
    let (lens, posterior) = best.ok_or_else(undetermined)?;
    let seen: Option<Vec<(Pixel, f64)>> = pairs
        .iter()
        .map(|(world, pixel)| Some((*pixel, lens.project(*world)?.nearness)))
        .collect();
    let field = Field::new(&seen.ok_or_else(undetermined)?, MOST_WAVES.min(pairs.len() / 2));
    let weights = vec![[0.0; 2]; field.len()];
    let mut state = State { pairs, lens, field, weights };
    let posterior = corrected(&mut state, posterior.settings, progress)?.ok_or_else(undetermined)?;
    CorrectedCamera::new(state.lens, &state.field, &posterior).ok_or_else(undetermined)
}

/// The lens of one layout without correction, and how well it explains the points.
fn bare(
    pairs: &[(Point3, Pixel)],
    plain: &Lens,
    layout: Layout,
    progress: &dyn Progress,
) -> Result<Option<(Lens, Posterior)>> {
    let start = plain.clone().laid_out(layout, pairs.iter().map(|(world, _)| world));
    let Some(lens) = least_squares(pairs, &start, progress)? else { return Ok(None) };
    let lens = Lens { bend: lens.bend, ..lens };
    let field = Field::new(&[(Pixel::origin(), 1.0)], 0).pruned(|_| false);
    let mut state = State { pairs, lens, field, weights: Vec::new() };
    let free = [true, true, true, false, false, false, false];
    let Some(sums) = state.sums() else { return Ok(None) };
    let noise = (sums.squares / (2 * pairs.len()) as f64).sqrt();
    let mut settings = Settings::start(noise);
    let mut last = None;
    for _ in 0..ROUNDS {
        let Some(posterior) =
            state.sums().and_then(|sums| sums.climb(&state.field, settings, free))
        else {
            break;
        };
        settings = posterior.settings;
        if !state.advance(&posterior) {
            break;
        }
        last = Some(posterior);
    }
    Ok(last.map(|posterior| (state.lens, posterior)))
}

/// Plain least squares from a start that may be far off, as that of a fisheye is.
fn least_squares(
    pairs: &[(Point3, Pixel)],
    start: &Lens,
    progress: &dyn Progress,
) -> Result<Option<Lens>> {
    // Standard deviations of the lens's terms, in units of one pixel's error each: they only keep
    // the search from wandering where points are few.
    let loose = |index: usize| if index < FIRST_TANGENTIAL { 1.0 } else { 0.1 };
    let patience = Patience { steps: 60, least_gain: 1e-6 };
    let mut scratch = vec![0.0; PARAMETERS];
    let found = minimise(&[0.0; PARAMETERS], patience, progress, |step, mut normal| {
        let step: [f64; PARAMETERS] = step.try_into().ok()?;
        let lens = start.moved(&step);
        let shifted = normal.is_some().then(|| {
            let by = |index: usize, size: f64| {
                let mut step = step;
                step[index] += size;
                start.moved(&step)
            };
            (0..PARAMETERS).map(|i| (by(i, 6e-6), by(i, -6e-6))).collect::<Vec<_>>()
        });
        let mut cost = 0.0;
        for (world, pixel) in pairs {
            let error = lens.project(*world)?.pixel - pixel;
            cost += 0.5 * error.norm_squared();
            if let (Some(normal), Some(shifted)) = (normal.as_deref_mut(), &shifted) {
                let slopes = Lens::slopes_by_parameters(shifted, *world)?;
                normal.add(slopes.row(0).transpose().as_slice(), error.x);
                normal.add(slopes.row(1).transpose().as_slice(), error.y);
            }
        }
        for index in FIRST_OF_LENS..PARAMETERS {
            let error = lens.bend[index - FIRST_OF_LENS] / loose(index);
            cost += 0.5 * error * error;
            if let Some(normal) = normal.as_deref_mut() {
                scratch.fill(0.0);
                scratch[index] = 1.0 / loose(index);
                normal.add(&scratch, error);
            }
        }
        Some(cost)
    });
    match found {
        Ok(found) => Ok(found.parameters.as_slice().try_into().ok().map(|step| start.moved(step))),
        Err(Error::Cancelled) => Err(Error::Cancelled),
        Err(_) => Ok(None),
    }
}

/// Fits lens and correction together.
fn corrected(
    state: &mut State<'_>,
    settings: Settings,
    progress: &dyn Progress,
) -> Result<Option<Posterior>> {
    let Some(sums) = state.sums() else { return Ok(None) };
    // The evidence may have two hills: short waves and long ones.
    let mut best: Option<Posterior> = None;
    for length in [0.25, 0.8] {
        progress.check()?;
        let mut start = settings;
        start.logs[WAVES] = settings.logs[NOISE];
        start.logs[PARALLAX] = settings.logs[NOISE];
        start.logs[LENGTH] = libm::log(length);
        let Some(found) = sums.climb(&state.field, start, [true; SETTINGS]) else { continue };
        if best.as_ref().is_none_or(|other| found.evidence > other.evidence) {
            best = Some(found);
        }
    }
    for _ in 0..ROUNDS {
        progress.check()?;
        let Some(posterior) = &best else { return Ok(None) };
        let settings = posterior.settings;
        if !state.advance(posterior) {
            return Ok(None);
        }
        let Some(sums) = state.sums() else { return Ok(None) };
        best = sums.climb(&state.field, settings, [true; SETTINGS]);
    }
    if let Some(posterior) = &best {
        state.advance(posterior);
    }
    Ok(best)
}

impl State<'_> {
    /// Sums about the present lens and weights; `None` where a point does not project.
    fn sums(&self) -> Option<Sums> {
        let (points, functions) = (self.pairs.len(), self.field.len());
        let shifted = self.lens.shifted();
        let mut field = DMatrix::zeros(points, functions);
        let mut lens = [0, 1].map(|_| DMatrix::zeros(points, PARAMETERS));
        let mut errors = [0, 1].map(|_| DVector::zeros(points));
        for (row, (world, pixel)) in self.pairs.iter().enumerate() {
            let seen = self.lens.project(*world)?;
            let values = self.field.values(seen.pixel, seen.nearness);
            values.iter().enumerate().for_each(|(index, value)| field[(row, index)] = value[0]);
            let slopes = Lens::slopes_by_parameters(&shifted, *world)?;
            let slopes = displaced(&slopes, &self.field.sum(&values, &self.weights));
            for axis in 0..2 {
                lens[axis].set_row(row, &slopes.row(axis));
                errors[axis][row] = pixel[axis] - seen.pixel[axis];
            }
        }
        let mut numbers = [0.0; PARAMETERS];
        numbers[FIRST_OF_LENS..].copy_from_slice(&self.lens.bend);
        Some(Sums {
            field: field.tr_mul(&field),
            mixed: [field.tr_mul(&lens[0]), field.tr_mul(&lens[1])],
            field_errors: [field.tr_mul(&errors[0]), field.tr_mul(&errors[1])],
            lens: lens[0].tr_mul(&lens[0]) + lens[1].tr_mul(&lens[1]),
            lens_errors: lens[0].tr_mul(&errors[0]) + lens[1].tr_mul(&errors[1]),
            squares: errors[0].norm_squared() + errors[1].norm_squared(),
            points,
            numbers,
        })
    }

    /// Takes the step and the weights of a posterior, the step halved until all points project.
    fn advance(&mut self, posterior: &Posterior) -> bool {
        let taken = (0..10).find_map(|halvings| {
            let share = 0.5_f64.powi(halvings);
            let step = std::array::from_fn(|index| share * posterior.step[index]);
            let lens = self.lens.moved(&step);
            self.pairs.iter().all(|(world, _)| lens.project(*world).is_some()).then_some(lens)
        });
        let Some(lens) = taken else { return false };
        self.lens = lens;
        self.weights.clone_from(&posterior.weights);
        true
    }
}

/// Slopes of the corrected pixel by the lens's numbers, from those of the plain pixel and the
/// nearness and from the field with its own slopes.
pub(super) fn displaced(
    slopes: &SMatrix<f64, 3, PARAMETERS>,
    field: &[[f64; 4]; 2],
) -> SMatrix<f64, 2, PARAMETERS> {
    let chain = SMatrix::<f64, 2, 3>::from_fn(|row, column| {
        field[row][1 + column] + if row == column { 1.0 } else { 0.0 }
    });
    chain * slopes
}
