//! What is done with the bytes of a fuzzer: every reader of files, each under its name. The fuzz targets call these, and so do
//! the tests with every input that once failed, which lie in `tests/regressions`.

use std::path::{Path, PathBuf};
use wheatstone::{
    Calibration, Capture, FORMATS, Format, Given, GrayImage, InputFile, Limits, Locator, Pixel,
    Silent, geometry::Point3, imaging::decode_image, tables,
};

/// A target takes what a fuzzer makes, and a folder that it may write to.
pub(super) type Target = fn(&[u8], &Path);

/// Every target by its name.
pub(super) const TARGETS: [(&str, Target); 10] = [
    ("arrow", arrow),
    ("calibrations", calibrations),
    ("capture", capture),
    ("chart_files", chart_files),
    ("model", model),
    ("npy", npy),
    ("parquet", parquet),
    ("picture", picture),
    ("points", points),
    ("tables", text),
];

/// What stands between two files of one input.
pub(super) const BETWEEN: &[u8] = b"\0--\0";

/// The files of an input, by these names; files beyond them are called by their number.
fn files(mut data: &[u8], names: &[&str]) -> Vec<InputFile> {
    let mut all = Vec::new();
    loop {
        let end = data.windows(BETWEEN.len()).position(|part| part == BETWEEN);
        let bytes = data[..end.unwrap_or(data.len())].to_vec();
        let name =
            names.get(all.len()).map_or_else(|| format!("file{}", all.len()), |n| (*n).into());
        all.push(InputFile { path: PathBuf::from(name), bytes });
        match end {
            Some(end) => data = &data[end + BETWEEN.len()..],
            None => return all,
        }
    }
}

/// The names that a format's files must have.
fn names(format: &Format) -> &'static [&'static str] {
    match format.name {
        "colmap" => &["cameras.txt", "images.txt"],
        "openptv" => {
            &["cam1.tif.ori", "cam1.tif.addpar", "ptv.par", "cam2.tif.ori", "cam2.tif.addpar"]
        }
        "ros" => &["left.yaml", "right.yaml"],
        _ => &[],
    }
}

/// A format that is read, of cameras or points, by the number in the first byte; and the files after it.
fn chosen(data: &[u8], cameras: bool) -> Option<(&'static Format, Vec<InputFile>)> {
    let (first, data) = data.split_first()?;
    let formats: Vec<&Format> =
        FORMATS.iter().filter(|f| f.reads() && f.is_calibration() == cameras).collect();
    let format = formats[usize::from(*first) % formats.len()];
    Some((format, files(data, names(format))))
}

/// What files do not say of themselves.
fn given() -> Given {
    Given { sizes: vec![[1280, 1024]], board: Some((3, 1.0)), ..Given::default() }
}

/// Calibrations of other programs.
fn calibrations(data: &[u8], _: &Path) {
    let Some((format, files)) = chosen(data, true) else { return };
    let Ok(rig) = format.read_rig(&files, &given()) else { return };
    for camera in &rig.cameras {
        if let Some(pixel) = camera.optics.project(Point3::new(1.0, 2.0, 300.0)) {
            assert!(!pixel.x.is_nan() && !pixel.y.is_nan());
        }
    }
    let _ = format.write_rig(&rig);
}

/// Points of other programs.
fn points(data: &[u8], _: &Path) {
    let Some((format, files)) = chosen(data, false) else { return };
    let Ok(found) = format.read_points(&files, &given()) else { return };
    assert!(found.correspondences.iter().all(|row| row.pixels.len() == found.cameras));
    if format.writes() {
        let _ = format.write_points(&found, &given());
    }
}

/// NumPy's matrices.
fn npy(data: &[u8], _: &Path) {
    let format = Format::named("npy").unwrap();
    if let Ok(found) = format.read_points(&files(data, &[]), &given()) {
        let _ = format.write_points(&found, &given());
    }
}

/// Tables as text, plain or gzipped.
fn text(data: &[u8], _: &Path) {
    table("points.csv", data);
}

fn parquet(data: &[u8], _: &Path) {
    table("points.parquet", data);
}

/// Arrow: files and streams.
fn arrow(data: &[u8], _: &Path) {
    table("points.arrow", data);
}

