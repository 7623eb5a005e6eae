//! Faults of what was recorded and of what the file says of it.

use super::alteration::{Draw, Faulty, all, altered, faulty, pixels};
use wheatstone_core::{
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Pose, Vector3, other_tilt},
};

pub(super) fn quarter_turn(draw: Draw) -> Option<Faulty> {
    let view = draw.some[0];
    let placement = draw.capture.placements[view];
    let quarter =
        Pose::from_rotation_vector(Vector3::zeros(), Vector3::z() * std::f64::consts::FRAC_PI_2);
    let turned = |w| placement.transform(quarter.transform(placement.inverse().transform(w)));
    let cameras = all(draw.data.cameras);
    let data = altered(draw.data, &[view], |row| row.world = row.world.map(turned));
    Some(faulty(data, &["board-turned"], vec![view], cameras))
}

/// Rows of a view that a camera saw.
fn seen(data: &Dataset, view: usize, camera: usize) -> Vec<usize> {
    let row = |row: &usize| {
        let c = &data.correspondences[*row];
        c.view == view && c.pixels[camera].is_some()
    };
    (0..data.correspondences.len()).filter(row).collect()
}

pub(super) fn list_reversed(draw: Draw) -> Option<Faulty> {
    let (mut data, camera) = (draw.data, draw.camera);
    for view in &draw.some {
        let rows = seen(&data, *view, camera);
        let pixels: Vec<Option<Pixel>> =
            rows.iter().map(|row| data.correspondences[*row].pixels[camera]).collect();
        for (row, pixel) in rows.into_iter().zip(pixels.into_iter().rev()) {
            data.correspondences[row].pixels[camera] = pixel;
        }
    }
    Some(faulty(data, &["board-turned", "order-reversed"], draw.some, vec![camera]))
}

pub(super) fn permuted(draw: Draw) -> Option<Faulty> {
    let (mut data, camera, view) = (draw.data, draw.camera, draw.some[0]);
    let mut rows = seen(&data, view, camera);
    draw.random.shuffle(&mut rows);
    rows.truncate((rows.len() as f64 * [0.35, 0.6, 1.0][draw.strength]) as usize);
    let first = data.correspondences[*rows.first()?].pixels[camera];
    for pair in rows.windows(2) {
        data.correspondences[pair[0]].pixels[camera] = data.correspondences[pair[1]].pixels[camera];
    }
    data.correspondences[*rows.last()?].pixels[camera] = first;
    Some(faulty(data, &["points-permuted"], vec![view], vec![camera]))
}

pub(super) fn wrong_pitch(draw: Draw) -> Option<Faulty> {
    let (by, view) = ([1.03, 0.9, 1.25][draw.strength], draw.some[0]);
    let data = draw.capture.recorded(
        |_, _, camera| camera.clone(),
        |v, place| if v == view { place * by } else { place },
    );
    let cameras = all(data.cameras);
    Some(faulty(data, &["wrong-pitch"], vec![view], cameras))
}

pub(super) fn units_mixed(draw: Draw) -> Option<Faulty> {
    let (by, view) = ([10.0, 0.1, 25.4][draw.strength], draw.some[0]);
    let cameras = all(draw.data.cameras);
    let data = altered(draw.data, &[view], |row| {
        row.world = row.world.map(|w| w * by);
        row.board = row.board.map(|board| board.map(|side| side * by));
    });
    Some(faulty(data, &["units-mixed"], vec![view], cameras))
}

pub(super) fn column_unit(draw: Draw) -> Option<Faulty> {
    // Of points that belong to no rigid chart nothing tells how deep they lie before cameras that look along Z.
    let axes = if draw.capture.scattered.is_some() { 2 } else { 3 };
    let (by, axis) = ([0.1, 10.0, 25.4][draw.strength], draw.random.below(axes));
    // Of charts that are parallel and before cameras that look along Z nothing would tell.
    let tilt = |pose: &Pose| pose.rotation[(2, 2)] < 0.98;
    if draw.capture.placements.iter().filter(|pose| tilt(pose)).count() < 2 {
        return None;
    }
    let views = all(draw.data.views.len());
    let scaled = |mut world: Point3| {
        world[axis] *= by;
        world
    };
    let data = altered(draw.data, &views, |row| row.world = row.world.map(scaled));
    Some(faulty(data, &["units-mixed"], views, Vec::new()))
}

