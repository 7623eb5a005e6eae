//! Which pictures of different cameras show one view.

use super::{passed_over, stars::Starred};
use crate::imaging::{in_counting_order, is_picture};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};
use wheatstone_core::{Error, Result};

/// A picture, and what tells which view it shows.
#[derive(Clone)]
pub(super) struct Picture {
    file: PathBuf,
    /// What stars in the names of folders stand for, where that differs among a camera's pictures.
    session: String,
    starred: Starred,
}

impl Picture {
    /// A picture, and what the stars of its camera's pattern stand for.
    pub(super) fn new(file: PathBuf, starred: Starred) -> Self {
        Self { file, session: String::new(), starred }
    }

    /// What of the file's name may tell the view: nothing where all files of a camera must have one name.
    fn name(&self) -> String {
        let tells = self.session.is_empty() || self.starred.file.is_some();
        if tells { stem(&self.file) } else { String::new() }
    }

    fn of_session(&self, name: &str) -> String {
        let parts = [&self.session, name].into_iter().filter(|part| !part.is_empty());
        parts.collect::<Vec<_>>().join("/")
    }

    /// The name of its view: `0`, or `mon/0` where there are sessions.
    fn label(&self) -> String {
        self.of_session(&self.name())
    }

    fn is_called(&self, view: &str) -> bool {
        let starred = self.starred.file.as_deref().unwrap_or_default();
        self.label() == view || !self.session.is_empty() && self.of_session(starred) == view
    }
}

/// One camera's pictures, sorted.
type Files = Vec<Picture>;

/// One camera's pictures, view by view; none where it has none of the view.
type Pictures = Vec<Option<PathBuf>>;

/// Refuses a capture file.
pub(super) fn refuse(path: &Path, problem: String, hint: &str) -> Error {
    Error::Malformed { path: path.into(), line: None, problem, hint: hint.into() }
}

