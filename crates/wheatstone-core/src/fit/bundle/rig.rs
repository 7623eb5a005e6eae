//! From single cameras to all of them in one frame.

use super::{
    adjustment::{Adjusted, Bundle, first_damping, lost},
    gather::Gathered,
    planar::{self, view_error},
    state::{Choice, Shot, State, thinned},
    two_fold,
};
use crate::{
    Error, Result,
    camera::{
        AnyCamera,
        brown_conrady::BrownConrady,
        kannala_brandt::KannalaBrandt,
        posed_lens::{POSE, PosedLens},
    },
    geometry::{LEAST_ON_PLANE as LEAST, Pixel, Point3, Pose},
    method::{Lens, information},
};
use rayon::prelude::*;
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Patience},
    loss::Loss,
    progress::Progress,
    statistics::median,
};

/// Steps, and the least gain (of the cost) that is worth another: while a start is tried, while all
/// cameras are brought together, while it is asked which terms predict best, and at the end.
const SCOUTING: Patience = Patience { steps: 25, least_gain: 1e-3 };
const JOINING: Patience = Patience { steps: 40, least_gain: 1e-4 };
const JUDGING: Patience = Patience { steps: 100, least_gain: 1e-6 };
const FINAL: Patience = Patience { steps: 100, least_gain: 1e-8 };

/// Views that tell where one camera's search begins, and points of each: more cost time, and the
/// adjustment of everything follows.
const SCOUTED_VIEWS: usize = 20;
const SCOUTED: usize = 24;

/// Which of a lens's numbers may change, from few to many; the focal lengths and the principal point,
/// the first four, always may.
pub(super) trait Terms: Lens + Into<AnyCamera> {
    const RUNGS: &'static [&'static [usize]];
}

impl Terms for BrownConrady {
    const RUNGS: &'static [&'static [usize]] =
        &[&[0, 1, 2, 3, 4], &[0, 1, 2, 3, 4, 5, 7, 8], &[0, 1, 2, 3, 4, 5, 6, 7, 8]];
}

impl Terms for KannalaBrandt {
    const RUNGS: &'static [&'static [usize]] =
        &[&[0, 1, 2, 3, 4], &[0, 1, 2, 3, 4, 5], &[0, 1, 2, 3, 4, 5, 6, 7]];
}

/// The numbers that may change: none of a lens that is known.
fn rungs<L: Terms>(gathered: &Gathered) -> &'static [&'static [usize]] {
    if gathered.lenses_are_known { &[&[]] } else { L::RUNGS }
}

/// Unknowns of a camera: its lens's terms, and its pose where that may change.
pub(super) fn unknowns(terms: &[usize], posed: bool) -> Vec<usize> {
    let pose = if posed { 0..POSE } else { 0..0 };
    pose.chain(terms.iter().map(|term| term + POSE)).collect()
}

/// Sizes of the errors of all points at a state.
fn errors<L: Lens>(state: &State<L>, shots: &[Shot]) -> Vec<f64> {
    let mut all = Vec::new();
    for (shot, chart) in shots.iter().zip(&state.charts) {
        for (camera, seen) in state.cameras.iter().zip(shot) {
            let pose = camera.camera_from_world.after(chart);
            all.extend(seen.iter().map(|(place, pixel)| {
                let at = camera.lens.project(pose.transform(*place));
                at.map_or(f64::INFINITY, |at| (at - pixel).norm())
            }));
        }
    }
    all
}

/// The scale of Cauchy's function for errors of this median: three standard deviations, of normal errors of
/// two coordinates whose median length is 1.18 of them.
fn scale_of(median: f64) -> f64 {
    (3.0 * median / 1.18).clamp(1e-3, 1e3)
}

fn scale(errors: &[f64]) -> f64 {
    scale_of(median(errors))
}

/// Whether two searches have come to the same place, by median error and focal length: what follows is
/// then the same too.
fn is_same(first: (f64, f64), second: (f64, f64)) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() < 0.01 * a.abs();
    near(first.0, second.0) && near(first.1, second.1)
}

