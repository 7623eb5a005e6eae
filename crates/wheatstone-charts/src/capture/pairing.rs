//! Which pictures of different cameras show one view.

use super::passed_over;
use crate::imaging::in_counting_order;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};
use wheatstone_core::{Error, Result};

/// One camera's picture files, sorted.
type Files = Vec<PathBuf>;

/// One camera's pictures, view by view; none where it has none of the view.
type Pictures = Vec<Option<PathBuf>>;

/// Refuses a capture file.
pub(super) fn refuse(path: &Path, problem: String, hint: &str) -> Error {
    Error::Malformed { path: path.into(), line: None, problem, hint: hint.into() }
}

/// One picture a camera for every view, and the views' names. Pictures named like the views go by their
/// names; so do pictures whose names, or numbers in them, are those of another camera's; others go by
/// sorted order, where there are as many of each camera.
pub(super) fn pair_up(
    path: &Path,
    (cameras, mut files): (&[String], Vec<Files>),
    names: Vec<String>,
) -> Result<(Vec<Pictures>, Vec<String>)> {
    if let Some(twice) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let problem = format!("two [[views]] are named `{}`", twice.1);
        return Err(refuse(path, problem, "give each its own name"));
    }
    if !names.is_empty() && files.iter().flatten().all(|picture| names.contains(&stem(picture))) {
        let found = by_key(files, &names, stem);
        let lonely = (0..names.len()).find(|view| found.iter().all(|all| all[*view].is_none()));
        if let Some(view) = lonely {
            return Err(refuse(
                path,
                format!("no camera has a picture of view `{}`", names[view]),
                "name its pictures like the view, or remove its [[views]] entry",
            ));
        }
        return Ok((found, names));
    }
    let key = KEYS.into_iter().find(|key| tells(&files, *key));
    // Here order alone tells which pictures belong together, or to which view.
    if key.is_none() || !names.is_empty() {
        files.iter_mut().for_each(|all| all.sort_by(|a, b| in_counting_order(a, b)));
    }
    let (mut pictures, found) = match key {
        Some(key) => by_shared_key(files, key),
        None => in_order(path, (cameras, files))?,
    };
    if names.is_empty() {
        return Ok((pictures, found));
    }
    if names.len() != found.len() {
        return Err(refuse(
            path,
            format!("{} [[views]], but {} pictures per camera", names.len(), found.len()),
            "give one [[views]] entry per picture pair, or none at all",
        ));
    }
    for own in &mut pictures {
        let of = |name: &String| own.iter().flatten().find(|picture| stem(picture) == *name);
        if let Some(named) = names.iter().map(|name| of(name).cloned()).collect::<Option<Vec<_>>>()
        {
            *own = named.into_iter().map(Some).collect();
        }
    }
    Ok((pictures, names))
}

/// Whether nothing in the names of these pictures, of cameras and views, tells which belong together.
pub(super) fn is_by_order(files: &[Files], views: &[&str]) -> bool {
    let named = |picture: &PathBuf| views.contains(&&*stem(picture));
    files.len() > 1
        && !files.iter().flatten().all(named)
        && !KEYS.into_iter().any(|key| tells(files, key))
}

/// What of a picture's name may say which view it shows.
type Key = fn(&Path) -> String;

const KEYS: [Key; 3] = [stem, last_number, first_number];

/// A picture's file name without its extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn last_number(path: &Path) -> String {
    let name = stem(path);
    name.split(|c: char| !c.is_ascii_digit()).rfind(|run| !run.is_empty()).unwrap_or("").into()
}

fn first_number(path: &Path) -> String {
    let name = stem(path);
    name.split(|c: char| !c.is_ascii_digit()).find(|run| !run.is_empty()).unwrap_or("").into()
}

/// Whether keys pair pictures: each camera has each once at most, and half of them or more are those of
/// several cameras.
fn tells(files: &[Files], key: Key) -> bool {
    let mut cameras: BTreeMap<String, usize> = BTreeMap::new();
    for pictures in files {
        let own: BTreeSet<String> = pictures.iter().map(|picture| key(picture)).collect();
        if own.len() < pictures.len() {
            return false;
        }
        own.into_iter().for_each(|key| *cameras.entry(key).or_default() += 1);
    }
    let shared = cameras.values().filter(|count| **count > 1).count();
    files.len() > 1 && 2 * shared >= cameras.len()
}

/// By keys that some cameras share. Views have the names of their first pictures, and lie in the order in
/// which the files do.
fn by_shared_key(files: Vec<Files>, key: Key) -> (Vec<Pictures>, Vec<String>) {
    // The camera with the most pictures leads; keys that it lacks go where they sort among its own.
    let most = files.iter().map(Vec::len).max().unwrap_or_default();
    let leader = files.iter().find(|all| all.len() == most);
    let mut keys: Vec<String> = leader.into_iter().flatten().map(|picture| key(picture)).collect();
    for new in files.iter().flatten().map(|picture| key(picture)) {
        if !keys.contains(&new) {
            let place = keys.iter().position(|other| (other.len(), other) > (new.len(), &new));
            keys.insert(place.unwrap_or(keys.len()), new);
        }
    }
    let pictures = by_key(files, &keys, key);
    let first = |view: usize| pictures.iter().find_map(|all| all[view].as_deref().map(stem));
    let names = (0..keys.len()).map(|view| first(view).unwrap_or_default()).collect();
    (pictures, names)
}

fn by_key(files: Vec<Files>, keys: &[String], key: Key) -> Vec<Pictures> {
    let of_camera = |all: Files| {
        let mut pictures = vec![None; keys.len()];
        for picture in all {
            if let Some(view) = keys.iter().position(|other| *other == key(&picture)) {
                pictures[view] = Some(picture);
            }
        }
        pictures
    };
    files.into_iter().map(of_camera).collect()
}

/// In sorted order; views have the names of the first camera's pictures.
fn in_order(
    path: &Path,
    (cameras, files): (&[String], Vec<Files>),
) -> Result<(Vec<Pictures>, Vec<String>)> {
    let names: Vec<String> = files.iter().take(1).flatten().map(|picture| stem(picture)).collect();
    if files.iter().any(|all| all.len() != names.len()) {
        let counts = cameras.iter().zip(&files);
        let list: Vec<String> =
            counts.map(|(name, all)| format!("`{name}` has {}", all.len())).collect();
        let passed_over = passed_over::told(&passed_over::beside(&files));
        let passed_over = passed_over.map(|told| format!("; {told}")).unwrap_or_default();
        return Err(refuse(
            path,
            format!(
                "the cameras have different numbers of pictures: {}{passed_over}",
                list.join(", ")
            ),
            "pictures are paired in sorted order: remove those without a partner, or name those of one view alike",
        ));
    }
    Ok((files.into_iter().map(|all| all.into_iter().map(Some).collect()).collect(), names))
}
