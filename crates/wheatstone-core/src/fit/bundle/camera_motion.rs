//! Whether the cameras kept their relative poses while charts were waved before them.
//!
//! A chart's estimated pose takes up a part of what happens to one camera. What it cannot take up is that the relative pose
//! of two cameras is another one in some views. Each way in which it may have changed (from a view on, evenly from view to
//! view, in a few views, in every view) has a gain in the sum of squared errors, which is judged by what freeing the camera
//! in all views gains besides: noise, and what a lens leaves over, change poses from view to view, too.

use super::{
    gather::Gathered,
    rig::Terms,
    solved::{CameraMotion, PoseChange},
    state::{Choice, Shot},
    view_equations::{Moved, Together, ViewEquations},
};
use crate::{
    camera::posed_lens::POSE,
    geometry::{Pixel, Point3},
};
use nalgebra::Vector2;
use wheatstone_numeric::statistics::median;

/// Of fewer views a single one decides.
const LEAST_VIEWS: usize = 5;

/// In pixels: what is left of exact pixels.
const EXACT: f64 = 0.01;

/// So many times what chance gains a change has to gain.
const CLEARLY: f64 = 15.0;

/// The variance of a pixel coordinate is so many times what is left of it, at least, where a camera's pose is another in every
/// view: so far lenses change poses less.
const IN_EVERY_VIEW: f64 = 4.0;

/// So many times as much as of any other camera does freeing its pose in every view gain.
const MORE: f64 = 2.0;

/// A turn alone explains a change where it gains this share of what it gains with a move.
const MOSTLY: f64 = 0.9;

/// Of so many views at most one is elsewhere: those where the camera stayed must be the most.
const FEW: usize = 3;

/// The change of a camera's pose that the views tell; `None` where they tell none, or nothing can be told.
pub(super) fn find<L: Terms>(choice: &Choice<L>, gathered: &Gathered) -> Option<CameraMotion> {
    let cameras = gathered.cameras;
    if cameras < 2 {
        return None;
    }
    let shots = without_gross(choice, &gathered.shots);
    let equations = ViewEquations::new(choice, &shots)?;
    let together = equations.together()?;
    let points: usize = shots.iter().flatten().map(Vec::len).sum();
    let charts = choice.loose.iter().filter(|loose| **loose).count();
    let unknowns = (POSE + choice.terms.len()) * cameras + POSE * charts;
    let errors = Errors {
        sum: equations.squares - together.gain,
        freedom: 2.0 * points as f64 - unknowns as f64,
    };
    // Two cameras move relative to each other.
    let candidates = if cameras == 2 { 1..2 } else { 0..cameras };
    let searches: Vec<Search> = candidates
        .filter_map(|camera| Search::new(&equations, &together, camera, errors))
        .collect();
    let clear = searches.iter().filter_map(Search::best);
    let best = clear.max_by(|a, b| a.gain.total_cmp(&b.gain)).or_else(|| every(&searches))?;
    Some(best.into_motion(&equations, &shots, errors, &gathered.names))
}

/// The points without those that stand out in their picture by six standard deviations and more: a picture that is
/// shifted as a whole stays. Views whose charts were not placed tell nothing.
fn without_gross<L: Terms>(choice: &Choice<L>, shots: &[Shot]) -> Vec<Shot> {
    let state = &choice.state;
    let of_picture = |view: usize, (camera, seen): (usize, &Vec<(Point3, Pixel)>)| {
        let posed = &state.cameras[camera];
        let pose = posed.camera_from_world.after(&state.charts[view]);
        let error = |(place, pixel): &(Point3, Pixel)| {
            let at = posed.lens.project(pose.transform(*place))?;
            Some(((*place, *pixel), at - pixel))
        };
        let errors: Vec<_> = seen.iter().filter_map(error).collect();
        let axis =
            |axis: usize| median(&errors.iter().map(|(_, error)| error[axis]).collect::<Vec<_>>());
        let middle = Vector2::new(axis(0), axis(1));
        let apart: Vec<f64> = errors.iter().map(|(_, error)| (error - middle).norm()).collect();
        // Normal errors of two coordinates have a median length of 1.18 standard deviations.
        let most = 6.0 / 1.18 * median(&apart) + EXACT;
        let kept = errors.iter().zip(apart).filter(|(_, apart)| *apart <= most);
        kept.map(|((seen, _), _)| *seen).collect()
    };
    let of_view = |(view, shot): (usize, &Shot)| -> Shot {
        if !choice.loose[view] {
            return vec![Vec::new(); shot.len()];
        }
        shot.iter().enumerate().map(|seen| of_picture(view, seen)).collect()
    };
    shots.iter().enumerate().map(of_view).collect()
}

