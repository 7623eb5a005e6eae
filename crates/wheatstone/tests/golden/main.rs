//! Results that every machine must reproduce to the last bit, whatever its registers and however many threads
//! it has. Each case is a file of figures in `files/`. `GOLDEN=bless cargo test -p wheatstone --test golden`
//! writes the files anew; a change of them is a change of what the program computes, and the changelog says so.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

mod cases;
mod figures;

use figures::Figures;
use rayon::ThreadPoolBuilder;
use std::{path::PathBuf, process::Command};
use wheatstone::numeric::simd::REGISTERS;

/// A test each file, named as the file.
macro_rules! files {
    ($($name:ident = $case:expr;)*) => {
        const NAMES: &[&str] = &[$(stringify!($name)),*];

        mod files {
            use super::{cases, hold};

            $(#[test]
            fn $name() {
                hold(stringify!($name), $case);
            })*
        }
    };
}

files! {
    data = cases::data;
    dlt = |figures| cases::method(figures, "dlt");
    tsai = |figures| cases::method(figures, "tsai");
    brown = |figures| cases::method(figures, "brown");
    kannala_brandt = |figures| cases::method(figures, "kannala-brandt");
    soloff = |figures| cases::method(figures, "soloff");
    interpolation = |figures| cases::method(figures, "interpolation");
    network = |figures| cases::method(figures, "network");
    neural_camera = |figures| cases::method(figures, "neural-camera");
    auto = |figures| cases::method(figures, "auto");
    many = cases::many;
    model = cases::model;
    stage = cases::stage_errors;
    hand_held = cases::hand_held;
    detection = cases::detection;
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden/files")
}

/// A case computed by so many threads.
fn computed(case: fn(&mut Figures), threads: usize) -> Figures {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut figures = Figures::default();
        case(&mut figures);
        figures
    })
}

/// Holds a case to its file: with 1, 2 and 5 threads, or with 2 in narrow registers.
fn hold(name: &str, case: fn(&mut Figures)) {
    let path = folder().join(format!("{name}.txt"));
    if std::env::var("GOLDEN").is_ok_and(|said| said == "bless") {
        std::fs::write(&path, computed(case, 1).text()).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    let threads: &[usize] = if std::env::var_os(REGISTERS).is_some() { &[2] } else { &[1, 2, 5] };
    for count in threads {
        let found = computed(case, *count);
        let wrong: Vec<String> = found.differences(&stored).collect();
        assert!(
            wrong.is_empty(),
            "golden/files/{name}.txt, {count} threads:\n{}\nwhere that is meant: \
             GOLDEN=bless cargo test -p wheatstone --test golden",
            wrong.join("\n")
        );
    }
}

/// All files again, in a process whose registers are kept narrow.
#[test]
fn results_are_those_of_the_files_in_narrow_registers() {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.arg("files::").env(REGISTERS, "128").env_remove("GOLDEN");
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let all = format!("{} passed", NAMES.len());
    assert!(output.status.success() && said.contains(&all), "in 128 bits: {said}");
}

/// A file without its case would hold nothing.
#[test]
fn every_file_has_its_case() {
    let mut found: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    let mut known = NAMES.to_vec();
    found.sort_unstable();
    known.sort_unstable();
    assert_eq!(found, known);
}
