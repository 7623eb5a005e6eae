//! Small valid files for the fuzz targets to begin with, in the form in which they take them.

use super::{
    damaged::{good, table},
    targets::{BETWEEN, TARGETS},
};
use std::path::{Path, PathBuf};
use wheatstone::{
    AnyMethod, Calibration, Prepared, Silent,
    chart::line_grid::LineGrid,
    formats::{FORMATS, InputFile},
    imaging::GrayImage,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
    tables,
};

fn joined(files: &[InputFile]) -> Vec<u8> {
    files.iter().map(|file| file.bytes.clone()).collect::<Vec<_>>().join(BETWEEN)
}

/// Every format that is read, by its number among those of cameras or of points.
fn formats() -> Vec<(&'static str, Vec<u8>)> {
    let mut seeds = Vec::new();
    for (cameras, target) in [(true, "calibrations"), (false, "points")] {
        let formats = FORMATS.iter().filter(|f| f.reads() && f.is_calibration() == cameras);
        for (number, format) in formats.enumerate() {
            for files in good(format.name) {
                let mut seed = vec![number as u8];
                seed.extend(joined(&files));
                seeds.push((target, seed));
                if format.name == "npy" {
                    seeds.push(("npy", joined(&files)));
                }
            }
        }
    }
    seeds
}

/// The same model in a version that has no checksum, which would refuse all that a fuzzer makes of it.
fn unchecked(model: &[u8]) -> Vec<u8> {
    let mut model: serde_json::Value = serde_json::from_slice(model).unwrap();
    model["version"] = 2.into();
    model.as_object_mut().unwrap().remove("checksum");
    let bytes = model.to_string().into_bytes();
    Calibration::from_bytes(&bytes).unwrap();
    bytes
}

fn models() -> Vec<(&'static str, Vec<u8>)> {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid { columns: 4, rows: 3, ..LineGrid::default() }.into();
    let views = Stage { step: 30.0, ..Stage::default() }.views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), None);
    let model = |name: &str| {
        let method = AnyMethod::named(name).unwrap();
        let prepared = Prepared::as_given(data.clone());
        let model = Calibration::fit(&method, &prepared, 0, false, &Silent).unwrap();
        unchecked(&model.to_bytes().unwrap())
    };
    ["dlt", "brown", "kannala-brandt", "tsai", "interpolation"]
        .map(|name| ("model", model(name)))
        .to_vec()
}

fn pictures(folder: &Path) -> Vec<(&'static str, Vec<u8>)> {
    let picture = image(folder, "seed.png");
    let mut seeds = vec![("picture", picture)];
    seeds.push(("picture", b"P5\n4 3\n255\n0123456789ab".to_vec()));
    seeds.push(("picture", b"P2\n2 2\n9\n1 2 3 4\n".to_vec()));
    seeds.push(("picture", b"P6\n2 1\n255\nabcdef".to_vec()));
    // A bitmap of two by two pixels in 24 bits.
    let mut bitmap =
        b"BM\x46\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x02\0\0\0\x02\0\0\0\x01\0\x18\0".to_vec();
    bitmap.extend([0; 24]);
    bitmap.extend(*b"abcdef\0\0ghijkl\0\0");
    seeds.push(("picture", bitmap));
    // A TIFF of one strip: width, height, bits, no compression, black is zero, where, rows, bytes.
    let mut tiff = b"II\x2a\0\x08\0\0\0\x08\0".to_vec();
    for (tag, value) in
        [(256, 2), (257, 2), (258, 8), (259, 1), (262, 1), (273, 110), (278, 2), (279, 4_u32)]
    {
        tiff.extend([tag as u8, (tag >> 8) as u8, 3, 0, 1, 0, 0, 0]);
        tiff.extend(value.to_le_bytes());
    }
    tiff.extend([0; 4]);
    tiff.extend(*b"abcd");
    seeds.push(("picture", tiff));
    seeds
}

