//! What all faults are judged by, worked out once: the views, each camera fitted to the views on
//! which most agree, and how far each camera's points of each view are from where the camera's
//! other views put them.

use super::{
    board::Board,
    camera_evidence::{CameraEvidence, EXACT, SCOUTED},
    extrapolation::{Extent, across, allowances},
    frame::Frame,
    pairs::{Pair, extent, sides},
    robust_camera::RobustCamera,
    views::{LEAST, View, are_pictures, views},
    whole_board::complete,
};
use crate::{dataset::Dataset, geometry::Pixel};
use nalgebra::Vector2;
use rayon::prelude::*;
use wheatstone_numeric::statistics::{mean, median};

/// The points of one view in one camera.
#[derive(Clone, Debug, Default)]
pub(super) struct Cell {
    /// Indices into the dataset's correspondences.
    pub(super) rows: Vec<usize>,
    /// Scaled world places with pixels.
    pub(super) pairs: Vec<Pair>,
    /// Median pixel error after the camera of the other views; infinite for too few points.
    pub(super) error: f64,
    /// Median of the pixel errors by axis.
    pub(super) offset: Vector2<f64>,
    /// Error over the good level up to which it is not suspicious.
    allowance: f64,
    pub(super) suspicious: bool,
}

impl Cell {
    /// By the camera of the other views.
    fn judge(&mut self, seen: Option<&CameraEvidence>, view: usize) {
        self.error = f64::INFINITY;
        if let (Some(seen), true) = (seen, self.pairs.len() >= LEAST) {
            self.error = seen.without[view].median_error(&self.pairs);
            self.suspicious = self.error > self.allowance * seen.good();
            self.offset = offset(&seen.without[view], &self.pairs);
        }
    }
}

/// Points of a cell whose nearest neighbours tell the noise.
const NEIGHBOURS: usize = 30;

/// The share of the error that a second place may leave, if it is more than noise: of one picture and of many. Tanks
/// and windows where nothing moved leave 0.19 and 0.47, a camera that was pushed before a window 0.28.
pub(super) const OF_ONE: f64 = 0.15;
pub(super) const OF_MANY: f64 = 0.35;

/// Everything.
pub(super) struct Evidence<'a> {
    pub(super) data: &'a Dataset,
    pub(super) frame: Frame,
    pub(super) views: Vec<View>,
    /// By view, then camera.
    pub(super) cells: Vec<Vec<Cell>>,
    /// By camera; `None` where no camera could be fitted.
    pub(super) seen: Vec<Option<CameraEvidence>>,
    /// By camera: what noise alone leaves of its median error, in pixels, whatever its optics.
    pub(super) noise: Vec<f64>,
    /// Whether the points of a view were seen at once, so that a picture of it may be another instant's.
    pub(super) are_pictures: bool,
}

impl<'a> Evidence<'a> {
    pub(super) fn new(data: &'a Dataset) -> Self {
        let frame = Frame::of(data);
        let mut views = views(data, &frame);
        complete(&mut views, data, &frame);
        let mut cells: Vec<Vec<Cell>> = views
            .iter()
            .map(|view| (0..data.cameras).map(|camera| cell(data, &frame, view, camera)).collect())
            .collect();
        let seen: Vec<Option<CameraEvidence>> = (0..data.cameras)
            .into_par_iter()
            .map(|camera| {
                let pairs: Vec<Vec<Pair>> =
                    cells.iter().map(|view| view[camera].pairs.clone()).collect();
                CameraEvidence::of(&pairs, data.has_estimated_poses())
            })
            .collect();
        for (place, view) in cells.iter_mut().enumerate() {
            for (cell, seen) in view.iter_mut().zip(&seen) {
                cell.judge(seen.as_ref(), place);
            }
        }
        let are_pictures = are_pictures(data);
        let mut evidence =
            Self { data, frame, views, cells, seen, noise: Vec::new(), are_pictures };
        evidence.noise = (0..data.cameras).map(|camera| evidence.noise_of(camera)).collect();
        (0..data.cameras).for_each(|camera| evidence.allow_for_extrapolation(camera));
        evidence
    }

