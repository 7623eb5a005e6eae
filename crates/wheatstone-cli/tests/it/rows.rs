//! Tables that pass through `locate`: whatever their length, their cuts and their spelling, rows keep their
//! order and their text.

use crate::program::{command, done, refused};
use std::{
    fmt::Write as _,
    io::{BufRead, BufReader, Write as _},
    path::Path,
    process::Stdio,
};

/// A folder with a model, and pixels that it locates.
fn fitted() -> (tempfile::TempDir, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["synth", "--points", "--noise", "0.1", "-o", "train.csv"]);
    done(at, &["fit", "train.csv", "--method", "dlt", "--no-validation", "-o", "model.json"]);
    let train = std::fs::read_to_string(at.join("train.csv")).unwrap();
    let pixels = |line: &str| line.split(',').take(4).collect::<Vec<_>>().join(",");
    let rows = train.lines().skip(1).map(pixels).collect();
    (folder, rows)
}

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap()
}

/// Whether lines are the same but for what many points at once may change: a hundredth of error bars.
fn agree(own: &str, expected: &str) -> bool {
    let number = |cell: &str| cell.parse::<f64>().ok();
    let close = |(a, b): (&str, &str)| match (number(a), number(b)) {
        (Some(a), Some(b)) => (a - b).abs() <= 0.01 * b.abs() + 1e-3,
        _ => a == b,
    };
    own == expected
        || own.matches(',').count() == expected.matches(',').count()
            && own.split(',').zip(expected.split(',')).all(close)
}

#[test]
fn long_tables_keep_text_and_order_whatever_their_line_ends_and_quotes() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    let short: String = pixels.iter().map(|row| format!("{row}\n")).collect();
    std::fs::write(at.join("short.csv"), format!("x1,y1,x2,y2\n{short}")).unwrap();
    let (short, _) = done(at, &["locate", "model.json", "short.csv"]);
    let places: Vec<&str> =
        short.lines().skip(1).map(|line| line.splitn(5, ',').nth(4).unwrap()).collect();
    // Several blocks, which their ends cut wherever; notes with all that quotes are for.
    let notes =
        ["plain", "\"with, comma\"", "\"over\ntwo lines\"", "\"she said \"\"no\"\"\"", "", "né"];
    for (end, notes) in
        [("\n", &notes[..]), ("\r\n", &notes[..]), ("\r\n", &notes[..1]), ("\r", &notes[..1])]
    {
        let mut text = format!("\u{feff}id,x1,y1,x2,y2,note{end}");
        let mut expected =
            String::from("id,x1,y1,x2,y2,note,X,Y,Z,sX,sY,sZ,residual,trust,mismatch\n");
        for row in 0..40_000 {
            let (which, note) = (row % pixels.len(), notes[row % notes.len()]);
            let _ = write!(text, "{row},{},{note}{end}", pixels[which]);
            let _ = writeln!(expected, "{row},{},{note},{}", pixels[which], places[which]);
        }
        assert!(text.len() > 2 << 20);
        std::fs::write(at.join("long.csv"), text).unwrap();
        done(at, &["locate", "model.json", "long.csv", "-o", "located.csv"]);
        let located = String::from_utf8(read(at, "located.csv")).unwrap();
        let differs = located.lines().zip(expected.lines()).position(|(a, b)| !agree(a, b));
        assert_eq!(differs, None, "{end:?}");
        assert_eq!(located.lines().count(), expected.lines().count(), "{end:?}");
    }
}

#[test]
fn the_same_bytes_come_of_any_number_of_threads() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    let mut text = String::from("x1\ty1\tx2\ty2\tid\tview\n");
    for row in 0..50_000 {
        let cells = pixels[row * 7 % pixels.len()].replace(',', "\t");
        let _ = match row % 11 {
            3 => writeln!(text, "\t\t1\t2\t\tb"),
            _ => writeln!(text, "{cells}\tpoint {row}\t{}", row / 1000),
        };
    }
    std::fs::write(at.join("in.csv"), text).unwrap();
    done(at, &["locate", "model.json", "in.csv", "-o", "in.parquet"]);
    let run = |threads: &str, input: &str, output: &str| {
        let mut command =
            command(at, &["locate", "model.json", input, "-o", output, "--covariance"]);
        assert!(command.env("RAYON_NUM_THREADS", threads).status().unwrap().success());
        read(at, output)
    };
    for (input, output) in [
        ("in.csv", "out.csv"),
        ("in.csv", "out.parquet"),
        ("in.parquet", "out.parquet"),
        ("in.parquet", "out.csv"),
    ] {
        let one = run("1", input, output);
        assert!(
            run("2", input, output) == one && run("4", input, output) == one,
            "{input} to {output}"
        );
    }
}

