//! Disparities against truth: renders that are known exactly, Middlebury's pairs, and pairs that nothing can be said of.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod curves;
mod deceptive;
mod errors;
mod hopeless;
mod measure;
mod properties;
mod real;
mod rectified;
mod renders;
mod scene;
mod threads;
