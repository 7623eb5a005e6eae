//! One file a verb, and its row below.

pub(crate) mod chart;
mod camera_motion;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod detect;
pub(crate) mod drive;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod fit;
pub(crate) mod info;
pub(crate) mod list;
pub(crate) mod locate;
pub(crate) mod man;
pub(crate) mod match_pictures;
pub(crate) mod new;
pub(crate) mod reconstruct;
pub(crate) mod rectify;
pub(crate) mod report;
pub(crate) mod reproduce;
pub(crate) mod synth;

use crate::failure::{Failure, Outcome, worded};
use std::io::Write;
use wheatstone::method::AnyMethod;

/// Makes the verbs of the program, in the order in which help lists them.
macro_rules! verbs {
    ($($file:ident::$Verb:ident,)*) => {
        #[derive(clap::Subcommand)]
        pub(crate) enum Verb {
            $($Verb($file::$Verb),)*
        }

        impl Verb {
            pub(crate) fn run(self) -> Outcome {
                match self {
                    $(Self::$Verb(verb) => verb.run(),)*
                }
            }
        }
    };
}

verbs! {
    demo::Demo,
    new::New,
    chart::Chart,
    check::Check,
    detect::Detect,
    fit::Fit,
    locate::Locate,
    evaluate::Evaluate,
    compare::Compare,
    info::Info,
    report::Report,
    export::Export,
    convert::Convert,
    rectify::Rectify,
    match_pictures::Match,
    reconstruct::Reconstruct,
    synth::Synth,
    reproduce::Reproduce,
    drive::Drive,
    list::List,
    completions::Completions,
    man::Man,
}

/// Prints one JSON object on standard output.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Outcome {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::from)?;
    writeln!(std::io::stdout(), "{text}")?;
    Ok(())
}

/// The methods of a list of names, all of them for `all`.
pub(crate) fn methods_named(names: &[String]) -> Outcome<Vec<AnyMethod>> {
    if names == ["all"] {
        return Ok(AnyMethod::all());
    }
    let named = names.iter().map(|name| AnyMethod::named(name.trim()));
    named.collect::<wheatstone::Result<Vec<_>>>().map_err(|e| {
        let hint = e.hint().map(worded).unwrap_or_default();
        Failure::usage(e.to_string(), hint)
    })
}
