//! Every verb that writes to a name that is given to it, in one list.

use crate::program::{command, done};
use std::{
    fs::{self, DirEntry},
    path::Path,
    process::Command,
};

/// A command without the last of its arguments, which is the name of what it writes.
pub(crate) struct Job {
    pub(crate) arguments: &'static [&'static str],
    /// How that name ends; nothing where it is a folder.
    pub(crate) extension: &'static str,
    /// What of the arguments is read.
    pub(crate) inputs: &'static [&'static str],
    /// What it writes besides.
    pub(crate) besides: &'static [&'static str],
}

const fn job(
    arguments: &'static [&'static str],
    extension: &'static str,
    inputs: &'static [&'static str],
) -> Job {
    Job { arguments, extension, inputs, besides: &[] }
}

const fn and(besides: &'static [&'static str], job: Job) -> Job {
    Job { besides, ..job }
}

/// Those that write one file.
pub(crate) const FILES: [Job; 14] = [
    and(
        &["out.truth.json"],
        job(&["synth", "--points", "--count", "100", "--seed", "5", "-o"], "csv", &[]),
    ),
    job(
        &["fit", "points.csv", "--method", "brown", "--no-validation", "-o"],
        "json",
        &["points.csv"],
    ),
    job(&["locate", "model.json", "points.csv", "-o"], "csv", &["model.json", "points.csv"]),
    job(&["locate", "model.json", "points.csv", "-o"], "parquet", &[]),
    job(&["locate", "model.json", "points.csv", "-o"], "arrow", &[]),
    job(&["export", "model.json", "--format", "opencv", "-o"], "yml", &["model.json"]),
    job(&["convert", "points.csv"], "csv", &["points.csv"]),
    job(&["convert", "points.csv"], "npy", &[]),
    job(&["check", "points.csv", "--fix"], "csv", &["points.csv"]),
    job(&["chart", "-o"], "pdf", &[]),
    job(&["chart", "-o"], "svg", &[]),
    job(&["detect", "capture", "-o"], "csv", &[]),
    job(&["report", "model.json", "--no-validation", "-o"], "html", &["model.json"]),
    job(&["compare", "points.csv", "--methods", "dlt", "-o"], "html", &["points.csv"]),
];

/// Those that write a folder.
pub(crate) const FOLDERS: [Job; 8] = [
    job(&["synth", "--near", "90", "--far", "120", "-o"], "", &[]),
    job(&["export", "model.json", "--format", "ros", "-o"], "", &[]),
    job(&["rectify", "model.json", "-o"], "", &[]),
    job(
        &["match", "capture/left/090.png", "capture/right/090.png", "--range", "0:16", "-o"],
        "",
        &[],
    ),
    job(
        &[
            "reconstruct",
            "model.json",
            "--images",
            "capture/left/090.png",
            "capture/right/090.png",
            "--force",
            "-o",
        ],
        "",
        &[],
    ),
    and(&["drawn.csv"], job(&["detect", "capture", "-o", "drawn.csv", "--draw"], "", &[])),
    job(&["man"], "", &[]),
    job(&["new"], "", &[]),
];

impl Job {
    /// The name of its output: this, and what it ends with.
    pub(crate) fn named(&self, stem: &str) -> String {
        match self.extension {
            "" => stem.into(),
            extension => format!("{stem}.{extension}"),
        }
    }

    pub(crate) fn to<'a>(&self, output: &'a str) -> Vec<&'a str> {
        [self.arguments, &[output]].concat()
    }

    /// The command that writes there.
    pub(crate) fn command(&self, folder: &Path, output: &str) -> Command {
        command(folder, &self.to(output))
    }
}

/// A folder with points, a model of them, and a capture.
pub(crate) fn prepared(points: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["synth", "--points", "--count", points, "--noise", "0.1", "-o", "points.csv"]);
    done(at, &["fit", "points.csv", "--method", "brown", "--no-validation", "-o", "model.json"]);
    done(at, &["synth", "--near", "90", "--far", "120", "-o", "capture"]);
    folder
}

/// All names in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let name = |entry: DirEntry| entry.file_name().into_string().unwrap();
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| name(entry.unwrap())).collect();
    names.sort();
    names
}