/// One picture a camera for every view, and the views' names. Pictures named like the views go by their
/// names; so do pictures whose names, or numbers in them, are those of another camera's; others go by
/// sorted order, where there are as many of each camera. Pictures of different sessions never come together.
pub(super) fn pair_up(
    path: &Path,
    (cameras, mut files): (&[String], Vec<Files>),
    names: Vec<String>,
) -> Result<(Vec<Pictures>, Vec<String>)> {
    if let Some(twice) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
        let problem = format!("two [[views]] are named `{}`", twice.1);
        return Err(refuse(path, problem, "give each its own name"));
    }
    let has_sessions = tell_sessions(&mut files);
    refuse_doubles(path, (cameras, &files))?;
    let is_named = |picture: &Picture| names.contains(&stem(&picture.file));
    if !names.is_empty() && (has_sessions || files.iter().flatten().all(is_named)) {
        return Ok((by_views(path, &files, &names)?, names));
    }
    let key = KEYS.into_iter().find(|key| tells(&files, *key));
    // Here order alone tells which pictures belong together, or to which view.
    if key.is_none() || !names.is_empty() {
        files.iter_mut().for_each(|all| all.sort_by(|a, b| in_counting_order(&a.file, &b.file)));
    }
    let (mut pictures, found) = match key {
        Some(key) => by_shared_key(files, key),
        None if has_sessions && files.len() > 1 => return Err(strangers(path, (cameras, &files))),
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

/// Tells the pictures their sessions, and whether there are any: the stars in a part of the patterns' folders stand for
/// different texts in the pictures of one camera.
fn tell_sessions(files: &mut [Files]) -> bool {
    let count = |picture: &Picture| picture.starred.folders.len();
    let most = files.iter().flatten().map(count).max().unwrap_or_default();
    let differs = |part: usize| {
        let of_camera = |all: &Files| {
            let texts: BTreeSet<_> = all.iter().map(|it| it.starred.folders.get(part)).collect();
            texts.len() > 1
        };
        files.iter().any(of_camera)
    };
    let telling: Vec<usize> = (0..most).filter(|part| differs(*part)).collect();
    for picture in files.iter_mut().flatten() {
        let texts = telling.iter().filter_map(|part| picture.starred.folders.get(*part));
        let texts: Vec<&str> = texts.map(String::as_str).filter(|text| !text.is_empty()).collect();
        picture.session = texts.join("/");
    }
    !telling.is_empty()
}

/// Refuses two pictures of one camera that nothing but the ending tells apart.
fn refuse_doubles(path: &Path, (cameras, files): (&[String], &[Files])) -> Result<()> {
    for (camera, own) in cameras.iter().zip(files) {
        let mut known: BTreeMap<String, &Picture> = BTreeMap::new();
        for picture in own.iter().filter(|picture| is_picture(&picture.file)) {
            if let Some(other) = known.insert(picture.label(), picture) {
                return Err(refuse(
                    path,
                    format!(
                        "camera `{camera}` has two pictures of view `{}`: `{}` and `{}`",
                        picture.label(),
                        other.file.display(),
                        picture.file.display()
                    ),
                    "move one of them elsewhere, or give a pattern that names only one, such as `left/*.png`",
                ));
            }
        }
    }
    Ok(())
}

/// By the names of views that are given: `mon/0`, or the name of the file alone where that is no other session's.
fn by_views(path: &Path, files: &[Files], names: &[String]) -> Result<Vec<Pictures>> {
    let mut found = vec![vec![None; names.len()]; files.len()];
    let mut taken: BTreeMap<&Path, &str> = BTreeMap::new();
    for (view, name) in names.iter().enumerate() {
        let those = |fits: &dyn Fn(&Picture) -> bool| -> Vec<(usize, &Picture)> {
            let all = files.iter().enumerate();
            all.flat_map(|(camera, own)| own.iter().map(move |picture| (camera, picture)))
                .filter(|(_, picture)| fits(picture))
                .collect()
        };
        let mut fitting = those(&|picture| picture.is_called(name));
        if fitting.is_empty() {
            fitting = those(&|picture| stem(&picture.file) == *name);
        }
        if fitting.is_empty() {
            return Err(refuse(
                path,
                format!("no camera has a picture of view `{name}`"),
                "name its pictures like the view, or remove its [[views]] entry",
            ));
        }
        let is_unclear = |two: &&[(usize, &Picture)]| {
            two[0].0 == two[1].0 || two[0].1.session != two[1].1.session
        };
        if let Some([(_, first), (_, other)]) = fitting.windows(2).find(is_unclear) {
            let files = format!("`{}` and `{}`", first.file.display(), other.file.display());
            let way = format!("write `{}` or `{}`", first.label(), other.label());
            return Err(refuse(path, format!("view `{name}` fits {files}"), &way));
        }
        for (camera, picture) in fitting {
            if let Some(other) = taken.insert(&picture.file, name) {
                let problem =
                    format!("views `{other}` and `{name}` both fit `{}`", picture.file.display());
                return Err(refuse(path, problem, "remove one of these [[views]] entries"));
            }
            found[camera][view] = Some(picture.file.clone());
        }
    }
    let mut all = files.iter().flatten();
    let Some(lonely) = all.find(|picture| !taken.contains_key(&*picture.file)) else {
        return Ok(found);
    };
    let hint = format!(
        "give one named `{}`, or a pattern of pictures that does not fit this one",
        lonely.label()
    );
    Err(refuse(path, format!("`{}` has no [[views]] entry", lonely.file.display()), &hint))
}

/// Refuses pictures of several sessions that have no names in common.
fn strangers(path: &Path, (cameras, files): (&[String], &[Files])) -> Error {
    let first = |(camera, all): (&String, &Files)| {
        Some(format!("`{camera}` has `{}`", all.first()?.label()))
    };
    let list: Vec<String> = cameras.iter().zip(files).filter_map(first).collect();
    refuse(
        path,
        format!(
            "fewer than half of the views have pictures of several cameras: {}",
            list.join(", ")
        ),
        "what the stars of the patterns stand for tells which pictures belong together: name folders and files of one view alike, or give patterns with one folder a camera",
    )
}

/// Whether nothing in the names of these pictures, of cameras and views, tells which belong together.
pub(super) fn is_by_order(files: &[Vec<PathBuf>], views: &[&str]) -> bool {
    let named = |picture: &PathBuf| views.contains(&&*stem(picture));
    // Where there are sessions, order tells nothing.
    let in_one_folder =
        |all: &Vec<PathBuf>| all.windows(2).all(|pair| pair[0].parent() == pair[1].parent());
    let plain = |all: &Vec<PathBuf>| -> Files {
        all.iter().map(|file| Picture::new(file.clone(), Starred::default())).collect()
    };
    let pictures: Vec<Files> = files.iter().map(plain).collect();
    files.len() > 1
        && files.iter().all(in_one_folder)
        && !files.iter().flatten().all(named)
        && !KEYS.into_iter().any(|key| tells(&pictures, key))
}

/// What of a picture's name may say which view it shows.
type Key = fn(&Picture) -> String;

const KEYS: [Key; 3] = [Picture::label, last_number, first_number];

/// A picture's file name without its extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn last_number(picture: &Picture) -> String {
    let name = picture.name();
    let mut numbers = name.split(|c: char| !c.is_ascii_digit());
    picture.of_session(numbers.rfind(|run| !run.is_empty()).unwrap_or(""))
}

