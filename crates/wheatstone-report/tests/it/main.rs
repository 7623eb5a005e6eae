//! What reports say of worlds whose truth is known.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod browser;
mod html;
mod report;
mod report_page;
mod scene_page;