pub(super) fn misplaced(draw: Draw) -> Option<Faulty> {
    let view = draw.some[0];
    let share = [0.05, 0.1, 0.2][draw.strength] * draw.capture.placements[view].translation.norm();
    let mut any = || draw.random.normal();
    let by = Vector3::new(any(), any(), any()).normalize() * share;
    let cameras = all(draw.data.cameras);
    let data = altered(draw.data, &[view], |row| row.world = row.world.map(|w| w + by));
    Some(faulty(data, &["view-misplaced"], vec![view], cameras))
}

/// A view whose pose was found from one camera's picture, which shows the chart nearly alike in two.
pub(super) fn other_pose(draw: Draw) -> Option<Faulty> {
    let centre = draw.capture.cameras[draw.camera].centre();
    let turn = |view: usize| {
        let placement = &draw.capture.placements[view];
        let sight = placement.translation - centre.coords;
        let rotation = other_tilt(sight, placement.rotation.column(2).into());
        Pose { rotation, translation: placement.translation - rotation * placement.translation }
    };
    // Less is no fault; more is seen.
    let is_two_fold = |view: &usize| (0.1..0.7).contains(&turn(*view).rotation_vector().norm());
    let view = (0..draw.data.views.len()).find(is_two_fold)?;
    let moved = turn(view);
    let cameras = all(draw.data.cameras);
    let data = altered(draw.data, &[view], |row| row.world = row.world.map(|w| moved.transform(w)));
    Some(faulty(data, &["pose-two-fold"], vec![view], cameras))
}

/// The pixels of a camera's view `from` where `view`'s should be.
fn pictures_of(data: &Dataset, camera: usize, from: impl Fn(usize) -> usize) -> Dataset {
    let mut shifted = data.clone();
    for row in &mut shifted.correspondences {
        let other = from(row.view);
        if other != row.view {
            let twin = data.correspondences.iter().find(|c| c.view == other && c.id == row.id);
            row.pixels[camera] = twin.and_then(|twin| twin.pixels[camera]);
        }
    }
    shifted.subset(|_, row| row.seen_by() > 0)
}

pub(super) fn unsynchronised(draw: Draw) -> Option<Faulty> {
    let view = draw.some[0];
    let next = if view + 1 < draw.data.views.len() { view + 1 } else { view - 1 };
    let data = pictures_of(&draw.data, draw.camera, |v| if v == view { next } else { v });
    Some(faulty(data, &["unsynchronised", "duplicate-views"], vec![view], vec![draw.camera]))
}

pub(super) fn shifted(draw: Draw) -> Option<Faulty> {
    let count = draw.data.views.len();
    let from = 2 + draw.random.below(count - 3);
    let data = pictures_of(&draw.data, draw.camera, |v| if v >= from { v + 1 } else { v });
    // The last view has no picture of this camera.
    Some(faulty(data, &["unsynchronised"], (from..count - 1).collect(), vec![draw.camera]))
}

pub(super) fn moved(draw: Draw) -> Option<Faulty> {
    let count = draw.data.views.len();
    let from = 2 + draw.random.below(count - 3);
    let degrees: f64 = [0.3, 1.0, 3.0][draw.strength];
    let mut any = || draw.random.normal();
    let axis = Vector3::new(any(), any(), any()).normalize();
    let turn = Pose::from_rotation_vector(Vector3::zeros(), axis * degrees.to_radians()).rotation;
    let data = draw.capture.recorded(
        |view, index, own| {
            let mut own = own.clone();
            if index == draw.camera && view >= from {
                let pose = &mut own.camera_from_world;
                *pose =
                    Pose { rotation: turn * pose.rotation, translation: turn * pose.translation };
            }
            own
        },
        |_, place| place,
    );
    Some(faulty(data, &["camera-moved"], (from..count).collect(), vec![draw.camera]))
}

