//! What a verb does to what stands where its output shall be: files are replaced, links kept, pipes and devices written
//! through, inputs refused; and where there is no room, everything is as before.

use crate::{
    jobs::{FILES, FOLDERS, Job, names, prepared},
    program::said,
};
use std::{
    fs,
    io::Read,
    os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink},
    path::Path,
    process::{Command, Stdio},
};

/// Runs a job, and gives the status that it ends with.
fn run(folder: &Path, job: &Job, output: &str) -> Option<i32> {
    let done = job.command(folder, output).output().unwrap();
    assert!(!said(&done).contains("panicked"), "{}", said(&done));
    done.status.code()
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o777
}

/// What would have been written under another name: reports show the command that made them.
fn as_if(bytes: &[u8], name: &str, other: &str) -> Vec<u8> {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.replace(name, other).into_bytes(),
        Err(_) => bytes.to_vec(),
    }
}

#[test]
fn a_link_stays_and_its_target_is_replaced() {
    let folder = prepared("100");
    let at = |name: &str| folder.path().join(name);
    for job in FILES {
        let [plain, target, link] = ["out", "target", "link"].map(|stem| job.named(stem));
        assert_eq!(run(folder.path(), &job, &plain), Some(0), "{:?}", job.arguments);
        fs::write(at("made"), "").unwrap();
        assert_eq!(mode(&at(&plain)), mode(&at("made")), "{:?}", job.arguments);
        fs::write(at(&target), "old").unwrap();
        fs::set_permissions(at(&target), fs::Permissions::from_mode(0o600)).unwrap();
        symlink(&target, at(&link)).unwrap();
        assert_eq!(run(folder.path(), &job, &link), Some(0), "{:?}", job.arguments);
        assert!(fs::symlink_metadata(at(&link)).unwrap().is_symlink(), "{:?}", job.arguments);
        assert_eq!(mode(&at(&target)), 0o600, "{:?}", job.arguments);
        let written = as_if(&fs::read(at(&target)).unwrap(), &link, &plain);
        assert!(written == fs::read(at(&plain)).unwrap(), "{:?}", job.arguments);
        [plain, target, link].iter().for_each(|name| fs::remove_file(at(name)).unwrap());
    }
}

#[test]
fn a_pipe_is_written_through() {
    let folder = prepared("100");
    let at = |name: &str| folder.path().join(name);
    for job in FILES {
        let [plain, pipe] = ["out", "pipe"].map(|stem| job.named(stem));
        assert_eq!(run(folder.path(), &job, &plain), Some(0), "{:?}", job.arguments);
        assert!(Command::new("mkfifo").arg(at(&pipe)).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = at(&pipe);
            move || {
                let mut bytes = Vec::new();
                fs::File::open(pipe).unwrap().read_to_end(&mut bytes).unwrap();
                bytes
            }
        });
        assert_eq!(run(folder.path(), &job, &pipe), Some(0), "{:?}", job.arguments);
        let written = as_if(&reader.join().unwrap(), &pipe, &plain);
        assert!(written == fs::read(at(&plain)).unwrap(), "{:?}", job.arguments);
        assert!(fs::metadata(at(&pipe)).unwrap().file_type().is_fifo(), "{:?}", job.arguments);
        [plain, pipe].iter().for_each(|name| fs::remove_file(at(name)).unwrap());
    }
}

#[test]
fn an_input_is_not_written_over() {
    let folder = prepared("100");
    let at = |name: &str| folder.path().join(name);
    for job in FILES {
        for input in job.inputs {
            let before = fs::read(at(input)).unwrap();
            // By its name, by another, and by a link.
            symlink(input, at("link")).unwrap();
            for name in [(*input).to_owned(), format!("./{input}"), "link".to_owned()] {
                let status = run(folder.path(), &job, &name);
                assert_eq!(status, Some(2), "{:?} {name}", job.arguments);
            }
            fs::remove_file(at("link")).unwrap();
            assert!(fs::read(at(input)).unwrap() == before, "{:?} {input}", job.arguments);
        }
    }
}

#[test]
fn a_folder_is_not_put_where_something_else_stands() {
    let folder = prepared("100");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("file"), "old").unwrap();
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    symlink("file", at("link")).unwrap();
    let before = names(folder.path());
    for job in FOLDERS {
        for name in ["file", "pipe", "link"] {
            let status = run(folder.path(), &job, name);
            assert!(matches!(status, Some(1 | 2)), "{:?} {name}: {status:?}", job.arguments);
            job.besides.iter().for_each(|besides| drop(fs::remove_file(at(besides))));
            assert_eq!(names(folder.path()), before, "{:?} {name}", job.arguments);
            assert_eq!(fs::read(at("file")).unwrap(), b"old", "{:?}", job.arguments);
        }
        // A link to a folder is followed.
        fs::create_dir(at("target")).unwrap();
        fs::remove_file(at("link")).unwrap();
        symlink("target", at("link")).unwrap();
        assert_eq!(run(folder.path(), &job, "link"), Some(0), "{:?}", job.arguments);
        assert!(!names(&at("target")).is_empty(), "{:?}", job.arguments);
        fs::remove_dir_all(at("target")).unwrap();
        fs::remove_file(at("link")).unwrap();
        symlink("file", at("link")).unwrap();
        job.besides.iter().for_each(|besides| drop(fs::remove_file(at(besides))));
    }
}