#[test]
fn text_and_parquet_of_the_same_rows_say_the_same() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    let mut text = String::from("x1,y1,x2,y2,id\n");
    for row in 0..140_000 {
        let _ = match row % 1000 {
            7 => writeln!(text, ",,1,2,"),
            8 => writeln!(text, ",,,,\"a,b\""),
            _ => writeln!(text, "{},p{}", pixels[row % pixels.len()], row % 50),
        };
    }
    std::fs::write(at.join("in.csv"), text).unwrap();
    done(at, &["locate", "model.json", "in.csv", "-o", "located.csv"]);
    done(at, &["locate", "model.json", "in.csv", "-o", "located.parquet"]);
    // Once more, so that the columns of the first time go along.
    done(at, &["locate", "model.json", "located.csv", "-o", "text.csv"]);
    done(at, &["locate", "model.json", "located.parquet", "-o", "parquet.csv"]);
    // The columns of the first time were rounded in text; the pixels and what is located of them are the same.
    let [text, parquet] =
        ["text.csv", "parquet.csv"].map(|name| String::from_utf8(read(at, name)).unwrap());
    assert_eq!(text.lines().count(), parquet.lines().count());
    for (text, parquet) in text.lines().zip(parquet.lines()) {
        assert!(text.split(',').take(4).eq(parquet.split(',').take(4)), "{text} {parquet}");
        assert!(text.rsplit(',').take(9).eq(parquet.rsplit(',').take(9)), "{text} {parquet}");
    }
    let located = String::from_utf8(read(at, "located.csv")).unwrap();
    assert!(located.lines().nth(8).unwrap().ends_with(",,1,2,,,,,,,,,,"));
    assert!(located.lines().nth(9).unwrap().ends_with(",,,,\"a,b\",,,,,,,,,"));
    assert_eq!(located.lines().count(), 140_001);
}

#[test]
fn faults_far_down_are_named_by_their_line_and_row() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    let good = |rows: usize| -> String { format!("{},\"a\nb\"\r\n", pixels[0]).repeat(rows) };
    let bad = [
        ("1,2,3,x,c", "column `y2` is `x`, which is not a number"),
        ("1,2,3,,c", "column `y2` is empty, but its partner is not"),
        ("1,2,inf,4,c", "column `x2` is `inf`, which is out of range"),
        ("1,2,3,4", "4 cells, the header has 5"),
        ("1,2,3,4,5,6", "6 cells, the header has 5"),
    ];
    for (row, words) in bad {
        let rows = 30_000;
        let text = format!("x1,y1,x2,y2,note\n\n{}{row}\n{}9,9,z,9,c\n", good(rows), good(20));
        std::fs::write(at.join("bad.csv"), text).unwrap();
        let message = refused(at, &["locate", "model.json", "bad.csv", "-o", "none.csv"]);
        let line = 3 + 2 * rows;
        assert!(message.contains(&format!("bad.csv:{line}: {words}")), "{line} {message}");
    }
    let mut bytes = format!("x1,y1,x2,y2,note\n{}", good(30_000)).into_bytes();
    bytes.extend(b"1,2,3,4,\xFF\n");
    std::fs::write(at.join("bad.csv"), bytes).unwrap();
    let message = refused(at, &["locate", "model.json", "bad.csv", "-o", "none.csv"]);
    assert!(message.contains("bad.csv:60002: not text (UTF-8)"), "{message}");
    // Nor anything else that was begun.
    let names = std::fs::read_dir(at).unwrap().map(|entry| entry.unwrap().file_name());
    let names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    assert!(names.iter().all(|name| !name.contains("none.csv")), "{names:?}");
    // Numbers of rows that are text in Parquet: one of them is none.
    let many = format!("note,x1,y1,x2,y2\n{}", format!("a,{}\n", pixels[0]).repeat(100_000));
    std::fs::write(at.join("in.csv"), many.replace("x1,y1", "x9,y9")).unwrap();
    let message = refused(at, &["locate", "model.json", "in.csv"]);
    assert!(message.contains("`x1`"), "{message}");
}

