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
mod elimination;
mod gather;
mod planar;
mod rig;
mod scale;
mod sums;

use crate::{
    Error, Result,
    camera::{AnyCamera, brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt},
    dataset::Dataset,
    geometry::{Point3, Pose},
};
use adjustment::{Shot, State};
use gather::Gathered;
use nalgebra::Matrix6;
pub(crate) use planar::placed;
use rig::Terms;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{progress::Progress, statistics::median};

/// Which frame is the world's where no chart's place is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Gauge {
    /// The chart of the first view: its points have Z = 0.
    #[default]
    FirstView,
    /// The first camera: x right, y down, z forward.
    FirstCamera,
}

impl Gauge {
    /// The names, as files and the command line have them.
    pub const NAMES: [&'static str; 2] = ["first-view", "first-camera"];

    /// By its name.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "first-view" => Ok(Self::FirstView),
            "first-camera" => Ok(Self::FirstCamera),
            _ => Err(Error::UnknownName {
                kind: "gauge",
                name: name.into(),
                known: Self::NAMES.map(String::from).into(),
            }),
        }
    }
}

/// Which lenses are tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Lenses {
    /// Both, and the one that explains the pixels better is taken.
    #[default]
    Either,
    /// Brown's.
    Brown,
    /// Kannala's and Brandt's.
    KannalaBrandt,
}

/// How charts are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Placing {
    /// The frame of the world where no place is known.
    pub gauge: Gauge,
    /// The lenses.
    pub lenses: Lenses,
    /// Whether every lens has all its terms, where fewer would predict as well.
    pub all_terms: bool,
    /// Whether points count that stand out as gross errors.
    pub keep_gross: bool,
}

/// Where a chart is believed to have stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ViewPose {
    /// The view's name.
    pub view: String,
    /// Where the chart's origin lies in the world.
    pub translation: [f64; 3],
    /// World from chart: a rotation vector in radians.
    pub rotation: [f64; 3],
    /// Standard deviation of `translation`; with a frame of the first view's chart it has that chart's
    /// own, as what is known is known from the cameras.
    pub translation_sigma: [f64; 3],
    /// Standard deviation of the turn about each axis of the world, in radians.
    pub rotation_sigma: [f64; 3],
    /// Points of this view that take part.
    pub points: usize,
}

/// Charts placed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SolvedPoses {
    /// The data with known places, beside those on the chart; points of views that could not be placed
    /// are gone.
    pub data: Dataset,
    /// One entry a view that was placed.
    pub views: Vec<ViewPose>,
    /// Views that could not be placed, for too few points.
    pub unplaced: Vec<String>,
    /// The lens that was used: a name of the registry of cameras.
    pub lens: &'static str,
    /// The cameras, each in its own frame.
    pub cameras: Vec<AnyCamera>,
    /// Root mean square distance of pixels from where cameras and charts say, gross errors left out.
    pub rms: f64,
    /// Points (a camera each) that stood out as gross errors.
    pub gross: usize,
    /// Distances of each camera from the first one, in the data's unit.
    pub baselines: Vec<f64>,
    /// Median distance of the charts from the first camera.
    pub distance: f64,
}

impl SolvedPoses {
    /// Takes over places to which charts were moved afterwards; the frame stays the first view's chart
    /// where it was that.
    pub fn adopt(&mut self, moved: Dataset, gauge: Gauge) {
        let from_board = |view: &str| -> Option<Pose> {
            let index = moved.views.iter().position(|name| name == view).unwrap_or(0);
            let rows = moved.correspondences.iter().filter(|row| row.view == index);
            let pairs: Vec<(Point3, Point3)> = rows
                .filter_map(|row| {
                    let [x, y] = row.board?;
                    Some((Point3::new(x, y, 0.0), row.world?))
                })
                .collect();
            Pose::aligning(&pairs)
        };
        let known = moved.correspondences.iter().any(|row| row.board.is_none());
        let first = self.views.first().and_then(|first| from_board(&first.view));
        let to_world = match (gauge, first) {
            (Gauge::FirstView, Some(first)) if !known => first.inverse(),
            _ => Pose::default(),
        };
        for view in &mut self.views {
            if let Some(pose) = from_board(&view.view).map(|pose| to_world.after(&pose)) {
                view.translation = pose.translation.into();
                view.rotation = pose.rotation_vector().into();
            }
        }
        self.data = moved;
        for row in &mut self.data.correspondences {
            row.world = row.world.map(|world| to_world.transform(world));
        }
    }
}

/// The best state of one lens.
struct Choice<L> {
    state: State<L>,
    terms: &'static [usize],
    clean: Vec<Shot>,
    loose: Vec<bool>,
    cost: f64,
    /// Standard deviation of one pixel coordinate.
    sigma: f64,
    /// Points that took part, a camera each.
    points: usize,
    charts: Option<Vec<Matrix6<f64>>>,
}

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
pub fn solve(data: &Dataset, placing: Placing, progress: &dyn Progress) -> Result<SolvedPoses> {
    let gathered = Gathered::new(data, placing)?;
    let gauge = placing.gauge;
    let of = |wanted: Lenses| placing.lenses == Lenses::Either || placing.lenses == wanted;
    let (brown, kannala) = rayon::join(
        || of(Lenses::Brown).then(|| place::<BrownConrady>(&gathered, data, progress)),
        || of(Lenses::KannalaBrandt).then(|| place::<KannalaBrandt>(&gathered, data, progress)),
    );
    match (brown, kannala) {
        (Some(Ok(brown)), Some(Ok(kannala))) => {
            if kannala.sigma < brown.sigma {
                finish(&gathered, data, gauge, (kannala, "kannala-brandt"), progress)
            } else {
                finish(&gathered, data, gauge, (brown, "brown-conrady"), progress)
            }
        }
        (Some(Ok(brown)), _) => finish(&gathered, data, gauge, (brown, "brown-conrady"), progress),
        (_, Some(Ok(kannala))) => {
            finish(&gathered, data, gauge, (kannala, "kannala-brandt"), progress)
        }
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
    placing: Placing,
    progress: &dyn Progress,
) -> Result<SolvedPoses> {
    if lenses.len() < data.cameras {
        return Err(Error::TooFew {
            method: "charts placed by known lenses".into(),
            what: "lenses, one a camera".into(),
            need: data.cameras,
            got: lenses.len(),
        });
    }
    let gathered = Gathered::new(data, placing)?;
    let near = rig::solve_near(&gathered, lenses, progress)?;
    let brown = kept_to(&gathered, data, near, progress)?;
    finish(&gathered, data, placing.gauge, (brown, "brown-conrady"), progress)
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
    scale::check(gathered, (&choice, data.flatness()), progress)?;
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
    let all: usize = gathered.shots.iter().flatten().map(Vec::len).sum();
    let views = gathered.placed(&choice, &to_world, &poses);
    let unplaced = (0..gathered.shots.len())
        .filter(|view| !choice.loose[*view] && !gathered.is_known(*view))
        .map(|view| gathered.names[view].clone());
    Ok(SolvedPoses {
        data: gathered.in_world(data, &choice.loose, &poses),
        views,
        unplaced: unplaced.collect(),
        lens,
        cameras: choice.state.cameras.iter().map(|camera| camera.lens.clone().into()).collect(),
        rms: (2.0 * choice.cost / choice.points.max(1) as f64).sqrt(),
        gross: all.saturating_sub(choice.points),
        distance: median(&distances),
        baselines: (1..gathered.cameras).map(|c| (centre(c) - centre(0)).norm()).collect(),
    })
}
