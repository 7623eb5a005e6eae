//! The program as its users meet it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod captures;
mod check;
mod cli;
mod command_line;
mod docs;
mod drive;
mod figures;
mod file_kinds;
mod formats;
mod hostile;
#[cfg(unix)]
mod jobs;
#[cfg(unix)]
mod kills;
mod matching;
mod messages;
mod models;
#[cfg(target_os = "linux")]
mod mutated;
mod behaviour;
#[cfg(target_os = "linux")]
mod bombs;
mod one_camera;
#[cfg(target_os = "linux")]
mod outputs;
mod paper;
mod program;
mod reconstruct;
mod reconstruct_faults;
mod rendered;
mod reports;
mod rows;
#[cfg(unix)]
mod signals;
mod silent_failures;
mod stage;
mod tutorials;
