//! How the program behaves beside its work: quiet, colours, typing slips, beginnings.

use crate::program::{said, wheatstone};

#[test]
fn quiet_says_nothing_and_colours_come_only_when_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    assert!(
        wheatstone(at, &["synth", "--points", "--count", "60", "-o", "t.csv"]).status.success()
    );
    let fit = ["fit", "t.csv", "--method", "dlt", "-o", "m.json"];
    let quiet: Vec<&str> = fit.into_iter().chain(["--quiet"]).collect();
    assert!(wheatstone(at, &quiet).stderr.is_empty());
    assert!(!wheatstone(at, &fit).stderr.is_empty());
    let missing = ["fit", "none.csv", "-o", "m.json"];
    assert!(said(&wheatstone(at, &missing)).starts_with("error: cannot read"));
    let coloured = said(&wheatstone(at, &["fit", "none.csv", "-o", "m.json", "--color", "always"]));
    assert!(coloured.starts_with("\u{1b}["), "{coloured}");
}

#[test]
fn typing_slips_are_understood() {
    let dir = tempfile::tempdir().unwrap();
    for (typed, meant) in [("fti", "fit"), ("locat", "locate"), ("compair", "compare")] {
        let output = wheatstone(dir.path(), &[typed]);
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).contains(&format!("'{meant}'")), "{typed}: {}", said(&output));
    }
}

#[test]
fn a_new_capture_is_ready_to_be_filled_in() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let new =
        ["new", "tank", "--cameras", "top,side,front", "--unit", "cm", "--chart", "line-grid"];
    assert!(wheatstone(at, &new).status.success());
    for name in ["capture.toml", "chart.pdf", "top", "side", "front"] {
        assert!(at.join("tank").join(name).exists(), "{name}");
    }
    // Whole but for its pictures: that is what is missed, and nothing else.
    let early = said(&wheatstone(at, &["fit", "tank", "-o", "m.json"]));
    assert!(early.contains("no file matches `top/*.*`"), "{early}");
    let again = wheatstone(at, &new);
    assert_eq!(again.status.code(), Some(2));
    assert!(said(&again).contains("exists already"));
    assert_eq!(wheatstone(at, &["new", "x", "--cameras", "left"]).status.code(), Some(2));
    assert_eq!(wheatstone(at, &["new", "x", "--cameras", "a b,c"]).status.code(), Some(2));
}
