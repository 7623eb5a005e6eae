//! From known points and their pixels in one camera to its lens, its correction and what is not known
//! about them.

use super::{
    chart_poses::UncertainPoses,
    correction_basis::{Field, Functions, chained},
    evidence::{Mode, Posterior, SIDE, Search, Sums},
    greatest_evidence,
    jacobian::{ByNumbers, Sloped},
    layout::Layout,
    lens::{FIRST_EXPECTED, FIRST_OF_PRINCIPAL, FIRST_TANGENTIAL, Lens, OF_PUPIL, PARAMETERS},
    pose_jacobian::Motions,
    settings::{NOISE, OF_FIELD, Settings},
};

use crate::{
    Error, Result,
    geometry::{Pixel, Point3, ProjectionMatrix},
};
use nalgebra::Matrix2;
use wheatstone_numeric::{
    blocked_matrix::BlockedMatrix,
    levenberg_marquardt::{Patience, minimise},
    progress::Progress,
};

/// Sixteen equations for the eleven numbers that nothing is known of, so that the noise shows.
pub(super) const POINTS_NEEDED: usize = 8;

/// Waves of a camera at most: about twelve half waves a side, which resolve lengths down to a fifth
/// of half the picture; the strongest bumps of the synthetic rigs ask for a third.
const MOST_WAVES: usize = 120;

/// Times that settings and linearisation take turns: two to follow each other, one to spare.
const ROUNDS: usize = 3;

/// A camera on its way to be fitted.
pub(super) struct State<'a> {
    pub(super) pairs: &'a [(Point3, Pixel)],
    pub(super) lens: Lens,
    pub(super) field: Field,
    pub(super) weights: Vec<[f64; 2]>,
    /// Where the charts stand, if that is not certain.
    pub(super) charts: Option<UncertainPoses>,
}

pub(super) fn undetermined() -> Error {
    Error::Degenerate {
        problem: "the known points do not determine a camera".into(),
        hint: "show it points at two or more distances, over the whole picture".into(),
    }
}

/// Fits one camera, and where its charts stand if they are loose.
pub(super) fn fit_state<'a>(
    pairs: &'a [(Point3, Pixel)],
    start: &ProjectionMatrix,
    charts: Option<UncertainPoses>,
    progress: &dyn Progress,
) -> Result<(State<'a>, Posterior)> {
    let plain = Lens::from_projection(start).ok_or_else(undetermined)?;
    let mut best: Option<(State<'a>, Posterior)> = None;
    for layout in [Layout::Perspective, Layout::Equidistant] {
        let candidate = bare(pairs, &plain, layout, charts.clone(), progress)?;
        if let Some((state, posterior)) = candidate
            && best.as_ref().is_none_or(|(_, other)| posterior.evidence > other.evidence)
        {
            best = Some((state, posterior));
        }
    }
    let (state, Posterior { settings, .. }) = best.ok_or_else(undetermined)?;
    // Charts that stand elsewhere look like distortion.
    let is_certain = state.charts.is_none();
    let choose = |sums: &Sums, field: &Field| {
        greatest_evidence::chosen(sums, field, (settings, is_certain), progress)
    };
    with_correction(state, choose, progress)
}

/// Fits a camera from where a fit to nearly the same points ended: no other layout and no other hill is tried.
pub(super) fn refit_state<'a>(
    pairs: &'a [(Point3, Pixel)],
    (lens, settings): (&Lens, Settings),
    progress: &dyn Progress,
) -> Result<(State<'a>, Posterior)> {
    let (lens, field) = (lens.clone(), Field::none());
    let state = State { pairs, lens, field, weights: Vec::new(), charts: None };
    let choose = |sums: &Sums, field: &Field| Ok(sums.climb(field, settings, Search::ALL));
    with_correction(state, choose, progress)
}

