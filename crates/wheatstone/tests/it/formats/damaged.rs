//! Damaged files: an error or a value, never a panic, never more memory than a good file takes.

use super::{damage::damage, file, format, given, rig, suited, written};
use std::path::Path;
use wheatstone::{
    dataset::{Correspondence, Dataset},
    formats::{FORMATS, Form, Given, InputFile},
    geometry::{Pixel, Point3},
    numeric::random::Random,
    tables::{self, TableOptions},
};

/// A small table.
pub(super) fn table() -> Dataset {
    let row = |index: usize| Correspondence {
        view: index / 2,
        id: Some(format!("{}", index % 2)),
        pixels: vec![Some(Pixel::new(1.5, 2.0 + index as f64)); 2],
        world: Some(Point3::new(1.0, index as f64, 3.25)),
        board: None,
    };
    let views = vec!["1".into(), "2".into()];
    Dataset { unit: "mm".into(), cameras: 2, views, correspondences: (0..4).map(row).collect() }
}

/// Good files of a format: written by us, or by its own tool.
pub(super) fn good(name: &str) -> Vec<Vec<InputFile>> {
    let own = format(name);
    let mut all = Vec::new();
    if own.is_calibration() && own.writes() {
        for kind in [Some(0), Some(4), None] {
            let mut rig = suited(name, rig(2, kind));
            let held = rig.cameras.iter_mut().all(|camera| {
                let held = own.forms().iter().find_map(|form: &Form| camera.optics.in_form(*form));
                held.map(|held| camera.optics = held).is_some()
            });
            if held {
                all.push(written(own.write_rig(&rig).unwrap()));
            }
        }
    } else if own.writes() && own.reads() {
        all.push(written(own.write_points(&table(), &given(2)).unwrap()));
    }
    match name {
        "opencv" => all.extend([vec![file("opencv.yml")], vec![file("opencv.json")]]),
        "openptv" => all.push(
            ["openptv/cam1.tif.ori", "openptv/cam1.tif.addpar", "openptv/ptv.par"]
                .map(file)
                .to_vec(),
        ),
        "colmap" => all.push(["colmap/cameras.txt", "colmap/images.txt"].map(file).to_vec()),
        "vnl" => {
            let bytes =
                b"# filename x y level\na-1.png 1 2 0\nb-1.png 3 4 -\na-2.png - - -\n".to_vec();
            all.push(vec![InputFile { path: "corners.vnl".into(), bytes }]);
        }
        _ => {}
    }
    all
}

/// Reads; whatever is read can be written again, or is refused.
fn feed(name: &str, files: &[InputFile]) -> bool {
    let own = format(name);
    let given = Given { board: Some((3, 1.0)), ..given(2) };
    let hinted = |error: wheatstone::Error| {
        assert!(!error.to_string().is_empty(), "{name}");
        false
    };
    if own.is_calibration() {
        return match own.read_rig(files, &given) {
            Ok(rig) => {
                let finite = |point: Option<Pixel>| point.is_none_or(|p| !p.x.is_nan());
                for camera in &rig.cameras {
                    let _ = finite(camera.optics.project(Point3::new(1.0, 2.0, 300.0)));
                    let _ = own.forms().iter().find_map(|form| camera.optics.in_form(*form));
                }
                let _ = own.write_rig(&rig);
                true
            }
            Err(error) => hinted(error),
        };
    }
    match own.read_points(files, &given) {
        Ok(data) => {
            assert!(data.correspondences.iter().all(|row| row.pixels.len() == data.cameras));
            let _ = own.write_points(&data, &given);
            true
        }
        Err(error) => hinted(error),
    }
}

#[test]
fn damaged_files_are_errors_or_values() {
    const TIMES: usize = 1500;
    for own in FORMATS.iter().filter(|format| format.reads()) {
        let mut random = Random::new(77);
        let goods = good(own.name);
        assert!(!goods.is_empty(), "{} has no example", own.name);
        for files in &goods {
            assert!(feed(own.name, files), "{} refuses a good file", own.name);
        }
        let mut refused = 0;
        for time in 0..TIMES {
            let mut files = goods[time % goods.len()].clone();
            let which = random.below(files.len());
            damage(&mut files[which].bytes, &mut random);
            refused += usize::from(!feed(own.name, &files));
        }
        assert!(refused > TIMES / 20, "{} refuses {refused} of {TIMES} damaged files", own.name);
    }
}

#[test]
fn noise_is_refused() {
    let mut random = Random::new(78);
    for own in FORMATS.iter().filter(|format| format.reads()) {
        let names: Vec<_> = good(own.name)[0].iter().map(|file| file.path.clone()).collect();
        for time in 0..300 {
            let mut noise = || -> Vec<u8> {
                let length = random.below(400);
                let most = if time % 2 == 0 { 256 } else { 128 };
                (0..length).map(|_| random.below(most) as u8).collect()
            };
            let files: Vec<InputFile> =
                names.iter().map(|path| InputFile { path: path.clone(), bytes: noise() }).collect();
            assert!(!feed(own.name, &files), "{} reads noise", own.name);
        }
    }
    // Brackets without end, and a list without an end of a million members.
    for text in
        ["[".repeat(1 << 20), "- ".repeat(1 << 20), "{a: ".repeat(1 << 18), "1,".repeat(1 << 20)]
    {
        for name in ["opencv", "kalibr", "ros", "mrcal", "dlt", "npy", "csv", "vnl", "anipose"] {
            let file = InputFile { path: "deep".into(), bytes: text.clone().into_bytes() };
            assert!(!feed(name, &[file]), "{name}");
        }
    }
}

/// Pages and the footer of a Parquet file carry checksums, which refuse what no reader could see.
#[test]
fn no_flipped_bit_of_a_parquet_file_changes_a_point() {
    let (name, options) = (Path::new("points.parquet"), TableOptions::default());
    let good = tables::encode(&table(), name).unwrap();
    let (mut refused, mut unchanged) = (0, 0);
    for place in 0..good.len() {
        for bit in 0..8 {
            let mut bytes = good.clone();
            bytes[place] ^= 1 << bit;
            match tables::read_bytes(name, bytes, &options) {
                Err(_) => refused += 1,
                Ok(found) => {
                    unchanged += 1;
                    assert_eq!(found, table(), "bit {bit} of byte {place}");
                }
            }
        }
    }
    assert!(refused > 9 * unchanged, "{refused} refused, {unchanged} read as they were");
}
