//! Commands that end with a report.

use crate::{
    figures::shown,
    program::{done, refused},
};
use std::path::Path;

/// The page, which must hold all of these.
fn page(path: &Path, parts: &[&str]) {
    let page = std::fs::read_to_string(path).unwrap();
    assert!(page.len() < 10_000_000, "{} bytes", page.len());
    for part in parts {
        assert!(page.contains(part), "{} holds no {part}", path.display());
    }
}

#[test]
fn the_demo_ends_with_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (told, said) = done(at, &["demo", "--out", "story", "--epochs", "100", "--json", "--open"]);
    // Nobody sits here: nothing opens, and nothing but the summary is on standard output.
    assert!(said.contains("`--open` does nothing"), "{said}");
    assert!(said.contains("Report              story"), "{said}");
    let mut summary: serde_json::Value = serde_json::from_str(&told).unwrap();
    let scene = summary.as_object_mut().unwrap().remove("scene").unwrap();
    insta::assert_snapshot!("demo-summary", shown(&summary.to_string()));
    assert!(scene["points"].as_u64().unwrap() > 200_000, "{scene}");
    let ratio = |place: &str| scene[place]["ratio_to_floor"].as_f64().unwrap();
    assert!(ratio("inside") < 1.05 && ratio("outside") < 1.5, "{scene}");
    assert!(scene["inside"]["within"][0].as_f64().unwrap() > 0.62, "{scene}");
    assert!(at.join("story/reconstruction/scene.html").is_file());
    let best = summary["methods"].as_array().unwrap().iter();
    let best = best.map(|method| method["exam"]["rms"].as_f64().unwrap()).fold(1e9, f64::min);
    page(
        &at.join("story/report.html"),
        &[
            "times the floor",
            "Methods compared",
            "network of 2001, whole pixels",
            "Where the error comes from",
            "Detections in the pictures",
            "id=\"picture-13\"",
            "wheatstone demo --out story",
        ],
    );
    assert!(
        best < 0.05,
        "a twentieth of a millimetre at a metre, or the pictures are at fault: {best}"
    );
}

#[test]
fn compare_writes_the_page_that_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["synth", "--points", "--count", "120", "--noise", "0.1", "-o", "t.csv"]);
    let compare = ["compare", "t.csv", "--methods", "dlt,brown", "--seed", "1"];
    let (told, _) = done(at, &[&compare[..], &["-o", "page one.html", "--json"]].concat());
    let found: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(found["chosen"], "brown");
    let command = "wheatstone compare t.csv --methods dlt,brown --seed 1 -o 'page one.html'";
    page(&at.join("page one.html"), &["Methods compared", "Error against depth", command]);
    done(at, &[&compare[..], &["--report", "two.html"]].concat());
    // The same input gives the same page but for the command in it.
    let page = |name: &str| {
        let text = std::fs::read_to_string(at.join(name)).unwrap();
        text.replace(" -o 'page one.html'", "").replace(" -o two.html", "")
    };
    assert_eq!(page("page one.html"), page("two.html"));
    // A place that cannot be written to is refused before any work.
    let said = refused(at, &[&compare[..], &["-o", "none/such/page.html"]].concat());
    assert!(!said.contains("Errors in"), "{said}");
    // So is a name of something else.
    for arguments in [&compare[..], &["report", "t.csv"]] {
        let said = refused(at, &[arguments, &["-o", "page.pdf"]].concat());
        assert!(said.contains("not written as .pdf") && said.contains("`.html`"), "{said}");
    }
}
