//! The program as a user meets it: verbs, messages, exit status, and what lies on disk afterwards.

use crate::program::{done, refused, wheatstone};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn from_a_table_to_located_points() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "--count", "400", "-o", "train.csv"]);
    done(at, &["synth", "--random", "50", "--noise", "0.1", "--seed", "1", "-o", "exam.csv"]);
    done(at, &["fit", "train.csv", "--method", "dlt", "-o", "model.json"]);
    let scores = json(&done(at, &["evaluate", "model.json", "exam.csv", "--json"]).0);
    assert_eq!(scores["unit"], "cm");
    assert_eq!((scores["n"].as_u64(), scores["located"].as_u64()), (Some(50), Some(50)));
    assert!(scores["mean_percent"].as_f64().unwrap() < 2.0);
    assert_eq!(scores["rms_xyz"].as_array().unwrap().len(), 3);
    assert!(scores["budget"]["lens_model"]["rms"].as_f64().unwrap() >= 0.0);

    done(at, &["fit", "train.csv", "--method", "brown", "-o", "brown.json"]);
    let (text, _) = done(at, &["info", "brown.json"]);
    for word in ["Held-out error", "fx", "standard deviation", "Baseline of cameras 1 and 2: 7.0"] {
        assert!(text.contains(word), "{word} is not in {text}");
    }
    let told = json(&done(at, &["info", "brown.json", "--json"]).0);
    assert_eq!(told["intrinsics"][1]["parameters"][2]["name"], "cx");
    assert!(told["intrinsics"][1]["parameters"][2]["sigma"].as_f64().unwrap() > 0.0);
    assert!(told["held_out"]["rms"].as_f64().unwrap() > 0.0);
    let [baseline, sigma] =
        ["baselines", "baseline_sigmas"].map(|key| told[key][0].as_f64().unwrap());
    assert!((baseline - 7.0).abs() < 4.0 * sigma && sigma < 0.1, "{baseline} ± {sigma}");

    let exam = std::fs::read_to_string(at.join("exam.csv")).unwrap();
    done(at, &["locate", "model.json", "exam.csv", "-o", "points.csv"]);
    let points = std::fs::read_to_string(at.join("points.csv")).unwrap();
    let mut lines = points.lines();
    let header = "x1,y1,x2,y2,input_X,input_Y,input_Z,X,Y,Z,sX,sY,sZ,residual,trust,mismatch";
    assert_eq!(lines.next(), Some(header));
    for (line, original) in lines.zip(exam.lines().skip(1)) {
        assert!(line.starts_with(original), "{line} does not begin with {original}");
        let all: Vec<&str> = line.split(',').collect();
        assert!(["inside", "edge", "outside"].contains(&all[14]) && all.len() == 16, "{line}");
        let cells: Vec<f64> = all[..14].iter().map(|cell| cell.parse().unwrap()).collect();
        for axis in 0..3 {
            let error = (cells[7 + axis] - cells[4 + axis]).abs();
            assert!(error < 10.0 && cells[10 + axis] > 0.0, "{line}");
        }
    }
    assert_eq!(points.lines().count(), 51);
}

#[test]
fn rows_that_cannot_be_located_keep_their_place() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--points", "-o", "train.csv"]);
    done(at, &["fit", "train.csv", "--method", "dlt", "-o", "model.json", "--no-validation"]);
    let train = std::fs::read_to_string(at.join("train.csv")).unwrap();
    let row: Vec<&str> = train.lines().nth(200).unwrap().split(',').take(4).collect();
    let row = row.join(";");
    let rows = format!("id;x1;y1;x2;y2\na;{row}\nb;;;1;2\nc;{row}\n");
    std::fs::write(at.join("in.csv"), rows).unwrap();
    let (text, _) = done(at, &["locate", "model.json", "in.csv"]);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[2], "b;;;1;2;;;;;;;;;");
    assert_eq!(lines[1][1..], lines[3][1..]);
    assert!(lines[1].contains("inside"), "{}", lines[1]);
}

