//! What is counted on the way, and how maps are judged.

use super::*;
use nalgebra::{Matrix2, Vector2};

#[test]
fn a_knock_is_counted_from_the_first_look_that_shows_it() {
    let mut tally = Tally::default();
    let look = |trust| Step {
        observation: crate::seeing::Observation {
            scene: crate::scene::Scene { trust, ..Default::default() },
            ..Default::default()
        },
        found: None,
        decision: crate::navigator::Decision::Drive(Velocity::STOP),
    };
    let (sound, broken) = (look(crate::scene::Trust::Sound), look(crate::scene::Trust::Broken));
    tally.count(&broken, 0.0);
    tally.count(&sound, 0.0);
    tally.noticed = Some(Detected { at: tally.steps + 1, after: None });
    for step in [&sound, &broken, &broken] {
        tally.count(step, 0.0);
    }
    assert_eq!(tally.noticed, Some(Detected { at: 3, after: Some(2) }));
}

#[test]
fn maps_are_judged_by_true_surfaces() {
    use crate::{
        Estimated, Ground,
        map::Map,
        scene::{Scene, ScenePoint},
    };
    let world = World::new(0);
    // From the middle of an obstacle straight to its face.
    let centre = Ground::from(world.obstacles[0].centre);
    let inside =
        |length: f64| world.obstacles[0].distance(centre + Vector2::new(length, 0.0)) < 0.0;
    let face = (0..).map(|step| f64::from(step) * 0.01).find(|length| !inside(*length)).unwrap();
    let off_by = |error: f64| {
        let place = centre + Vector2::new(face + error, 0.0);
        let point = ScenePoint { place, covariance: Matrix2::identity() * 1e-4, height: 10.0 };
        let scene = Scene { obstacles: vec![point; 8], ..Scene::default() };
        let mut map = Map::new(world.goal());
        for _ in 0..4 {
            map.add(&scene, &Estimated::default(), 1.0);
        }
        outcome::map_errors(&map, &world)
    };
    let exact = off_by(0.0);
    assert!(!exact.is_empty());
    // Half a cell's diagonal.
    assert!(exact.iter().all(|error| *error < 1.5), "{exact:?}");
    assert!(off_by(-4.0).iter().all(|error| (1.0..6.0).contains(error)));
}
