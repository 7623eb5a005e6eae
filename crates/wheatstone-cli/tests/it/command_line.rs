//! The command line as it is printed: help of every verb, completions, manual pages. A change of any
//! of them shows as a change of a file in `snapshots/`.

use crate::program::command;
use std::path::Path;

fn wheatstone(arguments: &[&str]) -> String {
    let mut command = command(Path::new("."), arguments);
    let output = command.env("COLUMNS", "100").env("NO_COLOR", "1").output().unwrap();
    assert!(output.status.success(), "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Every verb, as the program's own help lists them.
fn verbs() -> Vec<String> {
    let help = wheatstone(&["--help"]);
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names.map(|line| line.split_whitespace().next().unwrap().to_owned()).collect()
}

#[test]
fn help_of_every_verb() {
    insta::assert_snapshot!("help", wheatstone(&["--help"]));
    for verb in verbs().iter().filter(|verb| *verb != "help") {
        let help = wheatstone(&[verb, "--help"]);
        assert!(help.contains("\nExample"), "`{verb} --help` shows no example");
        insta::assert_snapshot!(format!("help-{verb}"), help);
    }
}

#[test]
fn completions_of_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = wheatstone(&["completions", shell]);
        for verb in verbs() {
            assert!(script.contains(&verb), "{shell} does not know `{verb}`");
        }
        insta::assert_snapshot!(format!("completions-{shell}"), script);
    }
}

#[test]
fn a_manual_page_for_every_verb() {
    let folder = tempfile::tempdir().unwrap();
    wheatstone(&["--quiet", "man", folder.path().to_str().unwrap()]);
    let verbs = verbs();
    let pages =
        verbs.iter().filter(|verb| *verb != "help").map(|verb| format!("wheatstone-{verb}"));
    for name in pages.chain(["wheatstone".into()]) {
        let page = std::fs::read_to_string(folder.path().join(format!("{name}.1"))).unwrap();
        insta::assert_snapshot!(format!("man-{name}"), page);
    }
}