pub(super) fn left_handed(draw: Draw) -> Option<Faulty> {
    let views = all(draw.data.views.len());
    let mirrored = |w: Point3| Point3::new(-w.x, w.y, w.z);
    let data = altered(draw.data, &views, |row| row.world = row.world.map(mirrored));
    Some(faulty(data, &["mirrored-frame"], Vec::new(), Vec::new()))
}

pub(super) fn y_up(draw: Draw) -> Option<Faulty> {
    let top = draw.capture.cameras[draw.camera].height as f64 - 1.0;
    let views = all(draw.data.views.len());
    let data = pixels(draw.data, &views, draw.camera, |p| Pixel::new(p.x, top - p.y));
    Some(faulty(data, &["v-axis-up"], views, vec![draw.camera]))
}

pub(super) fn y_up_in_views(draw: Draw) -> Option<Faulty> {
    let top = draw.capture.cameras[draw.camera].height as f64 - 1.0;
    let data = pixels(draw.data, &draw.some, draw.camera, |p| Pixel::new(p.x, top - p.y));
    Some(faulty(data, &["v-axis-up"], draw.some, vec![draw.camera]))
}

/// By some pixels that no way of counting differs by, in any direction.
fn any_shift(draw: &mut Draw) -> [f64; 2] {
    let by = [4.0, 10.0, 40.0][draw.strength] * draw.random.uniform(0.8, 1.2);
    let angle = draw.random.uniform(0.0, std::f64::consts::TAU);
    [by * libm::cos(angle), by * libm::sin(angle)]
}

pub(super) fn pixels_shifted_on(mut draw: Draw) -> Option<Faulty> {
    let count = draw.data.views.len();
    let views: Vec<usize> = (2 + draw.random.below(count - 3)..count).collect();
    let [x, y] = any_shift(&mut draw);
    let data = pixels(draw.data, &views, draw.camera, |p| Pixel::new(p.x + x, p.y + y));
    Some(faulty(data, &["camera-moved"], views, vec![draw.camera]))
}

/// In order of depth nobody can tell a drift from another camera.
pub(super) fn drifting(mut draw: Draw) -> Option<Faulty> {
    let [x, y] = any_shift(&mut draw);
    let mut order = all(draw.data.views.len());
    draw.random.shuffle(&mut order);
    let (mut data, camera, last) = (draw.data, draw.camera, order.len() - 1);
    for row in &mut data.correspondences {
        row.view = order[row.view];
        let time = row.view as f64 / last as f64;
        row.pixels[camera] = row.pixels[camera].map(|p| Pixel::new(p.x + time * x, p.y + time * y));
    }
    data.correspondences.sort_by_key(|row| row.view);
    Some(faulty(data, &["camera-drifted"], all(last + 1), vec![camera]))
}

pub(super) fn pixels_shifted(mut draw: Draw) -> Option<Faulty> {
    let [x, y] = any_shift(&mut draw);
    let count = draw.data.views.len();
    let data = pixels(draw.data, &draw.some, draw.camera, |p| Pixel::new(p.x + x, p.y + y));
    // Of the first views nobody can tell: then it moved before the next.
    let first = draw.some.len();
    let views = if draw.some[first - 1] == first - 1 && first > 1 {
        (first..count).collect()
    } else {
        draw.some
    };
    Some(faulty(data, &["camera-moved"], views, vec![draw.camera]))
}

