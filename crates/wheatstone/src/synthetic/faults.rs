//! Faults put into captures whose truth is known: what people do wrong, one at a time, at several
//! strengths.

use super::random_capture::RandomCapture;
use crate::{
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Pose, Vector3},
    numeric::random::Random,
};

/// A dataset with one fault, and what should be said of it.
#[derive(Clone, Debug)]
pub struct Faulty {
    /// The data.
    pub data: Dataset,
    /// The names that would be right.
    pub codes: &'static [&'static str],
    /// The views that have it; none where the fault is in all or in none in particular.
    pub views: Vec<usize>,
    /// The cameras that have it; none where it is in all or in none in particular.
    pub cameras: Vec<usize>,
}

/// The faults, by name.
pub const FAULTS: &[&str] = &[
    "cameras swapped in some views",
    "board turned by 180 degrees in one camera, some views",
    "board turned by 180 degrees in a view, all cameras",
    "board turned by 90 degrees in a view, all cameras",
    "order of rows reversed in one camera, some views",
    "rows and columns swapped in one camera, some views",
    "list reversed in one camera, some views",
    "board turned in one camera, all views",
    "points permuted in one camera of a view",
    "wrong pitch in a view",
    "units mixed in a view",
    "one picture of the next view",
    "pairs shifted by one from a view on",
    "camera moved from a view on",
    "left-handed world",
    "y up in one camera",
    "pixels off by a half or one in one camera, some views",
    "picture resized in one camera, some views",
    "single plane",
    "thin depth",
    "points in a corner of the picture",
    "duplicate view",
    "identical cameras",
];

/// Puts a fault (an index into [`FAULTS`]) into a capture; `strength` counts from 0 (slight) to 2
/// (gross). `None` where this capture cannot have it.
#[must_use]
pub fn inject(
    capture: &RandomCapture,
    fault: usize,
    strength: usize,
    random: &mut Random,
) -> Option<Faulty> {
    let data = capture.dataset();
    let (views, cameras) = (data.views.len(), data.cameras);
    let camera = random.below(cameras);
    // Up to a third of the views, one at least.
    let mut some: Vec<usize> = (0..views).collect();
    random.shuffle(&mut some);
    some.truncate((1 + strength).min(views / 3).max(1));
    some.sort_unstable();
    let view = some[0];
    let [columns, rows] = capture.counts;
    let turned = |i: usize| columns * rows - 1 - i;
    match fault {
        0 => {
            let other = (camera + 1 + random.below(cameras - 1)) % cameras;
            let mut both = vec![camera, other];
            both.sort_unstable();
            let swap = |row: &mut Correspondence| row.pixels.swap(camera, other);
            Some(faulty(altered(data, &some, swap), &["cameras-swapped"], some, both))
        }
        1 => Some(faulty(
            relabelled(&data, &some, &[camera], turned),
            &["board-turned", "order-reversed"],
            some,
            vec![camera],
        )),
        2 => Some(faulty(
            relabelled(&data, &[view], &all(cameras), turned),
            &["board-turned", "order-reversed"],
            vec![view],
            all(cameras),
        )),
        3 => Some(quarter_turn(capture, data, view)),
        4 => Some(faulty(
            relabelled(&data, &some, &[camera], |i| {
                (rows - 1 - i / columns) * columns + i % columns
            }),
            &["board-mirrored"],
            some,
            vec![camera],
        )),
        5 => Some(faulty(
            relabelled(&data, &some, &[camera], |i| (i % rows) * columns + i / rows),
            &["rows-columns-swapped"],
            some,
            vec![camera],
        )),
        6 => Some(faulty(
            list_reversed(data, &some, camera),
            &["board-turned", "order-reversed"],
            some,
            vec![camera],
        )),
        7 => Some(faulty(
            relabelled(&data, &all(views), &[camera], turned),
            &["board-turned"],
            all(views),
            if cameras > 2 { vec![camera] } else { Vec::new() },
        )),
        8 => Some(permuted(data, view, camera, (strength, random))),
        9 => Some(wrong_pitch(capture, view, strength)),
        10 => Some(units_mixed(capture, data, view, strength)),
        11 => unsynchronised(&data, view, camera),
        12 => shifted(&data, 2 + random.below(views - 3), camera),
        13 => Some(moved(capture, 2 + random.below(views - 3), camera, (strength, random))),
        14 => Some(faulty(
            altered(data, &all(views), |row| {
                row.world = row.world.map(|mut w| {
                    w.x = -w.x;
                    w
                })
            }),
            &["mirrored-frame"],
            Vec::new(),
            Vec::new(),
        )),
        15 => {
            let top = capture.cameras[camera].height as f64 - 1.0;
            let up = move |p: Pixel| Pixel::new(p.x, top - p.y);
            Some(faulty(
                pixels(data, &all(views), camera, up),
                &["v-axis-up"],
                all(views),
                vec![camera],
            ))
        }
        16 => {
            let by = [0.5, -0.5, 1.0][strength];
            let off = move |p: Pixel| Pixel::new(p.x + by, p.y + by);
            Some(faulty(pixels(data, &some, camera, off), &["pixel-offset"], some, vec![camera]))
        }
        17 => {
            let by = [0.75, 0.5, 2.0][strength];
            let sized = move |p: Pixel| Pixel::new((p.x + 0.5) * by - 0.5, (p.y + 0.5) * by - 0.5);
            Some(faulty(
                pixels(data, &some, camera, sized),
                &["picture-resized"],
                some,
                vec![camera],
            ))
        }
        18 => Some(faulty(single_view(data, view), &["single-plane"], Vec::new(), Vec::new())),
        19 => Some(faulty(thin(capture, strength), &["thin-depth"], Vec::new(), Vec::new())),
        20 => corner(capture, data),
        21 => Some(duplicated(data, view)),
        _ => {
            let other = (camera + 1) % cameras;
            let same = |row: &mut Correspondence| row.pixels[other] = row.pixels[camera];
            let mut both = vec![camera, other];
            both.sort_unstable();
            Some(faulty(altered(data, &all(views), same), &["identical-cameras"], all(views), both))
        }
    }
}

