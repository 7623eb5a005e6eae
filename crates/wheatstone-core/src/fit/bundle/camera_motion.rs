//! Whether the cameras kept their relative poses while charts were waved before them.
//!
//! A chart's estimated pose takes up a part of what happens to one camera. What it cannot take up is that the relative pose
//! of two cameras is another one in some views. Each way in which it may have changed (from a view on, evenly from view to
//! view, in a few views, in every view) has a gain in the sum of squared errors, which is judged by what freeing the camera
//! in all views gains besides: noise, and what a lens leaves over, change poses from view to view, too.

use super::{
    rig::Terms,
    state::Choice,
    view_equations::{Moved, Together, ViewEquations},
};
use crate::camera::posed_lens::POSE;

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

/// A camera whose pose relative to the others changed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraMotion {
    /// The camera, counted from 0; of two it may as well be the other.
    pub camera: usize,
    /// How it changed.
    pub change: PoseChange,
    /// The views' names in which it is another than in the first one; all of them for a drift.
    pub views: Vec<String>,
    /// By how far the chart's points moved in its pictures, in pixels: root mean square.
    pub shift: f64,
    /// Rotation, in degrees.
    pub rotation: f64,
    /// Translation in the data's unit; 0 where the rotation explains it.
    pub translation: f64,
    /// Root mean square error of a pixel coordinate with constant relative poses, and with this change.
    pub errors: [f64; 2],
}

/// How a camera's pose changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PoseChange {
    /// From a view on.
    Step,
    /// Evenly from the first view to the last.
    Drift,
    /// In some views, in each otherwise.
    Some,
    /// In every view otherwise.
    Every,
}

/// The change of a camera's pose that the views tell; `None` where they tell none, or nothing can be told.
pub(super) fn find<L: Terms>(choice: &Choice<L>, names: &[String]) -> Option<CameraMotion> {
    let cameras = choice.state.cameras.len();
    if cameras < 2 || choice.cost <= 0.0 {
        return None;
    }
    let equations = ViewEquations::new(choice)?;
    let together = equations.together()?;
    let sum = 2.0 * choice.cost;
    let errors = Errors { sum, freedom: sum / (choice.sigma * choice.sigma) };
    // Two cameras move relative to each other.
    let candidates = if cameras == 2 { 1..2 } else { 0..cameras };
    let searches: Vec<Search> = candidates
        .filter_map(|camera| Search::new(&equations, &together, camera, errors))
        .collect();
    let clear = searches.iter().filter_map(Search::best);
    let best = clear.max_by(|a, b| a.gain.total_cmp(&b.gain)).or_else(|| every(&searches))?;
    Some(best.as_motion(choice, &equations, errors, names))
}

/// The camera whose pose is another in every view.
fn every(searches: &[Search]) -> Option<Candidate> {
    let most = searches.iter().max_by(|a, b| a.free.0.total_cmp(&b.free.0))?;
    let others = searches.iter().filter(|other| other.camera != most.camera);
    let second = others.map(|other| other.free.0).fold(0.0, f64::max);
    let (gain, unknowns) = most.free;
    let left = most.within();
    let before = most.errors.sum / most.errors.freedom;
    let is_clear = gain > CLEARLY * unknowns * left && before > IN_EVERY_VIEW * left && gain > MORE * second;
    if !is_clear {
        return None;
    }
    let drift = most.drift()?;
    Some(Candidate { change: PoseChange::Every, gain, unknowns, left, ..drift })
}

impl Candidate {
    fn as_motion<L: Terms>(
        self,
        choice: &Choice<L>,
        equations: &ViewEquations,
        errors: Errors,
        names: &[String],
    ) -> CameraMotion {
        let Self { camera, change, views, gain, unknowns, moved, .. } = self;
        // A mount that gives way turns the camera: a move is told where that is not all.
        let is_turn = moved.gain_of_turn > MOSTLY * moved.gain;
        let pose = if is_turn { moved.turn } else { moved.pose };
        let points = views.iter().map(|view| choice.clean[*view][camera].len()).sum();
        let shift = match change {
            PoseChange::Every => ((gain / unknowns) * POSE as f64).sqrt(),
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
        let times = self.views.iter().map(|view| (*view, (*view as f64 - first) / (last - first) - 0.5));
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
            let Some((view, moved)) = each.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain)) else { break };
            chosen.push(view);
            gain += moved.gain;
            let unknowns = (POSE * chosen.len()) as f64;
            let mut views = chosen.clone();
            views.sort_unstable();
            let least = moved.gain;
            let left = self.left(gain, unknowns);
            if least > CLEARLY * POSE as f64 * left {
                let (camera, change) = (self.camera, PoseChange::Some);
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

pub(super) fn probe<L: Terms>(choice: &Choice<L>, names: &[String]) -> Option<()> {
    let equations = ViewEquations::new(choice)?;
    let together = equations.together()?;
    let cameras = choice.state.cameras.len();
    let errors = Errors { sum: 2.0 * choice.cost, freedom: 2.0 * choice.cost / choice.sigma.powi(2) };
    let candidates = if cameras == 2 { 1..2 } else { 0..cameras };
    for camera in candidates {
        let Some(search) = Search::new(&equations, &together, camera, errors) else { continue };
        let f = |c: &Candidate| format!("{:.2} ({:.2})", c.gain / c.unknowns / c.left, c.gain / c.unknowns / search.within());
        let points = |views: &[usize]| views.iter().map(|v| choice.clean[*v][camera].len()).sum::<usize>();
        let (step, drift) = (search.step()?, search.drift()?);
        let shift = |c: &Candidate, pose| equations.shift((camera, &c.views), pose, points(&c.views));
        let best = search.best();
        let some = search.some().into_iter().map(|c| format!("{}: {}", c.views.iter().map(|v| names[*v].clone()).collect::<Vec<_>>().join(","), f(&c))).collect::<Vec<_>>().join("; ");
        eprintln!("PROBE cam {camera} n {} sigma {:.4} free {:.4} all-F {:.2} | step {} {} turn {:.2} shift {:.3} {:.3} deg {:.4} | drift {} turn {:.2} | some {} => {}", search.views.len(), choice.sigma, search.within().sqrt(), search.free.0/search.free.1/search.within(),
          names[step.views[0]], f(&step), step.moved.gain_of_turn/step.moved.gain, shift(&step, &step.moved.pose), shift(&step, &step.moved.turn), step.moved.turn.norm().to_degrees(), f(&drift), drift.moved.gain_of_turn/drift.moved.gain, some, best.map_or("none".into(), |b| format!("{:?} {}", b.change, f(&b))));
    }
    Some(())
}
