//! How the program behaves beside its work: quiet, colours, typing slips, beginnings.

use crate::program::{done, refused, said, wheatstone};

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

#[test]
fn charts_of_every_kind_are_begun_printed_and_synthesised() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for kind in
        ["line-grid", "chessboard", "dot-grid", "charuco", "april-grid", "point-list", "two-level"]
    {
        done(at, &["new", kind, "--chart", kind]);
        let early = refused(at, &["detect", kind]);
        assert!(early.contains("no file matches `left/*.*`"), "{kind}: {early}");
        let table = format!("{kind}.csv");
        done(at, &["synth", "--points", "--chart", kind, "--noise", "0.1", "-o", &table]);
        let drawing = format!("{kind}.svg");
        done(at, &["chart", kind, "--pitch", "20", "-o", &drawing]);
    }
    let begun =
        |folder: &str| std::fs::read_to_string(at.join(folder).join("capture.toml")).unwrap();
    assert!(begun("april-grid").contains("\ntag = 25.0\n"), "{}", begun("april-grid"));
    assert!(begun("point-list").contains("[100.0,0.0,0.0],[125.0,0.0,0.0]"));
    let small = ["--columns", "6", "--rows", "5", "--pitch", "4", "--spacing", "0.2"];
    done(at, &[&["new", "small", "--chart", "april-grid"], &small[..]].concat());
    let text = begun("small");
    assert!(text.contains("columns = 6\nrows = 5\ntag = 4.0\n"), "{text}");
    assert!(text.contains("spacing = 0.2\n"), "{text}");
    let (_, told) =
        done(at, &["chart", "two-level", "--columns", "6", "--rows", "5", "-o", "p.pdf"]);
    assert!(told.contains("6 columns x 5 rows of dots and 5 x 4"), "{told}");
}

#[test]
fn an_option_of_another_kind_of_chart_is_refused_with_those_that_there_are() {
    let dir = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (
            &["chessboard", "--tag", "20"][..],
            &["`--tag` is no option", "`--columns`, `--rows`, `--pitch`"][..],
        ),
        (
            &["point-list", "--columns", "4"],
            &["`--columns` is no option of `point-list`", "`--diameter`"],
        ),
        (&["april-grid", "--tag", "20", "--pitch", "20"], &["`--tag` and `--pitch`", "leave one"]),
    ] {
        let told = refused(dir.path(), &[&["chart"], arguments, &["-o", "c.pdf"]].concat());
        assert!(words.iter().all(|word| told.contains(word)), "{words:?}: {told}");
    }
}