fn all(count: usize) -> Vec<usize> {
    (0..count).collect()
}

fn faulty(
    data: Dataset,
    codes: &'static [&'static str],
    views: Vec<usize>,
    cameras: Vec<usize>,
) -> Faulty {
    Faulty { data, codes, views, cameras }
}

fn altered(mut data: Dataset, views: &[usize], change: impl Fn(&mut Correspondence)) -> Dataset {
    for row in data.correspondences.iter_mut().filter(|row| views.contains(&row.view)) {
        change(row);
    }
    data
}

fn pixels(
    data: Dataset,
    views: &[usize],
    camera: usize,
    change: impl Fn(Pixel) -> Pixel,
) -> Dataset {
    altered(data, views, |row| row.pixels[camera] = row.pixels[camera].map(&change))
}

fn index(row: &Correspondence) -> usize {
    row.id.as_ref().and_then(|id| id.parse().ok()).unwrap_or(0)
}

/// Each label gets the pixels of another point of its view.
fn relabelled(
    data: &Dataset,
    views: &[usize],
    cameras: &[usize],
    point: impl Fn(usize) -> usize,
) -> Dataset {
    altered(data.clone(), views, |row| {
        let real = point(index(row));
        let twin = data.correspondences.iter().find(|c| c.view == row.view && index(c) == real);
        for camera in cameras {
            row.pixels[*camera] = twin.and_then(|twin| twin.pixels[*camera]);
        }
    })
    .subset(|_, row| row.seen_by() > 0)
}

fn quarter_turn(capture: &RandomCapture, data: Dataset, view: usize) -> Faulty {
    let placement = capture.placements[view];
    let quarter =
        Pose::from_rotation_vector(Vector3::zeros(), Vector3::z() * std::f64::consts::FRAC_PI_2);
    let turn = |row: &mut Correspondence| {
        row.world = row
            .world
            .map(|w| placement.transform(quarter.transform(placement.inverse().transform(w))));
    };
    let cameras = all(data.cameras);
    faulty(altered(data, &[view], turn), &["board-turned"], vec![view], cameras)
}

fn list_reversed(mut data: Dataset, views: &[usize], camera: usize) -> Dataset {
    for view in views {
        let rows: Vec<usize> = (0..data.correspondences.len())
            .filter(|row| {
                data.correspondences[*row].view == *view
                    && data.correspondences[*row].pixels[camera].is_some()
            })
            .collect();
        let mut seen: Vec<Option<Pixel>> =
            rows.iter().map(|row| data.correspondences[*row].pixels[camera]).collect();
        seen.reverse();
        for (row, pixel) in rows.into_iter().zip(seen) {
            data.correspondences[row].pixels[camera] = pixel;
        }
    }
    data
}

fn permuted(
    mut data: Dataset,
    view: usize,
    camera: usize,
    (strength, random): (usize, &mut Random),
) -> Faulty {
    let mut rows: Vec<usize> = (0..data.correspondences.len())
        .filter(|row| {
            data.correspondences[*row].view == view
                && data.correspondences[*row].pixels[camera].is_some()
        })
        .collect();
    random.shuffle(&mut rows);
    rows.truncate((rows.len() as f64 * [0.35, 0.6, 1.0][strength]) as usize);
    let first = data.correspondences[rows[0]].pixels[camera];
    for pair in rows.windows(2) {
        data.correspondences[pair[0]].pixels[camera] = data.correspondences[pair[1]].pixels[camera];
    }
    data.correspondences[rows[rows.len() - 1]].pixels[camera] = first;
    faulty(data, &["points-permuted"], vec![view], vec![camera])
}

