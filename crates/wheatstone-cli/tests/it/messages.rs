//! What the program says when something is wrong, word for word: every kind of error, warning, note and
//! finding. A change of any message shows as a change of a file in `snapshots/`; read it aloud once.

use crate::program::{done, said, wheatstone};
use std::{fmt::Write, fs, path::Path};
use wheatstone::{
    numeric::random::Random,
    synthetic::{
        faults::{inject, names},
        random_capture::RandomCapture,
    },
};

/// A points file of one line each of header and rows.
const TABLES: &[(&str, &str)] = &[
    ("empty.csv", ""),
    ("header.csv", "x1,y1,x2,y2,X,Y,Z\n"),
    ("numbers.csv", "1,2,3,4,5,6,7\n"),
    ("no-z.csv", "x1,y1,x2,y2,X,Y\n1,2,3,4,5,6\n"),
    ("word.csv", "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,far\n"),
    ("infinite.csv", "x1,y1,x2,y2,X,Y,Z\n1,2,3,inf,5,6,7\n"),
    ("half.csv", "x1,y1,x2,y2,X,Y,Z\n1,2,3,,5,6,7\n"),
    ("short.csv", "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6\n"),
    ("twice.csv", "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n"),
    ("stray.csv", "x1,y1,x2,y2,x4,y4\n1,2,3,4,5,6\n"),
    ("same.csv", "x1,y1,x1,y2,X,Y,Z\n1,2,3,4,5,6,7\n"),
    ("units.csv", "# unit: cm\nx1,y1,x2,y2,X_mm,Y_mm,Z_mm\n1,2,3,4,5,6,7\n"),
    ("few.csv", "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n2,2,3,4,5,6,8\n"),
    ("pixels.csv", "x1,y1,x2,y2\n1,2,3,4\n"),
    ("one.csv", "x1,y1,X,Y,Z\n1,2,5,6,7\n"),
    ("three.csv", "x1,y1,x2,y2,x3,y3\n1,2,3,4,5,6\n"),
    ("board.csv", "x1,y1,x2,y2,board_x,board_y,view\n1,2,3,4,5,6,a\n2,2,3,4,6,6,a\n"),
    ("broken.json", "{"),
    ("other.json", "{\"format\": \"something else\"}"),
    ("future.json", "{\"format\": \"wheatstone-calibration\", \"version\": 99}"),
    ("anchor.yml", "%YAML:1.0\n---\nK1: *x\n"),
    ("no-extrinsics.yml", "%YAML:1.0\n---\nK1: [1]\n"),
    ("picture.png", "not a picture"),
];

/// A description of a capture with something wrong, and the pictures that it has.
const CAPTURES: &[(&str, &str, &[&str])] = &[
    ("toml", "unit = ", &[]),
    (
        "unit",
        "unit = \"furlong\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\na = \"a/*\"\n",
        &[],
    ),
    ("chart", "unit = \"mm\"\n[chart]\ntype = \"chesboard\"\n[cameras]\na = \"a/*\"\n", &[]),
    (
        "size",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 1\nrows = 6\npitch = 25\n[cameras]\na = \"a/*\"\n",
        &[],
    ),
    (
        "cameras",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\n",
        &[],
    ),
    (
        "pattern",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\na = \"a/*.png\"\n",
        &[],
    ),
    (
        "uneven",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\na = \"a*.png\"\nb = \"b*.png\"\n",
        &["a1.png", "a2.png", "b7.png"],
    ),
    (
        "views",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\na = \"a*.png\"\n[[views]]\n[[views]]\n",
        &["a1.png"],
    ),
    (
        "pose",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\na = \"a*.png\"\n\
         [[views]]\nname = \"v\"\nrotation = [0, 0, 0]\n",
        &["a1.png"],
    ),
    (
        "picture",
        "unit = \"mm\"\n[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 25\n[cameras]\na = \"a*.png\"\nb = \"b*.png\"\n",
        &["a1.png", "b1.png"],
    ),
];

