//! Clouds of rendered scenes against their truth.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

#[cfg(feature = "mcap")]
mod mcap_log;
mod matches;
mod optics;
mod moved;
mod files;