#[test]
fn what_a_slow_producer_gives_goes_on_before_it_ends() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    let mut child = command(at, &["locate", "model.json", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut producer = child.stdin.take().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    producer.write_all(b"x1,y1,x2,y2\n").unwrap();
    assert!(lines.next().unwrap().unwrap().starts_with("x1,y1,x2,y2,X,Y,Z"));
    for row in &pixels[..20] {
        let (first, second) = row.split_at(5);
        producer.write_all(first.as_bytes()).unwrap();
        producer.flush().unwrap();
        producer.write_all(format!("{second}\n").as_bytes()).unwrap();
        producer.flush().unwrap();
        // It would wait here for ever, were rows held back until more come.
        assert!(lines.next().unwrap().unwrap().starts_with(row));
    }
    producer.write_all(pixels[20].as_bytes()).unwrap();
    drop(producer);
    assert!(lines.next().unwrap().unwrap().starts_with(&pixels[20]));
    assert!(lines.next().is_none() && child.wait().unwrap().success());
}

#[test]
fn tables_of_other_names_and_units_go_through() {
    let (folder, _) = fitted();
    let at = folder.path();
    let unit = std::fs::read_to_string(at.join("train.csv")).unwrap();
    let rows: Vec<&str> = unit.lines().skip(1).collect();
    let table = |name: &str, header: &str, scale: f64| {
        let mut text = format!("{header}\n");
        for row in &rows {
            let cells: Vec<&str> = row.split(',').collect();
            let lengths = cells[4..7].iter().map(|v| v.parse::<f64>().unwrap() * scale);
            let lengths: Vec<String> = lengths.map(|v| v.to_string()).collect();
            let _ = writeln!(text, "{},{}", cells[..4].join(","), lengths.join(","));
        }
        std::fs::write(at.join(name), text).unwrap();
    };
    // The model is in centimetres. What says that it is in metres is converted; what does not is refused by name.
    table("said.csv", "u1,v1,u2,v2,X_m,Y_m,Z_m", 0.01);
    table("silent.csv", "a,b,c,d,X,Y,Z", 0.01);
    table("own.csv", "x1,y1,x2,y2,X,Y,Z", 1.0);
    let names = "--columns=x1=a,y1=b,x2=c,y2=d";
    let rms = |arguments: &[&str]| {
        let (told, _) = done(at, arguments);
        serde_json::from_str::<serde_json::Value>(&told).unwrap()["rms"].as_f64().unwrap()
    };
    let wanted = rms(&["evaluate", "model.json", "own.csv", "--json"]);
    let near = |rms: f64| (rms / wanted - 1.0).abs() < 1e-6;
    assert!(near(rms(&["evaluate", "model.json", "said.csv", "--json"])));
    assert!(near(rms(&["evaluate", "model.json", "silent.csv", names, "--unit", "m", "--json"])));
    let message = refused(at, &["evaluate", "model.json", "silent.csv", names]);
    assert!(message.contains("these lengths look like m, but were read as cm"), "{message}");
    assert!(message.contains("say that the points are in m (`--unit`)"), "{message}");
    // Brought together by a rigid motion they are in the model's unit before.
    let aligned = ["evaluate", "model.json", "silent.csv", names, "--align"];
    let message = refused(at, &aligned);
    assert!(message.contains("these lengths look like m, but were read as cm"), "{message}");
    let best = rms(&["evaluate", "model.json", "own.csv", "--align", "--json"]);
    for unit in ["m", "metres"] {
        let found = rms(&[&aligned[..], &["--unit", unit, "--json"]].concat());
        assert!((found / best - 1.0).abs() < 1e-6, "{unit}: {found} against {best}");
    }
    let message = refused(at, &["fit", "own.csv", "--size", "64x48", "-o", "other.json"]);
    assert!(message.contains("lie outside of 64x48 pictures"), "{message}");
    let sizes = ["fit", "own.csv", "--size", "640x480,640x480,64x48", "-o", "other.json"];
    let message = refused(at, &sizes);
    assert!(message.contains("`--size` gives 3 sizes, and there are 2 cameras"), "{message}");
    let message = refused(at, &["fit", "silent.csv", "-o", "other.json"]);
    assert!(
        message.contains("no column `x1`, `y1`, `x2`, `y2`; found: a, b, c, d, X"),
        "{message}"
    );
    assert!(message.contains("--columns"), "{message}");
}

#[test]
fn decimal_commas_go_through() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    // Commas cannot be both.
    let text = pixels[..50].join("\n").replace('.', ",");
    std::fs::write(at.join("cut.csv"), format!("x1,y1,x2,y2\n{text}\n")).unwrap();
    let message = refused(at, &["locate", "model.json", "cut.csv", "-o", "cut-located.csv"]);
    assert!(message.contains("cut.csv:2: 8 cells, the header has 4"), "{message}");
    assert!(message.contains("decimal commas, separate the columns by semicolons"), "{message}");
    // German spreadsheets: what is added is written as the rest is.
    let text = pixels[..50].join("\n").replace(',', ";").replace('.', ",");
    std::fs::write(at.join("in.csv"), format!("# unit: cm\nx1;y1;x2;y2\n{text}\n")).unwrap();
    done(at, &["locate", "model.json", "in.csv", "-o", "out.csv"]);
    done(at, &["locate", "model.json", "in.csv", "-o", "out.arrow"]);
    let out = std::fs::read_to_string(at.join("out.csv")).unwrap();
    assert!(out.starts_with("# unit: cm\nx1;y1;x2;y2;X;Y;Z;"), "{out}");
    assert!(!out.contains('.'), "{out}");
    done(at, &["convert", "out.csv", "a.csv"]);
    done(at, &["convert", "out.arrow", "b.csv"]);
    // Text holds places to what their standard deviations mean, Arrow all bits.
    let [a, b] = ["a.csv", "b.csv"].map(|name| String::from_utf8(read(at, name)).unwrap());
    assert_eq!(a.lines().count(), b.lines().count());
    for (a, b) in a.lines().skip(1).zip(b.lines().skip(1)) {
        let number = |cell: &str| cell.parse::<f64>().unwrap();
        for (a, b) in a.split(',').zip(b.split(',')) {
            assert!(a == b || (number(a) - number(b)).abs() < 1e-3, "{a} {b}");
        }
    }
}