fn image(folder: &Path, name: &str) -> Vec<u8> {
    let path = folder.join(name);
    GrayImage::from_fn(8, 6, |x, y| (20 * x + y) as f32).write_png(&path).unwrap();
    std::fs::read(path).unwrap()
}

const CAPTURE: &str = "unit = \"cm\"\n[chart]\ntype = \"line-grid\"\ncolumns = 9\nrows = 7\npitch = 5.0\n\
    [cameras]\nleft = \"left/*.png\"\nright = \"right/*.png\"\n\
    [[views]]\nname = \"050\"\ntranslation = [0, 0, 50]\nrotation = [0, 0, 0]\n\
    [[views]]\nname = \"065\"\ntranslation = [0, 0, 65]\nsigma = 0.1\n";

const KALIBR: [&str; 3] = [
    "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n",
    "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n",
    "target_type: 'circlegrid'\ntargetCols: 6\ntargetRows: 7\nspacingMeters: 0.02\nasymmetricGrid: False\n",
];

fn seeds(folder: &Path) -> Vec<(&'static str, Vec<u8>)> {
    let mut seeds = formats();
    seeds.extend(models());
    seeds.extend(pictures(folder));
    for (target, name) in [
        ("tables", "t.csv"),
        ("tables", "t.csv.gz"),
        ("parquet", "t.parquet"),
        ("arrow", "t.arrow"),
    ] {
        seeds.push((target, tables::encode(&table(), Path::new(name)).unwrap()));
    }
    for line in ["x1;y1;x2;y2;X;Y;Z\n1,5;2;3;4;5;6;7\n", "# unit: cm\nu1\tv1\tu2\tv2\n1\t2\t\t\n"] {
        seeds.push(("tables", line.as_bytes().to_vec()));
    }
    for chart in ["chessboard", "dot-grid", "charuco", "april-grid", "two-level", "line-grid"] {
        seeds.push(("capture", CAPTURE.replace("line-grid", chart).into_bytes()));
    }
    for target in KALIBR {
        seeds.push(("chart_files", [&[1], target.as_bytes()].concat()));
    }
    let list: [&[u8]; 3] =
        [b"\0id,X,Y,Z\na,0,0,0\nb,1,0,0\nc,0,1,0.5\n", BETWEEN, b"id,x1,y1,x2,y2\na,1,2,3,4\n"];
    seeds.push(("chart_files", list.concat()));
    seeds
}

/// Inputs on which a target has once failed, by its name.
const REGRESSIONS: &str = "tests/regressions";

#[test]
fn seeds_and_what_once_failed_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, bytes: &[u8]| {
        let (_, target) = TARGETS.iter().find(|target| target.0 == name).unwrap();
        let own = folder.path().join(name);
        std::fs::create_dir_all(&own).unwrap();
        target(bytes, &own);
    };
    let mut seeded = std::collections::BTreeSet::new();
    for (name, bytes) in seeds(folder.path()) {
        run(name, &bytes);
        seeded.insert(name);
    }
    assert_eq!(seeded.len(), TARGETS.len(), "every target has seeds: {seeded:?}");
    let targets = std::fs::read_dir(REGRESSIONS).unwrap().map(Result::unwrap);
    for target in targets.filter(|entry| entry.path().is_dir()) {
        let name = target.file_name().into_string().unwrap();
        for input in std::fs::read_dir(target.path()).unwrap() {
            run(&name, &std::fs::read(input.unwrap().path()).unwrap());
        }
    }
}

#[test]
#[ignore = "writes the first inputs of the fuzz targets where FUZZ_CORPUS says"]
fn seeds_of_the_fuzz_targets() {
    let corpus = PathBuf::from(std::env::var_os("FUZZ_CORPUS").unwrap());
    let folder = tempfile::tempdir().unwrap();
    for (number, (target, bytes)) in seeds(folder.path()).into_iter().enumerate() {
        let folder = corpus.join(target);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(format!("seed-{number}")), bytes).unwrap();
    }
}