/// One camera with the charts that it saw, by itself: its state with the camera at the origin.
fn alone<L: Terms>(
    shots: &[Shot],
    camera: usize,
    progress: &dyn Progress,
) -> Result<Option<State<L>>> {
    let seen: Vec<usize> =
        (0..shots.len()).filter(|view| shots[*view][camera].len() >= LEAST).collect();
    let few = seen.len().min(SCOUTED_VIEWS);
    let scouted: Vec<usize> = (0..few).map(|index| seen[index * seen.len() / few]).collect();
    let own: Vec<Shot> = scouted.iter().map(|view| vec![shots[*view][camera].clone()]).collect();
    let kept = thinned(&own, SCOUTED);
    let loose = vec![true; kept.len()];
    let mut best: Option<(f64, State<L>)> = None;
    let mut passed: Vec<(f64, f64)> = Vec::new();
    for start in planar::starts::<L>(&kept, 0) {
        let mut state = start;
        let mut finite = true;
        for (rung, terms) in L::RUNGS.iter().enumerate() {
            let here = (median(&errors(&state, &kept)), state.cameras[0].lens.pinhole().focal[0]);
            if rung == 1 && passed.iter().any(|other| is_same(*other, here)) {
                finite = false;
                break;
            } else if rung == 1 {
                passed.push(here);
            }
            let bundle = Bundle {
                shots: &kept,
                loose: &loose,
                free: vec![unknowns(terms, false)],
                loss: Loss::Cauchy(scale_of(here.0)),
                damping: first_damping(),
            };
            let found = bundle.adjust(state, SCOUTING, progress)?;
            state = found.state;
            finite = found.sums.cost.is_finite();
        }
        if !finite {
            continue;
        }
        // Costs under different scales cannot be compared: medians can.
        let error = median(&errors(&state, &kept));
        if best.as_ref().is_none_or(|(least, _)| error < *least) {
            best = Some((error, state));
        }
    }
    Ok(best.map(|(_, state)| with_all_views(state, shots, camera, &scouted)))
}

/// One camera's state with the charts of all views that it saw, where it was found from some.
fn with_all_views<L: Lens>(
    mut state: State<L>,
    shots: &[Shot],
    camera: usize,
    scouted: &[usize],
) -> State<L> {
    let mut charts = vec![Pose::default(); shots.len()];
    for (view, chart) in scouted.iter().zip(&state.charts) {
        charts[*view] = *chart;
    }
    let lens = &state.cameras[0].lens;
    let missing = charts.iter_mut().zip(thinned(shots, SCOUTED)).enumerate();
    for (_, (chart, shot)) in missing.filter(|(view, _)| !scouted.contains(view)) {
        if let Some(pose) = planar::place(lens, &shot[camera]) {
            *chart = pose;
        }
    }
    state.charts = charts;
    state
}

/// All cameras in the first one's frame, each chart where the cameras placed so far see it.
fn joined<L: Terms>(shots: &[Shot], single: Vec<State<L>>) -> Result<State<L>> {
    let count = single.len();
    let saw = |camera: usize, view: usize| shots[view][camera].len() >= LEAST;
    let mut cameras: Vec<Option<Pose>> = vec![None; count];
    cameras[0] = Some(Pose::default());
    let mut charts: Vec<Option<Pose>> =
        (0..shots.len()).map(|view| saw(0, view).then(|| single[0].charts[view])).collect();
    while let Some(next) =
        (0..count).filter(|camera| cameras[*camera].is_none()).max_by_key(|camera| {
            (0..shots.len()).filter(|v| saw(*camera, *v) && charts[*v].is_some()).count()
        })
    {
        let shared: Vec<usize> =
            (0..shots.len()).filter(|v| saw(next, *v) && charts[*v].is_some()).collect();
        let lens = &single[next].cameras[0].lens;
        let candidates = shared.iter().step_by(shared.len().div_ceil(30).max(1));
        let mut best: Option<(f64, Pose)> = None;
        for view in candidates {
            let Some(chart) = charts[*view] else { continue };
            let pose = single[next].charts[*view].after(&chart.inverse());
            let each: Vec<f64> = shared
                .iter()
                .filter_map(|v| Some(view_error(lens, &pose.after(&charts[*v]?), &shots[*v][next])))
                .collect();
            let error = median(&each);
            if best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, pose));
            }
        }
        let (_, pose) = best.ok_or_else(|| Error::Degenerate {
            problem: format!("camera {} has no view in common with the cameras before it", next + 1),
            hint: "show the board to two cameras at once, so that common views link every camera to the others".into(),
        })?;
        cameras[next] = Some(pose);
        for (view, chart) in charts.iter_mut().enumerate() {
            if chart.is_none() && saw(next, view) {
                *chart = Some(pose.inverse().after(&single[next].charts[view]));
            }
        }
    }
    let posed = single.into_iter().zip(cameras).map(|(state, pose)| {
        let lens = state.cameras.into_iter().next().map(|camera| camera.lens);
        Some(PosedLens { lens: lens?, camera_from_world: pose? })
    });
    let cameras: Option<Vec<PosedLens<L>>> = posed.collect();
    Ok(State {
        cameras: cameras.ok_or_else(lost)?,
        charts: charts.into_iter().map(Option::unwrap_or_default).collect(),
    })
}