/// Commands that fail, or that say something beside their work.
const COMMANDS: &[&str] = &[
    "fti points.csv",
    "fit missing.csv -o m.json",
    "fit points.csv -o missing/m.json",
    "fit points.csv --method brwon -o m.json",
    "fit points.csv --method dlt --epochs 5 -o m.json",
    "fit points.csv --unit furlong -o m.json",
    "fit points.csv --method network --preset papr -o m.json",
    "fit points.csv --expect-baseline 7:5:1 -o m.json",
    "fit empty.csv -o m.json",
    "fit header.csv -o m.json",
    "fit numbers.csv -o m.json",
    "fit no-z.csv -o m.json",
    "fit object-points.csv -o m.json",
    "fit word.csv -o m.json",
    "fit infinite.csv -o m.json",
    "fit half.csv -o m.json",
    "fit short.csv -o m.json",
    "fit twice.csv -o m.json",
    "fit stray.csv -o m.json",
    "fit same.csv -o m.json",
    "fit units.csv -o m.json",
    "fit few.csv -o m.json",
    "fit pixels.csv -o m.json",
    "fit one.csv -o m.json",
    "fit board.csv -o m.json",
    "fit points.csv --columns x1=u -o m.json",
    "fit picture.png -o m.json",
    "fit toml -o m.json",
    "fit unit -o m.json",
    "fit chart -o m.json",
    "fit size -o m.json",
    "fit cameras -o m.json",
    "fit pattern -o m.json",
    "fit uneven -o m.json",
    "fit views -o m.json",
    "fit pose -o m.json",
    "fit picture -o m.json",
    "detect picture",
    "compare one.csv",
    "compare few.csv",
    "compare points.csv --methods dlt,tsia",
    "report points.csv -o r.html --pictures missing",
    "locate broken.json points.csv",
    "locate other.json points.csv",
    "locate future.json points.csv",
    "locate model.json three.csv",
    "locate model.json numbers.csv",
    "locate model.json exchanged.csv -o out.csv",
    "locate model.json mismatched.csv -o out.csv",
    "locate one.json points.csv",
    "evaluate model.json board.csv",
    "evaluate model.json metres.csv",
    "export model.json --format opencvv -o o.yml",
    "export model.json --format opencv -o o.yml",
    "export interpolation.json --size 1280x1024 --format opencv -o o.yml",
    "export model.json --size 1280x1024 --format remap -o -",
    "convert points.csv",
    "convert points.csv out.xyz",
    "convert points.csv out.json",
    "convert points.csv out.json --to model",
    "convert anchor.yml out.json",
    "convert no-extrinsics.yml out.json",
    "convert model.json out.json",
    "convert rig.yml rig.json",
    "rectify model.json --cameras 1,1 --size 1280x1024 -o pair",
    "rectify model.json --cameras 1 -o pair",
    "rectify model.json -o pair",
    "chart chessboard --columns 1 --rows 6 --pitch 25 -o chart.svg",
    "new here --cameras left,left",
    "new toml",
    "synth --rig telescope -o s.csv",
    "synth --points --noise loud -o s.csv",
    "synth --near 100 --far 50 -o s",
    "drive --knock 400",
];

/// A table whose rows are changed.
fn changed(folder: &Path, name: &str, change: impl Fn(&mut Vec<f64>)) {
    let text = fs::read_to_string(folder.join("points.csv")).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').take(7).collect();
    let mut out = header.join(",") + "\n";
    for line in lines {
        let mut cells: Vec<f64> = line.split(',').take(7).map(|c| c.parse().unwrap()).collect();
        change(&mut cells);
        let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
        out += &(cells.join(",") + "\n");
    }
    fs::write(folder.join(name), out).unwrap();
}