pub(super) fn y_up_everywhere(draw: Draw) -> Option<Faulty> {
    let tops: Vec<f64> = draw.capture.cameras.iter().map(|own| own.height as f64 - 1.0).collect();
    let mut data = draw.data;
    for row in &mut data.correspondences {
        for (pixel, top) in row.pixels.iter_mut().zip(&tops) {
            *pixel = pixel.map(|p| Pixel::new(p.x, top - p.y));
        }
    }
    Some(faulty(data, &["mirrored-frame", "v-axis-up"], Vec::new(), Vec::new()))
}

pub(super) fn offset(draw: Draw) -> Option<Faulty> {
    let by = [0.5, -0.5, 1.0][draw.strength];
    let data = pixels(draw.data, &draw.some, draw.camera, |p| Pixel::new(p.x + by, p.y + by));
    Some(faulty(data, &["pixel-offset"], draw.some, vec![draw.camera]))
}

pub(super) fn resized(draw: Draw) -> Option<Faulty> {
    let by = [0.75, 0.5, 2.0][draw.strength];
    let sized = |value: f64| (value + 0.5) * by - 0.5;
    let data = pixels(draw.data, &draw.some, draw.camera, |p| p.map(sized));
    Some(faulty(data, &["picture-resized"], draw.some, vec![draw.camera]))
}

pub(super) fn single_view(draw: Draw) -> Option<Faulty> {
    let view = draw.some[0];
    let mut one = draw.data.subset(|_, row| row.view == view);
    one.views = vec![one.views[view].clone()];
    for row in &mut one.correspondences {
        row.view = 0;
    }
    Some(faulty(one, &["single-plane"], Vec::new(), Vec::new()))
}

pub(super) fn thin(draw: Draw) -> Option<Faulty> {
    let mut near = draw.capture.clone();
    let count = near.placements.len();
    let middle = near.placements[count / 2].translation.z;
    let reach = near.pitch * near.counts[0] as f64 * [0.02, 0.01, 0.005][draw.strength];
    for (index, placement) in near.placements.iter_mut().enumerate() {
        let depth = middle + reach * (index as f64 / (count as f64 - 1.0) - 0.5);
        *placement = Pose { translation: Vector3::new(0.0, 0.0, depth), ..Pose::default() };
    }
    Some(faulty(near.dataset(), &["thin-depth"], Vec::new(), Vec::new()))
}

pub(super) fn corner(draw: Draw) -> Option<Faulty> {
    // Two fifths of the width and of the height.
    const PART: f64 = 0.42;
    let first = &draw.capture.cameras[0];
    let (right, bottom) = (PART * first.width as f64, PART * first.height as f64);
    let inside = |p: Pixel| p.x < right && p.y < bottom;
    let kept = draw.data.subset(|_, row| row.pixels[0].is_some_and(inside));
    let whole = |view: usize| {
        let rows = kept.correspondences.iter().filter(|row| row.view == view);
        rows.filter(|row| row.pixels.iter().all(Option::is_some)).count()
    };
    let enough = (0..kept.views.len()).filter(|view| whole(*view) >= 8).count() >= 4;
    enough.then(|| faulty(kept, &["corner-only"], Vec::new(), Vec::new()))
}

pub(super) fn duplicated(draw: Draw) -> Option<Faulty> {
    let (mut data, view) = (draw.data, draw.some[0]);
    let copy = data.views.len();
    data.views.push("again".into());
    let rows = data.correspondences.iter().filter(|row| row.view == view);
    let again: Vec<Correspondence> =
        rows.map(|row| Correspondence { view: copy, ..row.clone() }).collect();
    data.correspondences.extend(again);
    let cameras = all(data.cameras);
    Some(faulty(data, &["duplicate-views"], vec![copy], cameras))
}

pub(super) fn identical(draw: Draw) -> Option<Faulty> {
    let (camera, other) = (draw.camera, (draw.camera + 1) % draw.data.cameras);
    let views = all(draw.data.views.len());
    let same = |row: &mut Correspondence| row.pixels[other] = row.pixels[camera];
    let data = altered(draw.data, &views, same);
    Some(faulty(data, &["identical-cameras"], views, vec![camera.min(other), camera.max(other)]))
}