    /// Charts at given places; those of estimated poses are spread by pose, and none is beyond all others.
    fn allow_for_extrapolation(&mut self, camera: usize) {
        let Some(seen) = &self.seen[camera] else { return };
        let across = across(self.cells.iter().map(|view| view[camera].pairs.as_slice()));
        let reach = |view: usize| {
            self.at(view, camera).filter(|_| !self.has_estimated_pose(view)).map(|(cell, ..)| {
                let places =
                    cell.pairs.iter().map(|(world, _)| across.dot(&world.coords)).collect();
                Extent { places, excess: self.excess((view, camera)) }
            })
        };
        let extents: Vec<Option<Extent>> = (0..self.views.len()).map(reach).collect();
        // Of places that are wrong by far more than an extrapolation, the uncertainty there tells nothing.
        const MOST: f64 = 0.01;
        let all: Vec<Pair> =
            self.cells.iter().flat_map(|view| view[camera].pairs.iter().copied()).collect();
        let most = MOST * extent(&all);
        for (view, allowance) in allowances(&extents).into_iter().enumerate() {
            // Two standard deviations of where the other views put these points.
            let open = (2.0 * seen.uncertainty[view]).min(most);
            let allowance = allowance.max(1.0 + open / seen.good());
            let cell = &mut self.cells[view][camera];
            cell.allowance = allowance;
            cell.suspicious &= cell.error > allowance * seen.good();
        }
    }