#[test]
fn points_beyond_what_was_trained_and_pixels_of_different_points_are_told() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "-o", "train.csv"]);
    done(at, &["fit", "train.csv", "--method", "brown", "-o", "model.json", "--no-validation"]);
    let train = std::fs::read_to_string(at.join("train.csv")).unwrap();
    let pixels = |line: &str| -> Vec<f64> {
        line.split(',').take(4).map(|cell| cell.parse().unwrap()).collect()
    };
    let row = pixels(train.lines().nth(200).unwrap());
    let rows: String = [[0.0, 0.0], [0.0, 8.0], [40.0, 0.0]]
        .map(|[x, y]| format!("{},{},{},{}\n", row[0], row[1], row[2] + x, row[3] + y))
        .concat();
    std::fs::write(at.join("in.csv"), format!("x1,y1,x2,y2\n{rows}")).unwrap();
    let (text, _) = done(at, &["locate", "model.json", "in.csv", "--covariance"]);
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| lines[0].iter().position(|cell| *cell == name).unwrap();
    let (trust, mismatch) = (column("trust"), column("mismatch"));
    assert_eq!((lines[1][trust], lines[1][mismatch]), ("inside", ""));
    assert_eq!(lines[2][mismatch], "yes", "the rows of the pictures differ by 8");
    assert_eq!(lines[3][trust], "outside", "nothing was shown so near or so far");
    let number = |name: &str| lines[1][column(name)].parse::<f64>().unwrap();
    for (term, sigma) in [("cXX", "sX"), ("cYY", "sY"), ("cZZ", "sZ")] {
        // Standard deviations have four digits at least.
        assert!((number(sigma).powi(2) / number(term) - 1.0).abs() < 2e-3, "{term}");
    }
    assert!(number("cXY").is_finite() && number("cYZ").is_finite() && lines[0].len() == 19);
    for wrong in ["0", "1", "-0.1", "often", "NaN"] {
        let rate = format!("--false-alarm={wrong}");
        let output = wheatstone(at, &["locate", "model.json", "in.csv", &rate]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn comparison_has_the_contracts_fields() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--points", "--count", "300", "-o", "train.csv"]);
    let found = json(&done(at, &["compare", "train.csv", "--json"]).0);
    assert_eq!(found["unit"], "cm");
    let names: Vec<&str> = found["methods"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| m["method"].as_str().unwrap())
        .collect();
    assert!(names.contains(&"dlt") && names.contains(&"network"), "{names:?}");
    assert!(names.contains(&found["chosen"].as_str().unwrap()));
    let causes = ["detector", "lens_model", "stage", "extrapolation"];
    let shares = causes.map(|cause| found["budget"][cause]["share"].as_f64().unwrap());
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9 && shares.iter().all(|s| *s >= 0.0));
    assert!(found["budget"]["ratio_to_floor"].as_f64().unwrap() > 0.5);
    for method in found["methods"].as_array().unwrap() {
        for field in ["rms", "median", "p95", "mean_percent", "fit_seconds", "ratio_to_floor"] {
            assert!(method[field].as_f64().is_some(), "{field} in {method}");
        }
        let kinds: Vec<&str> = method["folds"]
            .as_array()
            .unwrap()
            .iter()
            .map(|f| f["kind"].as_str().unwrap())
            .collect();
        assert_eq!(kinds.len(), 7);
        assert_eq!(
            (kinds[0], kinds[3], kinds[6]),
            ("extrapolation", "interpolation", "extrapolation")
        );
    }
}

