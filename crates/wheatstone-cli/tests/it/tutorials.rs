//! Every command of the documentation is typed as it stands there, and prints what stands there.

use crate::{
    docs::{docs, pages},
    program::wheatstone,
    rendered::rendered,
};
use std::{collections::VecDeque, sync::Mutex};

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

/// The `console` blocks of a page, command by command.
fn steps(page: &str) -> Vec<Step> {
    let (mut steps, mut inside): (Vec<Step>, bool) = (Vec::new(), false);
    for (number, line) in page.lines().enumerate() {
        if line.starts_with("```") {
            inside = line == "```console";
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

/// Whether a command renders.
fn renders(words: &[&str]) -> bool {
    words.first() == Some(&"synth")
        && !words.iter().any(|word| ["--points", "--random"].contains(word))
}

/// Types the commands of a page; what is wrong, if anything.
fn run(name: &str, steps: &[Step]) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    for step in steps {
        let place = format!("{name}:{}: {}", step.line, step.words.join(" "));
        let words: Vec<&str> = step.words[1..].iter().map(String::as_str).collect();
        if step.printed.is_empty() && renders(&words) {
            rendered(folder.path(), &words);
            continue;
        }
        let output = wheatstone(folder.path(), &words);
        let all = [output.stderr, output.stdout].concat();
        let all = String::from_utf8(all).unwrap();
        if !output.status.success() {
            return Err(format!("{place}\n{all}"));
        }
        let mut lines = all.lines();
        for expected in step.printed.iter().filter(|line| *line != LEFT_OUT && !line.is_empty()) {
            if !lines.any(|line| agrees(expected, line)) {
                return Err(format!("{place}\nprints no line like\n{expected}\nbut\n{all}"));
            }
        }
    }
    Ok(())
}

/// All pages at once, as many at a time as there are processors.
#[test]
fn commands_of_all_pages_run() {
    let mut work: Vec<(String, Vec<Step>)> = pages()
        .into_iter()
        .map(|page| (page.clone(), steps(&std::fs::read_to_string(docs().join(&page)).unwrap())))
        .filter(|(_, steps)| !steps.is_empty())
        .collect();
    assert!(work.len() >= 15, "{} pages have commands", work.len());
    // Tutorials take the longest.
    work.sort_by_key(|(page, steps)| (!page.starts_with("tutorial"), usize::MAX - steps.len()));
    let work = Mutex::new(VecDeque::from(work));
    let failed = Mutex::new(Vec::new());
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..processors {
            scope.spawn(|| {
                while let Some((page, steps)) = { work.lock().unwrap().pop_front() } {
                    if let Err(wrong) = run(&page, &steps) {
                        failed.lock().unwrap().push(wrong);
                    }
                }
            });
        }
    });
    let failed = failed.into_inner().unwrap();
    assert!(failed.is_empty(), "{}", failed.join("\n\n"));
}

#[test]
fn lines_agree_up_to_the_last_digits_of_numbers() {
    assert!(agrees("dlt  0.535  ---  rest …", "  dlt  0.531 ----- rest 5 6"));
    assert!(!agrees("dlt 0.535", "dlt 0.735"));
    assert!(!agrees("dlt 0.535", "tsai 0.535"));
    assert!(!agrees("dlt", "dlt 5"));
}