fn first_number(picture: &Picture) -> String {
    let name = picture.name();
    let mut numbers = name.split(|c: char| !c.is_ascii_digit());
    picture.of_session(numbers.find(|run| !run.is_empty()).unwrap_or(""))
}

/// Whether keys pair pictures: each camera has each once at most, and half of them or more are those of
/// several cameras.
fn tells(files: &[Files], key: Key) -> bool {
    let mut cameras: BTreeMap<String, usize> = BTreeMap::new();
    for pictures in files {
        let own: BTreeSet<String> = pictures.iter().map(key).collect();
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
    let mut keys: Vec<String> = leader.into_iter().flatten().map(key).collect();
    for new in files.iter().flatten().map(key) {
        if !keys.contains(&new) {
            let place = keys.iter().position(|other| (other.len(), other) > (new.len(), &new));
            keys.insert(place.unwrap_or(keys.len()), new);
        }
    }
    let first = |key_of_view: &String| {
        let picture = files.iter().flatten().find(|picture| key(picture) == *key_of_view);
        picture.map(Picture::label).unwrap_or_default()
    };
    let names = keys.iter().map(first).collect();
    let of_camera = |all: &Files| {
        let of = |wanted: &String| all.iter().find(|picture| key(picture) == *wanted);
        keys.iter().map(|key| of(key).map(|picture| picture.file.clone())).collect()
    };
    (files.iter().map(of_camera).collect(), names)
}

/// In sorted order; views have the names of the first camera's pictures.
fn in_order(
    path: &Path,
    (cameras, files): (&[String], Vec<Files>),
) -> Result<(Vec<Pictures>, Vec<String>)> {
    let in_files = |all: Files| all.into_iter().map(|picture| picture.file).collect::<Vec<_>>();
    let names: Vec<String> = files.iter().take(1).flatten().map(Picture::label).collect();
    if files.iter().any(|all| all.len() != names.len()) {
        let counts = cameras.iter().zip(&files);
        let list: Vec<String> =
            counts.map(|(name, all)| format!("`{name}` has {}", all.len())).collect();
        let found: Vec<Vec<PathBuf>> = files.into_iter().map(in_files).collect();
        let passed_over = passed_over::told(&passed_over::beside(&found));
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
    let in_views = |all: Files| in_files(all).into_iter().map(Some).collect();
    Ok((files.into_iter().map(in_views).collect(), names))
}