#[test]
fn a_rendered_capture_is_detected_and_drawn() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--near", "80", "--far", "110", "--step", "30", "-o", "capture"]);
    let (text, _) = done(at, &["detect", "capture", "--draw", "found"]);
    assert!(text.starts_with("x1,y1,x2,y2,X,Y,Z,view,id\n"));
    assert_eq!(text.lines().count(), 1 + 2 * 63);
    assert!(at.join("found/left-080.png").is_file());
    done(at, &["detect", "capture/capture.toml", "--whole-pixels", "-o", "whole.csv"]);
    let whole = std::fs::read_to_string(at.join("whole.csv")).unwrap();
    let first: Vec<f64> =
        whole.lines().nth(1).unwrap().split(',').take(4).map(|c| c.parse().unwrap()).collect();
    assert!(first.iter().all(|pixel| pixel.fract() == 0.0), "{first:?}");
}

#[test]
fn charts_are_printed_to_scale() {
    let dir = folder();
    let at = dir.path();
    done(
        at,
        &[
            "chart",
            "chessboard",
            "--columns",
            "4",
            "--rows",
            "3",
            "--pitch",
            "3",
            "--unit",
            "cm",
            "-o",
            "c.svg",
        ],
    );
    let text = std::fs::read_to_string(at.join("c.svg")).unwrap();
    // 5 x 4 squares of 30 mm and half a square of margin all round; below it the name and the ruler.
    assert!(text.contains("width=\"180mm\" height=\"165.1mm\""), "{text}");
    assert_eq!(text.matches("width=\"30\" height=\"30\"").count(), 10);
}

#[test]
fn lists_name_what_there_is() {
    let dir = folder();
    let (text, _) = done(dir.path(), &["list"]);
    for name in ["network", "dlt", "line-grid", "chessboard", "brown-conrady", "paper"] {
        assert!(text.contains(name), "{name} is not in {text}");
    }
    let object = json(&done(dir.path(), &["list", "charts", "--json"]).0);
    assert_eq!(object["charts"][0], "line-grid");
}

#[test]
fn bad_tables_are_refused_with_file_line_and_hint() {
    let dir = folder();
    let at = dir.path();
    let good = "x1,y1,x2,y2,X,Y,Z\n";
    let plane: String = (0..40)
        .map(|i| format!("{i},{},{},{},{},{},5\n", i * i % 17, i + 2, i % 7, i, i * i % 13))
        .collect();
    for (name, text, words) in [
        ("empty.csv", String::new(), "empty.csv:1: the file is empty"),
        ("text.csv", format!("{good}1,2,3,oops,5,6,7\n"), "text.csv:2: column `y2` is `oops`"),
        (
            "nan.csv",
            format!("{good}1,2,3,4,5,6,NaN\n"),
            "nan.csv:2: column `Z` is empty, but its partner",
        ),
        ("short.csv", format!("{good}1,2,3,4,5,6,7\n1,2\n"), "short.csv:3: 2 cells"),
        ("twice.csv", format!("{good}1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n"), "twice.csv:3: the same row"),
        ("header.csv", "1,2,3,4,5,6,7\n".into(), "header.csv:1: the header is missing"),
        ("few.csv", format!("{good}1,2,3,4,5,6,7\n2,2,3,4,5,6,8\n"), "at least 4"),
        ("plane.csv", format!("{good}{plane}"), "one plane"),
        (
            "world.csv",
            "x1,y1,x2,y2\n1,2,3,4\n".into(),
            "no column `X`, `Y`, `Z`; found: x1, y1, x2, y2",
        ),
    ] {
        std::fs::write(at.join(name), text).unwrap();
        let message = refused(at, &["fit", name, "-o", "model.json"]);
        assert!(message.contains(words), "{name}: {message}");
        let message = refused(at, &["compare", name]);
        assert!(message.contains(words), "compare {name}: {message}");
    }
    std::fs::write(at.join("binary.csv"), b"x1,y1,x2,y2,X,Y,Z\n\xff\xfe,1,2,3,4,5,6\n").unwrap();
    let message = refused(at, &["fit", "binary.csv", "-o", "model.json"]);
    assert!(message.contains("binary.csv:2: not text"), "{message}");
    std::fs::write(at.join("few.truth.json"), "{\"truth\": 1}").unwrap();
    let message = refused(at, &["fit", "few.csv", "-o", "model.json"]);
    assert!(message.contains("few.truth.json:1: not a truth file"), "{message}");
    assert!(message.contains("hint: rename the file if it is yours"), "{message}");
    for (name, bytes, words) in [
        ("book.xlsx", &b"\xd0\xcf\x11\xe0\xa1\xb1"[..], "hint: save the table as CSV"),
        ("table.zip", b"PK\x03\x04\x14\0\x06\0", "a ZIP archive"),
        ("bare.csv", b"x\x001\0,\0y\x001\0", "hint: save it as UTF-8"),
        ("latin.csv", b"x1,y1,x2,y2,X,Y,Z,\xb0\n", "save it as UTF-8"),
        ("wide.csv", b"\xff\xfex\x001\0,\0\r\0\n\0", "hint: save it as UTF-8"),
        ("capture.toml", b"\xff\xfeu\0n\0", "hint: save it as UTF-8"),
        ("left.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF", "`wheatstone new` makes one"),
    ] {
        std::fs::write(at.join(name), bytes).unwrap();
        let message = refused(at, &["fit", name, "-o", "model.json"]);
        assert!(message.contains(words), "{name}: {message}");
    }
    assert!(!at.join("model.json").exists(), "a failed fit leaves a file");
}

