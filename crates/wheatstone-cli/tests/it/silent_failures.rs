//! Nothing is silently wrong: every bad table is refused, warned of, or fitted nearly as well as the
//! clean one. Each table is a clean one with one fault; the truth is known, so that a wrong model
//! cannot pass for a right one.

use crate::program::wheatstone;
use std::path::Path;

/// One row: view, id, pixels of two cameras, place.
#[derive(Clone)]
struct Row {
    view: String,
    id: usize,
    pixels: [[f64; 2]; 2],
    world: [f64; 3],
}

fn read(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x1,y1,x2,y2,X,Y,Z,view,id"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let n = |index: usize| cells[index].parse::<f64>().unwrap();
        Row {
            view: cells[7].into(),
            id: cells[8].parse().unwrap(),
            pixels: [[n(0), n(1)], [n(2), n(3)]],
            world: [n(4), n(5), n(6)],
        }
    };
    lines.map(row).collect()
}

fn write(path: &Path, rows: &[Row]) {
    let mut text = String::from("view,id,x1,y1,x2,y2,X,Y,Z\n");
    for Row { view, id, pixels: [[a, b], [c, d]], world: [x, y, z] } in rows {
        text += &format!("{view},{id},{a},{b},{c},{d},{x},{y},{z}\n");
    }
    std::fs::write(path, text).unwrap();
}

