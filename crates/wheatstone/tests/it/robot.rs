//! The robot's sight and its way, from pictures alone, against the truth about made worlds.

use wheatstone::{
    Calibration,
    method::AnyMethod,
    numeric::{progress::Silent, random::Random},
    robot::{
        Ground, PlanarPose, Vehicle, Velocity,
        capture::ChartPictures,
        motion::OwnMotion,
        navigator::{Decision, Reason},
        pilot::Pilot,
        scene::Trust,
        seeing::{Observer, SeenCorner},
        simulated::{CameraFailure, SimulatedRobot, Wheels, eyes},
        world::{Eye, World},
    },
    synthetic::Sensor,
};

const SIZE: [usize; 2] = [640, 480];

fn calibrated(world: &World) -> ([Eye; 2], Calibration) {
    calibrated_by(&AnyMethod::named("brown").unwrap(), world)
}

fn calibrated_by(method: &AnyMethod, world: &World) -> ([Eye; 2], Calibration) {
    let mut random = Random::stream(world.seed, 5);
    let eyes = eyes(Sensor::default(), &mut random).unwrap();
    let pictures = ChartPictures::take(&eyes, world, &mut random).unwrap();
    let calibration = pictures.calibrate(method, 0, &Silent).unwrap();
    (eyes, calibration)
}

fn robot<'a>(world: &'a World, eyes: [Eye; 2], wheels: Wheels) -> SimulatedRobot<'a> {
    SimulatedRobot::new(world, eyes, (wheels, Sensor::default()), Random::stream(world.seed, 6))
}

#[test]
fn the_floor_is_told_from_what_stands_on_it() {
    let (eyes, calibration) = calibrated(&World::new(1));
    let mut observer = Observer::new(&calibration, SIZE, &Silent).unwrap();
    let (mut points, mut wrong, mut corners, mut astray) = (0, 0, 0, 0);
    for seed in [1, 4, 5, 10] {
        let world = World::new(seed);
        let mut random = Random::new(seed);
        let pose = PlanarPose { heading: random.uniform(-0.3, 0.3), ..PlanarPose::default() };
        let pictures = [0, 1].map(|eye: usize| eyes[eye].look(&world, pose, None, &mut random));
        let seen = observer.observe(&pictures);
        assert_eq!(seen.scene.trust, Trust::Sound);
        let clearance = |place: Ground| world.clearance(pose.transform(place));
        for point in &seen.scene.obstacles {
            points += 1;
            let most = 3.0 + 0.03 * point.place.coords.norm();
            wrong += usize::from(clearance(point.place) > most);
        }
        // A stretch may end a little way into the foot of what ends it.
        for stretch in &seen.scene.clear {
            let within = |share: f64| clearance(stretch.from + (stretch.to - stretch.from) * share);
            let least = (0..=50).map(|part| within(f64::from(part) / 50.0)).fold(99.0, f64::min);
            assert!(least > -6.0, "world {seed}: {stretch:?} lies {least} in something");
        }
        assert!(seen.scene.clear.len() > 100, "{}", seen.scene.clear.len());
        for corner in &seen.corners {
            let place = Ground::new(corner.point.x, corner.point.z);
            let on_floor = corner.point.y.abs() < 1.0 + 0.02 * place.coords.norm();
            let on_face = clearance(place).abs() < 2.0 + 0.03 * place.coords.norm();
            corners += 1;
            astray += usize::from(!on_floor && !on_face);
        }
    }
    assert!(points > 600 && wrong * 20 < points, "{wrong} of {points} obstacle points are none");
    assert!(corners > 100 && astray * 25 < corners, "{astray} of {corners} corners are nowhere");
}

