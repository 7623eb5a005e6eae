//! Ways through walls with gaps.

use nalgebra::Matrix2;
use wheatstone_numeric::random::Random;
use wheatstone_robot::{
    Estimated, Ground,
    map::{CELL, Cell, Map},
    plan::{MARGIN, Path, Terrain},
    scene::{Scene, ScenePoint, Trust},
    world::{NARROWEST, ROBOT_RADIUS},
};

/// A wall across the way at 150 cm with gaps, each given by its middle and its width.
fn walled(gaps: &[[f64; 2]]) -> Map {
    let mut map = Map::new(Ground::new(0.0, 300.0));
    let points =
        (-600..600).flat_map(|step| [0.25, 0.75].map(|part| (f64::from(step) + part) * 0.5));
    let obstacles: Vec<ScenePoint> = points
        .filter(|x| gaps.iter().all(|[middle, wide]| (x - middle).abs() >= 0.5 * wide))
        .flat_map(|x| [150.0, 151.0].map(|z| Ground::new(x, z)))
        .map(|place| ScenePoint { place, covariance: Matrix2::identity() * 0.01, height: 5.0 })
        .collect();
    let scene = Scene { obstacles, clear: Vec::new(), trust: Trust::Sound };
    for _ in 0..3 {
        map.add(&scene, &Estimated::default(), 1.0);
    }
    map
}

fn way(map: &Map) -> Option<Path> {
    Terrain::new(map, MARGIN).way(map, Ground::origin(), Ground::new(0.0, 300.0))
}

#[test]
fn the_narrowest_gap_is_passed_in_its_middle() {
    for middle in [-40.3, 0.0, 25.9] {
        let map = walled(&[[middle, NARROWEST]]);
        let way = way(&map).unwrap();
        let ends = way.places.windows(2).find(|ends| ends[1].y > 150.0).unwrap();
        let part = (150.0 - ends[0].y) / (ends[1].y - ends[0].y);
        let at = ends[0] + (ends[1] - ends[0]) * part;
        assert!((at.x - middle).abs() < NARROWEST / 2.0 - ROBOT_RADIUS - 2.0, "{at} {middle}");
        assert_eq!(way.places[0], Ground::origin());
        assert_eq!(way.places.last(), Some(&Ground::new(0.0, 300.0)));
    }
}

#[test]
fn no_way_leads_through_a_gap_that_is_too_narrow_but_one_up_to_it() {
    // A margin from the wall, or into the gap until its ends are a margin away.
    for (gaps, least, most) in
        [(&[[0.0, 2.0 * ROBOT_RADIUS + 3.0]][..], 138.0, 143.0), (&[], 130.0, 136.0)]
    {
        let way = way(&walled(gaps)).unwrap();
        let end = way.places[way.places.len() - 1];
        assert!(!way.whole && way.cost.is_finite());
        assert!(end.x.abs() < 3.0 && (least..most).contains(&end.y), "{end}");
    }
}

#[test]
fn a_wide_gap_a_little_aside_is_worth_the_way() {
    let through = |map: &Map| {
        let way = way(map).unwrap();
        way.places.iter().map(|place| place.x).fold(0.0, f64::max)
    };
    assert!(through(&walled(&[[0.0, NARROWEST], [65.0, 80.0]])) > 20.0);
    assert!(through(&walled(&[[0.0, NARROWEST], [150.0, 80.0]])) < 20.0);
}

#[test]
fn an_open_way_is_straight_and_is_shortened_as_it_is_followed() {
    let map = Map::new(Ground::new(40.0, 290.0));
    let terrain = Terrain::new(&map, MARGIN);
    let goal = Ground::new(40.0, 290.0);
    let way = terrain.way(&map, Ground::origin(), goal).unwrap();
    let length: f64 = way.places.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
    assert!(length < 1.02 * goal.coords.norm(), "{length}");
    let here = Ground::from(goal.coords * 0.5) + nalgebra::Vector2::new(3.0, 0.0);
    let (rest, astray) = terrain.rest(&map, &way, here);
    assert!(astray < 6.0, "{astray}");
    assert_eq!(rest.places[0], here);
    assert_eq!(rest.places.last(), Some(&goal));
    assert!(rest.cost < way.cost);
}

#[test]
fn a_robot_too_near_to_something_may_leave() {
    let map = walled(&[]);
    let terrain = Terrain::new(&map, MARGIN);
    let near = Ground::new(0.0, 137.0);
    assert!(terrain.clearance(&map, near) < ROBOT_RADIUS + MARGIN);
    assert!(terrain.way(&map, near, Ground::origin()).is_some_and(|way| way.whole));
}

#[test]
fn clearance_is_the_distance_to_the_nearest_cell_of_all_that_something_stands_on() {
    let mut map = Map::new(Ground::new(0.0, 300.0));
    let mut random = Random::new(3);
    let cells = |map: &Map| -> Vec<[usize; 2]> {
        let columns = map.columns();
        (0..map.rows()).flat_map(|row| (0..columns).map(move |column| [column, row])).collect()
    };
    for [column, row] in cells(&map) {
        if random.below(150) == 0 {
            // Twice: once is not believed.
            (0..2).for_each(|_| map.suspect(map.place(column, row), 0.1 * CELL));
        }
    }
    let stands = |[column, row]: &[usize; 2]| map.cell(*column, *row) == Cell::Occupied;
    let occupied: Vec<[usize; 2]> = cells(&map).into_iter().filter(stands).collect();
    assert!(occupied.len() > 50);
    let terrain = Terrain::new(&map, MARGIN);
    for [column, row] in cells(&map) {
        let found = terrain.clearance(&map, map.place(column, row));
        let away = |other: &[usize; 2]| {
            let (across, along) = (other[0].abs_diff(column), other[1].abs_diff(row));
            ((across * across + along * along) as f64).sqrt() * CELL
        };
        let nearest = occupied.iter().map(away).fold(32.0, f64::min);
        assert!((found - nearest).abs() < 1e-4, "{column} {row}: {found} {nearest}");
    }
}