#[test]
fn missing_and_misplaced_files_are_named() {
    let dir = folder();
    let at = dir.path();
    std::fs::create_dir(at.join("folder.csv")).unwrap();
    for (arguments, words) in [
        (&["fit", "none.csv", "-o", "m.json"][..], "cannot read `none.csv`"),
        (&["fit", "folder.csv", "-o", "m.json"], "`wheatstone new` makes one"),
        (&["locate", "none.json", "in.csv"], "cannot read `none.json`"),
        (&["locate", "folder.csv", "in.csv"], "folder.csv"),
        (&["evaluate", "none.json", "in.csv"], "none.json"),
        (&["detect", "nowhere"], "nowhere"),
        (&["synth", "--points", "-o", "no/such/folder.csv"], "no/such"),
        (&["synth", "--points", "-o", "folder.csv"], "folder.csv"),
    ] {
        let message = refused(at, arguments);
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
}

#[test]
fn mistyped_words_are_usage_errors_with_a_suggestion() {
    let dir = folder();
    let at = dir.path();
    for (arguments, words) in [
        (&["fit", "a.csv", "--method", "netwrok", "-o", "m.json"][..], "network"),
        (&["compare", "a.csv", "--methods", "dtl"], "did you mean `dlt`"),
        (&["synth", "--rig", "papr", "-o", "x"], "paper"),
        (&["chart", "chesboard", "-o", "x.svg"], "chessboard"),
        (&["compar", "a.csv"], "compare"),
    ] {
        let output = wheatstone(at, arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
    done(at, &["synth", "--points", "-o", "a.csv"]);
    let message =
        refused(at, &["fit", "a.csv", "--method", "network", "--preset", "papr", "-o", "m.json"]);
    assert!(message.contains("did you mean `paper`"), "{message}");
    let message = refused(at, &["synth", "--points", "--noise", "loud", "-o", "b.csv"]);
    assert!(message.contains("noise cannot be loud"), "{message}");
}

#[test]
fn bad_pictures_and_captures_are_refused_by_name() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--near", "90", "--far", "90", "-o", "capture"]);
    let picture = at.join("capture/right/090.png");
    let whole = std::fs::read(&picture).unwrap();
    let mut header = b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR".to_vec();
    header.extend([0, 0, 0xEA, 0x60, 0, 0, 0xEA, 0x60, 8, 0, 0, 0, 0]);
    for bytes in [&whole[..whole.len() / 2], &whole[..20], &[], b"P5 60000 60000 255\n", &header] {
        std::fs::write(&picture, bytes).unwrap();
        let message = refused(at, &["detect", "capture", "-o", "points.csv"]);
        assert!(message.contains("right/090.png"), "{message}");
    }
    std::fs::write(&picture, whole).unwrap();
    let file = at.join("capture/capture.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("pitch = 5.0", "pitch = \"wide\"")).unwrap();
    let message = refused(at, &["detect", "capture", "-o", "points.csv"]);
    assert!(message.contains("capture.toml"), "{message}");
    assert!(!at.join("points.csv").exists());
}

#[test]
fn failures_leave_what_was_there() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--points", "-o", "train.csv"]);
    done(at, &["fit", "train.csv", "--method", "dlt", "--no-validation", "-o", "model.json"]);
    let model = std::fs::read(at.join("model.json")).unwrap();
    std::fs::write(at.join("bad.csv"), "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,x\n").unwrap();
    refused(at, &["fit", "bad.csv", "-o", "model.json"]);
    assert_eq!(std::fs::read(at.join("model.json")).unwrap(), model);
    // The fault comes late: what was located before it must not appear.
    let mut many: String = "x1,y1,x2,y2\n".into();
    many += &"300,200,320,210\n".repeat(20_000);
    many += "300,200,320,left\n";
    std::fs::write(at.join("late.csv"), many).unwrap();
    std::fs::write(at.join("points.csv"), "precious").unwrap();
    let message = refused(at, &["locate", "model.json", "late.csv", "-o", "points.csv"]);
    assert!(message.contains("late.csv:20002: column `y2`"), "{message}");
    assert_eq!(std::fs::read_to_string(at.join("points.csv")).unwrap(), "precious");
    let names: Vec<_> = std::fs::read_dir(at)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(names.len(), 6, "something was left behind: {names:?}");
    let mut three: String = "x1,y1,x2,y2,x3,y3\n".into();
    three += "1,2,3,4,5,6\n";
    std::fs::write(at.join("three.csv"), three).unwrap();
    let message = refused(at, &["locate", "model.json", "three.csv"]);
    assert!(message.contains("number of cameras: the model has 2, the data has 3"), "{message}");
}

