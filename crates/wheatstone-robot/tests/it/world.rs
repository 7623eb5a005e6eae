//! Worlds by the number.

use wheatstone_robot::{
    Ground,
    world::{DISTANCE, Footprint, LOWEST_OBSTACLE, Obstacle, ROBOT_RADIUS, WIDE, World},
};

#[test]
fn worlds_are_as_they_should_be() {
    let mut tight = 0;
    for seed in 0..60 {
        let world = World::new(seed);
        assert_eq!(world, World::new(seed));
        assert!((6..=12).contains(&world.obstacles.len()));
        assert!((world.goal().coords.norm() - DISTANCE).abs() < 1e-9);
        for obstacle in &world.obstacles {
            assert!(obstacle.height >= LOWEST_OBSTACLE);
            // Every face is seen against the floor.
            for (face, tile) in
                obstacle.shades.iter().flat_map(|f| world.tiles.shades.map(|t| (*f, t)))
            {
                assert!((face - tile).abs() > 0.09);
            }
        }
        let way = |t: f64| world.clearance(Ground::from(world.goal().coords * t));
        let narrowest = (0..100).map(|i| way(f64::from(i) / 100.0)).fold(f64::MAX, f64::min);
        tight += usize::from(narrowest < ROBOT_RADIUS);
    }
    // In most of them the straight way is barred.
    assert!(tight > 30, "{tight}");
}

#[test]
fn simple_worlds_have_few_boxes_and_wide_gaps() {
    let mut barred = 0;
    for seed in 0..60 {
        let world = World::simple(seed);
        assert_eq!(world, World::simple(seed));
        assert!((2..=4).contains(&world.obstacles.len()));
        let [left, right, ..] = world.walls;
        for (number, one) in world.obstacles.iter().enumerate() {
            let centre = Ground::from(one.centre);
            let beside = (centre.x - left).min(right - centre.x) - one.reach();
            let others = world.obstacles.iter().take(number);
            let apart = others.map(|other| other.distance(centre) - one.reach());
            assert!(apart.fold(beside, f64::min) >= WIDE, "world {seed}");
            // Black or white on tiles that are neither.
            for tile in world.tiles.shades {
                assert!((one.shades[0] - tile).abs() > 0.25, "world {seed}");
            }
        }
        let way = |t: f64| world.clearance(Ground::from(world.goal().coords * t));
        let narrowest = (0..100).map(|i| way(f64::from(i) / 100.0)).fold(f64::MAX, f64::min);
        barred += usize::from(narrowest < ROBOT_RADIUS);
    }
    assert!(barred > 15, "{barred}");
}

#[test]
fn distances_to_outlines_are_those_of_their_nearest_points() {
    let obstacle = Obstacle {
        footprint: Footprint::Box([10.0, 4.0]),
        centre: [5.0, 50.0],
        turn: std::f64::consts::FRAC_PI_2,
        height: 20.0,
        shades: [0.1, 0.9, 0.5],
    };
    // Turned by a quarter it is long ahead.
    assert!((obstacle.distance(Ground::new(5.0, 65.0)) - 5.0).abs() < 1e-12);
    assert!((obstacle.distance(Ground::new(12.0, 64.0)) - 5.0).abs() < 1e-12);
    assert!((obstacle.distance(Ground::new(5.0, 50.0)) + 4.0).abs() < 1e-12);
}