/// The camera whose pose is another in every view.
fn every(searches: &[Search]) -> Option<Candidate> {
    let most = searches.iter().max_by(|a, b| a.free.0.total_cmp(&b.free.0))?;
    let others = searches.iter().filter(|other| other.camera != most.camera);
    let second = others.map(|other| other.free.0).fold(0.0, f64::max);
    let (gain, unknowns) = most.free;
    let left = most.within();
    let before = most.errors.sum / most.errors.freedom;
    let is_clear =
        gain > CLEARLY * unknowns * left && before > IN_EVERY_VIEW * left && gain > MORE * second;
    if !is_clear {
        return None;
    }
    let drift = most.drift()?;
    Some(Candidate { change: PoseChange::Every, gain, unknowns, left, ..drift })
}

impl Candidate {
    fn into_motion(
        self,
        equations: &ViewEquations,
        shots: &[Shot],
        errors: Errors,
        names: &[String],
    ) -> CameraMotion {
        let Self { camera, change, views, gain, unknowns, moved, .. } = self;
        // A mount that gives way turns the camera: a move is told where that is not all.
        let is_turn = moved.gain_of_turn > MOSTLY * moved.gain;
        let pose = if is_turn { moved.turn } else { moved.pose };
        let points: usize = views.iter().map(|view| shots[*view][camera].len()).sum();
        let shift = match change {
            // What the charts cannot follow.
            PoseChange::Every => (gain / points.max(1) as f64).sqrt(),
            _ => equations.shift((camera, &views), &pose, points),
        };
        let size = |first: usize| pose.fixed_rows::<3>(first).norm();
        CameraMotion {
            camera,
            change,
            views: views.iter().map(|view| names[*view].clone()).collect(),
            shift,
            rotation: size(0).to_degrees(),
            translation: if is_turn { 0.0 } else { size(3) },
            errors: [
                (errors.sum / errors.freedom).sqrt(),
                ((errors.sum - gain).max(0.0) / (errors.freedom - unknowns)).sqrt(),
            ],
        }
    }
}

/// Squared errors of all pixels, and what they are compared with.
#[derive(Clone, Copy)]
struct Errors {
    sum: f64,
    /// Coordinates less unknowns.
    freedom: f64,
}

/// One camera, whose pose may be another in some views.
struct Search<'a> {
    equations: &'a ViewEquations,
    together: &'a Together<'a>,
    camera: usize,
    /// The views in which its pose relative to others shows.
    views: Vec<usize>,
    errors: Errors,
    /// What its pose gains where it is free in every view, and how many unknowns that takes.
    free: (f64, f64),
}

/// One way in which it may have changed.
struct Candidate {
    camera: usize,
    change: PoseChange,
    views: Vec<usize>,
    gain: f64,
    unknowns: f64,
    moved: Moved,
    /// Variance of a pixel coordinate that is left, by the larger of what is left between views and within them.
    left: f64,
}