fn prepare(folder: &Path) {
    let words = "synth --points --noise 0.1 --count 200 --seed 1 -o points.csv";
    done(folder, &words.split(' ').collect::<Vec<_>>());
    for (name, text) in TABLES {
        fs::write(folder.join(name), text).unwrap();
    }
    for (name, text, pictures) in CAPTURES {
        fs::create_dir(folder.join(name)).unwrap();
        fs::write(folder.join(name).join("capture.toml"), text).unwrap();
        for picture in *pictures {
            fs::write(folder.join(name).join(picture), "not a picture").unwrap();
        }
    }
    fs::write(folder.join("one-camera.csv"), crate::one_camera::corners(0..8)).unwrap();
    fs::write(folder.join("object-points.csv"), object_points()).unwrap();
    changed(folder, "exchanged.csv", |cells| cells[..4].rotate_left(2));
    changed(folder, "mismatched.csv", |cells| cells[1] += 100.0);
    changed(folder, "metres.csv", |cells| cells[4..].iter_mut().for_each(|v| *v /= 100.0));
    for words in [
        "fit points.csv --method brown --no-validation -o model.json",
        "fit points.csv --method interpolation --no-validation -o interpolation.json",
        "export model.json --size 1280x1024 --format opencv -o rig.yml",
        "fit one-camera.csv --method brown --no-validation -o one.json",
    ] {
        done(folder, &words.split(' ').collect::<Vec<_>>());
    }
}

/// The corners of a board in the hand as OpenCV's users list them: the place on the board, and Z = 0.
fn object_points() -> String {
    let corners = crate::one_camera::corners(0..8);
    let second = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let x: f64 = cells[4].parse().unwrap();
        format!("{line},0,{},{}\n", 0.9 * x - 20.0, cells[5])
    };
    let rows: String = corners.lines().skip(1).map(second).collect();
    format!("view,id,X,Y,x1,y1,Z,x2,y2\n{rows}")
}

#[test]
fn errors_warnings_and_notes() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let mut all = String::new();
    for line in COMMANDS {
        let words: Vec<&str> = line.split(' ').collect();
        let output = wheatstone(folder.path(), &words);
        let said = said(&output);
        assert!(!said.is_empty(), "{line}");
        writeln!(all, "$ wheatstone {line}\n{}\n", said.trim_end()).unwrap();
    }
    insta::assert_snapshot!("messages", all);
}

/// Each fault of the survey, in the first random captures that can have it.
#[test]
fn findings() {
    let mut all = String::new();
    for (fault, name) in names().into_iter().enumerate() {
        let seeds = 0..20;
        let faulty = seeds.into_iter().find_map(|seed| {
            let mut random = Random::stream(seed, fault as u64);
            let capture = RandomCapture::new(seed);
            inject(&capture, fault, 2, &mut random).map(|faulty| (capture, faulty))
        });
        let (capture, faulty) = faulty.unwrap();
        let folder = tempfile::tempdir().unwrap();
        let data = capture.as_filed(faulty.data);
        fs::write(folder.path().join("points.csv"), wheatstone::tables::write(&data)).unwrap();
        let said = said(&wheatstone(folder.path(), &["check", "points.csv", "--unit", &data.unit]));
        // What no data can show is much the same each time.
        let told = if fault == 0 { &said } else { said.split("What these data").next().unwrap() };
        writeln!(all, "# {name}\n{}\n", told.trim_end()).unwrap();
    }
    insta::assert_snapshot!("findings", all);
}

/// Terms by which people of this field search.
const TERMS: [&str; 14] = [
    "reprojection error",
    "intrinsics",
    "extrinsics",
    "baseline",
    "epipolar",
    "leave-one",
    "cross-validation",
    "bundle adjustment",
    "triangulation",
    "covariance",
    "residual",
    "principal point",
    "focal length",
    "rectif",
];

/// All pages in a folder and below.
fn all_text(folder: &Path) -> String {
    let mut all = String::new();
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            all += &all_text(&path);
        } else if path.extension().is_some_and(|it| it == "md" || it == "1") {
            all += &fs::read_to_string(path).unwrap();
        }
    }
    all
}

#[test]
fn help_and_documentation_have_the_terms_of_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man");
    done(folder.path(), &["--quiet", "man", pages.to_str().unwrap()]);
    let plain = |text: String| text.replace("\\-", "-").replace('\n', " ").to_lowercase();
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let texts = [("help", plain(all_text(&pages))), ("docs", plain(all_text(&docs)))];
    for (place, text) in &texts {
        for term in TERMS {
            assert!(text.contains(term), "nothing in the {place} says `{term}`");
        }
    }
}
