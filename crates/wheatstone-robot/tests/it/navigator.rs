//! Drives without pictures.

mod simulation_of_scenes;

use simulation_of_scenes::{Faults, Simulated};
use wheatstone_robot::{
    PlanarPose, Velocity,
    navigator::{Activity, Decision, Navigator, Reason},
    scene::{Scene, Trust},
    world::{Footprint, Obstacle, ROBOT_RADIUS, World},
};

/// After so many steps a robot gives up by itself.
const MOST_STEPS: usize = 1000;

const PERIOD: f64 = 0.25;

/// Drives until it ends; panics where it never does.
fn run(robot: &mut Simulated) -> (Navigator, Decision) {
    let mut navigator = Navigator::new(robot.world.goal(), PERIOD);
    for _ in 0..=MOST_STEPS {
        let (scene, believed) = robot.look();
        match navigator.step(&scene, believed.as_ref()) {
            Decision::Drive(velocity) => robot.drive(velocity, PERIOD),
            end => return (navigator, end),
        }
    }
    panic!("it goes on for ever");
}

#[test]
fn worlds_are_crossed_without_touching_anything() {
    for seed in 0..10 {
        let mut robot = Simulated::new(World::new(seed), Faults::default());
        let (navigator, end) = run(&mut robot);
        let off = (robot.truth.place() - robot.world.goal()).norm();
        assert_eq!(end, Decision::Arrived, "{seed}: {}", navigator.why());
        assert!(off < 15.0, "{seed}: {off}");
        assert!(robot.least > ROBOT_RADIUS, "{seed}: {}", robot.least);
        assert!(navigator.steps() < 350, "{seed}: {}", navigator.steps());
    }
}

#[test]
fn feet_that_are_missed_bring_no_collision() {
    let faults = Faults { missed_feet: 0.4, overrun_feet: 0.05, ..Faults::default() };
    for seed in [16, 27, 72] {
        let mut robot = Simulated::new(World::new(seed), faults);
        let (navigator, end) = run(&mut robot);
        assert_eq!(end, Decision::Arrived, "{seed}: {}", navigator.why());
        assert!(robot.least > ROBOT_RADIUS, "{seed}: {}", robot.least);
    }
}

#[test]
fn who_is_walled_in_gives_up_where_it_stands() {
    let mut world = World::new(1);
    let wall = |centre, half| Obstacle {
        footprint: Footprint::Box(half),
        centre,
        turn: 0.0,
        height: 20.0,
        shades: [0.1, 0.9, 0.5],
    };
    world.obstacles = vec![
        wall([0.0, 70.0], [80.0, 6.0]),
        wall([0.0, -50.0], [80.0, 4.0]),
        wall([-80.0, 10.0], [6.0, 70.0]),
        wall([80.0, 10.0], [6.0, 70.0]),
    ];
    let mut robot = Simulated::new(world, Faults::default());
    let (_, end) = run(&mut robot);
    assert_eq!(end, Decision::Stopped(Reason::NoWay));
    assert!(robot.least > ROBOT_RADIUS);
}

#[test]
fn broken_pictures_stop_it_for_good_but_not_two_alone() {
    let mut robot = Simulated::new(World::new(2), Faults::default());
    let mut navigator = Navigator::new(robot.world.goal(), PERIOD);
    let (scene, believed) = robot.look();
    let broken = Scene { trust: Trust::Broken, ..scene.clone() };
    let stands = Decision::Drive(Velocity::STOP);
    assert_eq!(navigator.step(&broken, believed.as_ref()), stands);
    assert_ne!(navigator.step(&scene, believed.as_ref()), stands);
    for _ in 0..2 {
        assert_eq!(navigator.step(&broken, believed.as_ref()), stands);
    }
    let end = Decision::Stopped(Reason::Broken);
    assert_eq!(navigator.step(&broken, believed.as_ref()), end);
    assert_eq!(navigator.step(&scene, believed.as_ref()), end);
    assert_eq!(navigator.activity(), Activity::Stopped);
}

#[test]
fn who_does_not_know_its_motion_drives_nowhere() {
    let mut robot = Simulated::new(World::new(2), Faults { lost: 1.0, ..Faults::default() });
    let (navigator, end) = run(&mut robot);
    assert_eq!(end, Decision::Stopped(Reason::Lost));
    assert!(navigator.steps() < 20);
    let PlanarPose { x, z, .. } = robot.truth;
    assert_eq!([x, z], [0.0, 0.0]);
}

#[test]
fn poor_pictures_and_doubtful_places_slow_it_down() {
    let robot = || Simulated::new(World::new(7), Faults { lost: 0.0, ..Faults::default() });
    let fastest = |trust: Trust, doubt: f64| {
        let mut robot = robot();
        let mut navigator = Navigator::new(robot.world.goal(), PERIOD);
        let mut fastest = 0.0_f64;
        for _ in 0..12 {
            let (mut scene, believed) = robot.look();
            scene.trust = trust;
            let believed = believed.map(|mut believed| {
                believed.covariance.m11 += doubt;
                believed
            });
            if let Decision::Drive(velocity) = navigator.step(&scene, believed.as_ref()) {
                fastest = fastest.max(velocity.forward);
                robot.drive(velocity, PERIOD);
            }
        }
        fastest
    };
    let usual = fastest(Trust::Sound, 0.0);
    assert!(fastest(Trust::Poor, 0.0) < usual);
    assert!(fastest(Trust::Sound, 900.0) < usual);
}
