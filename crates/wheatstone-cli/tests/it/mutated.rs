//! Damaged files of every kind that is read, through the program and within little memory: an answer or one error.
//! `WHEATSTONE_MUTATIONS=30000` tries more.

#[path = "../../../wheatstone/tests/it/formats/damage.rs"]
mod damage;

use self::damage::damage;
use crate::{
    bombs::bounded,
    jobs::{names, prepared},
    program::{done, said},
};
use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};
use wheatstone::{
    FORMATS,
    numeric::random::Random,
    tables::{self, TableOptions},
};

/// A command, and the files that it reads and that are damaged.
#[derive(Clone)]
struct Kind {
    arguments: String,
    files: Vec<PathBuf>,
}

/// A file, or all files of a folder.
fn files(at: &Path, name: &str) -> Vec<PathBuf> {
    let path = at.join(name);
    if path.is_file() {
        return vec![path];
    }
    names(&path).iter().flat_map(|inner| files(&path, inner)).collect()
}

fn kind(at: &Path, name: &str, arguments: String) -> Kind {
    Kind { arguments, files: files(at, name) }
}

/// Cameras and points of every format that is written and read.
fn formats(at: &Path) -> Vec<Kind> {
    let mut kinds = Vec::new();
    for format in FORMATS.iter().filter(|format| format.reads() && format.writes()) {
        let name = format.name;
        let made = match name {
            "csv" | "npy" | "parquet" | "arrow" | "ply" | "pcd" => format!("as-{name}.{name}"),
            _ => format!("as-{name}"),
        };
        let from = if format.is_calibration() { "model.json" } else { "points.csv" };
        done(at, &["convert", "--to", name, "--size", "640x480", from, &made]);
        let to = if format.is_calibration() { "made.json" } else { "made.csv" };
        let size = "--size 640x480,640x480";
        kinds.push(kind(at, &made, format!("convert --from {name} {size} {made} {to}")));
    }
    kinds
}

/// Models, with and without the checksum that refuses most of what is done to them.
fn models(at: &Path) -> Vec<Kind> {
    let mut kinds = Vec::new();
    for method in ["dlt", "brown", "network", "interpolation", "kannala-brandt"] {
        let name = format!("{method}.json");
        done(at, &["fit", "points.csv", "--method", method, "--no-validation", "-o", &name]);
        let text = fs::read_to_string(at.join(&name)).unwrap();
        let mut model: serde_json::Value = serde_json::from_str(&text).unwrap();
        model["version"] = 2.into();
        model.as_object_mut().unwrap().remove("checksum");
        let unchecked = format!("unchecked-{name}");
        fs::write(at.join(&unchecked), model.to_string()).unwrap();
        for name in [&name, &unchecked] {
            kinds.push(kind(at, name, format!("locate {name} points.csv -o made.csv")));
        }
        kinds.push(kind(at, &unchecked, format!("info {unchecked} --json")));
    }
    kinds
}

/// Captures with pictures of every kind, and tables that are fitted and checked.
fn captures(at: &Path) -> Vec<Kind> {
    let mut kinds = vec![
        kind(at, "capture/capture.toml", "detect capture -o made.csv".into()),
        kind(at, "points.csv", "fit points.csv --method dlt --no-validation -o made.json".into()),
        kind(at, "points.csv", "check points.csv".into()),
    ];
    let points = tables::read_with(&at.join("points.csv"), &TableOptions::default()).unwrap();
    let packed = tables::encode(&points, Path::new("p.csv.gz"));
    fs::write(at.join("points.csv.gz"), packed.unwrap()).unwrap();
    kinds.push(kind(at, "points.csv.gz", "convert points.csv.gz made.npy".into()));
    let text = fs::read_to_string(at.join("capture/capture.toml")).unwrap();
    for extension in ["png", "jpg", "tif", "bmp", "pgm"] {
        let capture = format!("capture-{extension}");
        fs::create_dir(at.join(&capture)).unwrap();
        let text = text.replace(".png", &format!(".{extension}"));
        fs::write(at.join(&capture).join("capture.toml"), text).unwrap();
        let mut files = files(at, "capture");
        files.retain(|file| file.extension().is_some_and(|found| found == "png"));
        let mut made = Vec::new();
        for file in files {
            let inner = file.strip_prefix(at.join("capture")).unwrap();
            let place = at.join(&capture).join(inner).with_extension(extension);
            fs::create_dir_all(place.parent().unwrap()).unwrap();
            image::open(&file).unwrap().to_luma8().save(&place).unwrap();
            made.push(place);
        }
        kinds.push(Kind { arguments: format!("detect {capture} -o made.csv"), files: made });
    }
    kinds
}

#[test]
fn mutated_files_are_answered_or_refused() {
    let folder = prepared("60");
    let at = folder.path();
    let kinds = [formats(at), models(at), captures(at)].concat();
    assert!(kinds.len() >= 33, "{}", kinds.len());
    let asked = std::env::var("WHEATSTONE_MUTATIONS").ok().and_then(|times| times.parse().ok());
    let times: usize = asked.unwrap_or(600);
    let (mut random, mut refused) = (Random::new(33), 0);
    for time in 0..times {
        let kind = &kinds[time % kinds.len()];
        let file = &kind.files[random.below(kind.files.len())];
        let good = fs::read(file).unwrap();
        let mut bytes = good.clone();
        damage(&mut bytes, &mut random);
        fs::write(file, &bytes).unwrap();
        let began = Instant::now();
        let output = bounded(at, &kind.arguments);
        let (took, told) = (began.elapsed(), said(&output));
        let is_ended =
            matches!(output.status.code(), Some(0..=2)) && took < Duration::from_secs(10);
        let is_told = output.status.success() != told.contains("error: ");
        let case = format!("mutation {time}, {}: {} {took:?}", file.display(), kind.arguments);
        assert!(is_ended && is_told, "{case}: {:?} {told}", output.status);
        refused += usize::from(!output.status.success());
        fs::write(file, good).unwrap();
    }
    assert!(refused > times / 10, "{refused} of {times} refused");
}
