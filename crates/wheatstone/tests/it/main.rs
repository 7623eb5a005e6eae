//! Tests of the library from outside.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod data;
mod real_charts;
