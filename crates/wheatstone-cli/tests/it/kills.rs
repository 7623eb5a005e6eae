//! The program killed at random moments: each output is there whole or not at all, and the next run removes what was
//! left behind. `WHEATSTONE_KILLS=2000` kills more often.

use crate::{
    jobs::{FILES, FOLDERS, Job, names, prepared},
    program::done,
};
use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::Stdio,
    thread,
    time::{Duration, Instant},
};
use wheatstone::numeric::random::Random;

/// The names of what a job writes.
fn outputs(job: &Job) -> Vec<String> {
    let besides = job.besides.iter().map(|name| (*name).to_owned());
    [job.named("out")].into_iter().chain(besides).collect()
}

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

#[test]
fn a_kill_leaves_outputs_whole_or_absent() {
    let folder = prepared("2000");
    let at = folder.path();
    let inputs = names(at);
    let jobs: Vec<&Job> = FILES.iter().chain(&FOLDERS).collect();
    let mut whole = Vec::new();
    for job in &jobs {
        let began = Instant::now();
        done(at, &job.to(&job.named("out")));
        let contents: Vec<_> = outputs(job).iter().map(|name| content(&at.join(name))).collect();
        assert!(contents.iter().all(Option::is_some), "{:?}: {:?}", job.arguments, names(at));
        whole.push((began.elapsed(), contents));
        outputs(job).iter().for_each(|name| remove(&at.join(name)));
    }
    let asked = std::env::var("WHEATSTONE_KILLS").ok().and_then(|kills| kills.parse().ok());
    let (mut random, mut killed) = (Random::new(36), 0);
    for _ in 0..asked.unwrap_or(200) {
        let number = random.below(jobs.len());
        let (job, (took, contents)) = (jobs[number], &whole[number]);
        let mut child = job.command(at, &job.named("out")).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(took.mul_f64(random.uniform(0.0, 1.1)) + Duration::from_millis(1));
        let _ = child.kill();
        killed += usize::from(!child.wait().unwrap().success());
        for (name, content_of) in outputs(job).iter().zip(contents) {
            let found = content(&at.join(name));
            let is_whole = found.is_none() || found == *content_of;
            assert!(is_whole, "{:?} left a part of {name}", job.arguments);
            remove(&at.join(name));
        }
        for name in names(at) {
            let is_known = inputs.contains(&name) || name.contains(".wheatstone-tmp");
            assert!(is_known, "{:?} left {name}", job.arguments);
        }
    }
    assert!(killed > 20, "{killed} were killed in time");
    done(at, &jobs[0].to(&jobs[0].named("out")));
    outputs(jobs[0]).iter().for_each(|name| remove(&at.join(name)));
    let left: Vec<_> = names(at).into_iter().filter(|name| !inputs.contains(name)).collect();
    assert!(left.is_empty(), "{left:?}");
}