#[test]
fn own_motion_is_found_from_pictures() {
    let world = World::new(11);
    let (eyes, calibration) = calibrated(&world);
    let mut observer = Observer::new(&calibration, SIZE, &Silent).unwrap();
    let mut robot = robot(&world, eyes, Wheels { bias: 0.1, noise: 0.1, slips: 0.2, slip: 0.4 });
    let mut motion = OwnMotion::new(0);
    let turns = [0.0, 0.4, 0.4, 0.0, -0.5, -0.5, -0.3, 0.0, 0.3, 0.0];
    let mut told = PlanarPose::default();
    for turn in turns {
        let pictures = robot.look().unwrap().unwrap();
        let seen = observer.observe(&pictures);
        let found = motion.update((&seen.corners, seen.floor_direction), &told).unwrap();
        let truth = robot.pose();
        let off = (found.pose.place() - truth.place()).norm();
        assert!(off < 1.0, "{off} cm");
        assert!((found.pose.heading - truth.heading).abs() < 0.01);
        let velocity = Velocity { forward: 12.0, turn };
        told = velocity.motion(robot.period());
        robot.drive(velocity).unwrap();
    }
    // What the wheels were told would have led elsewhere.
    let believed = turns.iter().fold(PlanarPose::default(), |pose, turn| {
        pose.then(&Velocity { forward: 12.0, turn: *turn }.motion(robot.period()))
    });
    assert!((believed.place() - robot.pose().place()).norm() > 1.0);
}

#[test]
fn the_robot_reaches_its_goal_without_running_into_anything() {
    let world = World::new(12);
    let (eyes, calibration) = calibrated(&world);
    let mut robot = robot(&world, eyes, Wheels::default());
    let task = (world.goal(), robot.period());
    let mut pilot = Pilot::new(&calibration, SIZE, task, (0, &Silent)).unwrap();
    let end = pilot.drive(&mut robot, &mut |_, _, _, _| Ok(())).unwrap();
    assert_eq!(end, Some(Decision::Arrived));
    assert!(robot.clearance() > 0.0);
    let off = (robot.pose().place() - world.goal()).norm();
    assert!(off < 15.0, "{off} cm");
}

#[test]
fn by_the_recipe_of_2001_it_knows_its_way() {
    let method = AnyMethod::named("network").unwrap().preset("paper").unwrap();
    let world = World::simple(0);
    let (eyes, calibration) = calibrated_by(&method, &world);
    let mut observer = Observer::new(&calibration, SIZE, &Silent).unwrap();
    let error = observer.map_error().unwrap();
    assert!((1.0..8.0).contains(&error), "{error} cm");
    let mut robot = robot(&world, eyes, Wheels::default());
    let mut motion = OwnMotion::new(0).with_compass_first();
    let velocity = Velocity { forward: 20.0, turn: 0.1 };
    let told = velocity.motion(robot.period());
    for look in 0..8 {
        let seen = observer.observe(&robot.look().unwrap().unwrap());
        assert_eq!(seen.complaint, None, "look {look}");
        // Error bars are those of the map, which errs by centimetres.
        let tight = |corner: &SeenCorner| corner.covariance.trace().sqrt() < 0.5 * error;
        assert!(!seen.corners.iter().any(tight), "look {look}");
        let told = if look == 0 { PlanarPose::default() } else { told };
        let found = motion.update((&seen.corners, seen.floor_direction), &told).unwrap();
        let off = (found.pose.place() - robot.pose().place()).norm();
        assert!(off < 5.0, "look {look}: {off} cm");
        robot.drive(velocity).unwrap();
    }
}

#[test]
fn knocked_and_covered_cameras_stop_the_robot() {
    let degree = 1.0_f64.to_radians();
    let mishaps = [
        CameraFailure::Knocked { camera: 0, rotation: [0.0, degree, 0.0] },
        CameraFailure::Knocked { camera: 1, rotation: [0.0, 0.0, degree] },
        CameraFailure::Covered { camera: 0 },
    ];
    let world = World::new(15);
    for mishap in mishaps {
        let (eyes, calibration) = calibrated(&world);
        let mut robot = robot(&world, eyes, Wheels::default());
        let task = (world.goal(), robot.period());
        let mut pilot = Pilot::new(&calibration, SIZE, task, (0, &Silent)).unwrap();
        let (mut looks, mut sound) = (0, 0);
        let end = pilot
            .drive(&mut robot, &mut |robot, _, _, step| {
                looks += 1;
                if looks == 12 {
                    robot.befall(mishap)?;
                }
                sound += usize::from(step.observation.scene.trust == Trust::Sound);
                Ok(())
            })
            .unwrap();
        assert_eq!(end, Some(Decision::Stopped(Reason::Broken)), "{mishap:?}");
        assert!(sound >= 11 && looks < 40 && robot.clearance() > 0.0, "{mishap:?}: {looks} looks");
    }
}
