//! Which pictures of different cameras show one view.

use super::{CameraPictures, ViewEntry, refuse};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};
use wheatstone_core::Result;

/// One camera's name and its picture files, sorted.
type Files = (String, Vec<PathBuf>);

/// One picture a camera for every view, and the views' names. Pictures named like the views go by their
/// names; so do pictures whose names, or numbers in them, are those of another camera's; others go by
/// sorted order, where there are as many of each camera.
pub(super) fn pair_up(
    path: &Path,
    files: Vec<Files>,
    entries: &[ViewEntry],
) -> Result<(Vec<CameraPictures>, Vec<String>)> {
    let names: Vec<String> = entries.iter().map(|entry| entry.name.clone()).collect();
    if let Some(twice) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let problem = format!("two [[views]] are named `{}`", twice.1);
        return Err(refuse(path, problem, "give each its own name"));
    }
    if !names.is_empty()
        && files.iter().all(|(_, all)| all.iter().all(|p| names.contains(&stem(p))))
    {
        let cameras = by_key(files, &names, stem);
        let lonely =
            (0..names.len()).find(|view| cameras.iter().all(|c| c.pictures[*view].is_none()));
        if let Some(view) = lonely {
            return Err(refuse(
                path,
                format!("no camera has a picture of view `{}`", names[view]),
                "name its pictures like the view, or remove its [[views]] entry",
            ));
        }
        return Ok((cameras, names));
    }
    let (mut cameras, found) = match KEYS.into_iter().find(|key| tells(&files, *key)) {
        Some(key) => by_shared_key(files, key),
        None => in_order(path, files)?,
    };
    if !names.is_empty() && names.len() != found.len() {
        return Err(refuse(
            path,
            format!("{} [[views]], but {} pictures per camera", names.len(), found.len()),
            "give one [[views]] entry per picture pair, or none at all",
        ));
    }
    if names.is_empty() {
        return Ok((cameras, found));
    }
    for camera in &mut cameras {
        let of =
            |name: &String| camera.pictures.iter().flatten().find(|picture| stem(picture) == *name);
        if let Some(pictures) =
            names.iter().map(|name| of(name).cloned()).collect::<Option<Vec<_>>>()
        {
            camera.pictures = pictures.into_iter().map(Some).collect();
        }
    }
    Ok((cameras, names))
}

/// What of a picture's name may say which view it shows.
type Key = fn(&Path) -> String;

const KEYS: [Key; 3] = [stem, last_number, first_number];

/// A picture's file name without its extension.
fn stem(path: &Path) -> String {
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
    for (_, pictures) in files {
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
fn by_shared_key(files: Vec<Files>, key: Key) -> (Vec<CameraPictures>, Vec<String>) {
    // The camera with the most pictures leads; keys that it lacks go where they sort among its own.
    let most = files.iter().map(|(_, all)| all.len()).max().unwrap_or_default();
    let leader = files.iter().find(|(_, all)| all.len() == most);
    let mut keys: Vec<String> =
        leader.into_iter().flat_map(|(_, all)| all).map(|p| key(p)).collect();
    for new in files.iter().flat_map(|(_, all)| all).map(|picture| key(picture)) {
        if !keys.contains(&new) {
            let place = keys.iter().position(|other| (other.len(), other) > (new.len(), &new));
            keys.insert(place.unwrap_or(keys.len()), new);
        }
    }
    let cameras = by_key(files, &keys, key);
    let first = |view: usize| {
        let mut pictures = cameras.iter().filter_map(|camera| camera.pictures[view].as_ref());
        pictures.next().map(|picture| stem(picture)).unwrap_or_default()
    };
    let names = (0..keys.len()).map(first).collect();
    (cameras, names)
}

fn by_key(files: Vec<Files>, keys: &[String], key: Key) -> Vec<CameraPictures> {
    let camera = |(name, all): Files| {
        let mut pictures = vec![None; keys.len()];
        for picture in all {
            if let Some(view) = keys.iter().position(|other| *other == key(&picture)) {
                pictures[view] = Some(picture);
            }
        }
        CameraPictures { name, pictures }
    };
    files.into_iter().map(camera).collect()
}

/// In sorted order; views have the names of the first camera's pictures.
fn in_order(path: &Path, files: Vec<Files>) -> Result<(Vec<CameraPictures>, Vec<String>)> {
    let counts: Vec<usize> = files.iter().map(|(_, all)| all.len()).collect();
    if counts.iter().any(|count| *count != counts[0]) {
        let list: Vec<String> =
            files.iter().map(|(name, all)| format!("`{name}` has {}", all.len())).collect();
        return Err(refuse(
            path,
            format!("the cameras have different numbers of pictures: {}", list.join(", ")),
            "pictures are paired in sorted order: remove those without a partner, or name those of one view alike",
        ));
    }
    let names = files.first().map(|(_, all)| all.iter().map(|p| stem(p)).collect());
    let camera =
        |(name, all): Files| CameraPictures { name, pictures: all.into_iter().map(Some).collect() };
    Ok((files.into_iter().map(camera).collect(), names.unwrap_or_default()))
}