    /// The same where one view's chart stands as in `data`, and so its board; the cameras are those of the other views.
    pub(super) fn with_view_moved<'b>(
        &self,
        view: usize,
        (data, board): (&'b Dataset, Option<Board>),
    ) -> Evidence<'b> {
        let Self { frame, seen, noise, are_pictures, .. } = self;
        let (mut views, mut cells) = (self.views.clone(), self.cells.clone());
        views[view].board = board;
        for (camera, (own, seen)) in cells[view].iter_mut().zip(seen).enumerate() {
            *own = Cell { allowance: own.allowance, ..cell(data, frame, &views[view], camera) };
            own.judge(seen.as_ref(), view);
        }
        let (seen, noise) = (seen.clone(), noise.clone());
        Evidence { data, frame: *frame, views, cells, seen, noise, are_pictures: *are_pictures }
    }

    /// The cell, what is known of its camera, and the camera of the other views.
    pub(super) fn at(
        &self,
        view: usize,
        camera: usize,
    ) -> Option<(&Cell, &CameraEvidence, &RobustCamera)> {
        let cell = &self.cells[view][camera];
        let seen = self.seen[camera].as_ref()?;
        (cell.pairs.len() >= LEAST).then(|| (cell, seen, &seen.without[view]))
    }

    /// Whether the pose of a view's chart was estimated from these pixels: an explanation may have another.
    pub(super) fn has_estimated_pose(&self, view: usize) -> bool {
        let mut rows = self.views[view].rows.iter();
        rows.any(|row| self.data.correspondences[*row].has_estimated_pose())
    }

    /// All suspicious cells, by view and camera.
    pub(super) fn suspicious(&self) -> Vec<(usize, usize)> {
        let all = (0..self.views.len()).flat_map(|v| (0..self.data.cameras).map(move |c| (v, c)));
        all.filter(|(view, camera)| self.cells[*view][*camera].suspicious).collect()
    }

    /// The suspicious cameras of a view.
    pub(super) fn suspects(&self, view: usize) -> Vec<usize> {
        (0..self.data.cameras).filter(|camera| self.cells[view][*camera].suspicious).collect()
    }

    /// The cameras that saw enough of a view.
    pub(super) fn present(&self, view: usize) -> Vec<usize> {
        (0..self.data.cameras).filter(|camera| self.at(view, *camera).is_some()).collect()
    }

    /// Whether no camera explains even most of a camera's views, while another camera's are explained:
    /// then its views do not stand out from one another, all being bad.
    pub(super) fn is_lost(&self, camera: usize) -> bool {
        let typical =
            |seen: &Option<CameraEvidence>| seen.as_ref().map_or(f64::INFINITY, |s| s.typical);
        let best = self.seen.iter().map(typical).fold(f64::INFINITY, f64::min);
        // Lenses differ; one that errs so many times as much as another has another reason.
        typical(&self.seen[camera]) > 4.0 * best + 0.5
    }

    /// How far sound views of a camera are off as a whole: the median length of their offsets.
    pub(super) fn stray(&self, camera: usize) -> f64 {
        let sound = self.cells.iter().map(|view| &view[camera]);
        let sizes: Vec<f64> = sound
            .filter(|cell| !cell.suspicious && cell.error.is_finite())
            .map(|cell| cell.offset.norm())
            .collect();
        median(&sizes)
    }

    /// How well a cell is explained by other world places: median pixel error, over the cell's good
    /// level. Below 1 it is explained.
    pub(super) fn explained(
        &self,
        (view, camera): (usize, usize),
        mut pair: impl FnMut(usize, Pair) -> Option<Pair>,
    ) -> f64 {
        let Some((cell, seen, other)) = self.at(view, camera) else { return f64::INFINITY };
        // Eighty points tell as much as a thousand.
        let step = cell.pairs.len().div_ceil(80).max(1);
        let pairs: Vec<Option<Pair>> = (0..cell.pairs.len())
            .step_by(step)
            .map(|index| pair(index, cell.pairs[index]))
            .collect();
        let known: Vec<Pair> = pairs.iter().flatten().copied().collect();
        // A hypothesis that says nothing of most points explains nothing.
        if known.len() < LEAST.min(cell.pairs.len()) || 2 * known.len() < pairs.len() {
            return f64::INFINITY;
        }
        other.median_error(&known) / seen.good()
    }

    /// Mean over a camera's views of the median error, for one camera fitted to all views, but one that may be
    /// left out, whose points are read in some way (by view, index in the cell, pair). `None` for a reading
    /// that says nothing of most points of a view: it would be judged by the points that it likes.
    pub(super) fn overall(
        &self,
        camera: usize,
        left_out: Option<usize>,
        read: impl Fn(usize, usize, Pair) -> Option<Pair>,
    ) -> Option<f64> {
        let mut views: Vec<Vec<Pair>> = Vec::new();
        for (view, cells) in self.cells.iter().enumerate() {
            if Some(view) == left_out {
                continue;
            }
            let pairs = &cells[camera].pairs;
            let step = pairs.len().div_ceil(SCOUTED).max(1);
            let asked = (0..pairs.len()).step_by(step);
            let told: Vec<Pair> = asked.clone().filter_map(|i| read(view, i, pairs[i])).collect();
            if 2 * told.len() < asked.len() {
                return None;
            }
            views.push(told);
        }
        let all: Vec<Pair> = views.iter().flatten().copied().collect();
        let mut fitted = RobustCamera::fit(&all, 10)?;
        if self.data.has_estimated_poses() {
            fitted = fitted.decentred().refined(&all, 10);
        }
        // A wide lens may want more steps; a wrong reading is not helped by them.
        if fitted.median_error(&all) > 1.0 {
            fitted = fitted.refined(&all, 30);
        }
        let errors: Vec<f64> = views
            .iter()
            .filter(|pairs| pairs.len() >= LEAST)
            .map(|pairs| fitted.median_error(pairs))
            .collect();
        (errors.len() > 1).then(|| mean(&errors))
    }

    /// Whether a view is off by so little of its picture's shorter side that its chart has no other size or
    /// unit: the least that gets mixed up, a factor of two, moves half of its points by an eighth of that.
    pub(super) fn is_slight(&self, view: usize, cameras: &[usize]) -> bool {
        const SLIGHT: f64 = 0.05;
        let slight = |camera: &usize| {
            let cell = &self.cells[view][*camera];
            let [width, height] = sides(&cell.pairs);
            cell.error < SLIGHT * width.min(height)
        };
        cameras.iter().all(slight)
    }

    /// What no explanation of a fault in all views is expected to go below, in pixels: what sound views of
    /// the best camera leave. Where no view is sound that is too much; most detectors err by this all the same.
    pub(super) fn floor(&self) -> f64 {
        const DETECTORS: f64 = 0.15;
        self.seen.iter().flatten().map(|seen| seen.typical).fold(DETECTORS, f64::min)
    }

    /// Mean over a camera's views of their errors.
    pub(super) fn mean_error(&self, camera: usize) -> f64 {
        let errors: Vec<f64> =
            self.cells.iter().map(|view| view[camera].error).filter(|e| e.is_finite()).collect();
        mean(&errors)
    }

    /// What an explanation of a cell leaves at most, over the good level: that level, and where the cell is beyond all
    /// views in depth what extrapolation leaves, unless that is much of its error.
    pub(super) fn most_left(&self, (view, camera): (usize, usize)) -> f64 {
        const MUCH: f64 = 0.4;
        let allowance = self.cells[view][camera].allowance;
        allowance.min(MUCH * self.excess((view, camera))).max(1.0)
    }

    /// Whether an explanation that leaves `left` (over the good level) is to be believed: it brings
    /// the cell down to that level, or takes away nearly all of a great error.
    pub(super) fn accepts(&self, cell: (usize, usize), left: f64) -> bool {
        let before = self.excess(cell);
        left <= 0.5 * before
            && (left <= self.most_left(cell) || left <= 6.0 && left <= 0.06 * before)
    }

    /// By how much errors of points that are neighbours in a picture differ: what a lens formula leaves over, they share.
    fn noise_of(&self, camera: usize) -> f64 {
        let of_view = |view: usize| {
            let (cell, _, other) = self.at(view, camera)?;
            let step = cell.pairs.len().div_ceil(NEIGHBOURS).max(1);
            let errors = cell.pairs.iter().map(|pair| (pair.1, other.error(pair)));
            let errors: Vec<(Pixel, Vector2<f64>)> = errors.collect();
            let differences: Vec<f64> = (0..errors.len())
                .step_by(step)
                .filter_map(|own| {
                    let (at, error) = errors[own];
                    let others = errors.iter().enumerate().filter(|(index, _)| *index != own);
                    let distance = |other: &(Pixel, Vector2<f64>)| (other.0 - at).norm_squared();
                    let (_, near) =
                        others.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))?;
                    Some((near.1 - error).norm() / std::f64::consts::SQRT_2)
                })
                .collect();
            Some(median(&differences))
        };
        let views: Vec<f64> = (0..self.views.len()).filter_map(of_view).collect();
        median(&views)
    }

    /// Whether the lens formula describes a camera's optics: what it leaves over is little more than noise.
    pub(super) fn is_described(&self, camera: usize) -> bool {
        let noise = self.noise[camera];
        self.seen[camera].as_ref().is_some_and(|seen| seen.typical <= 2.0 * noise + EXACT)
    }

    /// Whether what an explanation with a free place leaves of a camera's error speaks for it: it is noise, or less than
    /// such a share of what there was. Where the lens formula does not hold (water, glass), a free place takes up a part
    /// of what it leaves over, and much is left. `error` is before and after, in pixels.
    pub(super) fn is_convincing(&self, camera: usize, error: [f64; 2], share: f64) -> bool {
        const NOISE: f64 = 1.4;
        error[1] <= share * error[0] || error[1] <= NOISE * self.noise[camera] + EXACT
    }

    /// Error of a cell over its good level.
    pub(super) fn excess(&self, (view, camera): (usize, usize)) -> f64 {
        self.at(view, camera).map_or(0.0, |(cell, seen, _)| cell.error / seen.good())
    }
}

/// Median error by axis.
fn offset(camera: &RobustCamera, pairs: &[Pair]) -> Vector2<f64> {
    let errors: Vec<_> = pairs.iter().map(|pair| camera.error(pair)).collect();
    let along = |axis: usize| median(&errors.iter().map(|error| error[axis]).collect::<Vec<_>>());
    Vector2::new(along(0), along(1))
}

fn cell(data: &Dataset, frame: &Frame, view: &View, camera: usize) -> Cell {
    let mut cell = Cell { allowance: 1.0, ..Cell::default() };
    for row in &view.rows {
        let c = &data.correspondences[*row];
        if let (Some(world), Some(Some(pixel))) = (c.world, c.pixels.get(camera)) {
            cell.rows.push(*row);
            cell.pairs.push((frame.scaled(world), *pixel));
        }
    }
    cell
}
