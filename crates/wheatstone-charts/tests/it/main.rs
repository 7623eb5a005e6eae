//! Charts, pictures and captures whose truth is known.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod capture;
mod sessions;
mod chart;
mod imaging;
