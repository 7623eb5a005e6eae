//! What the robot does in worlds whose truth is known.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod map;
mod motion;
mod navigator;
mod plan;
mod recorded;
mod trial;
mod world;
