//! A synthetic capture with a scene, which the tests of `wheatstone reconstruct` share.

use crate::program::done;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};

pub(crate) const LEFT: &str = "capture/scene/left.png";
pub(crate) const RIGHT: &str = "capture/scene/right.png";

/// A capture with a scene, and a model of it. They are made once, as that takes longer than to reconstruct the scene.
pub(crate) fn prepared(at: &Path) {
    static MADE: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().unwrap();
        let from = folder.path();
        done(from, &["synth", "--scene", "-o", "capture"]);
        done(from, &["fit", "capture", "--method", "brown", "--no-validation", "-o", "model.json"]);
        let mut files = BTreeMap::new();
        gather(from, Path::new(""), &mut files);
        files
    };
    for (name, bytes) in MADE.get_or_init(make) {
        let path = at.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

/// The files of a folder and of those in it, by their names from `root`.
fn gather(root: &Path, inside: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in fs::read_dir(root.join(inside)).unwrap() {
        let name = inside.join(entry.unwrap().file_name());
        if root.join(&name).is_dir() {
            gather(root, &name, files);
        } else {
            files.insert(name.clone(), fs::read(root.join(&name)).unwrap());
        }
    }
}
