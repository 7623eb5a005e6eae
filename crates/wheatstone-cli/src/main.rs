//! The program `wheatstone`: from pictures of a chart to points in the world.
//!
//! What people read goes to standard error, what programs read to standard output. Exit status: 0
//! done, 1 the input or the fit failed, 2 the command line was not understood.

mod commands;
mod failure;
mod input;
mod progress;
mod table;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Metric 3-D from matched pixels of any two or more cameras.
///
/// Show the cameras a chart at known places, fit, and locate: no camera model to choose, no first
/// guess, and every point comes with its error bar.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
#[command(after_help = "Examples:\n  \
    wheatstone demo                                   the whole story on a rendered rig\n  \
    wheatstone fit capture/ -o model.json             from pictures of a chart to a model\n  \
    wheatstone locate model.json pixels.csv -o points.csv\n  \
    wheatstone compare points.csv                     which method to trust, on held-out views")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(commands::demo::Demo),
    Detect(commands::detect::Detect),
    Fit(commands::fit::Fit),
    Locate(commands::locate::Locate),
    Evaluate(commands::evaluate::Evaluate),
    Compare(commands::compare::Compare),
    Synth(commands::synth::Synth),
    Chart(commands::chart::Chart),
    Report(commands::report::Report),
    Reproduce(commands::reproduce::Reproduce),
    List(commands::list::List),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Demo(command) => command.run(),
        Command::Detect(command) => command.run(),
        Command::Fit(command) => command.run(),
        Command::Locate(command) => command.run(),
        Command::Evaluate(command) => command.run(),
        Command::Compare(command) => command.run(),
        Command::Synth(command) => command.run(),
        Command::Chart(command) => command.run(),
        Command::Report(command) => command.run(),
        Command::Reproduce(command) => command.run(),
        Command::List(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