/// The cameras and charts that explain the pixels best, from nothing but them.
pub(super) fn solve<L: Terms>(gathered: &Gathered, progress: &dyn Progress) -> Result<Choice<L>> {
    let shots = &gathered.shots;
    let single: Vec<Result<Option<State<L>>>> = (0..gathered.cameras)
        .into_par_iter()
        .map(|camera| alone::<L>(shots, camera, progress))
        .collect();
    let mut states = Vec::new();
    for (camera, found) in single.into_iter().enumerate() {
        let found = found?.ok_or_else(|| Error::Degenerate {
            problem: format!("no view of camera {} determines a chart pose", camera + 1),
            hint: format!(
                "each camera must see at least {LEAST} points of a flat chart in several views"
            )
            .into(),
        })?;
        states.push(found);
    }
    let state = joined(&thinned(shots, SCOUTED), states)?;
    refine(gathered, state, progress)
}

/// The cameras and charts that explain the pixels best, from lenses that are known, or nearly.
pub(super) fn solve_near<L: Terms>(
    gathered: &Gathered,
    lenses: &[L],
    progress: &dyn Progress,
) -> Result<Choice<L>> {
    let shots = &gathered.shots;
    let alone = |(camera, lens): (usize, &L)| {
        let posed = PosedLens { lens: lens.clone(), camera_from_world: Pose::default() };
        let state = State { cameras: vec![posed], charts: Vec::new() };
        with_all_views(state, shots, camera, &[])
    };
    let known = lenses.iter().take(gathered.cameras).enumerate();
    let states: Vec<State<L>> = known.map(alone).collect();
    let state = joined(&thinned(shots, SCOUTED), states)?;
    refine(gathered, state, progress)
}

/// From a state near the best one to the best, gross errors left out.
pub(super) fn refine<L: Terms>(
    gathered: &Gathered,
    state: State<L>,
    progress: &dyn Progress,
) -> Result<Choice<L>> {
    let loose: Vec<bool> = (0..gathered.shots.len())
        .map(|view| {
            !gathered.fixed[view] && gathered.shots[view].iter().any(|seen| seen.len() >= LEAST)
        })
        .collect();
    let usable: Vec<Shot> = gathered
        .shots
        .iter()
        .enumerate()
        .map(|(view, shot)| {
            if loose[view] || gathered.fixed[view] {
                shot.clone()
            } else {
                vec![Vec::new(); gathered.cameras]
            }
        })
        .collect();
    let rungs = rungs::<L>(gathered);
    let last = rungs[rungs.len() - 1];
    let mut state = state;
    // Few points bring cameras together as well as all do.
    let few = thinned(&usable, SCOUTED);
    let mut damping = first_damping();
    for terms in [rungs[0], last] {
        let loss = Loss::Cauchy(scale(&errors(&state, &few)));
        let free = free(gathered, terms);
        let bundle = Bundle { shots: &few, loose: &loose, free, loss, damping: first_damping() };
        let joined = bundle.adjust(state, JOINING, progress)?;
        (state, damping) = (joined.state, joined.damping);
    }
    let loss = Loss::Cauchy(scale(&errors(&state, &few)));
    state = two_fold::better(state, (&few, &loose), loss, progress)?;
    let clean =
        if gathered.bundle_settings.keep_gross { usable } else { without_gross(&state, &usable) };
    chosen(gathered, (&state, damping), (clean, loose), progress)
}

