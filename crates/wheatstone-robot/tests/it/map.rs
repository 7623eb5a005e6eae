//! Maps of made-up scenes.

use nalgebra::Matrix2;
use wheatstone_robot::{
    Estimated, Ground, PlanarPose,
    map::{Cell, Map},
    scene::{Scene, ScenePoint, Stretch, Trust},
};

/// Stretches at every third of a degree to a distance ahead, from an eye at the origin.
fn floor(to: f64, blocked: bool) -> Scene {
    let stretch = |column: i32| {
        let across = 0.0056 * f64::from(column);
        let at = |depth: f64| Ground::new(across * depth, depth);
        Stretch { from: at(40.0), to: at(to), sigma: 0.3, blocked }
    };
    let clear = (-60..60).map(stretch).collect();
    Scene { obstacles: Vec::new(), clear, trust: Trust::Sound }
}

fn point(x: f64, z: f64) -> ScenePoint {
    ScenePoint { place: Ground::new(x, z), covariance: Matrix2::identity() * 0.1, height: 8.0 }
}

fn at(map: &Map, x: f64, z: f64) -> Cell {
    let [column, row] = map.cell_at(Ground::new(x, z)).unwrap();
    map.cell(column, row)
}

fn looked(scenes: &[&Scene]) -> Map {
    let mut map = Map::new(Ground::new(0.0, 300.0));
    for scene in scenes {
        map.add(scene, &Estimated::default(), 1.0);
    }
    map
}

#[test]
fn floor_is_free_as_far_as_it_was_seen_without_gaps() {
    let seen = floor(200.0, false);
    let map = looked(&[&seen, &seen, &seen]);
    for step in 0..80 {
        let z = 41.0 + 2.0 * f64::from(step - 1);
        for across in [-0.3, -0.17, 0.0, 0.21, 0.3] {
            assert_eq!(at(&map, across * z, z), Cell::Free, "{across} {z}");
        }
    }
    assert_eq!(at(&map, 0.0, 206.0), Cell::Unknown);
    assert_eq!(at(&map, 90.0, 100.0), Cell::Unknown);
    // The start is known to be free all about, and it is not known yet what one or two looks show.
    assert_eq!(at(&map, -30.0, -20.0), Cell::Free);
    assert_eq!(at(&looked(&[&seen, &seen]), 0.0, 150.0), Cell::Unknown);
}

#[test]
fn feet_and_points_stand_and_hide_what_is_behind() {
    let map = looked(&[&floor(120.0, true), &floor(120.0, true), &floor(120.0, true)]);
    assert_eq!(at(&map, 0.0, 120.5), Cell::Occupied);
    assert_eq!(at(&map, 20.0, 120.5), Cell::Occupied);
    assert_eq!(at(&map, 0.0, 110.0), Cell::Free);
    assert_eq!(at(&map, 0.0, 130.0), Cell::Unknown);
}

#[test]
fn one_wrong_point_bars_nothing_and_one_wrong_look_opens_nothing() {
    let open = floor(200.0, false);
    let wrong = Scene { obstacles: vec![point(3.0, 90.0)], ..open.clone() };
    assert_eq!(at(&looked(&[&wrong]), 3.0, 90.0), Cell::Unknown);
    let map = looked(&[&open, &open, &open, &wrong, &open]);
    assert_eq!(at(&map, 3.0, 90.0), Cell::Free);

    let barred = floor(120.0, true);
    let map = looked(&[&barred, &barred, &barred, &open]);
    assert_eq!(at(&map, 3.0, 120.5), Cell::Occupied);
    assert_eq!(at(&map, 3.0, 126.0), Cell::Unknown);
}

#[test]
fn the_map_changes_its_mind() {
    let (open, barred) = (floor(200.0, false), floor(120.0, true));
    let long = |scene| std::iter::repeat_n(scene, 40);
    let scenes: Vec<&Scene> = long(&barred).chain(long(&open).take(12)).collect();
    let map = looked(&scenes);
    assert_eq!(at(&map, 3.0, 120.5), Cell::Free);
    assert_eq!(at(&map, 3.0, 130.0), Cell::Free);
    let scenes: Vec<&Scene> = long(&open).chain([&barred; 3]).collect();
    assert_eq!(at(&looked(&scenes), 3.0, 120.5), Cell::Occupied);
}

#[test]
fn what_is_seen_lies_where_the_robot_stands() {
    let mut map = Map::new(Ground::new(0.0, 300.0));
    let pose = PlanarPose { x: 20.0, z: 50.0, heading: std::f64::consts::FRAC_PI_2 };
    for _ in 0..3 {
        map.add(&floor(100.0, true), &Estimated { pose, ..Estimated::default() }, 1.0);
    }
    assert_eq!(at(&map, 120.5, 50.0), Cell::Occupied);
    assert_eq!(at(&map, 80.0, 50.0), Cell::Free);
    assert_eq!(at(&map, 20.0, 120.0), Cell::Unknown);
    // Sight begins where the stretches say, a little nearer for what they tell of lower things.
    assert!(map.sight() > 24.0 && map.sight() < 32.0, "{}", map.sight());
}

#[test]
fn suspicion_bars_unseen_floor_and_doubt_lifts_it() {
    let mut map = looked(&[]);
    let place = Ground::new(60.0, 60.0);
    map.suspect(place, 6.0);
    assert_eq!(at(&map, 60.0, 60.0), Cell::Unknown);
    map.suspect(place, 6.0);
    assert_eq!(at(&map, 60.0, 60.0), Cell::Occupied);
    map.doubt(place, 10.0, 0.25);
    assert_eq!(at(&map, 60.0, 60.0), Cell::Unknown);
    map.suspect(Ground::origin(), 6.0);
    map.suspect(Ground::origin(), 6.0);
    assert_eq!(at(&map, 0.0, 0.0), Cell::Free);
}
