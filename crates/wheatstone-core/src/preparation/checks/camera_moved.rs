//! A camera that stands elsewhere from a view on; and a single picture that was taken while the chart
//! stood elsewhere.

use super::{
    Fault,
    coverage::{THIN, thickness},
    evidence::{Evidence, OF_MANY, OF_ONE},
    finding::{Freedom, Proposal, Severity},
    pairs::Pair,
    parting::parting,
    pixel_offset,
    robust_camera::RobustCamera,
    unsynchronised,
};
use nalgebra::Vector2;
use wheatstone_numeric::statistics::mean;

pub(super) struct CameraMoved;

/// How far above the good level a cell must be before a free pose may explain it: a pose also takes up
/// part of what lenses and stages do.
const CLEARLY: f64 = 3.0;

/// So many points of a cell are used, and less than twice as many: more take time only.
const USED: usize = 14;

impl Fault for CameraMoved {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        if !evidence.are_pictures {
            return found;
        }
        let cameras = 0..evidence.data.cameras;
        let splits: Vec<Option<Split>> =
            cameras.clone().map(|camera| Split::of(evidence, camera)).collect();
        for camera in cameras {
            let views = of_views(evidence, camera);
            match &splits[camera] {
                Some(split)
                    if is_clear(evidence, camera, &splits)
                        && !is_of_views(evidence, camera, &views) =>
                {
                    let counted = split.as_counted(evidence, camera);
                    found
                        .extend(counted.unwrap_or_else(|| vec![proposal(evidence, camera, split)]));
                }
                _ => found.extend(views),
            }
        }
        found
    }

    fn of_picture(&self, evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
        shifted(evidence, picture).or_else(|| single(evidence, picture)).into_iter().collect()
    }
}

/// Pictures of a camera that are explained one by one: shifted as a whole; all from one other place; each from a
/// place of its own.
fn of_views(evidence: &Evidence, camera: usize) -> Vec<Proposal> {
    let cells: Vec<(usize, usize)> = (0..evidence.views.len()).map(|view| (view, camera)).collect();
    let alone: Vec<Proposal> = cells.iter().filter_map(|cell| single(evidence, *cell)).collect();
    let from_one_place = from_one_place(evidence, camera, &alone);
    let explained = |cell: &(usize, usize)| {
        let among = |all: &[Proposal]| all.iter().find(|one| one.cells.contains(cell)).cloned();
        shifted(evidence, *cell).or_else(|| among(&from_one_place)).or_else(|| among(&alone))
    };
    let mut found: Vec<Proposal> = cells.iter().filter_map(explained).collect();
    if is_at_an_end(evidence, camera, &found) {
        for one in &mut found {
            one.changes.clear();
            one.hint = "fix the camera's mount, its focus and its zoom, and record again, or use only the views in which it stands where it will stay".into();
        }
    }
    found
}

/// Whether two pictures or more are explained, which are the first or the last ones: only who took them knows in which
/// place the camera is to be calibrated.
fn is_at_an_end(evidence: &Evidence, camera: usize, explained: &[Proposal]) -> bool {
    let present = (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some());
    let bad: Vec<bool> = present
        .map(|view| explained.iter().any(|one| one.cells.contains(&(view, camera))))
        .collect();
    let ends = bad.first().is_some_and(|first| *first) || bad.last().is_some_and(|last| *last);
    let changes = bad.windows(2).filter(|two| two[0] != two[1]).count();
    explained.len() > 1 && ends && changes == 1
}

/// The same pictures, where the camera took two or more of them from one place.
fn from_one_place(evidence: &Evidence, camera: usize, alone: &[Proposal]) -> Vec<Proposal> {
    let cells: Vec<(usize, usize)> = alone.iter().flat_map(|one| one.cells.clone()).collect();
    let Some(seen) = evidence.seen[camera].as_ref().filter(|_| cells.len() > 1) else {
        return Vec::new();
    };
    let points = |cell: &(usize, usize)| &evidence.cells[cell.0][cell.1].pairs;
    let all: Vec<Pair> = cells.iter().flat_map(points).copied().collect();
    let there = seen.camera.moved(&all, 20);
    let left = |cell: &(usize, usize)| there.median_error(points(cell)) / seen.good();
    if cells.iter().any(|cell| left(cell) > 1.0) {
        return Vec::new();
    }
    let what = "the picture was taken from elsewhere: the camera was moved";
    cells.iter().map(|cell| elsewhere(evidence, *cell, (left(cell), Freedom::Pose), what)).collect()
}

