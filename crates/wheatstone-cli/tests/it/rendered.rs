//! Captures that the program rendered, shared by all tests: rendering takes longer than what comes after it.

use crate::program::done;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, OnceLock},
};

/// Contents by names.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// What each command has written. In memory: what is static cannot remove its folder at the end.
static RENDERED: Mutex<BTreeMap<String, Arc<OnceLock<Files>>>> = Mutex::new(BTreeMap::new());

/// Does in a folder what a command that renders would do, such as `synth --scene -o capture`.
pub(crate) fn rendered(folder: &Path, words: &[&str]) {
    let made = RENDERED.lock().unwrap().entry(words.join(" ")).or_default().clone();
    let files = made.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        done(folder.path(), words);
        let mut files = Files::new();
        gather(folder.path(), Path::new(""), &mut files);
        files
    });
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

/// The files of a folder and of those in it, by their names from `root`.
fn gather(root: &Path, inside: &Path, files: &mut Files) {
    for entry in fs::read_dir(root.join(inside)).unwrap() {
        let name = inside.join(entry.unwrap().file_name());
        if root.join(&name).is_dir() {
            gather(root, &name, files);
        } else {
            files.insert(name.clone(), fs::read(root.join(&name)).unwrap());
        }
    }
}