/// Fits lens and correction together, with settings that are chosen by the sums about the bare lens.
fn with_correction<'a>(
    mut state: State<'a>,
    choose: impl Fn(&Sums, &Field) -> Result<Option<Posterior>>,
    progress: &dyn Progress,
) -> Result<(State<'a>, Posterior)> {
    state.lens = state.lens.seen_from_its_centre();
    let seen: Option<Vec<(Pixel, f64)>> = state
        .pairs
        .iter()
        .map(|(world, pixel)| Some((*pixel, state.lens.project(*world)?.nearness)))
        .collect();
    let most = MOST_WAVES.min(state.pairs.len() / 2);
    state.field = Field::new(&seen.ok_or_else(undetermined)?, state.lens.reach, most);
    state.weights = vec![[0.0; 2]; state.field.len()];
    let sums = state.sums().ok_or_else(undetermined)?;
    progress.check()?;
    let first = choose(&sums, &state.field)?;
    let posterior = state.alternate(sums, first, Search::ALL, progress)?;
    Ok((state, posterior.ok_or_else(undetermined)?))
}

/// The lens of one layout without correction, and how well it explains the points.
fn bare<'a>(
    pairs: &'a [(Point3, Pixel)],
    plain: &Lens,
    layout: Layout,
    charts: Option<UncertainPoses>,
    progress: &dyn Progress,
) -> Result<Option<(State<'a>, Posterior)>> {
    let start = plain.clone().laid_out(layout, pairs);
    let Some(lens) = least_squares(pairs, &start, progress)? else { return Ok(None) };
    let field = Field::none();
    let mut state = State { pairs, lens, field, weights: Vec::new(), charts };
    let free = std::array::from_fn(|setting| !OF_FIELD.contains(&setting));
    let search = Search { free, ..Search::ALL };
    let Some(sums) = state.sums() else { return Ok(None) };
    let noise = (sums.squares / (2 * pairs.len()) as f64).sqrt();
    let settings = Settings::start(noise);
    let first = sums.climb(&state.field, settings, search);
    let posterior = state.alternate(sums, first, search, progress)?;
    Ok(posterior.map(|posterior| (state, posterior)))
}

/// Plain least squares from a start that may be far off, as that of a fisheye is.
fn least_squares(
    pairs: &[(Point3, Pixel)],
    start: &Lens,
    progress: &dyn Progress,
) -> Result<Option<Lens>> {
    // Standard deviations of the lens's terms, in units of one pixel's error each: they only keep
    // the search from wandering where points are few.
    let loose = |index: usize| match index {
        FIRST_OF_PRINCIPAL..FIRST_TANGENTIAL => 1.0,
        OF_PUPIL => 1e-6,
        _ => 0.1,
    };
    let patience = Patience { steps: 60, least_gain: 1e-4 };
    let found = minimise(&[0.0; PARAMETERS], patience, progress, |step, normal| {
        let step: [f64; PARAMETERS] = step.try_into().ok()?;
        let lens = start.moved(&step);
        let sloped = Sloped::after(&lens, start, &step);
        let mut cost = 0.0;
        for (world, pixel) in pairs {
            let (seen, slopes) = sloped.project(*world)?;
            let error = seen.pixel - pixel;
            cost += 0.5 * error.norm_squared();
            let [x, y] = [0, 1].map(|axis| slopes.row(axis).transpose());
            normal.add_pixel([x.as_slice(), y.as_slice()], error.into());
        }
        for (index, value) in lens.numbers().iter().enumerate().skip(FIRST_EXPECTED) {
            let error = value / loose(index);
            cost += 0.5 * error * error;
            normal.add_sparse(&[(index, 1.0 / loose(index))], error);
        }
        Some(cost)
    });
    match found {
        Ok(found) => Ok(found.parameters.as_slice().try_into().ok().map(|step| start.moved(step))),
        Err(wheatstone_numeric::Error::Cancelled) => Err(Error::Cancelled),
        Err(_) => Ok(None),
    }
}

