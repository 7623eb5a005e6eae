//! Charts that did not stand where they were said to: found on rigs whose truth is known, and on real
//! data by cameras that had no say in it.

use super::data;
use nalgebra::Vector3;
use rayon::prelude::*;
use wheatstone::{
    Error,
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::cross_validate,
    fit::stage::{SolvedStage, StagePrior, solve, suspect},
    geometry::{Point3, StageCovariance},
    method::{AnyMethod, CalibratedMap, Reconstructor},
    numeric::{least_squares, progress::Silent, statistics::root_mean_square},
    synthetic::{
        Noise, Rig, Stage, StageError, chart_correspondences, misplaced_correspondences,
        random_correspondences,
    },
    tables::{self, Duplicates},
};

/// Near charts, so that pixels locate points to 0.2 mm and a stage that errs by 0.4 mm shows.
const STAGE: Stage = Stage { near: 20.0, far: 50.0, step: 5.0 };
const NOISE: Noise = Noise::Normal(0.05);

/// A stage that errs, as it is and as it is said to be.
struct World {
    rig: Rig,
    chart: AnyChart,
    given: Dataset,
    actual: Dataset,
}

impl World {
    fn new(rig: &str, error: StageError, seed: u64) -> Self {
        let rig = Rig::named(rig, 2).unwrap();
        // As large as the paper's chart looks at its farthest place.
        let pitch = rig.chart_pitch() * STAGE.far / 140.0;
        let chart: AnyChart = LineGrid { pitch, ..LineGrid::default() }.into();
        let nominal = STAGE.views().unwrap();
        let places = error.apply(&nominal, 900 + seed);
        let noise = (NOISE, seed);
        let most = Some(60 * nominal.len());
        let given = misplaced_correspondences(&rig, &chart, (&places, &nominal), noise, most);
        let actual = chart_correspondences(&rig, &chart, &places, noise, most);
        Self { rig, chart, given, actual }
    }

    /// By how much the middle of each view's points was moved.
    fn offsets(&self) -> Vec<[f64; 3]> {
        let mut sums = vec![([0.0; 3], 0.0); self.given.views.len()];
        for ((stood, row), (said, _)) in self.actual.known().zip(self.given.known()) {
            let (sum, count) = &mut sums[row.view];
            (0..3).for_each(|axis| sum[axis] += (stood - said)[axis]);
            *count += 1.0;
        }
        sums.into_iter().map(|(sum, count)| sum.map(|value| value / count)).collect()
    }

    /// Errors of the observable part of the offsets: in centimetres, and in their stated sigmas.
    fn errors(&self, solved: &SolvedStage) -> (Vec<f64>, Vec<f64>) {
        let (mut errors, mut normalised) = (Vec::new(), Vec::new());
        let truth = self.offsets();
        let places: Vec<f64> =
            STAGE.views().unwrap().iter().flat_map(|(_, pose)| [1.0, pose.translation.z]).collect();
        for axis in 0..3 {
            let wrong: Vec<f64> =
                solved.offsets.iter().zip(&truth).map(|(o, t)| o.offset[axis] - t[axis]).collect();
            let line = least_squares::solve(&places, 2, &wrong, 1).unwrap();
            for (view, offset) in solved.offsets.iter().enumerate() {
                let along = line[0] + line[1] * places[2 * view + 1];
                errors.push(wrong[view] - along);
                normalised.push((wrong[view] - along) / offset.observable_sigma[axis]);
            }
        }
        (errors, normalised)
    }

    /// Error of points elsewhere, of a fit to `data`, less the affine map that no pixel can show.
    fn held_out(&self, data: &Dataset) -> f64 {
        let range = (STAGE.near, STAGE.far);
        let exam = random_correspondences(&self.rig, &self.chart, range, (NOISE, 77), 1000);
        let method = AnyMethod::named("neural-camera").unwrap();
        let fit = method.fit_checked(data, 0, &Silent).unwrap().reconstructor;
        let (mut found, mut truth) = (Vec::new(), Vec::new());
        for (world, row) in exam.known() {
            let point = fit.locate(&row.pixels).unwrap().point;
            found.extend([1.0, point.x, point.y, point.z]);
            truth.extend([world.x, world.y, world.z]);
        }
        let map = least_squares::solve(&found, 4, &truth, 3).unwrap();
        let mapped = nalgebra::DMatrix::from_row_slice(truth.len() / 3, 4, &found) * map;
        let errors: Vec<f64> =
            mapped.transpose().iter().zip(&truth).map(|(found, truth)| found - truth).collect();
        root_mean_square(&errors)
    }
}

