//! Cameras that move while a chart is waved before them.

use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::{
    dataset::Dataset,
    fit::bundle::{self, BundleSettings, CameraMotion, PoseChange},
    geometry::Pixel,
    preparation::{self, checks::Severity},
};
use wheatstone_numeric::{progress::Silent, random::Random};
use wheatstone_synthetic::{HandHeld, Noise, Rig, hand_held_correspondences};

/// Views of a chart of 63 corners, in no order, before cameras with this lens.
fn capture(rig: &str, cameras: usize, seed: u64) -> Dataset {
    let rig = Rig::named(rig, cameras).unwrap();
    let grid = LineGrid { columns: 9, rows: 7, ..LineGrid::default() };
    let chart = AnyChart::from(LineGrid { pitch: rig.chart_pitch(), ..grid });
    let held = HandHeld { views: 12, ..HandHeld::default() };
    let mut placements = held.placements(&chart, seed).unwrap();
    let mut poses: Vec<_> = placements.iter().map(|(_, pose)| *pose).collect();
    Random::new(seed).shuffle(&mut poses);
    placements.iter_mut().zip(poses).for_each(|(placement, pose)| placement.1 = pose);
    hand_held_correspondences(&rig, &chart, &placements, (Noise::Normal(0.1), seed)).0
}

/// The last camera's picture shifted by a multiple of (1.2, 1.6) pixels in each view.
fn shifted(mut data: Dataset, times: impl Fn(usize) -> f64) -> Dataset {
    for row in &mut data.correspondences {
        let (time, last) = (times(row.view), row.pixels.len() - 1);
        let by = |pixel: Pixel| Pixel::new(pixel.x + 1.2 * time, pixel.y + 1.6 * time);
        row.pixels[last] = row.pixels[last].map(by);
    }
    data
}

fn motion(data: &Dataset) -> Option<CameraMotion> {
    bundle::solve(data, BundleSettings::default(), &Silent).unwrap().motion
}

/// The one fault that is found: its code and severity, its views and cameras.
fn fault(data: &Dataset) -> (&'static str, Severity, Vec<String>, Vec<usize>) {
    let found = preparation::examine(data, BundleSettings::default(), &Silent).unwrap().findings;
    let mut found: Vec<_> =
        found.into_iter().filter(|one| one.severity > Severity::Information).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    let one = found.remove(0);
    (one.code, one.severity, one.views, one.cameras)
}

#[test]
fn a_camera_that_moved_is_named_with_the_view_and_by_how_much() {
    for (cameras, told) in [(2, vec![0, 1]), (3, vec![2])] {
        for seed in 0..3 {
            let sound = capture("paper", cameras, seed);
            assert_eq!(motion(&sound), None, "{cameras} cameras, seed {seed}");
            let at = 3 + 2 * seed as usize;
            let moved = shifted(sound, |view| f64::from(u8::from(view >= at)));
            let found = motion(&moved).unwrap();
            assert_eq!((found.change, &found.views[..]), (PoseChange::Step, &moved.views[at..]));
            assert!((found.shift - 2.0).abs() < 0.3, "{found:?}");
            let due = ("camera-moved", Severity::Fatal, moved.views[at..].to_vec(), told.clone());
            // All that is examined takes a while.
            if seed == 0 {
                assert_eq!(fault(&moved), due, "{cameras} cameras");
            }
        }
    }
}

#[test]
fn a_camera_that_drifts_is_named() {
    for (cameras, told) in [(2, vec![0, 1]), (3, vec![2])] {
        let sound = capture("paper", cameras, 5);
        let drifting = shifted(sound, |view| view as f64 / 11.0);
        let (code, severity, views, cameras) = fault(&drifting);
        assert_eq!((code, severity), ("camera-drifted", Severity::Fatal));
        assert_eq!((views, cameras), (drifting.views.clone(), told));
        let found = motion(&drifting).unwrap();
        assert!((found.shift - 2.0).abs() < 0.3, "{found:?}");
    }
}

/// As a delay of its frames does.
#[test]
fn a_camera_that_shows_every_view_otherwise_is_named() {
    let mut random = Random::new(8);
    let times: Vec<f64> = (0..12).map(|_| 2.0 * random.normal()).collect();
    let found = fault(&shifted(capture("paper", 2, 8), |view| times[view]));
    assert_eq!((found.0, found.1), ("unsynchronised", Severity::Fatal));
}

/// What a lens leaves over changes poses, too.
#[test]
fn lenses_that_no_formula_holds_do_not_move() {
    for rig in ["fisheye", "water", "glass", "bump"] {
        for seed in 0..3 {
            assert_eq!(motion(&capture(rig, 2, seed)), None, "{rig}, seed {seed}");
        }
    }
}