#[test]
fn both_decimal_marks_in_one_table_are_refused() {
    let (folder, pixels) = fitted();
    let at = folder.path();
    let mut rows: Vec<String> =
        pixels[..20].iter().map(|row| row.replace(',', ";").replace('.', ",")).collect();
    rows.push(pixels[20].replace(',', ";"));
    std::fs::write(at.join("in.csv"), format!("x1;y1;x2;y2\n{}\n", rows.join("\n"))).unwrap();
    let message = refused(at, &["locate", "model.json", "in.csv", "-o", "out.csv"]);
    assert!(message.contains("in.csv:22: ") && message.contains("decimal comma"), "{message}");
    assert!(message.contains("one decimal mark") && !at.join("out.csv").exists(), "{message}");
}

#[test]
fn an_array_is_located_like_its_table() {
    let (folder, _) = fitted();
    let at = folder.path();
    done(at, &["convert", "train.csv", "train.npy"]);
    done(at, &["locate", "model.json", "train.npy", "-o", "located.csv"]);
    let located = String::from_utf8(read(at, "located.csv")).unwrap();
    let train = String::from_utf8(read(at, "train.csv")).unwrap();
    assert!(located.starts_with("x1,y1,x2,y2,input_X,input_Y,input_Z,X,Y,Z,"), "{located}");
    let rows = |text: &str| text.lines().filter(|line| !line.starts_with('#')).count();
    assert_eq!(rows(&located), rows(&train));
}

#[test]
fn a_unit_that_some_names_lack_is_noted() {
    let (folder, _) = fitted();
    let at = folder.path();
    let train = String::from_utf8(read(at, "train.csv")).unwrap();
    let rows: Vec<&str> =
        train.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).collect();
    let cells = |row: &&str| row.split(',').take(7).collect::<Vec<_>>().join(",");
    let rows: Vec<String> = rows.iter().map(cells).collect();
    let text = format!("x1,y1,x2,y2,X,Y,Z [cm]\n{}\n", rows.join("\n"));
    std::fs::write(at.join("named.csv"), text).unwrap();
    let (_, said) = done(at, &["evaluate", "model.json", "named.csv"]);
    assert!(said.contains("`X`, `Y` are taken to be in cm, as `Z [cm]` says"), "{said}");
}