impl<'a> Search<'a> {
    fn new(
        equations: &'a ViewEquations,
        together: &'a Together<'a>,
        camera: usize,
        errors: Errors,
    ) -> Option<Self> {
        let views = equations.linked(camera);
        if views.len() < LEAST_VIEWS {
            return None;
        }
        let mut free = equations.clone();
        let mut gain = -together.gain;
        for view in &views {
            gain += free.free(camera, *view)?;
        }
        gain += free.together()?.gain;
        let unknowns = (POSE * (views.len() - 1)) as f64;
        Some(Self { equations, together, camera, views, errors, free: (gain, unknowns) })
    }

    /// Variance of a pixel coordinate within views.
    fn within(&self) -> f64 {
        let (gain, unknowns) = self.free;
        ((self.errors.sum - gain) / (self.errors.freedom - unknowns)).max(EXACT * EXACT)
    }

    /// The variance that is left beside a gain, by what views differ in besides.
    fn left(&self, gain: f64, unknowns: f64) -> f64 {
        let (all, most) = self.free;
        ((all - gain) / (most - unknowns)).max(self.within())
    }

    fn candidate(&self, change: PoseChange, views: Vec<usize>, moved: Moved) -> Candidate {
        let (gain, unknowns) = (moved.gain, POSE as f64);
        let left = self.left(gain, unknowns);
        Candidate { camera: self.camera, change, views, gain, unknowns, moved, left }
    }

    /// It moved once.
    fn step(&self) -> Option<Candidate> {
        let from = |at: usize| {
            let after = self.views[at..].iter().map(|view| (*view, 1.0));
            Some((at, self.together.moved(self.camera, after)?))
        };
        let all = (1..self.views.len()).filter_map(from);
        let (at, moved) = all.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain))?;
        Some(self.candidate(PoseChange::Step, self.views[at..].to_vec(), moved))
    }

    /// It moves evenly.
    fn drift(&self) -> Option<Candidate> {
        let (first, last) = (*self.views.first()? as f64, *self.views.last()? as f64);
        let times =
            self.views.iter().map(|view| (*view, (*view as f64 - first) / (last - first) - 0.5));
        let moved = self.together.moved(self.camera, times)?;
        Some(self.candidate(PoseChange::Drift, self.views.clone(), moved))
    }

    /// It was elsewhere in a few views: one after the other, each time the one that gains most.
    fn some(&self) -> Vec<Candidate> {
        let mut equations = self.equations.clone();
        let mut chosen: Vec<usize> = Vec::new();
        let mut gain = 0.0;
        let mut all = Vec::new();
        while FEW * chosen.len() < self.views.len() {
            let Some(together) = equations.together() else { break };
            let rest = self.views.iter().filter(|view| !chosen.contains(view));
            let each = rest.filter_map(|view| {
                Some((*view, together.moved(self.camera, [(*view, 1.0)].into_iter())?))
            });
            let Some((view, moved)) = each.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain)) else {
                break;
            };
            chosen.push(view);
            gain += moved.gain;
            let unknowns = (POSE * chosen.len()) as f64;
            let mut views = chosen.clone();
            views.sort_unstable();
            let least = moved.gain;
            let left = self.left(gain, unknowns);
            if least > CLEARLY * POSE as f64 * left {
                let (camera, change) = (self.camera, PoseChange::FewViews);
                all.push(Candidate { camera, change, views, gain, unknowns, moved, left });
            }
            if equations.free(self.camera, view).is_none() {
                break;
            }
        }
        all
    }

    fn best(&self) -> Option<Candidate> {
        let all = self.step().into_iter().chain(self.drift()).chain(self.some());
        let is_clear = |one: &Candidate| one.gain > CLEARLY * one.unknowns * one.left;
        // Each unknown has to gain what chance gains among so many.
        let worth = |one: &Candidate| one.gain - CLEARLY * one.unknowns * self.within();
        all.filter(is_clear).max_by(|a, b| worth(a).total_cmp(&worth(b)))
    }
}
