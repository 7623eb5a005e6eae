//! The program killed at random moments: each output is there whole or not at all, and the next run removes what was
//! left behind. `WHEATSTONE_KILLS=2000` kills more often.

use crate::program::{command, done};
use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::Stdio,
    thread,
    time::{Duration, Instant},
};
use wheatstone::numeric::random::Random;

/// Each with the names of what it writes.
const JOBS: [(&[&str], &[&str]); 13] = [
    (&["synth", "--points", "--seed", "5", "-o", "s.csv"], &["s.csv", "s.truth.json"]),
    (&["synth", "--near", "90", "--far", "120", "-o", "rendered"], &["rendered"]),
    (&["fit", "points.csv", "--method", "brown", "-o", "m.json"], &["m.json"]),
    (&["locate", "model.json", "points.csv", "-o", "l.csv"], &["l.csv"]),
    (&["locate", "model.json", "points.csv", "-o", "l.parquet"], &["l.parquet"]),
    (&["export", "model.json", "--format", "opencv", "-o", "o.yml"], &["o.yml"]),
    (&["rectify", "model.json", "-o", "rectified"], &["rectified"]),
    (&["convert", "points.csv", "c.arrow"], &["c.arrow"]),
    (&["check", "points.csv", "--fix", "f.csv"], &["f.csv"]),
    (&["chart", "-o", "c.pdf"], &["c.pdf"]),
    (&["detect", "capture", "--draw", "drawn", "-o", "d.csv"], &["drawn", "d.csv"]),
    (&["report", "model.json", "--no-validation", "-o", "r.html"], &["r.html"]),
    (&["man", "pages"], &["pages"]),
];

/// What stands under a name: the bytes of a file, or of all files of a folder.
fn content(path: &Path) -> Option<BTreeMap<String, Vec<u8>>> {
    if path.is_file() {
        return Some([(String::new(), fs::read(path).unwrap())].into());
    }
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(path).ok()? {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        let inner = content(&entry.path()).unwrap();
        all.extend(inner.into_iter().map(|(own, bytes)| (format!("{name}/{own}"), bytes)));
    }
    Some(all)
}

fn remove(path: &Path) {
    if path.is_dir() {
        fs::remove_dir_all(path).unwrap();
    } else if path.exists() {
        fs::remove_file(path).unwrap();
    }
}

fn names(folder: &Path) -> Vec<String> {
    let name = |entry: Result<fs::DirEntry, _>| entry.unwrap().file_name().into_string().unwrap();
    fs::read_dir(folder).unwrap().map(name).collect()
}

#[test]
fn a_kill_leaves_outputs_whole_or_absent() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["synth", "--points", "--count", "2000", "--noise", "0.1", "-o", "points.csv"]);
    done(at, &["fit", "points.csv", "--method", "brown", "-o", "model.json"]);
    done(at, &["synth", "--near", "90", "--far", "120", "-o", "capture"]);
    let inputs = names(at);
    let mut whole = Vec::new();
    for (arguments, outputs) in JOBS {
        let began = Instant::now();
        done(at, arguments);
        let contents: Vec<_> = outputs.iter().map(|name| content(&at.join(name))).collect();
        assert!(contents.iter().all(Option::is_some), "{arguments:?}: {:?}", names(at));
        whole.push((began.elapsed(), contents));
        outputs.iter().for_each(|name| remove(&at.join(name)));
    }
    let asked = std::env::var("WHEATSTONE_KILLS").ok().and_then(|kills| kills.parse().ok());
    let (mut random, mut killed) = (Random::new(36), 0);
    for _ in 0..asked.unwrap_or(200) {
        let job = random.below(JOBS.len());
        let (arguments, outputs) = JOBS[job];
        let mut child = command(at, arguments).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(whole[job].0.mul_f64(random.uniform(0.0, 1.1)) + Duration::from_millis(1));
        let _ = child.kill();
        killed += usize::from(!child.wait().unwrap().success());
        for (name, content_of) in outputs.iter().zip(&whole[job].1) {
            let found = content(&at.join(name));
            assert!(found.is_none() || found == *content_of, "{arguments:?} left a part of {name}");
            remove(&at.join(name));
        }
        for name in names(at) {
            let is_known = inputs.contains(&name) || name.contains(".wheatstone-tmp");
            assert!(is_known, "{arguments:?} left {name}");
        }
    }
    assert!(killed > 20, "{killed} were killed in time");
    done(at, JOBS[0].0);
    JOBS[0].1.iter().for_each(|name| remove(&at.join(name)));
    let left: Vec<_> = names(at).into_iter().filter(|name| !inputs.contains(name)).collect();
    assert!(left.is_empty(), "{left:?}");
}