/// Of points elsewhere, located after the stage was solved for: their mean square error, and the shares of them
/// within their 68 % and 95 % ellipsoids.
#[derive(Clone, Copy, Default)]
struct Held {
    square: f64,
    p68: f64,
    p95: f64,
}

/// Squared Mahalanobis radii of those ellipsoids.
const RADII: [f64; 2] = [3.506, 7.815];

impl World {
    /// By how much the nominal places, as a whole, differ from the true ones at a depth: the best line through
    /// the differences, which no pixel shows.
    fn frame_error(&self, depth: f64) -> Vector3<f64> {
        let places: Vec<f64> =
            STAGE.views().unwrap().iter().flat_map(|(_, pose)| [1.0, pose.translation.z]).collect();
        let wrong: Vec<f64> = self.offsets().into_iter().flatten().collect();
        let line = least_squares::solve(&places, 2, &wrong, 3).unwrap();
        Vector3::from_fn(|axis, _| line[(0, axis)] + line[(1, axis)] * depth)
    }

    /// Of a fit to `data` with charts that leave points as uncertain as `stage` has it: against the true places,
    /// or against those in the frame of the nominal ones.
    fn held(
        &self,
        data: &Dataset,
        stage: Option<&StageCovariance>,
        in_nominal_frame: bool,
    ) -> Held {
        let range = (STAGE.near, STAGE.far);
        let exam = random_correspondences(&self.rig, &self.chart, range, (NOISE, 78), 400);
        let method = AnyMethod::named("neural-camera").unwrap();
        let fit = method.fit_checked(data, 0, &Silent).unwrap().reconstructor;
        let map = CalibratedMap::new(&*fit).with_uncertainty(None, None, stage);
        let mut held = Held::default();
        for (world, row) in exam.known() {
            let found = map.locate(&row.pixels).unwrap();
            let mut error = found.point - world;
            if in_nominal_frame {
                error += self.frame_error(world.z);
            }
            let distance2 = error.dot(&(found.covariance.try_inverse().unwrap() * error));
            held.square += error.norm_squared() / 400.0;
            held.p68 += f64::from(u8::from(distance2 < RADII[0])) / 400.0;
            held.p95 += f64::from(u8::from(distance2 < RADII[1])) / 400.0;
        }
        held
    }
}

fn mean(all: &[Held]) -> Held {
    let of = |part: fn(&Held) -> f64| all.iter().map(part).sum::<f64>() / all.len() as f64;
    Held { square: of(|h| h.square), p68: of(|h| h.p68), p95: of(|h| h.p95) }
}

#[test]
fn what_no_pixel_shows_stays_nominal() {
    ["paper", "water", "glass", "scheimpflug"].into_par_iter().for_each(|rig| {
        let error = StageError { offset: 0.04, rotation: 0.0 };
        let run = |seed: u64| {
            let world = World::new(rig, error, 20 + seed);
            let solved = solve(&world.given, &prior(), &Silent).unwrap();
            let relative = solved.uncertainty.relative();
            let best = world.held(&world.actual, None, false);
            (best, world.held(&solved.data, Some(&relative), true))
        };
        let (best, reached): (Vec<Held>, Vec<Held>) = (0..4).map(run).unzip();
        let (best, reached) = (mean(&best), mean(&reached));
        let ratio = (reached.square / best.square).sqrt();
        assert!(ratio < 1.02, "{rig}: {ratio} of the fit with true places");
        let Held { p68, p95, .. } = reached;
        assert!((0.63..0.73).contains(&p68) && (0.92..0.98).contains(&p95), "{rig}: {p68} {p95}");
    });
}

#[test]
fn error_bars_hold_what_no_pixel_shows() {
    let error = StageError { offset: 0.04, rotation: 0.0 };
    let run = |seed: u64| {
        let world =
            World::new(["paper", "water", "scheimpflug"][seed as usize % 3], error, 40 + seed);
        let solved = solve(&world.given, &prior(), &Silent).unwrap();
        let places: Vec<f64> =
            STAGE.views().unwrap().iter().map(|(_, p)| p.translation.z).collect();
        let (middle, count) = (35.0, places.len() as f64);
        let squares: f64 = places.iter().map(|z| (z - middle).powi(2)).sum();
        for depth in [20.0, 35.0, 60.0] {
            // Of a line through places that err independently.
            let expected = 0.04_f64.powi(2) * (1.0 / count + (depth - middle).powi(2) / squares);
            let frame = solved.uncertainty.frame(Point3::new(0.0, 0.0, depth));
            (0..3).for_each(|axis| assert!((frame[(axis, axis)] / expected - 1.0).abs() < 0.02));
        }
        world.held(&solved.data, Some(&solved.uncertainty), false)
    };
    let Held { p68, p95, .. } = mean(&(0..30).into_par_iter().map(run).collect::<Vec<_>>());
    // All points of a world share its frame's error: thirty worlds are thirty draws.
    assert!((0.55..0.80).contains(&p68) && (0.88..0.99).contains(&p95), "{p68} {p95}");
}