/// Mounts what an output can meet, of which nothing is the machine's own: a folder that cannot be written to, one that is
/// full, and, where the system lets us make them, a device that takes everything and one that takes nothing.
const ROOM: &str = "set -e
mount -t tmpfs none room && mkdir room/readonly room/full
mknod room/null c 1 3 2> errors && mknod room/none c 1 7 || true
mount -t tmpfs -o size=16k none room/full
dd if=/dev/zero of=room/full/filled bs=4k count=4 2> errors
mount -t tmpfs -o ro none room/readonly
set +e
";

/// Runs a shell's lines with mounts of their own, as the administrator or as one who is taken for him.
fn apart(folder: &Path, lines: &str) -> std::process::Output {
    let is_root = fs::metadata("/proc/self").unwrap().uid() == 0;
    let mut unshare = Command::new("unshare");
    unshare.args(if is_root { &["--mount"][..] } else { &["--map-root-user", "--mount"] });
    unshare.args(["sh", "-c", lines]).current_dir(folder).stdin(Stdio::null()).output().unwrap()
}

/// A folder with inputs and an empty `room`; none where the system does not let us do this in it.
fn prepared_with_room(probe: &str) -> Option<tempfile::TempDir> {
    let folder = prepared("100");
    fs::create_dir(folder.path().join("room")).unwrap();
    let is_able = apart(folder.path(), &format!("{ROOM} {probe}")).status.success();
    if !is_able {
        eprintln!("not tried: this system does not permit `{probe}` in a room of one's own");
    }
    is_able.then_some(folder)
}

/// How a job ended in a room.
struct Ended {
    status: Option<i32>,
    /// All that it said.
    told: String,
    /// What is in the folders afterwards, and what is a device.
    left: String,
}

/// Runs jobs in a room, with their outputs at a place in it, where NAME is the name of each.
fn in_room(folder: &Path, jobs: &[Job], place: &str) -> Vec<Ended> {
    let mut lines = ROOM.to_owned();
    for (number, job) in jobs.iter().enumerate() {
        let output = place.replace("NAME", &job.named("out"));
        let words: Vec<_> = job.to(&output).iter().map(|word| format!("'{word}'")).collect();
        let program = env!("CARGO_BIN_EXE_wheatstone");
        lines += &format!("'{program}' {} > printed 2> errors{number}\n", words.join(" "));
        lines += "echo $? $(ls -A room/full room/readonly) $(test -c room/null && echo null) \
                  $(test -c room/none && echo none)\n";
    }
    let output = apart(folder, &lines);
    assert!(output.status.success(), "{}", said(&output));
    let lines = String::from_utf8(output.stdout).unwrap();
    let ended = lines.lines().enumerate().map(|(number, line)| {
        let told = fs::read_to_string(folder.join(format!("errors{number}"))).unwrap();
        assert!(!told.contains("panicked"), "{told}");
        let (status, left) = line.split_once(' ').unwrap();
        Ended { status: status.parse().ok(), told, left: left.to_owned() }
    });
    ended.collect()
}

/// What is in the folders of a room where nothing was left there.
const UNTOUCHED: &str = "room/full: filled room/readonly:";

#[test]
fn where_there_is_no_room_nothing_is_left() {
    let Some(folder) = prepared_with_room("true") else { return };
    for (place, words) in [
        ("room/full/NAME", "No space left on device"),
        ("room/readonly/NAME", "Read-only file system"),
    ] {
        for jobs in [&FILES[..], &FOLDERS] {
            for (job, ended) in jobs.iter().zip(in_room(folder.path(), jobs, place)) {
                let case = format!("{:?} {place}: {}", job.arguments, ended.told);
                assert_eq!(ended.status, Some(1), "{case}");
                assert!(ended.told.contains(words), "{case}");
                assert!(ended.left.starts_with(UNTOUCHED), "{} {case}", ended.left);
            }
        }
    }
}

#[test]
fn a_device_is_written_through_and_stays() {
    let Some(folder) = prepared_with_room("test -c room/none") else { return };
    let devices = format!("{UNTOUCHED} null none");
    for (job, ended) in FILES.iter().zip(in_room(folder.path(), &FILES, "room/null")) {
        let case = format!("{:?}: {}", job.arguments, ended.told);
        // Some need the name of an output to know what to write.
        let is_unnamed =
            ended.status == Some(2) && ["convert", "chart"].contains(&job.arguments[0]);
        assert!(ended.status == Some(0) || is_unnamed, "{:?} {case}", ended.status);
        assert_eq!(ended.left, devices, "{case}");
    }
    for (job, ended) in FILES.iter().zip(in_room(folder.path(), &FILES, "room/none")) {
        let case = format!("{:?}: {}", job.arguments, ended.told);
        assert!(matches!(ended.status, Some(1 | 2)), "{:?} {case}", ended.status);
        assert_eq!(ended.left, devices, "{case}");
    }
    for place in ["room/null", "room/none"] {
        for (job, ended) in FOLDERS.iter().zip(in_room(folder.path(), &FOLDERS, place)) {
            let case = format!("{:?}: {}", job.arguments, ended.told);
            assert!(matches!(ended.status, Some(1 | 2)), "{:?} {case}", ended.status);
            assert_eq!(ended.left, devices, "{case}");
        }
    }
}
