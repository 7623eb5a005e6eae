//! What the program says to people: on standard error, in colour on terminals only, and as much as
//! they asked for; and what they let in.

use anstyle::{AnsiColor, Style};
use clap::{Args, ColorChoice};
use std::{
    io::Write,
    sync::atomic::{AtomicI8, Ordering},
};

/// How much is said, in which colours, and how much is taken in; every verb takes these.
#[derive(Args)]
#[command(next_help_heading = "Output and limits")]
pub(crate) struct Verbosity {
    /// Print only errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Print more: settings, versions, times
    #[arg(short, long, global = true)]
    verbose: bool,
    /// Colours; `auto` uses them on terminals unless NO_COLOR is set
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    color: ColorChoice,
    /// Raise the limits on input size by this factor
    #[arg(
        long,
        global = true,
        value_name = "TIMES",
        default_value = "1",
        hide_default_value = true
    )]
    limits: std::num::NonZeroU64,
}

/// -1 quiet, 0 as usual, 1 verbose; one for the process, as there is one standard error.
static LOUDNESS: AtomicI8 = AtomicI8::new(0);

impl Verbosity {
    /// Keeps to it from now on.
    pub(crate) fn adopt(&self) {
        wheatstone::limits::raise(self.limits.get());
        LOUDNESS.store(i8::from(self.verbose) - i8::from(self.quiet), Ordering::Relaxed);
        match self.color {
            ColorChoice::Always => anstream::ColorChoice::Always,
            ColorChoice::Never => anstream::ColorChoice::Never,
            ColorChoice::Auto => anstream::ColorChoice::Auto,
        }
        .write_global();
    }
}

/// Whether anything but errors is said.
pub(crate) fn speaks() -> bool {
    LOUDNESS.load(Ordering::Relaxed) >= 0
}

/// Whether more than usual is said.
pub(crate) fn is_verbose() -> bool {
    LOUDNESS.load(Ordering::Relaxed) > 0
}

/// The colour of a word at the beginning of a line. It repeats what the word says.
fn style_of(word: &str) -> Style {
    let style = Style::new().bold();
    match word {
        "error" => style.fg_color(Some(AnsiColor::Red.into())),
        "warning" => style.fg_color(Some(AnsiColor::Yellow.into())),
        _ => style.fg_color(Some(AnsiColor::Cyan.into())),
    }
}

/// Prints `word: text`, the word in its colour; errors and their hints are printed always.
pub(crate) fn labelled(word: &str, text: &str) {
    let style = style_of(word);
    tell(format_args!("{style}{word}:{style:#} {text}"));
}

/// Prints a line to standard error. Where nobody can hear it, there is nobody to tell that.
pub(crate) fn tell(text: std::fmt::Arguments) {
    let _ = writeln!(anstream::stderr(), "{text}");
}

/// Prints a line, or several, unless the reader wants quiet.
macro_rules! say {
    ($($text:tt)*) => {
        if $crate::verbosity::speaks() {
            $crate::verbosity::tell(::std::format_args!($($text)*));
        }
    };
}

/// Prints a line for readers who want more than usual.
macro_rules! detail {
    ($($text:tt)*) => {
        if $crate::verbosity::is_verbose() {
            $crate::verbosity::tell(::std::format_args!($($text)*));
        }
    };
}

/// Prints a line that begins with `note:` or `warning:`, unless the reader wants quiet.
macro_rules! remark {
    ($word:expr, $($text:tt)*) => {
        if $crate::verbosity::speaks() {
            $crate::verbosity::labelled($word, &::std::format!($($text)*));
        }
    };
}

pub(crate) use {detail, remark, say};