#[test]
fn a_report_of_a_model_and_one_of_points() {
    let dir = folder();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "--count", "150", "-o", "train.csv"]);
    done(at, &["fit", "train.csv", "--method", "dlt", "--no-validation", "-o", "model.json"]);
    let numbers = ["--json", "numbers.json", "--figures", "figures"];
    done(at, &[&["report", "model.json", "-o", "model.html"], &numbers[..]].concat());
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    let report = json(&read("numbers.json"));
    assert_eq!((&report["format"], &report["unit"]), (&"wheatstone-report".into(), &"cm".into()));
    assert_eq!(report["judgement"], "held-out");
    assert_eq!(report["points"].as_array().unwrap().len(), 150);
    let page = read("model.html");
    assert!(page.contains(report["verdict"]["sentence"].as_str().unwrap()));
    assert!(page.contains("<code><bdi>wheatstone report model.json -o model.html</bdi></code>"));
    assert!(read("figures/error-by-depth.svg").starts_with("<svg xmlns"));
    // Given points, it compares and fits first; the truth beside them gives the floor.
    let points = ["report", "train.csv", "--methods", "dlt,brown", "-o", "points.html"];
    done(at, &[&points[..], &["--json", "numbers.json"]].concat());
    let report = json(&read("numbers.json"));
    assert_eq!(report["methods"].as_array().unwrap().len(), 2);
    assert!(report["accuracy"]["floor_rms"].as_f64().unwrap() > 0.0);
    assert!(refused(at, &["report", "numbers.json", "-o", "x.html"]).contains("not a model file"));
    let message = refused(at, &["report", "model.json", "-o", "nowhere/report.html"]);
    assert!(message.contains("nowhere"), "{message}");
}
