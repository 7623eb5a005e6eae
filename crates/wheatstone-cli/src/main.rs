//! The program `wheatstone`: from pictures of a chart to points in the world.
//!
//! What people read goes to standard error, what programs read to standard output. Exit status: 0
//! done, 1 the input or the fit failed, 2 the command line was not understood, 130 interrupted,
//! 143 asked to end.

mod browser;
mod commands;
mod conversion;
mod exposure;
mod failure;
mod frame;
mod input;
mod interruption;
mod output;
mod matches;
mod picture_sets;
mod prepare;
mod progress;
mod table;
mod tables;
mod verbosity;

use clap::{
    CommandFactory, Parser,
    error::{ContextKind, ContextValue},
};
use std::{io::Write, process::ExitCode};

/// Metric 3-D points from matched pixels of any two or more calibrated cameras.
///
/// Calibration and triangulation from pictures of a chart at known poses or in the hand: no camera
/// model to choose, no initial guess, and every point comes with its covariance.
#[derive(Parser)]
#[command(name = "wheatstone", version, max_term_width = 100)]
#[command(after_help = "Examples:\n  \
    wheatstone demo                                   the complete workflow on rendered pictures\n  \
    wheatstone new capture/                           start a capture of your own\n  \
    wheatstone fit capture/ -o model.json             from pictures of a chart to a model\n  \
    wheatstone locate model.json pixels.csv -o points.csv\n  \
    wheatstone compare points.csv                     which method is best, by cross-validation")]
struct Arguments {
    #[command(subcommand)]
    verb: commands::Verb,
    #[command(flatten)]
    verbosity: verbosity::Verbosity,
}

/// The command line as data: what help, completions and manual pages are made from.
fn definition() -> clap::Command {
    Arguments::command()
}

/// What other programs call our verbs.
const SYNONYMS: [(&str, &str); 10] = [
    ("calibrate", "fit"),
    ("train", "fit"),
    ("triangulate", "locate"),
    ("predict", "locate"),
    ("validate", "evaluate"),
    ("import", "convert"),
    ("undistort", "rectify"),
    ("disparity", "match"),
    ("stereo", "match"),
    ("simulate", "synth"),
];

/// A mistyped verb with the one that was probably meant, where the parser itself suggests none; another program's with ours.
fn suggesting(mut error: clap::Error) -> clap::Error {
    let typed = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(typed)) => typed.clone(),
        _ => return error,
    };
    if let Some((_, ours)) = SYNONYMS.iter().find(|(theirs, _)| *theirs == typed) {
        let ours = ContextValue::Strings(vec![(*ours).to_owned()]);
        error.insert(ContextKind::SuggestedSubcommand, ours);
        return error;
    }
    let verbs: Vec<String> =
        definition().get_subcommands().map(|verb| verb.get_name().to_owned()).collect();
    if error.get(ContextKind::SuggestedSubcommand).is_none()
        && let Some(near) = wheatstone::error::nearest(&typed, &verbs)
    {
        let near = ContextValue::Strings(vec![near.to_owned()]);
        error.insert(ContextKind::SuggestedSubcommand, near);
    }
    error
}

/// Prints what the parser has to say in place of a command: help, the version, or an error.
fn print_instead(instead: &clap::Error) -> ExitCode {
    let printed = instead.print().and_then(|()| std::io::stdout().flush());
    match printed {
        Err(problem) if !instead.use_stderr() => failure::Failure::from(problem).report(),
        _ => ExitCode::from(instead.exit_code().clamp(0, 255) as u8),
    }
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(instead) => return print_instead(&suggesting(instead)),
    };
    arguments.verbosity.adopt();
    interruption::listen();
    match arguments.verb.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
