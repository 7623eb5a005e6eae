//! Where charts stood whose place nobody measured: a board waved by hand.
//!
//! Cameras and charts are adjusted together (bundle adjustment: Triggs et al. 2000,
//! doi:10.1007/3-540-44480-7_21), for a camera with Brown's or with Kannala's and Brandt's lens,
//! whichever explains the pixels better. The result is data with known places, to which any method is
//! then fitted; for optics that neither lens describes (water, glass) the charts go on to
//! [`super::stage`], which adjusts them together with the model-free camera.
//!
//! **What cannot be seen.** All lengths are those of the chart: a wrong pitch scales the world. From
//! charts that are all parallel to each other focal length and distance cannot be told apart; such data
//! are refused.

mod adjustment;
mod camera_motion;
mod elimination;
mod gather;
mod mirrors;
mod settings;
mod planar;
mod rig;
mod scale;
mod solved;
mod state;
mod sums;
mod two_fold;
mod view_equations;

pub use settings::{BundleSettings, Gauge, Lenses};
pub use solved::{CameraMotion, PoseChange, SolvedPoses, ViewPose};

use crate::{
    Error, Result,
    camera::{AnyCamera, brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt},
    dataset::Dataset,
    geometry::{Point3, Pose},
};
use gather::Gathered;
use rig::Terms;
use state::Choice;
use wheatstone_numeric::{progress::Progress, statistics::median};

/// Whether some points of `data` are on charts whose places are not known.
#[must_use]
pub fn needed(data: &Dataset) -> bool {
    data.correspondences.iter().any(|c| c.world.is_none() && c.board.is_some() && c.seen_by() > 0)
}