fn prior() -> StagePrior {
    StagePrior::of(0.04)
}

const ERROR: StageError = StageError { offset: 0.04, rotation: 0.001 };
const NONE: StageError = StageError { offset: 0.0, rotation: 0.0 };

#[test]
fn charts_are_found_where_they_stood_behind_any_optics() {
    ["paper", "water", "glass", "bump", "fisheye"].into_par_iter().for_each(|rig| {
        let world = World::new(rig, ERROR, 1);
        let solved = solve(&world.given, &prior(), &Silent).unwrap();
        let (errors, normalised) = world.errors(&solved);
        let rms = root_mean_square(&errors);
        assert!(rms < 0.002, "{rig}: {rms} cm");
        let normalised = root_mean_square(&normalised);
        assert!(normalised < 1.5, "{rig}: errors are {normalised} of their sigmas");
        assert!(solved.significance.is_clear(), "{rig}: {:?}", solved.significance);
        let estimated = solved.significance.estimated_sigma / 0.04;
        assert!((0.6..1.6).contains(&estimated), "{rig}: {estimated} of the stage's sigma");
        let (best, reached) = (world.held_out(&world.actual), world.held_out(&solved.data));
        assert!(reached < 1.05 * best, "{rig}: {reached} instead of {best}");
        if rig == "water" {
            let uncorrected = world.held_out(&world.given);
            assert!(uncorrected > 1.2 * best, "{rig}: {uncorrected} shows no stage error");
        }
    });
}

#[test]
fn a_sigma_that_is_wrong_by_a_factor_does_no_harm() {
    [("glass", 0.12), ("paper", 0.013)].into_par_iter().for_each(|(rig, sigma)| {
        let world = World::new(rig, ERROR, 2);
        let solved = solve(&world.given, &StagePrior::of(sigma), &Silent).unwrap();
        let rms = root_mean_square(&world.errors(&solved).0);
        assert!(rms < 0.004, "{rig}, {sigma}: {rms} cm");
        let (best, reached) = (world.held_out(&world.actual), world.held_out(&solved.data));
        assert!(reached < 1.10 * best, "{rig}, {sigma}: {reached} instead of {best}");
    });
}

#[test]
fn a_good_stage_is_left_alone() {
    let outcomes: Vec<(f64, f64)> = (0..4_u64)
        .into_par_iter()
        .map(|seed| {
            let world = World::new(["paper", "water", "bump"][seed as usize % 3], NONE, seed);
            let guess = suspect(&world.given, &Silent).unwrap();
            assert!(!guess.is_clear() && guess.estimated_sigma < 0.004, "{seed}: {guess:?}");
            let solved = solve(&world.given, &prior(), &Silent).unwrap();
            assert!(!solved.significance.is_clear(), "{seed}: {:?}", solved.significance);
            let (errors, normalised) = world.errors(&solved);
            (root_mean_square(&errors), root_mean_square(&normalised))
        })
        .collect();
    let (errors, normalised): (Vec<f64>, Vec<f64>) = outcomes.into_iter().unzip();
    assert!(root_mean_square(&errors) < 0.0015, "{errors:?} cm were invented");
    let spread = root_mean_square(&normalised);
    assert!((0.6..1.2).contains(&spread), "{normalised:?} of their sigmas");
}

#[test]
fn a_bad_stage_is_suspected_and_its_size_estimated() {
    for rig in ["paper", "water"] {
        let guess = suspect(&World::new(rig, ERROR, 3).given, &Silent).unwrap();
        assert!(guess.is_clear(), "{rig}: {guess:?}");
        let ratio = guess.estimated_sigma / ERROR.offset;
        assert!((0.6..1.6).contains(&ratio), "{rig}: {guess:?}");
    }
}

