//! Every command of the tutorials is typed as it stands there, and prints what stands there.

use crate::program::wheatstone;
use std::path::{Path, PathBuf};

/// What is left out of what a command prints: a line or the rest of one.
const LEFT_OUT: &str = "…";

/// Numbers may differ by so much: methods get better, and what a tutorial says stays true.
const TOLERANCE: f64 = 0.1;

/// A command, the line it stands in, and what it prints.
struct Step {
    line: usize,
    words: Vec<String>,
    printed: Vec<String>,
}

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
}

/// The `console` blocks of a page, command by command.
fn steps(page: &str) -> Vec<Step> {
    let (mut steps, mut inside): (Vec<Step>, bool) = (Vec::new(), false);
    for (number, line) in page.lines().enumerate() {
        if line.starts_with("```") {
            inside = line == "```console";
            assert!(line != "```sh", "line {}: `sh` blocks are not run", number + 1);
        } else if let Some(command) = line.strip_prefix("$ ").filter(|_| inside) {
            let words: Vec<String> = command.split_whitespace().map(String::from).collect();
            assert_eq!(words[0], "wheatstone", "line {}", number + 1);
            steps.push(Step { line: number + 1, words, printed: Vec::new() });
        } else if inside {
            steps.last_mut().unwrap().printed.push(line.trim_end().into());
        }
    }
    steps
}

fn number(word: &str) -> Option<f64> {
    word.trim_end_matches([',', ';', '.', '%']).parse().ok()
}

/// Whether a line is what is expected: the same words, and about the same numbers.
fn agrees(expected: &str, line: &str) -> bool {
    let (expected, mut words) = (expected.split_whitespace(), line.split_whitespace());
    for wanted in expected {
        if wanted == LEFT_OUT {
            return true;
        }
        let Some(word) = words.next() else { return false };
        let same = match (number(wanted), number(word)) {
            (Some(a), Some(b)) => (a - b).abs() <= TOLERANCE * a.abs().max(b.abs()),
            _ => wanted == word || (is_rule(wanted) && is_rule(word)),
        };
        if !same {
            return false;
        }
    }
    words.next().is_none()
}

/// Whether a word is the line below a column's heading, whose length hangs on the numbers.
fn is_rule(word: &str) -> bool {
    word.chars().all(|letter| letter == '-')
}

fn run(name: &str) {
    let page = std::fs::read_to_string(docs().join("tutorial").join(name)).unwrap();
    let steps = steps(&page);
    assert!(steps.len() >= 5, "{name} has {} commands", steps.len());
    let folder = tempfile::tempdir().unwrap();
    for step in steps {
        let place = format!("{name}:{}: {}", step.line, step.words.join(" "));
        let words: Vec<&str> = step.words[1..].iter().map(String::as_str).collect();
        let output = wheatstone(folder.path(), &words);
        let all = [output.stderr, output.stdout].concat();
        let all = String::from_utf8(all).unwrap();
        assert!(output.status.success(), "{place}\n{all}");
        let mut lines = all.lines();
        for expected in step.printed.iter().filter(|line| *line != LEFT_OUT && !line.is_empty()) {
            let found = lines.any(|line| agrees(expected, line));
            assert!(found, "{place}\nprints no line like\n{expected}\nbut\n{all}");
        }
    }
    for picture in page.split("](../pictures/").skip(1) {
        let file = picture.split(')').next().unwrap();
        assert!(docs().join("pictures").join(file).is_file(), "{name}: no picture {file}");
    }
}

#[test]
fn a_grid_on_a_stage() {
    run("stage.md");
}

#[test]
fn cameras_looking_into_a_tank() {
    run("tank.md");
}

#[test]
fn lines_agree_up_to_the_last_digits_of_numbers() {
    assert!(agrees("dlt  0.535  ---  rest …", "  dlt  0.531 ----- rest 5 6"));
    assert!(!agrees("dlt 0.535", "dlt 0.735"));
    assert!(!agrees("dlt 0.535", "tsai 0.535"));
    assert!(!agrees("dlt", "dlt 5"));
}

#[test]
fn a_board_in_the_hand() {
    run("hand-held.md");
}