/// Places the charts of `data` that have no known place, together with the cameras.
///
/// # Errors
///
/// [`Error::TooFew`] for fewer than three views, [`Error::Degenerate`] for charts that are all
/// parallel, for cameras that no view links, and where nothing fits, [`Error::Cancelled`].
pub fn solve(
    data: &Dataset,
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<SolvedPoses> {
    let gathered = Gathered::new(data, bundle_settings)?;
    let direct = with_better_lens(&gathered, data, progress);
    let Some(unmirrored) = mirrors::unmirrored(&gathered) else { return Ok(direct?.1) };
    match (direct, with_better_lens(&unmirrored, data, progress)) {
        (Ok((sigma, direct)), Ok((other, _))) if sigma <= other => Ok(direct),
        (_, Ok((_, unmirrored))) => Ok(unmirrored),
        (_, Err(cancelled @ Error::Cancelled)) => Err(cancelled),
        (direct, Err(_)) => Ok(direct?.1),
    }
}

/// With the lens that explains the pixels better, and the standard deviation of a pixel coordinate.
fn with_better_lens(
    gathered: &Gathered,
    data: &Dataset,
    progress: &dyn Progress,
) -> Result<(f64, SolvedPoses)> {
    let BundleSettings { lenses, gauge, .. } = gathered.bundle_settings;
    let of = |wanted: Lenses| lenses == Lenses::Either || lenses == wanted;
    let (brown, kannala) = rayon::join(
        || of(Lenses::Brown).then(|| place::<BrownConrady>(gathered, data, progress)),
        || of(Lenses::KannalaBrandt).then(|| place::<KannalaBrandt>(gathered, data, progress)),
    );
    let with_brown = |brown: Choice<BrownConrady>| {
        Ok((brown.sigma, finish(gathered, data, gauge, (brown, "brown-conrady"), progress)?))
    };
    let with_kannala = |kannala: Choice<KannalaBrandt>| {
        Ok((kannala.sigma, finish(gathered, data, gauge, (kannala, "kannala-brandt"), progress)?))
    };
    match (brown, kannala) {
        (Some(Ok(brown)), Some(Ok(kannala))) if kannala.sigma < brown.sigma => {
            with_kannala(kannala)
        }
        (Some(Ok(brown)), _) => with_brown(brown),
        (_, Some(Ok(kannala))) => with_kannala(kannala),
        (Some(Err(error)), _) | (_, Some(Err(error))) => Err(error),
        (None, None) => Err(adjustment::lost()),
    }
}

/// As [`solve`], with Brown's lenses that are known nearly, one a camera in the data's order: from them the
/// charts are placed and the cameras linked, then everything is adjusted together.
///
/// # Errors
///
/// As [`solve`]; [`Error::TooFew`] for fewer lenses than cameras.
pub fn solve_near(
    data: &Dataset,
    lenses: &[BrownConrady],
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<SolvedPoses> {
    one_each(data, lenses.len())?;
    let gathered = Gathered::new(data, bundle_settings)?;
    from_lenses(&gathered, data, (lenses, "brown-conrady"), progress)
}

/// As [`solve`], with lenses that are known, one a camera in the data's order, all Brown's or all Kannala's and Brandt's:
/// they stay as they are, and only where cameras and charts stand is adjusted. One view is enough.
///
/// # Errors
///
/// As [`solve`]; [`Error::TooFew`] for fewer lenses than cameras.
pub fn solve_known(
    data: &Dataset,
    lenses: &[AnyCamera],
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<SolvedPoses> {
    one_each(data, lenses.len())?;
    let gathered = Gathered::of(data, bundle_settings, true)?;
    let brown = |lens: &AnyCamera| match lens {
        AnyCamera::BrownConrady(lens) => Some(*lens),
        _ => None,
    };
    let kannala = |lens: &AnyCamera| match lens {
        AnyCamera::KannalaBrandt(lens) => Some(*lens),
        _ => None,
    };
    if let Some(lenses) = lenses.iter().map(brown).collect::<Option<Vec<_>>>() {
        return from_lenses(&gathered, data, (&lenses, "brown-conrady"), progress);
    }
    if let Some(lenses) = lenses.iter().map(kannala).collect::<Option<Vec<_>>>() {
        return from_lenses(&gathered, data, (&lenses, "kannala-brandt"), progress);
    }
    Err(Error::Degenerate {
        problem: "these lenses are not all of one kind".into(),
        hint: "give lenses of Brown's model for all cameras, or of Kannala's and Brandt's".into(),
    })
}

fn one_each(data: &Dataset, lenses: usize) -> Result<()> {
    if lenses >= data.cameras {
        return Ok(());
    }
    Err(Error::TooFew {
        method: "estimating chart poses with known lenses".into(),
        what: "lenses, one per camera".into(),
        need: data.cameras,
        got: lenses,
    })
}

fn from_lenses<L: Terms>(
    gathered: &Gathered,
    data: &Dataset,
    (lenses, name): (&[L], &'static str),
    progress: &dyn Progress,
) -> Result<SolvedPoses> {
    let found = rig::solve_near(gathered, lenses, progress)?;
    let found = kept_to(gathered, data, found, progress)?;
    finish(gathered, data, gathered.bundle_settings.gauge, (found, name), progress)
}

fn place<L: Terms>(
    gathered: &Gathered,
    data: &Dataset,
    progress: &dyn Progress,
) -> Result<Choice<L>> {
    kept_to(gathered, data, rig::solve::<L>(gathered, progress)?, progress)
}

/// The same with the places kept to that are known.
fn kept_to<L: Terms>(
    gathered: &Gathered,
    data: &Dataset,
    found: Choice<L>,
    progress: &dyn Progress,
) -> Result<Choice<L>> {
    match gathered.known_frame(data, &found.state) {
        None => Ok(found),
        // Known places are kept to, now that it is known where the cameras are.
        Some((fixed, state)) => rig::refine(&fixed, state, progress),
    }
}

fn finish<L: Terms>(
    gathered: &Gathered,
    data: &Dataset,
    gauge: Gauge,
    (choice, lens): (Choice<L>, &'static str),
    progress: &dyn Progress,
) -> Result<SolvedPoses> {
    if !gathered.lenses_are_known {
        scale::check(gathered, (&choice, data.flatness()), progress)?;
    }
    let known = gathered.has_known();
    let to_world = match gauge {
        _ if known => Pose::default(),
        Gauge::FirstCamera => choice.state.cameras[0].camera_from_world,
        Gauge::FirstView => {
            let first = choice.loose.iter().position(|loose| *loose).unwrap_or(0);
            choice.state.charts[first].inverse()
        }
    };
    let poses: Vec<Pose> = choice.state.charts.iter().map(|chart| to_world.after(chart)).collect();
    let centre = |index: usize| {
        Point3::from(choice.state.cameras[index].camera_from_world.inverse().translation)
    };
    let first = choice.state.cameras[0].camera_from_world;
    let charts = choice.state.charts.iter().zip(&choice.loose).filter(|(_, loose)| **loose);
    let distances: Vec<f64> =
        charts.map(|(chart, _)| first.after(chart).translation.norm()).collect();
    let undecided =
        two_fold::undecided(&choice.state, (&choice.clean, &choice.loose), choice.sigma, progress);
    let all: usize = gathered.shots.iter().flatten().map(Vec::len).sum();
    let views = gathered.placed(&choice, &to_world, &poses);
    let unplaced = (0..gathered.shots.len())
        .filter(|view| !choice.loose[*view] && !gathered.is_known(*view))
        .map(|view| gathered.names[view].clone());
    Ok(SolvedPoses {
        data: gathered.in_world(data, &choice.loose, &poses),
        views,
        unplaced: unplaced.collect(),
        motion: camera_motion::find(&choice, gathered),
        undecided: undecided.into_iter().map(|view| gathered.names[view].clone()).collect(),
        lens,
        cameras: choice.state.cameras.iter().map(|camera| camera.lens.clone().into()).collect(),
        rms: (2.0 * choice.cost / choice.points.max(1) as f64).sqrt(),
        gross: all.saturating_sub(choice.points),
        distance: median(&distances),
        baselines: (1..gathered.cameras).map(|c| (centre(c) - centre(0)).norm()).collect(),
    })
}
