//! Faults put into captures whose truth is known: what people do wrong, one at a time, at several
//! strengths.

mod alteration;
mod recorded;

pub use alteration::Faulty;

use super::random_capture::RandomCapture;
use alteration::{Draw, all, altered, faulty, relabelled};
use recorded::{
    column_unit, corner, duplicated, identical, left_handed, list_reversed, misplaced, moved,
    offset, permuted, quarter_turn, resized, shifted, single_view, thin, units_mixed,
    unsynchronised, wrong_pitch, y_up, y_up_everywhere,
};
use wheatstone_core::dataset::Correspondence;
use wheatstone_numeric::random::Random;

type Inject = fn(Draw) -> Option<Faulty>;

/// The faults, by name.
const FAULTS: &[(&str, Inject)] = &[
    ("cameras swapped in some views", swapped),
    ("board turned by 180 degrees in one camera, some views", turned_in_a_camera),
    ("board turned by 180 degrees in a view, all cameras", turned_in_a_view),
    ("board turned by 90 degrees in a view, all cameras", quarter_turn),
    ("order of rows reversed in one camera, some views", rows_reversed),
    ("rows and columns swapped in one camera, some views", transposed),
    ("list reversed in one camera, some views", list_reversed),
    ("board turned in one camera, all views", turned_everywhere),
    ("points permuted in one camera of a view", permuted),
    ("wrong pitch in a view", wrong_pitch),
    ("units mixed in a view", units_mixed),
    ("one column in another unit, all views", column_unit),
    ("view elsewhere than the file says", misplaced),
    ("one picture of the next view", unsynchronised),
    ("pairs shifted by one from a view on", shifted),
    ("camera moved from a view on", moved),
    ("left-handed world", left_handed),
    ("y up in one camera", y_up),
    ("y up in all cameras", y_up_everywhere),
    ("pixels off by a half or one in one camera, some views", offset),
    ("picture resized in one camera, some views", resized),
    ("single plane", single_view),
    ("thin depth", thin),
    ("points in a corner of the picture", corner),
    ("duplicate view", duplicated),
    ("identical cameras", identical),
];

/// The names of all faults, in their order.
#[must_use]
pub fn names() -> Vec<&'static str> {
    FAULTS.iter().map(|(name, _)| *name).collect()
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
    let data = capture.dataset();
    let views = data.views.len();
    let camera = random.below(data.cameras);
    let mut some: Vec<usize> = (0..views).collect();
    random.shuffle(&mut some);
    some.truncate((1 + strength).min(views / 3).max(1));
    some.sort_unstable();
    let (_, put) = FAULTS.get(fault)?;
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
