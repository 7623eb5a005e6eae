//! What was seen, and where cameras and charts stand.

use crate::{
    camera::posed_lens::PosedLens,
    geometry::{Pixel, Point3, Pose},
};
use nalgebra::Matrix6;

/// What every camera saw of one view: the chart's points in its own frame, with pixels, a camera.
pub(super) type Shot = Vec<Vec<(Point3, Pixel)>>;

/// At most so many points of what each camera saw of a view, spread evenly over the list.
pub(super) fn thinned(shots: &[Shot], most: usize) -> Vec<Shot> {
    let few = |seen: &Vec<(Point3, Pixel)>| -> Vec<(Point3, Pixel)> {
        if seen.len() <= most {
            return seen.clone();
        }
        (0..most).map(|index| seen[index * seen.len() / most]).collect()
    };
    shots.iter().map(|shot| shot.iter().map(few).collect()).collect()
}

/// All that is adjusted.
#[derive(Clone, Debug)]
pub(super) struct State<L> {
    pub(super) cameras: Vec<PosedLens<L>>,
    /// World from chart, a view.
    pub(super) charts: Vec<Pose>,
}

/// The best state of one lens.
pub(super) struct Choice<L> {
    pub(super) state: State<L>,
    pub(super) terms: &'static [usize],
    pub(super) clean: Vec<Shot>,
    pub(super) loose: Vec<bool>,
    pub(super) cost: f64,
    /// Standard deviation of one pixel coordinate.
    pub(super) sigma: f64,
    /// Points that took part, a camera each.
    pub(super) points: usize,
    pub(super) charts: Option<Vec<Matrix6<f64>>>,
}