#[test]
fn layers_do_for_views_and_too_few_views_are_refused() {
    let world = World::new("paper", ERROR, 4);
    let named = solve(&world.given, &prior(), &Silent).unwrap();
    let mut nameless = world.given.clone();
    nameless.views.clear();
    nameless.correspondences.iter_mut().for_each(|row| row.view = 0);
    let layered = solve(&nameless, &prior(), &Silent).unwrap();
    assert_eq!(layered.offsets[0].view, "Z = 20");
    for (a, b) in named.offsets.iter().zip(&layered.offsets) {
        // The points come in another order: sums differ by rounding.
        (0..3).for_each(|axis| assert!((a.offset[axis] - b.offset[axis]).abs() < 1e-6));
    }

    let mut scattered = world.actual.clone();
    scattered.views.clear();
    for two in [scattered, world.given.subset(|_, row| row.view < 2)] {
        let refused = solve(&two, &prior(), &Silent).unwrap_err();
        assert!(matches!(refused, Error::Degenerate { .. }), "{refused}");
    }
}

#[test]
fn a_view_may_be_known_better_than_the_others() {
    let world = World::new("paper", ERROR, 5);
    let held = StagePrior { views: vec![("035".into(), 0.0)], ..prior() };
    let solved = solve(&world.given, &held, &Silent).unwrap();
    let view = solved.offsets.iter().find(|offset| offset.view == "035").unwrap();
    assert_eq!((view.offset, view.sigma), ([0.0; 3], [0.0; 3]));
    assert!(root_mean_square(&world.errors(&solved).0) < 0.002);
    // Nor need it turn, and two views that are held leave nothing of the frame to be uncertain.
    let unturned = StagePrior { rotation_sigma: Some(0.0), ..prior() };
    let solved = solve(&world.given, &unturned, &Silent).unwrap();
    assert!(solved.offsets.iter().all(|offset| offset.rotation == [0.0; 3]));
    let ends = ["020", "050"].map(|view| (view.to_owned(), 0.0)).into();
    let solved = solve(&world.given, &StagePrior { views: ends, ..prior() }, &Silent).unwrap();
    assert_eq!(solved.uncertainty.frame(Point3::origin()), nalgebra::Matrix3::zeros());
    let unknown = StagePrior { views: vec![("35".into(), 0.1)], ..prior() };
    assert!(matches!(solve(&world.given, &unknown, &Silent), Err(Error::UnknownName { .. })));
    for sigma in [0.0, -1.0, f64::NAN] {
        let refused = solve(&world.given, &StagePrior::of(sigma), &Silent);
        assert!(matches!(refused, Err(Error::Setting { .. })));
    }
}

/// The same points with the pixels of some of the cameras.
fn seen_by(data: &Dataset, cameras: &[usize]) -> Dataset {
    let mut data = data.clone();
    data.cameras = cameras.len();
    for row in &mut data.correspondences {
        row.pixels = cameras.iter().map(|camera| row.pixels[*camera]).collect();
    }
    data
}

fn held_out_views(data: &Dataset) -> f64 {
    let dlt = AnyMethod::named("dlt").unwrap();
    cross_validate(&dlt, data, 0, &Silent).unwrap().unwrap().all.rms
}

#[test]
fn one_pair_of_real_cameras_corrects_the_stage_for_the_other() {
    let Some(folder) = data::folder("openptv-multiplane") else { return };
    let data = tables::read(&folder.join("points.csv"), "mm", Duplicates::Refuse).unwrap();
    // Pairs that look from both sides, on planes that the other pair was left out of.
    let mut ratios = 1.0;
    for (pair, other) in [([0, 2], [1, 3]), ([1, 3], [0, 2])] {
        let solved = solve(&seen_by(&data, &pair), &StagePrior::of(0.3), &Silent).unwrap();
        let mut corrected = data.clone();
        for (row, moved) in corrected.correspondences.iter_mut().zip(&solved.data.correspondences) {
            row.world = moved.world;
        }
        let before = held_out_views(&seen_by(&data, &other));
        let after = held_out_views(&seen_by(&corrected, &other));
        assert!(after < 0.80 * before, "{pair:?}: {after} mm after {before} mm");
        ratios *= after / before;
    }
    assert!(ratios < 0.44, "{ratios}");
    let solved = solve(&data, &StagePrior::of(0.3), &Silent).unwrap();
    assert!(solved.significance.is_clear());
    let (before, after) = (held_out_views(&data), held_out_views(&solved.data));
    assert!(after < 0.4 * before, "{after} mm after {before} mm");
    // More than noise parts these cameras, and it is said.
    assert!(solved.disagreement > 10.0);
}