/// A picture that the camera took while it stood elsewhere: it is left out.
fn elsewhere(
    evidence: &Evidence,
    cell: (usize, usize),
    how: (f64, Freedom),
    what: &str,
) -> Proposal {
    let mut found = unsynchronised::proposal(evidence, &[cell], how, "moved".into(), what.into());
    found.code = "camera-moved";
    found.hint =
        "fix the camera's mount and record these views again, or let these pictures be left out"
            .into();
    found
}

/// Whether what is wrong belongs to single views: all cameras see it, or each is explained by itself and they are
/// neither all the first nor all the last ones, or just one.
fn is_of_views(evidence: &Evidence, camera: usize, explained: &[Proposal]) -> bool {
    let present: Vec<usize> =
        (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
    let is_bad = |view: &usize| evidence.cells[*view][camera].suspicious;
    let bad: Vec<usize> = present.iter().copied().filter(is_bad).collect();
    let is_shared = |view: &usize| {
        let cameras = evidence.present(*view).len();
        cameras > 1 && evidence.suspects(*view).len() == cameras
    };
    if bad.iter().all(is_shared) {
        return !bad.is_empty();
    }
    let is_explained =
        |view: &usize| explained.iter().any(|one| one.cells.contains(&(*view, camera)));
    let changes = present.windows(2).filter(|pair| is_bad(&pair[0]) != is_bad(&pair[1])).count();
    bad.iter().all(is_explained) && (changes > 1 || bad.len() == 1)
}

/// A camera with one lens and two places, and how well it does.
struct Halves {
    /// Mean over the views of the median error.
    error: f64,
    before: RobustCamera,
    after: RobustCamera,
}

/// One lens, one place for the views before `at` and one for those from it on.
fn halves(start: &RobustCamera, views: &[Vec<Pair>], at: usize, thorough: bool) -> Halves {
    let join = |part: &[Vec<Pair>]| -> Vec<Pair> { part.iter().flatten().copied().collect() };
    let (first, second) = (join(&views[..at]), join(&views[at..]));
    let lens = start.without_field();
    // The lens is told best by the part with more views.
    let lens = match (thorough, 2 * at >= views.len()) {
        (false, _) => lens,
        (true, true) => lens.refined(&first, 12),
        (true, false) => lens.refined(&second, 12),
    };
    let steps = if thorough { 20 } else { 4 };
    let (before, after) = (lens.moved(&first, steps), lens.moved(&second, steps));
    let errors: Vec<f64> = views
        .iter()
        .enumerate()
        .map(
            |(view, pairs)| {
                if view < at { before.median_error(pairs) } else { after.median_error(pairs) }
            },
        )
        .collect();
    Halves { error: mean(&errors), before, after }
}

/// The points of a camera by view.
pub(super) fn used(evidence: &Evidence, camera: usize, views: &[usize]) -> Vec<Vec<Pair>> {
    let of_view = |view: &usize| {
        let pairs = &evidence.cells[*view][camera].pairs;
        pairs.iter().step_by((pairs.len() / USED).max(1)).copied().collect()
    };
    views.iter().map(of_view).collect()
}

/// One camera for all views, and the mean over them of its median error.
pub(super) fn of_all(start: &RobustCamera, pairs: &[Vec<Pair>]) -> (RobustCamera, f64) {
    let all: Vec<Pair> = pairs.iter().flatten().copied().collect();
    let one = start.without_field().refined(&all, 8);
    let error = mean(&pairs.iter().map(|view| one.median_error(view)).collect::<Vec<_>>());
    (one, error)
}

/// A camera's views parted in two where that explains most.
struct Split {
    /// The views that it saw enough of.
    views: Vec<usize>,
    /// The first of the second part.
    at: usize,
    /// Coordinates of pixels that both errors are of.
    numbers: usize,
    /// Mean over the views of the median error, of one camera for all of them.
    whole: f64,
    /// The same with a place for each part.
    found: Halves,
}

impl Split {
    fn of(evidence: &Evidence, camera: usize) -> Option<Self> {
        let seen = evidence.seen[camera].as_ref()?;
        let views: Vec<usize> =
            (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
        if views.len() < 4 {
            return None;
        }
        let pairs = used(evidence, camera, &views);
        let (one, whole) = of_all(&seen.camera, &pairs);
        let error = |at: usize| {
            let both = [&seen.camera, &one].map(|start| halves(start, &pairs, at, false).error);
            both[0].min(both[1])
        };
        let at = parting(views.len(), error)?;
        let found = [&seen.camera, &one]
            .map(|start| halves(start, &pairs, at, true))
            .into_iter()
            .min_by(|a, b| a.error.total_cmp(&b.error))?;
        let numbers = 2 * pairs.iter().map(Vec::len).sum::<usize>();
        Some(Self { views, at, numbers, whole, found })
    }

    /// The same as pixels counted otherwise in the part with fewer views, where that explains as much: it has one number
    /// where a move has six.
    fn as_counted(&self, evidence: &Evidence, camera: usize) -> Option<Vec<Proposal>> {
        /// What six numbers take up of lenses and noise.
        const AS_WELL: f64 = 1.1;
        let seen = evidence.seen[camera].as_ref()?;
        let (first, second) = self.views.split_at(self.at);
        let part = if first.len() < second.len() { first } else { second };
        let error = |meant: f64| {
            let mut pairs = used(evidence, camera, &self.views);
            let counted = self.views.iter().zip(&mut pairs).filter(|(view, _)| part.contains(view));
            for (_, pixel) in counted.flat_map(|(_, pairs)| pairs) {
                *pixel -= Vector2::repeat(meant);
            }
            of_all(&seen.camera, &pairs).1
        };
        let tried = pixel_offset::KNOWN.map(|meant| (error(meant), meant));
        let (left, meant) = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        (left <= AS_WELL * self.found.error).then(|| {
            pixel_offset::of_views(evidence, camera, part, (meant, Vector2::repeat(meant)))
        })
    }

    /// Error of the camera where it does not move.
    fn before(&self, evidence: &Evidence, camera: usize) -> f64 {
        self.whole.min(evidence.mean_error(camera))
    }

    /// Logarithm of how many times smaller errors are where it may.
    fn gain(&self, evidence: &Evidence, camera: usize) -> f64 {
        libm::log(self.before(evidence, camera) / self.found.error)
    }
}

/// Whether the camera moved: a second place takes away most of its error, or clearly more than of any other
/// camera's, and leaves it about as good as they are. Where charts stand off their places all cameras err alike,
/// and two places of a camera take up part of that.
fn is_clear(evidence: &Evidence, camera: usize, splits: &[Option<Split>]) -> bool {
    let Some(split) = &splits[camera] else { return false };
    let before = split.before(evidence, camera);
    if !evidence.is_convincing(camera, [before, split.found.error], OF_MANY) {
        return false;
    }
    if split.found.error <= 0.45 * before && alone(evidence, camera, (before, split.found.error)) {
        return true;
    }
    // In a slab a camera's place is known by so little that a second one takes up anything.
    if thickness(evidence).is_some_and(|share| share < THIN) {
        return false;
    }
    /// What lenses gain at most, where nothing moved, and how many times as much the camera must, by surveys of
    /// captures with and without stage errors.
    const BY_CHANCE: f64 = 0.1;
    const MORE: f64 = 3.0;
    /// Of few pixels the numbers of a second place, and of a lens for either part, take up more of the noise.
    const TAKEN_UP: f64 = 18.0;
    let by_chance = BY_CHANCE.max(TAKEN_UP / split.numbers as f64);
    let others = splits.iter().enumerate().filter(|(other, _)| *other != camera);
    let gains = others.filter_map(|(other, split)| Some(split.as_ref()?.gain(evidence, other)));
    let most = gains.fold(by_chance, f64::max);
    splits.len() > 1
        && split.gain(evidence, camera) > MORE * most
        && split.found.error <= 1.3 * worst_of_others(evidence, camera).max(0.05)
}

/// The largest of the other cameras' typical errors.
fn worst_of_others(evidence: &Evidence, camera: usize) -> f64 {
    let others = evidence.seen.iter().enumerate().filter(|(other, _)| *other != camera);
    others.filter_map(|(_, seen)| Some(seen.as_ref()?.typical)).fold(0.0, f64::max)
}

/// Whether the camera errs clearly more than every other, and is about as good as they are once it may
/// move.
fn alone(evidence: &Evidence, camera: usize, (whole, error): (f64, f64)) -> bool {
    let most = worst_of_others(evidence, camera);
    let others = (0..evidence.seen.len()).filter(|o| *o != camera && evidence.seen[*o].is_some());
    let mean = others.map(|other| evidence.mean_error(other)).fold(0.0, f64::max);
    // Two places take up a part of what stages and lenses do, but leave the rest: only where nearly all is
    // gone may something be left.
    let left = if error < 0.35 * whole { 3.0 } else { 1.3 };
    (whole > 1.6 * most || evidence.mean_error(camera) > 1.6 * mean)
        && error <= left * most.max(0.05)
}

fn proposal(evidence: &Evidence, camera: usize, split: &Split) -> Proposal {
    let Split { views, at, whole, found, .. } = split;
    let distance = (found.after.centre() - found.before.centre()).norm() * evidence.frame.size;
    let turn = found.after.rotation() * found.before.rotation().transpose();
    let angle = libm::acos(((turn.trace() - 1.0) / 2.0).clamp(-1.0, 1.0)).to_degrees();
    let name = &evidence.views[views[*at]].name;
    let mut figures = unsynchronised::overall_figures(*whole, found.error);
    figures.push((format!("moved, {}", evidence.data.unit), distance));
    figures.push(("turned, degrees".into(), angle));
    Proposal {
        freedom: Freedom::Scale,
        // Simpler explanations of slight errors come first.
        left: 0.9,
        cells: views[*at..].iter().map(|view| (*view, camera)).collect(),
        also: views.iter().map(|view| (*view, camera)).collect(),
        key: "segment".into(),
        figures,
        ..Proposal::itself(
            "camera-moved",
            Severity::Fatal,
            format!(
                "the camera moved before view `{name}`: by {distance:.3} {}, rotated by {angle:.3} degrees",
                evidence.data.unit
            ),
            &format!(
                "fix the camera's mount, its focus and its zoom, and record again, or use only the views before `{name}`, or only those from it on"
            ),
        )
    }
}

/// One picture that fits when it is moved as a whole, while the other cameras' pictures of the view fit: a camera
/// that was touched turns by little more than that.
fn shifted(evidence: &Evidence, cell: (usize, usize)) -> Option<Proposal> {
    /// Ways of counting pixels differ by one at most.
    const COUNTING: f64 = 1.5;
    let (view, camera) = cell;
    let by = evidence.at(view, camera)?.0.offset;
    if evidence.suspects(view) != [camera]
        || evidence.excess(cell) < CLEARLY
        || by.norm() < COUNTING
    {
        return None;
    }
    let left = evidence.explained(cell, |_, (world, pixel)| Some((world, pixel - by)));
    if left > evidence.most_left(cell).min(0.3 * evidence.excess(cell)) {
        return None;
    }
    let what = "the picture is shifted as a whole: the camera was moved";
    let mut found = elsewhere(evidence, cell, (left, Freedom::Scale), what);
    found.figures = vec![("shift of x, px".into(), by.x), ("shift of y, px".into(), by.y)];
    Some(found)
}

/// One picture that fits from another place, while the other cameras' pictures of the view fit.
fn single(evidence: &Evidence, cell: (usize, usize)) -> Option<Proposal> {
    let (view, camera) = cell;
    let (points, seen, other) = evidence.at(view, camera)?;
    if evidence.suspects(view) != [camera] || evidence.excess(cell) < CLEARLY {
        return None;
    }
    let error = other.moved(&points.pairs, 20).median_error(&points.pairs);
    let left = error / seen.good();
    if left > evidence.most_left(cell).min(0.3 * evidence.excess(cell))
        || !evidence.is_convincing(camera, [points.error, error], OF_ONE)
    {
        return None;
    }
    let what = "the picture shows the chart at another pose than the other cameras do: it was taken at another instant, or the camera was moved".to_owned();
    Some(unsynchronised::proposal(
        evidence,
        &[cell],
        (left, Freedom::Pose),
        format!("alone {view}"),
        what,
    ))
}