/// Reads a table to its end; what is read is written and read again.
fn table(name: &str, data: &[u8]) {
    let options = tables::TableOptions::default();
    let Ok(found) = tables::read_bytes(Path::new(name), data.to_vec(), &options) else { return };
    assert!(found.correspondences.iter().all(|row| row.pixels.len() == found.cameras));
    let options = tables::TableOptions {
        duplicates: tables::Duplicates::Keep,
        ..tables::TableOptions::default()
    };
    let bytes = tables::encode(&found, Path::new("again.parquet")).unwrap();
    let again = tables::read_bytes(Path::new("again.parquet"), bytes, &options).unwrap();
    assert_eq!(found.correspondences.len(), again.correspondences.len());
}

/// Model files.
fn model(data: &[u8], _: &Path) {
    let Ok(model) = Calibration::from_bytes(data) else { return };
    let cameras = model.reconstructor.cameras();
    for place in [[320.0, 240.0], [0.0, 0.0], [1e9, -1e9]] {
        let pixels = vec![Some(Pixel::new(place[0], place[1])); cameras];
        let _ = model.reconstructor.locate(&pixels);
        let _ = model.volume.trust(&pixels);
    }
    let columns: Vec<[f64; 2]> = vec![[320.0, f64::NAN]; 2 * cameras];
    let columns: Vec<&[f64]> = columns.iter().map(|column| &column[..]).collect();
    let mut locator = Locator::new(&*model.reconstructor, Some(&model.volume));
    let _ = locator.locate_columns(&columns, &Silent);
    let bytes = model.to_bytes().unwrap();
    Calibration::from_bytes(&bytes).unwrap();
}

/// Pictures: PNG, JPEG, TIFF, BMP, PNM.
fn picture(data: &[u8], _: &Path) {
    // A picture of the default limits may take gigabytes, and minutes.
    let limits = Limits { side: 4096, pixels: 1 << 21 };
    if let Ok(picture) = decode_image(Path::new("picture"), data, limits) {
        assert_eq!(picture.values().len(), picture.width() * picture.height());
        assert!(picture.values().iter().all(|value| (0.0..=255.0).contains(value)));
    }
}

/// Puts a small picture where there is none yet.
fn put_picture(place: &Path) {
    if !place.exists() {
        let folder = place.parent().unwrap();
        std::fs::create_dir_all(folder).unwrap();
        let picture = GrayImage::from_fn(4, 3, |x, y| (x + y) as f32);
        picture.write_png(place).unwrap();
    }
}

/// `capture.toml`, beside pictures that it may name.
fn capture(data: &[u8], folder: &Path) {
    for name in ["left/050.png", "left/065.png", "right/050.png", "right/065.png"] {
        put_picture(&folder.join(name));
    }
    std::fs::write(folder.join("capture.toml"), data).unwrap();
    if let Ok(capture) = Capture::open(folder) {
        assert!(capture.chart.points().len() < 1 << 24);
        assert_eq!(capture.sizes().len(), capture.cameras.len());
    }
}

const CHART_FILES: &str = "[cameras]\nleft = \"left*.png\"\nright = \"right*.png\"\n[[views]]\nname = \"a\"\n\
                           translation = [0, 0, 50]\n";

/// Files that a capture names: lists of points and start files, or targets of Kalibr. The first byte says which.
fn chart_files(data: &[u8], folder: &Path) {
    let Some((first, data)) = data.split_first() else { return };
    for name in ["left.png", "right.png"] {
        put_picture(&folder.join(name));
    }
    let (chart, names): (&str, &[&str]) = if first % 2 == 0 {
        let chart = "type = \"point-list\"\nfile = \"points.csv\"\nstart = \"start.csv\"\n";
        (chart, &["points.csv", "start.csv"])
    } else {
        ("file = \"target.yaml\"\n", &["target.yaml"])
    };
    let text = format!("unit = \"mm\"\n[chart]\n{chart}{CHART_FILES}");
    std::fs::write(folder.join("capture.toml"), text).unwrap();
    for file in files(data, names) {
        std::fs::write(folder.join(&file.path), file.bytes).unwrap();
    }
    if let Ok(capture) = Capture::open(folder) {
        let points = capture.chart.points();
        assert!(points.iter().all(|point| point.iter().all(|value| value.is_finite())));
    }
}
