//! What outputs leave behind where a call to the file system fails: each call, one after the other.

use super::{
    Output,
    calls::{Calls, failing::Failing},
    folder::write_with,
};
use crate::Error;
use std::{
    collections::BTreeMap,
    fs,
    io::{ErrorKind, Write},
    path::Path,
};

/// A disk that is full, one that is broken, and a signal.
const FAULTS: [ErrorKind; 3] = [ErrorKind::StorageFull, ErrorKind::Other, ErrorKind::Interrupted];

/// Does `work` with every call failing in its turn, until none is left to fail. `check` is told whether all went well.
fn each_call_fails(
    work: impl Fn(&'static dyn Calls, &Path) -> Result<(), Error>,
    before: impl Fn(&Path),
    check: impl Fn(bool, &Path),
) {
    for kind in FAULTS {
        let mut calls = 0;
        loop {
            let folder = tempfile::tempdir().unwrap();
            before(folder.path());
            let failing: &'static Failing = Box::leak(Box::new(Failing::at(calls, kind)));
            let done = work(failing, folder.path()).is_ok();
            if !failing.has_failed() {
                assert!(done && calls > 3, "{kind:?}: {calls} calls");
                break;
            }
            // A call that a signal interrupted is made again.
            assert_eq!(done, kind == ErrorKind::Interrupted, "{kind:?} at call {calls}");
            check(done, folder.path());
            calls += 1;
        }
    }
}

/// All files of a folder and the folders in it, by their names.
fn files(folder: &Path) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let (path, name) = {
            let entry = entry.unwrap();
            (entry.path(), entry.file_name().into_string().unwrap())
        };
        if path.is_dir() {
            found.extend(
                files(&path).into_iter().map(|(own, text)| (format!("{name}/{own}"), text)),
            );
        } else {
            found.insert(name, fs::read_to_string(path).unwrap());
        }
    }
    found
}

fn named<const N: usize>(all: [(&str, &str); N]) -> BTreeMap<String, String> {
    all.map(|(name, text)| (name.to_owned(), text.to_owned())).into()
}

#[test]
fn a_file_is_the_old_one_or_the_new_one() {
    let write = |calls, folder: &Path| {
        let path = folder.join("file");
        let mut output = Output::create_with(&path, calls)?;
        output.write_all(b"new and longer").map_err(|e| Error::writing(&path, e))?;
        output.commit()
    };
    let (old, new) = (named([("file", "old")]), named([("file", "new and longer")]));
    each_call_fails(
        write,
        |folder| fs::write(folder.join("file"), "old").unwrap(),
        |done, folder| {
            let found = files(folder);
            // The last call puts a name on the disk that is there already.
            assert!(found == new || !done && found == old, "{found:?}");
        },
    );
}

#[test]
fn a_new_folder_is_there_whole_or_not_at_all() {
    let whole = named([("made/in/a", "1"), ("made/b", "2")]);
    let write = |calls: &'static dyn Calls, folder: &Path| {
        let fill = |made: &Path| {
            fs::create_dir(made.join("in")).unwrap();
            fs::write(made.join("in/a"), "1").unwrap();
            fs::write(made.join("b"), "2").unwrap();
            Ok(())
        };
        write_with(&folder.join("made"), fill, calls)
    };
    each_call_fails(
        write,
        |_| {},
        |done, folder| {
            let found = files(folder);
            assert!(found == whole || !done && found.is_empty(), "{found:?}");
        },
    );
}

#[test]
fn of_a_folder_that_is_there_other_files_stay() {
    let write = |calls: &'static dyn Calls, folder: &Path| {
        let fill = |made: &Path| {
            fs::create_dir(made.join("in")).unwrap();
            fs::write(made.join("in/a"), "new").unwrap();
            fs::write(made.join("b"), "new").unwrap();
            Ok(())
        };
        write_with(&folder.join("made"), fill, calls)
    };
    let before = |folder: &Path| {
        fs::create_dir_all(folder.join("made/in")).unwrap();
        for name in ["made/in/a", "made/in/own", "made/own"] {
            fs::write(folder.join(name), "old").unwrap();
        }
    };
    each_call_fails(write, before, |done, folder| {
        let found = files(folder);
        assert!(found["made/in/own"] == "old" && found["made/own"] == "old", "{found:?}");
        assert!(!done || found["made/in/a"] == "new" && found["made/b"] == "new", "{found:?}");
        assert!(found.keys().all(|name| name.starts_with("made/")), "{found:?}");
        assert!(found.values().all(|text| text == "old" || text == "new"), "{found:?}");
    });
}

#[test]
fn what_a_killed_program_left_is_removed_and_what_is_being_written_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut own = Output::create(&at("own")).unwrap();
    own.write_all(b"own").unwrap();
    // Its lock went with the program that held it.
    fs::write(at(".1.wheatstone-tmp"), "left").unwrap();
    fs::create_dir(at(".1.wheatstone-tmp-folder")).unwrap();
    fs::write(at(".1.wheatstone-tmp-folder/left"), "left").unwrap();
    fs::write(at(".x.wheatstone-tmp"), "not ours").unwrap();
    super::unfinished::sweep(folder.path());
    own.commit().unwrap();
    assert_eq!(files(folder.path()), named([("own", "own"), (".x.wheatstone-tmp", "not ours")]));
}