fn wrong_pitch(capture: &RandomCapture, view: usize, strength: usize) -> Faulty {
    let by = [1.03, 0.9, 1.25][strength];
    let data = capture.recorded(
        |_, _, camera| camera.clone(),
        |v, place| if v == view { place * by } else { place },
    );
    faulty(data, &["wrong-pitch"], vec![view], all(capture.cameras.len()))
}

fn units_mixed(capture: &RandomCapture, data: Dataset, view: usize, strength: usize) -> Faulty {
    let by = [10.0, 0.1, 25.4][strength];
    let data = altered(data, &[view], |row| row.world = row.world.map(|w| w * by));
    faulty(data, &["units-mixed"], vec![view], all(capture.cameras.len()))
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

fn unsynchronised(data: &Dataset, view: usize, camera: usize) -> Option<Faulty> {
    let next = if view + 1 < data.views.len() { view + 1 } else { view - 1 };
    let shifted = pictures_of(data, camera, |v| if v == view { next } else { v });
    Some(faulty(shifted, &["unsynchronised", "duplicate-views"], vec![view], vec![camera]))
}

fn shifted(data: &Dataset, from: usize, camera: usize) -> Option<Faulty> {
    let last = data.views.len() - 1;
    let shifted = pictures_of(data, camera, |v| if v >= from { v + 1 } else { v });
    let views = (from..last).collect();
    // The last view has no picture of this camera.
    Some(faulty(shifted, &["unsynchronised"], views, vec![camera]))
}

fn moved(
    capture: &RandomCapture,
    from: usize,
    camera: usize,
    (strength, random): (usize, &mut Random),
) -> Faulty {
    let degrees: f64 = [0.3, 1.0, 3.0][strength];
    let mut any = || random.normal();
    let axis = Vector3::new(any(), any(), any()).normalize();
    let turn = Pose::from_rotation_vector(Vector3::zeros(), axis * degrees.to_radians());
    let data = capture.recorded(
        |view, index, own| {
            let mut own = own.clone();
            if index == camera && view >= from {
                own.camera_from_world.rotation = turn.rotation * own.camera_from_world.rotation;
                own.camera_from_world.translation =
                    turn.rotation * own.camera_from_world.translation;
            }
            own
        },
        |_, place| place,
    );
    faulty(data, &["camera-moved"], (from..capture.placements.len()).collect(), vec![camera])
}

fn single_view(data: Dataset, view: usize) -> Dataset {
    let mut one = data.subset(|_, row| row.view == view);
    one.views = vec![one.views[view].clone()];
    for row in &mut one.correspondences {
        row.view = 0;
    }
    one
}

fn thin(capture: &RandomCapture, strength: usize) -> Dataset {
    let mut near = capture.clone();
    let middle = capture.placements[capture.placements.len() / 2].translation.z;
    let reach = capture.pitch * capture.counts[0] as f64 * [0.02, 0.01, 0.005][strength];
    let count = near.placements.len() as f64;
    for (index, placement) in near.placements.iter_mut().enumerate() {
        let depth = middle + reach * (index as f64 / (count - 1.0) - 0.5);
        *placement = Pose { translation: Vector3::new(0.0, 0.0, depth), ..Pose::default() };
    }
    near.dataset()
}

fn corner(capture: &RandomCapture, data: Dataset) -> Option<Faulty> {
    let (width, height) = (capture.cameras[0].width as f64, capture.cameras[0].height as f64);
    let kept = data
        .subset(|_, row| row.pixels[0].is_some_and(|p| p.x < 0.42 * width && p.y < 0.42 * height));
    let counts: Vec<usize> = (0..kept.views.len())
        .map(|view| {
            kept.correspondences
                .iter()
                .filter(|row| row.view == view && row.pixels.iter().all(Option::is_some))
                .count()
        })
        .collect();
    let enough = counts.iter().filter(|count| **count >= 8).count() >= 4;
    enough.then(|| faulty(kept, &["corner-only"], Vec::new(), Vec::new()))
}

fn duplicated(mut data: Dataset, view: usize) -> Faulty {
    let copy = data.views.len();
    data.views.push("again".into());
    let again: Vec<Correspondence> = data
        .correspondences
        .iter()
        .filter(|row| row.view == view)
        .map(|row| Correspondence { view: copy, ..row.clone() })
        .collect();
    data.correspondences.extend(again);
    let cameras = all(data.cameras);
    faulty(data, &["duplicate-views"], vec![copy], cameras)
}
