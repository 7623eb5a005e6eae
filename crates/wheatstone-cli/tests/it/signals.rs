//! Ctrl-C and requests to end: whatever the program is at, it ends within a second and leaves nothing half-written.

use crate::program::{command, done, said, wheatstone};
use std::{
    fs,
    io::Write,
    os::{fd::OwnedFd, unix::net::UnixStream},
    path::Path,
    process::{Command, Output, Stdio},
    thread,
    time::{Duration, Instant},
};

/// Sends a signal to a command after a while. None where it had ended by then.
fn signalled(at: &Path, arguments: &[&str], signal: &str, after: Duration) -> Option<Output> {
    let mut started = command(at, arguments);
    started.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = started.spawn().unwrap();
    thread::sleep(after);
    if child.try_wait().unwrap().is_some() {
        return None;
    }
    let number = child.id().to_string();
    assert!(Command::new("kill").args([signal, &number]).status().unwrap().success());
    let asked = Instant::now();
    let output = child.wait_with_output().unwrap();
    // Half a second is what work is given; a loaded machine is given more.
    assert!(asked.elapsed() < Duration::from_secs(5), "{arguments:?}: {:?}", asked.elapsed());
    assert!(!said(&output).contains("panicked"), "{}", said(&output));
    Some(output)
}

#[test]
fn a_long_fit_is_cancelled_and_the_old_model_stays() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--count", "60", "-o", "t.csv"]);
    fs::write(at.join("model.json"), "the old one").unwrap();
    let fit = ["fit", "t.csv", "--method", "network", "--preset", "paper", "--epochs", "900000000"];
    let arguments: Vec<&str> = fit.into_iter().chain(["-o", "model.json"]).collect();
    for (signal, status) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let output = signalled(at, &arguments, signal, Duration::from_millis(700)).unwrap();
        assert_eq!(output.status.code(), Some(status), "{}", said(&output));
        assert!(said(&output).contains("error: cancelled"), "{}", said(&output));
        assert_eq!(fs::read_to_string(at.join("model.json")).unwrap(), "the old one");
        assert_eq!(fs::read_dir(at).unwrap().count(), 3, "points, their truth, the old model");
    }
}

#[test]
fn whoever_waits_for_a_pipe_ends() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--count", "60", "-o", "t.csv"]);
    done(at, &["fit", "t.csv", "--method", "dlt", "-o", "model.json"]);
    assert!(Command::new("mkfifo").arg(at.join("pipe.csv")).status().unwrap().success());
    for arguments in [
        &["locate", "model.json", "pipe.csv", "-o", "out.csv"][..],
        &["locate", "model.json", "t.csv", "-o", "pipe.csv"],
        &["fit", "pipe.csv", "-o", "other.json"],
        &["info", "pipe.csv"],
    ] {
        let output = signalled(at, arguments, "-TERM", Duration::from_millis(300)).unwrap();
        assert_eq!(output.status.code(), Some(143), "{arguments:?}: {}", said(&output));
        assert_eq!(fs::read_dir(at).unwrap().count(), 4, "{arguments:?}");
    }
}

#[test]
fn at_any_moment_nothing_is_left_half_written() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--seed", "3", "-o", "capture"]);
    let before = fs::read_dir(at).unwrap().count();
    for (arguments, output) in [
        (&["synth", "--seed", "4", "-o", "out"][..], "out"),
        (&["detect", "capture", "-o", "out.csv", "--draw", "out"], "out"),
        (&["drive", "--method", "dlt", "-o", "out"], "out"),
        (&["fit", "capture", "--method", "dlt", "-o", "out.json"], "out.json"),
    ] {
        for moment in 1..6 {
            let after = Duration::from_millis(60 * moment);
            let Some(ended) = signalled(at, arguments, "-TERM", after) else { continue };
            if ended.status.code() == Some(143) {
                assert!(!at.join(output).exists(), "{arguments:?} after {after:?}");
            }
            for name in ["out", "out.csv", "out.json"].map(|name| at.join(name)) {
                let _ = fs::remove_dir_all(&name);
                let _ = fs::remove_file(&name);
            }
            assert_eq!(fs::read_dir(at).unwrap().count(), before, "{arguments:?} after {after:?}");
        }
    }
}

/// What takes no more bytes and says so, as a full disk does: a socket whose other end does not read.
fn full() -> (UnixStream, Stdio) {
    let (mut filled, unread) = UnixStream::pair().unwrap();
    filled.set_nonblocking(true).unwrap();
    while filled.write(&[0; 4096]).is_ok() {}
    while filled.write(&[0]).is_ok() {}
    (unread, OwnedFd::from(filled).into())
}

#[test]
fn where_nobody_listens_nothing_panics() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (_unread, unheard) = full();
    assert_eq!(
        command(at, &["info", "none.json"]).stderr(unheard).status().unwrap().code(),
        Some(1)
    );
    for arguments in [&["--help"][..], &["--version"], &["list", "methods"], &["fit", "--help"]] {
        let (_unread, full) = full();
        let output = command(at, arguments).stdout(full).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert!(said(&output).contains("cannot write to standard output"), "{}", said(&output));
    }
    assert!(wheatstone(at, &["--version"]).status.success());
}