impl State<'_> {
    /// Settings and linearisation take turns, from `sums` about the present state and the posterior that was
    /// found by them; ends at the mode, with the posterior there.
    pub(super) fn alternate(
        &mut self,
        mut sums: Sums,
        first: Option<Posterior>,
        search: Search,
        progress: &dyn Progress,
    ) -> Result<Option<Posterior>> {
        let Some(mut posterior) = first else { return Ok(None) };
        for round in 0..=ROUNDS {
            progress.check()?;
            let Some((moved, there)) = self.solve(sums, &posterior) else { return Ok(None) };
            // What was chosen for a state that does not move is chosen.
            if !moved {
                break;
            }
            let settings = posterior.settings;
            let next = if round < ROUNDS {
                there.climb(&self.field, settings, search)
            } else {
                there.posterior(&self.field, settings)
            };
            let Some(next) = next else { return Ok(None) };
            (sums, posterior) = (there, next);
        }
        Ok(Some(posterior))
    }

    /// Sums about the present lens and weights; `None` where a point does not project.
    pub(super) fn sums(&self) -> Option<Sums> {
        let points = self.pairs.len();
        let sloped = Sloped::new(&self.lens);
        let numbers = self.numbers();
        let mut field = BlockedMatrix::zeros(self.field.len(), points);
        let mut sides = BlockedMatrix::zeros(2 * SIDE, points);
        let mut motions = Motions::default();
        let mut plain = Vec::with_capacity(self.field.len());
        let mut left = 0.0;
        let mut functions = Functions::new(&self.field);
        for (row, (world, pixel)) in self.placed().enumerate() {
            let (seen, slopes) = sloped.project(world)?;
            let values = functions.at(seen.pixel, seen.nearness);
            plain.clear();
            plain.extend(values.iter().map(|value| value[0]));
            field.fill_column(row, &plain);
            let sum = self.field.sum(values, &self.weights);
            let slopes = displaced(&slopes, &sum);
            let errors = pixel - seen.pixel;
            plain.clear();
            for axis in 0..2 {
                plain.extend(slopes.row(axis).iter());
                plain.push(errors[axis]);
                left += (errors[axis] - sum[axis][0]).powi(2);
            }
            sides.fill_column(row, &plain);
            let by_chart = self.charts.as_ref().and_then(|charts| {
                let by_world = [0, 1].map(|axis: usize| {
                    seen.slopes.row(axis).transpose() + chained(&sum[axis], &seen)
                });
                charts.slopes(row, world, &by_world)
            });
            motions.rows.extend(by_chart.map(|(first, slopes)| (row, first, slopes)));
        }
        let mut sums = Sums { left, ..summed((&field, &sides), numbers) };
        motions.add_to(&mut sums, (&field, &sides));
        Some(sums)
    }

    /// The points where the charts are now believed to stand, with their pixels.
    fn placed(&self) -> impl Iterator<Item = (Point3, Pixel)> {
        self.pairs.iter().enumerate().map(|(row, (world, pixel))| {
            let place = |charts: &UncertainPoses| charts.place(row, *world);
            (self.charts.as_ref().map_or(*world, place), *pixel)
        })
    }

    /// What is expected near 0: the lens's numbers, and how far free charts have moved.
    fn numbers(&self) -> Vec<f64> {
        let mut numbers = self.lens.numbers().to_vec();
        numbers.extend(self.charts.iter().flat_map(UncertainPoses::free_numbers));
        numbers
    }

    /// What the fit makes least at fixed settings, of the sums about the present lens and weights.
    fn objective(&self, sums: &Sums, settings: &Settings) -> f64 {
        let precision = settings.value(NOISE).powi(-2);
        sums.left * precision + settings.penalty(&self.field, &self.weights, &sums.numbers)
    }

    /// Goes towards a mode, the step halved until it is better than where it started, `before`; how good that
    /// is, with the sums there. `None` where no step helps. A step is hardly ever halved: sums are made at once.
    fn advance(&mut self, mode: &Mode, settings: &Settings, before: f64) -> Option<(f64, Sums)> {
        let old = (self.lens.clone(), self.weights.clone(), self.charts.clone());
        let (old_lens, old_weights, old_charts) = &old;
        for halvings in 0..12 {
            let share = 0.5_f64.powi(halvings);
            let step = std::array::from_fn(|index| share * mode.step[index]);
            self.lens = old_lens.moved(&step);
            let weights = old_weights.iter().zip(&mode.weights);
            let between = |(old, new): (&[f64; 2], &[f64; 2])| {
                [0, 1].map(|axis: usize| old[axis] + share * (new[axis] - old[axis]))
            };
            self.weights = weights.map(between).collect();
            self.charts = old_charts.clone();
            if let Some(charts) = &mut self.charts {
                charts.advance(share, &mode.step.as_slice()[PARAMETERS..]);
            }
            let there = self.sums().map(|sums| (self.objective(&sums, settings), sums));
            if let Some(better) = there.filter(|(after, _)| *after < before) {
                return Some(better);
            }
        }
        (self.lens, self.weights, self.charts) = old;
        None
    }

    /// Goes from `sums`, about the present state, to the mode at the settings of `first`, their posterior:
    /// whether that moved it, and the sums there. `None` where no camera is determined.
    pub(super) fn solve(&mut self, mut sums: Sums, first: &Posterior) -> Option<(bool, Sums)> {
        let settings = first.settings;
        let mut here = self.objective(&sums, &settings);
        let mut moved = false;
        let mut next;
        let mut mode = &first.mode;
        for step in 0..MOST_STEPS {
            // No step brings what the mode, for which the camera is linear, does not promise.
            let better = (here - mode.least >= ENOUGH).then(|| self.advance(mode, &settings, here));
            let Some((after, there)) = better.flatten() else { break };
            (moved, sums) = (true, there);
            if here - after < ENOUGH {
                break;
            }
            here = after;
            if step + 1 < MOST_STEPS {
                next = sums.mode(&self.field, settings)?;
                mode = &next;
            }
        }
        Some((moved, sums))
    }
}