/// A number in 0..1 that depends on the row: no two runs differ.
fn chance(seed: usize) -> f64 {
    let mixed = (seed as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

/// The `n`-th view's name.
fn view(rows: &[Row], n: usize) -> String {
    let mut names: Vec<String> = rows.iter().map(|row| row.view.clone()).collect();
    names.dedup();
    names[n].clone()
}

/// Rows of one view take the pixels of camera 2 from the row that `partner` names by its id.
fn relabel(rows: &mut [Row], only: Option<&str>, partner: impl Fn(usize) -> usize) {
    let before = rows.to_vec();
    for row in rows.iter_mut().filter(|row| only.is_none_or(|view| row.view == view)) {
        let other = partner(row.id);
        match before.iter().find(|o| o.view == row.view && o.id == other) {
            Some(other) => row.pixels[1] = other.pixels[1],
            None => row.id = usize::MAX,
        }
    }
}

/// Moves a share of camera 2's pixels by up to `reach` along each axis.
fn gross_errors(rows: &mut [Row], share: f64, reach: f64) {
    for (index, row) in rows.iter_mut().enumerate() {
        if chance(3 * index) < share {
            row.pixels[1][0] += reach * (2.0 * chance(3 * index + 1) - 1.0);
            row.pixels[1][1] += reach * (2.0 * chance(3 * index + 2) - 1.0);
        }
    }
}

type Fault = (&'static str, fn(&mut Vec<Row>));

/// Columns and rows of the rendered chart.
const COLUMNS: usize = 9;
const POINTS: usize = 9 * 7;

const FAULTS: &[Fault] = &[
    ("not a number", |rows| rows[7].pixels[0][0] = f64::NAN),
    ("infinite", |rows| rows[7].pixels[1][1] = f64::INFINITY),
    ("beyond all pictures", |rows| rows[7].world[2] = 1e12),
    ("one pixel 400 px off", |rows| rows[30].pixels[1][0] += 400.0),
    ("10 % of pixels up to 20 px off", |rows| gross_errors(rows, 0.1, 20.0)),
    ("30 % of pixels up to 20 px off", |rows| gross_errors(rows, 0.3, 20.0)),
    ("30 % of pixels up to 200 px off", |rows| gross_errors(rows, 0.3, 200.0)),
    ("every row twice", |rows| rows.extend(rows.clone())),
    ("one view ten times, under other names", |rows| {
        let name = view(rows, 3);
        let only: Vec<Row> = rows.iter().filter(|row| row.view == name).cloned().collect();
        *rows = Vec::new();
        for copy in 0..10 {
            rows.extend(only.iter().map(|row| Row { view: copy.to_string(), ..row.clone() }));
        }
    }),
    ("one view", |rows| {
        let name = view(rows, 0);
        rows.retain(|row| row.view == name);
    }),
    ("three points", |rows| rows.truncate(3)),
    ("no points", Vec::clear),
    ("points on a line", |rows| {
        for row in rows.iter_mut() {
            row.world = [row.world[2], row.world[2], row.world[2]];
        }
    }),
    ("all zero", |rows| {
        for row in rows.iter_mut() {
            row.pixels = [[0.0; 2]; 2];
            row.world = [0.0; 3];
        }
    }),
    ("cameras exchanged in one view", |rows| {
        let name = view(rows, 2);
        rows.iter_mut().filter(|row| row.view == name).for_each(|row| row.pixels.swap(0, 1));
    }),
    ("board reversed in one view of camera 2", |rows| {
        let name = view(rows, 4);
        relabel(rows, Some(&name), |id| POINTS - 1 - id);
        rows.retain(|row| row.id != usize::MAX);
    }),
    ("board reversed in all views of camera 2", |rows| {
        relabel(rows, None, |id| POINTS - 1 - id);
        rows.retain(|row| row.id != usize::MAX);
    }),
    ("rows and columns exchanged in camera 2", |rows| {
        relabel(rows, None, |id| (id % COLUMNS) * (POINTS / COLUMNS) + id / COLUMNS);
        rows.retain(|row| row.id != usize::MAX);
    }),
    ("pairs shifted by one point", |rows| {
        let before = rows.clone();
        let count = rows.len();
        for (index, row) in rows.iter_mut().enumerate() {
            row.pixels[1] = before[(index + 1) % count].pixels[1];
        }
    }),
    ("camera 2 a view late", |rows| {
        let before = rows.clone();
        let names: Vec<String> = (0..7).map(|n| view(&before, n)).collect();
        for row in rows.iter_mut() {
            let own = names.iter().position(|name| *name == row.view).unwrap();
            let next = &names[(own + 1).min(6)];
            match before.iter().find(|o| o.view == *next && o.id == row.id) {
                Some(other) => row.pixels[1] = other.pixels[1],
                None => row.id = usize::MAX,
            }
        }
        rows.retain(|row| row.id != usize::MAX);
    }),
    ("pictures of camera 2 at half size in half of the views", |rows| {
        let from: Vec<String> = (3..7).map(|n| view(rows, n)).collect();
        for row in rows.iter_mut().filter(|row| from.contains(&row.view)) {
            row.pixels[1] = row.pixels[1].map(|value| value / 2.0);
        }
    }),
    ("one view in millimetres", |rows| {
        let name = view(rows, 5);
        for row in rows.iter_mut().filter(|row| row.view == name) {
            row.world = row.world.map(|value| value * 10.0);
        }
    }),
    ("wrong pitch in one view", |rows| {
        let name = view(rows, 5);
        for row in rows.iter_mut().filter(|row| row.view == name) {
            row.world = [row.world[0] * 1.1, row.world[1] * 1.1, row.world[2]];
        }
    }),
    ("camera 2 knocked half-way", |rows| {
        let from: Vec<String> = (4..7).map(|n| view(rows, n)).collect();
        for row in rows.iter_mut().filter(|row| from.contains(&row.view)) {
            row.pixels[1] = [row.pixels[1][0] + 12.0, row.pixels[1][1] - 5.0];
        }
    }),
    ("places of points permuted", |rows| {
        let before = rows.clone();
        for (index, row) in rows.iter_mut().enumerate() {
            row.world = before[(index * 173) % before.len()].world;
        }
    }),
];

/// What fits to these data come to: the error on clean points over that of the clean fit, or none
/// where the fit was refused; and what was said.
fn outcome(at: &Path, clean: f64) -> (Option<f64>, String) {
    let _ = std::fs::remove_file(at.join("m.json"));
    let fitted =
        wheatstone(at, &["fit", "bad.csv", "--unit", "cm", "--method", "brown", "-o", "m.json"]);
    let said = String::from_utf8(fitted.stderr).unwrap();
    assert!(!said.contains("panicked"), "{said}");
    if !fitted.status.success() {
        assert!(said.contains("error: ") && said.contains("hint: "), "{said}");
        assert!(!at.join("m.json").exists());
        return (None, said);
    }
    (Some(error(at) / clean), said)
}

fn error(at: &Path) -> f64 {
    let judged = wheatstone(at, &["evaluate", "m.json", "exam.csv", "--json"]);
    let scores: serde_json::Value = serde_json::from_slice(&judged.stdout).unwrap();
    scores["rms"].as_f64().unwrap()
}

#[test]
fn no_bad_table_is_silently_wrong() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    assert!(
        wheatstone(at, &["synth", "--points", "--noise", "0.1", "-o", "clean.csv"])
            .status
            .success()
    );
    let exam = ["synth", "--random", "400", "--noise", "0.1", "--seed", "1", "-o", "exam.csv"];
    assert!(wheatstone(at, &exam).status.success());
    let rows = read(&at.join("clean.csv"));
    write(&at.join("bad.csv"), &rows);
    let (own, said) = outcome(at, 1.0);
    let clean = own.unwrap();
    assert!(!said.contains("warning"), "{said}");
    let mut silent = Vec::new();
    for (name, fault) in FAULTS {
        let mut bad = rows.clone();
        fault(&mut bad);
        write(&at.join("bad.csv"), &bad);
        let (ratio, said) = outcome(at, clean);
        let told =
            said.lines().find(|line| line.starts_with("error") || line.starts_with("warning"));
        eprintln!("{name}: {ratio:.2?} {}", told.unwrap_or_default());
        if ratio.is_some_and(|ratio| ratio > 1.5) && told.is_none() {
            silent.push(format!("{name}: {ratio:?}\n{said}"));
        }
    }
    assert!(silent.is_empty(), "silently wrong: {}", silent.join("\n"));
}
