//! Middlebury's pairs (Scharstein and Szeliski 2002, doi:10.1023/A:1014573219977, and later sets).

use crate::measure::{Judged, bad, confident, median_error};
use std::{fs, path::PathBuf};
use wheatstone_stereo::{DisparityMap, Matcher, Picture};

/// In `WHEATSTONE_DATA`, or in `shared/data` beside the project.
fn folder(pair: &str) -> Option<PathBuf> {
    let root = std::env::var_os("WHEATSTONE_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let folder = root.join("stereo").join(pair);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no `stereo/{pair}` in {}; set WHEATSTONE_DATA", root.display());
    None
}

struct Truth {
    disparity: Vec<f32>,
    is_seen_by_both: Vec<bool>,
}

fn open(
    pair: &str,
    end: i32,
    matcher: impl Fn(Matcher) -> Matcher,
) -> Option<(DisparityMap, Truth)> {
    let folder = folder(pair)?;
    let grey = |name: &str| image::open(folder.join(name)).unwrap().to_luma8();
    let (left, right, seen) = (grey("left.png"), grey("right.png"), grey("nocc.png"));
    let (width, height) = (left.width() as usize, left.height() as usize);
    let picture = |pixels| Picture::new(width, height, pixels).unwrap();
    let matcher = matcher(Matcher::new(0..end));
    let map = matcher.compute(&picture(left.as_raw()), &picture(right.as_raw())).unwrap();
    let bytes = fs::read(folder.join("disp.npy")).unwrap();
    let values = &bytes[bytes.len() - 4 * width * height..];
    let disparity = values.as_chunks().0.iter().map(|&value| f32::from_le_bytes(value)).collect();
    let is_seen_by_both = seen.as_raw().iter().map(|&seen| seen > 0).collect();
    Some((map, Truth { disparity, is_seen_by_both }))
}

fn judge(map: &DisparityMap, truth: &Truth, above: f32) -> Vec<Judged> {
    confident(map, above, |x, y| {
        let disparity = truth.disparity[y * map.width + x];
        disparity.is_finite().then_some(f64::from(disparity))
    })
}

/// Name, end of the range; the least share of all pixels above a confidence of 0.9, and of those the most that may be
/// 2 pixels off, and the median error.
const PAIRS: [(&str, i32, f64, f64, f64); 3] = [
    ("cones", 64, 0.72, 0.010, 0.125),
    ("motorcycle", 64, 0.67, 0.018, 0.150),
    ("syn0", 80, 0.74, 0.007, 0.075),
];

#[test]
fn confident_disparities_are_right_and_many() {
    for (pair, end, density, most_bad, median) in PAIRS {
        let Some((map, truth)) = open(pair, end, |matcher| matcher) else { return };
        let judged = judge(&map, &truth, 0.9);
        let found = (map.density(0.9), bad(&judged, 2.0), median_error(&judged));
        assert!(found.0 >= density && found.1 <= most_bad && found.2 <= median, "{pair} {found:?}");
    }
}

#[test]
fn filled_maps_are_mostly_right() {
    let Some((map, truth)) = open("cones", 64, |matcher| matcher.filling(true)) else { return };
    let known: Vec<usize> =
        (0..map.disparity.len()).filter(|&at| truth.disparity[at].is_finite()).collect();
    let wrong = |at: &&usize| (map.disparity[**at] - truth.disparity[**at]).abs() > 2.0;
    let share = known.iter().filter(wrong).count() as f64 / known.len() as f64;
    assert!(share < 0.095, "{share}");
    assert!(truth.is_seen_by_both.iter().any(|&seen| !seen));
}
