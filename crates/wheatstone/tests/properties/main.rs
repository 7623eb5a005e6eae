//! What holds of any input. Inputs are drawn at random, and one that fails is shrunk to the simplest that does.
//!
//! The draws are the same in every run, so a failure repeats itself and nothing need be kept of it. With
//! `PROPTEST_CASES=10000 PROPTEST_RNG_SEED=7` in the environment there are more of them, and others.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod cameras;
mod datasets;
mod formats;
mod geometry;
mod tables;

use proptest::{
    prelude::*,
    test_runner::{Config, RngSeed},
};
use wheatstone::geometry::{Point3, Pose, Vector3};

/// How many inputs are drawn, and from which seed, unless the environment says otherwise.
fn config() -> Config {
    let mut config = Config { failure_persistence: None, ..Config::default() };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = 64;
    }
    if std::env::var_os("PROPTEST_RNG_SEED").is_none() {
        config.rng_seed = RngSeed::Fixed(1838);
    }
    config
}

/// A vector whose parts are at most `most`.
fn vector(most: f64) -> impl Strategy<Value = Vector3> {
    let side = -most..=most;
    (side.clone(), side.clone(), side).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn point(most: f64) -> impl Strategy<Value = Point3> {
    vector(most).prop_map(Point3::from)
}

/// A rotation vector of less than half a turn, where it is unique.
fn turn() -> impl Strategy<Value = Vector3> {
    vector(3.1).prop_map(|turn| if turn.norm() > 3.1 { turn * (3.1 / turn.norm()) } else { turn })
}

fn pose() -> impl Strategy<Value = Pose> {
    (vector(1000.0), turn()).prop_map(|(place, turn)| Pose::from_rotation_vector(place, turn))
}
