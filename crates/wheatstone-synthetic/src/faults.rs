//! Faults put into captures whose truth is known: what people do wrong, one at a time, at several
//! strengths.

mod alteration;
mod recorded;

pub use alteration::Faulty;

use super::random_capture::RandomCapture;
use alteration::{Draw, all, altered, faulty, relabelled};
use recorded::{
    column_unit, corner, drifting, duplicated, identical, left_handed, list_reversed, misplaced,
    moved, offset, other_pose, permuted, pixels_shifted, pixels_shifted_on, quarter_turn, resized,
    shifted, single_view, thin, units_mixed, unsynchronised, wrong_pitch, y_up, y_up_everywhere,
    y_up_in_views,
};
use wheatstone_core::dataset::Correspondence;
use wheatstone_numeric::random::Random;

type Inject = fn(Draw) -> Option<Faulty>;

/// What captures can have a fault.
#[derive(Clone, Copy)]
enum Points {
    /// All.
    Any,
    /// Those whose views are planes.
    Plane,
    /// Those of a lattice, whose points have the same labels in every view.
    Lattice,
}

/// Of which charts a fault can be told.
#[derive(Clone, Copy, PartialEq)]
enum Charts {
    /// Those held by hand too, whose poses are estimated.
    Any,
    /// Those whose places are given.
    Placed,
}

/// The faults, by name.
const FAULTS: &[(&str, Inject, Points, Charts)] = &[
    ("cameras swapped in some views", swapped, Points::Any, Charts::Any),
    (
        "board turned by 180 degrees in one camera, some views",
        turned_in_a_camera,
        Points::Lattice,
        Charts::Any,
    ),
    (
        "board turned by 180 degrees in a view, all cameras",
        turned_in_a_view,
        Points::Lattice,
        Charts::Placed,
    ),
    (
        "board turned by 90 degrees in a view, all cameras",
        quarter_turn,
        Points::Lattice,
        Charts::Placed,
    ),
    (
        "order of rows reversed in one camera, some views",
        rows_reversed,
        Points::Lattice,
        Charts::Any,
    ),
    (
        "rows and columns swapped in one camera, some views",
        transposed,
        Points::Lattice,
        Charts::Any,
    ),
    ("list reversed in one camera, some views", list_reversed, Points::Any, Charts::Any),
    ("board turned in one camera, all views", turned_everywhere, Points::Lattice, Charts::Placed),
    ("points permuted in one camera of a view", permuted, Points::Any, Charts::Any),
    ("wrong pitch in a view", wrong_pitch, Points::Any, Charts::Any),
    ("units mixed in a view", units_mixed, Points::Any, Charts::Any),
    ("one column in another unit, all views", column_unit, Points::Any, Charts::Placed),
    ("view elsewhere than the file says", misplaced, Points::Any, Charts::Placed),
    ("one picture of the next view", unsynchronised, Points::Lattice, Charts::Any),
    ("pairs shifted by one from a view on", shifted, Points::Lattice, Charts::Any),
    ("camera moved from a view on", moved, Points::Any, Charts::Any),
    ("left-handed world", left_handed, Points::Any, Charts::Placed),
    ("y up in one camera", y_up, Points::Any, Charts::Any),
    ("y up in all cameras", y_up_everywhere, Points::Any, Charts::Placed),
    ("pixels off by a half or one in one camera, some views", offset, Points::Any, Charts::Any),
    ("picture resized in one camera, some views", resized, Points::Any, Charts::Any),
    ("single plane", single_view, Points::Plane, Charts::Placed),
    ("thin depth", thin, Points::Plane, Charts::Placed),
    ("points in a corner of the picture", corner, Points::Any, Charts::Placed),
    ("duplicate view", duplicated, Points::Any, Charts::Placed),
    ("identical cameras", identical, Points::Any, Charts::Placed),
    ("y up in one camera, some views", y_up_in_views, Points::Any, Charts::Any),
    ("pixels of one camera shifted from a view on", pixels_shifted_on, Points::Any, Charts::Any),
    ("pixels of one camera shifted in some views", pixels_shifted, Points::Any, Charts::Any),
    ("chart in the other of its two poses, a view", other_pose, Points::Plane, Charts::Placed),
    ("pixels of one camera drift, views in no order", drifting, Points::Any, Charts::Any),
];