/// A gain that is not worth a step: the objective is in units of a squared standard deviation.
const ENOUGH: f64 = 1e-5;

/// Sums over points, a column each: of the field's functions, and of both coordinates' slopes and errors.
fn summed((field, sides): (&BlockedMatrix, &BlockedMatrix), numbers: Vec<f64>) -> Sums {
    let (mixed, own) = (field.product(sides), sides.square());
    let lens = |first: usize| own.view((first, first), (PARAMETERS, PARAMETERS));
    let errors = |first: usize| own.view((first, first + PARAMETERS), (PARAMETERS, 1));
    let size = numbers.len();
    Sums {
        field: field.square(),
        mixed: [0, SIDE].map(|first| {
            let of_lens = mixed.columns(first, PARAMETERS).into_owned();
            of_lens.resize_horizontally(size, 0.0)
        }),
        field_errors: [0, SIDE].map(|first| mixed.column(first + PARAMETERS).into_owned()),
        lens: (lens(0) + lens(SIDE)).resize(size, size, 0.0),
        lens_errors: (errors(0) + errors(SIDE)).column(0).into_owned().resize_vertically(size, 0.0),
        squares: own[(PARAMETERS, PARAMETERS)] + own[(SIDE + PARAMETERS, SIDE + PARAMETERS)],
        left: 0.0,
        points: field.shape().1,
        numbers,
    }
}

/// Most Gauss-Newton steps at fixed settings. Two or three are the rule; where points lie so flat that
/// focal length and distance are hard to tell apart the valley is long: ten steps left the held-out
/// error of a target in water a third above that of sixty.
const MOST_STEPS: usize = 60;

/// Slopes of the corrected pixel by the lens's numbers, from those of the plain pixel and
/// from the field with its own slopes.
pub(super) fn displaced(slopes: &ByNumbers, field: &[[f64; 4]; 2]) -> ByNumbers {
    let chain = Matrix2::from_fn(|row, column| {
        field[row][1 + column] + if row == column { 1.0 } else { 0.0 }
    });
    chain * slopes
}
