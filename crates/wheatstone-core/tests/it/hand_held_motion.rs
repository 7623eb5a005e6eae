//! Cameras that move while a chart is waved before them.

use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::{
    dataset::Dataset,
    fit::bundle::{self, BundleSettings, CameraMotion, PoseChange},
    geometry::Pixel,
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

#[test]
fn a_camera_that_moved_is_named_with_the_view_and_by_how_much() {
    for cameras in [2, 3] {
        for seed in 0..3 {
            let sound = capture("paper", cameras, seed);
            assert_eq!(motion(&sound), None, "{cameras} cameras, seed {seed}");
            let at = 3 + 2 * seed as usize;
            let moved = shifted(sound, |view| f64::from(u8::from(view >= at)));
            let found = motion(&moved).unwrap();
            // Of two cameras either may have moved.
            assert_eq!((found.change, found.camera), (PoseChange::Step, cameras - 1));
            assert_eq!(found.views, moved.views[at..]);
            assert!((found.shift - 2.0).abs() < 0.1, "{found:?}");
            assert!(found.errors[0] > found.errors[1], "{found:?}");
        }
    }
}

#[test]
fn a_camera_that_drifts_is_named() {
    for cameras in [2, 3] {
        let drifting = shifted(capture("paper", cameras, 5), |view| view as f64 / 11.0);
        let found = motion(&drifting).unwrap();
        assert_eq!((found.change, found.camera), (PoseChange::Drift, cameras - 1));
        assert!((found.shift - 2.0).abs() < 0.1, "{found:?}");
    }
}

/// As a delay of its frames does.
#[test]
fn a_camera_that_shows_every_view_otherwise_is_named() {
    let mut random = Random::new(8);
    let times: Vec<f64> = (0..12).map(|_| 0.5 * random.normal()).collect();
    let found = motion(&shifted(capture("paper", 2, 8), |view| times[view])).unwrap();
    assert_eq!(found.change, PoseChange::Every);
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