/// Each camera's unknowns that may change; the first one's pose does not where no place is known.
fn free(gathered: &Gathered, terms: &[usize]) -> Vec<Vec<usize>> {
    let first_is_fixed = gathered.fixed.iter().all(|fixed| !fixed);
    (0..gathered.cameras).map(|camera| unknowns(terms, camera > 0 || !first_is_fixed)).collect()
}

/// The best state of all points, with as many terms as predict best.
fn chosen<L: Terms>(
    gathered: &Gathered,
    (state, damping): (&State<L>, Damping),
    (clean, loose): (Vec<Shot>, Vec<bool>),
    progress: &dyn Progress,
) -> Result<Choice<L>> {
    let rungs = rungs::<L>(gathered);
    let last = rungs[rungs.len() - 1];
    let rungs = if gathered.bundle_settings.all_terms { &rungs[rungs.len() - 1..] } else { rungs };
    let few = thinned(&clean, SCOUTED);
    let points: usize = clean.iter().flatten().map(Vec::len).sum();
    let of = |shots, terms, damping| Bundle {
        shots,
        loose: &loose,
        free: free(gathered, terms),
        loss: Loss::Squares,
        damping,
    };
    let unknowns = |bundle: &Bundle| {
        let charts = loose.iter().filter(|loose| **loose).count();
        bundle.free.iter().map(Vec::len).sum::<usize>() + POSE * charts
    };
    let mut best: Option<(f64, Adjusted<L>, &'static [usize])> = None;
    // What there is no choice of need not be judged.
    let patience = if rungs.len() > 1 { JUDGING } else { FINAL };
    for terms in rungs {
        // With all its terms the lens has been adjusted to few points already.
        let (start, damping) = if *terms == last {
            (state.clone(), damping)
        } else {
            let start = without_others(state, terms);
            let near = of(&few, terms, first_damping()).adjust(start, JOINING, progress)?;
            (near.state, near.damping)
        };
        let bundle = of(&clean, terms, damping);
        let found = bundle.adjust(start, patience, progress)?;
        let worth = information(2.0 * found.sums.cost, points, unknowns(&bundle));
        if best.as_ref().is_none_or(|(least, ..)| worth < *least) {
            best = Some((worth, found, terms));
        }
    }
    let (_, mut found, terms) = best.ok_or_else(lost)?;
    let bundle = of(&clean, terms, found.damping);
    if rungs.len() > 1 {
        found = bundle.adjust(found.state, FINAL, progress)?;
    }
    let cost = found.sums.cost;
    let freedom = ((2 * points) as f64 - unknowns(&bundle) as f64).max(1.0);
    let sigma = (2.0 * cost / freedom).sqrt();
    let charts = found.sums.chart_covariances(&loose, sigma);
    Ok(Choice { state: found.state, terms, cost, charts, sigma, points, clean, loose })
}

fn without_others<L: Terms>(state: &State<L>, terms: &[usize]) -> State<L> {
    let mut state = state.clone();
    for camera in &mut state.cameras {
        for (index, value) in camera.lens.parameters_mut().into_iter().enumerate() {
            if index >= 4 && !terms.contains(&index) {
                *value = 0.0;
            }
        }
    }
    state
}

/// The points without those whose errors stand out: six standard deviations and more.
fn without_gross<L: Lens>(state: &State<L>, shots: &[Shot]) -> Vec<Shot> {
    let most = 2.0 * scale(&errors(state, shots)) + 1e-9;
    let keep = |shot: &Shot, chart: &Pose| -> Shot {
        let each = state.cameras.iter().zip(shot).map(|(camera, seen)| {
            let pose = camera.camera_from_world.after(chart);
            let near = |(place, pixel): &&(Point3, Pixel)| {
                let at = camera.lens.project(pose.transform(*place));
                at.is_some_and(|at| (at - pixel).norm() <= most)
            };
            seen.iter().filter(near).copied().collect()
        });
        each.collect()
    };
    shots.iter().zip(&state.charts).map(|(shot, chart)| keep(shot, chart)).collect()
}