/// The names of all faults, in their order.
#[must_use]
pub fn names() -> Vec<&'static str> {
    FAULTS.iter().map(|(name, ..)| *name).collect()
}

/// Puts a fault (its place in [`names`]) into a capture; `strength` counts from 0 (slight) to 2
/// (gross). `None` where this capture cannot have it, or there is no such fault.
#[must_use]
pub fn inject(
    capture: &RandomCapture,
    fault: usize,
    strength: usize,
    random: &mut Random,
) -> Option<Faulty> {
    let (_, put, points, charts) = FAULTS.get(fault)?;
    let can_have_it = match points {
        Points::Any => true,
        Points::Plane => capture.scattered.is_none_or(|depth| depth == 0.0),
        Points::Lattice => capture.scattered.is_none(),
    };
    if !can_have_it || capture.held_by_hand && *charts == Charts::Placed {
        return None;
    }
    let data = capture.dataset();
    let views = data.views.len();
    let camera = random.below(data.cameras);
    let mut some: Vec<usize> = (0..views).collect();
    random.shuffle(&mut some);
    some.truncate((1 + strength).min(views / 3).max(1));
    some.sort_unstable();
    put(Draw { capture, data, strength: strength.min(2), random, camera, some })
}

const TURNED: &[&str] = &["board-turned", "order-reversed"];

fn swapped(draw: Draw) -> Option<Faulty> {
    let cameras = draw.data.cameras;
    let (camera, other) =
        (draw.camera, (draw.camera + 1 + draw.random.below(cameras - 1)) % cameras);
    let swap = |row: &mut Correspondence| row.pixels.swap(camera, other);
    let data = altered(draw.data, &draw.some, swap);
    Some(faulty(data, &["cameras-swapped"], draw.some, vec![camera.min(other), camera.max(other)]))
}

/// The number of the point opposite.
fn opposite(capture: &RandomCapture, index: usize) -> usize {
    capture.counts[0] * capture.counts[1] - 1 - index
}

fn turned_in_a_camera(draw: Draw) -> Option<Faulty> {
    let cameras = [draw.camera];
    let data = relabelled(&draw.data, &draw.some, &cameras, |i| opposite(draw.capture, i));
    Some(faulty(data, TURNED, draw.some, cameras.to_vec()))
}

fn turned_in_a_view(draw: Draw) -> Option<Faulty> {
    let (view, cameras) = (draw.some[0], all(draw.data.cameras));
    let data = relabelled(&draw.data, &[view], &cameras, |i| opposite(draw.capture, i));
    Some(faulty(data, TURNED, vec![view], cameras))
}

fn turned_everywhere(draw: Draw) -> Option<Faulty> {
    let views = all(draw.data.views.len());
    let data = relabelled(&draw.data, &views, &[draw.camera], |i| opposite(draw.capture, i));
    // Of two cameras nobody can tell which is upright.
    let cameras = if data.cameras > 2 { vec![draw.camera] } else { Vec::new() };
    Some(faulty(data, TURNED, views, cameras))
}

fn rows_reversed(draw: Draw) -> Option<Faulty> {
    let [columns, rows] = draw.capture.counts;
    let mirrored = |i: usize| (rows - 1 - i / columns) * columns + i % columns;
    let data = relabelled(&draw.data, &draw.some, &[draw.camera], mirrored);
    Some(faulty(data, &["board-mirrored"], draw.some, vec![draw.camera]))
}

fn transposed(draw: Draw) -> Option<Faulty> {
    let [columns, rows] = draw.capture.counts;
    let by_column = |i: usize| (i % rows) * columns + i / rows;
    let data = relabelled(&draw.data, &draw.some, &[draw.camera], by_column);
    Some(faulty(data, &["rows-columns-swapped"], draw.some, vec![draw.camera]))
}
