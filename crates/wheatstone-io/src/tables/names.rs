//! What the columns of users' tables are called: our own names, usual ones, and those that a user tells.

use std::collections::BTreeMap;
use wheatstone_core::{Error, Result, unit};

/// What a user tells of the columns of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ColumnNames {
    /// Names for columns that the table calls otherwise: ours, the table's.
    Renamed(Vec<(String, String)>),
    /// The name of each column in turn, of a table without a header too; `_` for one that is passed over.
    InOrder(Vec<String>),
}

impl ColumnNames {
    /// From `x1=u_left,y1=v_left,…`, or `x1,y1,x2,y2,_,X,Y,Z` for all columns in order.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] where a name is none of ours, or both forms are mixed.
    pub fn parse(text: &str) -> Result<Self> {
        let refuse = |value: &str, need: &str| Error::Setting {
            setting: "columns".into(),
            value: format!("`{value}`"),
            need: need.into(),
        };
        let known = |name: &str| {
            let ours = camera_column(name).is_some()
                || ["X", "Y", "Z", "board_x", "board_y", "view", "id"].contains(&name);
            let need = "names such as x1, y1, x2, y2, X, Y, Z, board_x, board_y, view, id";
            if ours { Ok(name.to_owned()) } else { Err(refuse(name, need)) }
        };
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        if parts.iter().all(|part| part.contains('=')) {
            let pair = |part: &&str| {
                let (ours, theirs) = part.split_once('=').unwrap_or((part, ""));
                Ok((known(ours.trim())?, theirs.trim().to_owned()))
            };
            return parts.iter().map(pair).collect::<Result<_>>().map(Self::Renamed);
        }
        if parts.iter().any(|part| part.contains('=')) {
            let need =
                "either NAME=COLUMN for each column that is renamed, or the names of all columns";
            return Err(refuse(text, need));
        }
        let name = |part: &&str| if *part == "_" { Ok(String::new()) } else { known(part) };
        parts.iter().map(name).collect::<Result<_>>().map(Self::InOrder)
    }
}

impl std::fmt::Display for ColumnNames {
    /// As it is [parsed](ColumnNames::parse).
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let parts: Vec<String> = match self {
            Self::Renamed(pairs) => {
                pairs.iter().map(|(ours, theirs)| format!("{ours}={theirs}")).collect()
            }
            Self::InOrder(names) => {
                let name = |name: &String| if name.is_empty() { "_".into() } else { name.clone() };
                names.iter().map(name).collect()
            }
        };
        f.write_str(&parts.join(","))
    }
}

/// The camera, as it is counted in the table, and the axis of one of our own names of pixels: `x1`, `y12`.
fn camera_column(name: &str) -> Option<(usize, usize)> {
    let axis = ["x", "y"].iter().position(|letter| name.starts_with(letter))?;
    let digits = name.get(1..).filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))?;
    Some((digits.parse().ok()?, axis))
}

/// Ways to name the pixels of several cameras: which letters, and how cameras are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Family {
    /// Ours before others.
    rank: u8,
    cameras: Cameras,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Cameras {
    Numbers,
    Letters,
    Sides,
}

impl Family {
    /// Whether these are our own names, which go before others.
    pub(super) fn is_ours(self) -> bool {
        self.rank == 0
    }
}

/// The columns of pixels by camera as the table counts them, x and y.
pub(super) type Pixels = BTreeMap<usize, [Option<usize>; 2]>;

/// The columns that may be pixels, by the way in which they are named.
pub(super) fn families(names: &[String]) -> BTreeMap<Family, Pixels> {
    let mut found: BTreeMap<Family, Pixels> = BTreeMap::new();
    for (index, name) in names.iter().enumerate() {
        let own = camera_column(name)
            .map(|(camera, axis)| (Family { rank: 0, cameras: Cameras::Numbers }, camera, axis));
        if let Some((family, camera, axis)) = own.or_else(|| usual(name)) {
            found.entry(family).or_default().entry(camera).or_default()[axis].get_or_insert(index);
        }
    }
    found
}

/// Reads a usual name of pixels: `u1`, `x_1`, `xa`, `x1 [px]`, `left_x`, `cam1_x`.
fn usual(name: &str) -> Option<(Family, usize, usize)> {
    let pixels = |unit: &str| ["px", "pix", "pixel", "pixels"].contains(&unit).then_some("px");
    let mut tokens = tokens(without_unit(name, pixels).0);
    // `xl`, `ub`: a letter for the axis, a letter for the camera.
    if let [one] = &tokens[..]
        && one.len() == 2
        && one.is_ascii()
    {
        tokens = vec![one[..1].to_owned(), one[1..].to_owned()];
    }
    if tokens.len() > 2 {
        tokens.retain(|token| !["cam", "camera", "c", "img", "image"].contains(&token.as_str()));
    }
    let [first, second] = &tokens[..] else { return None };
    let axis = |token: &str| ["x", "y", "u", "v"].iter().position(|letter| *letter == token);
    let (axis, key) = match (axis(first), axis(second)) {
        (Some(axis), _) => (axis, second),
        (None, Some(axis)) => (axis, first),
        (None, None) => return None,
    };
    let (cameras, camera) = match key.as_str() {
        "left" | "l" => (Cameras::Sides, 1),
        "right" | "r" => (Cameras::Sides, 2),
        letter if letter.len() == 1 && ("a"..="h").contains(&letter) => {
            (Cameras::Letters, usize::from(letter.as_bytes()[0] - b'a') + 1)
        }
        number => (Cameras::Numbers, number.parse().ok()?),
    };
    Some((Family { rank: 1 + (axis / 2) as u8, cameras }, camera, axis % 2))
}

/// The columns of three (or two) lengths in the world, or on a board, and the units that their names say.
pub(super) fn lengths<const N: usize>(
    names: &[String],
    ours: [&str; N],
) -> ([Option<usize>; N], Vec<&'static str>) {
    let exact = ours.map(|own| names.iter().position(|name| name == own));
    if exact.iter().all(Option::is_some) {
        return (exact, Vec::new());
    }
    let read: Vec<_> = names.iter().map(|name| without_unit(name, known_unit)).collect();
    let usual = ours.map(|own| {
        let own = tokens(own);
        read.iter().position(|(name, _)| length_name(name) == own)
    });
    if usual.iter().any(Option::is_none) {
        return (exact, Vec::new());
    }
    let mut said: Vec<_> = usual.iter().flatten().filter_map(|column| read[*column].1).collect();
    said.dedup();
    (usual, said)
}

/// A name without the unit of length that it may end in.
pub(super) fn without_length_unit(name: &str) -> &str {
    without_unit(name, known_unit).0
}

/// Our name for a column, with the unit of length that the column's own name says; pixels and names have none.
pub(super) fn with_unit_of(column: &str, ours: &str) -> String {
    let is_length = ["X", "Y", "Z", "board_x", "board_y"].contains(&ours);
    match without_unit(column, known_unit).1.filter(|_| is_length) {
        Some(unit) => format!("{ours} [{unit}]"),
        None => ours.to_owned(),
    }
}

fn known_unit(text: &str) -> Option<&'static str> {
    unit::names().find(|name| *name == unit::canonical(text))
}

/// What to say of lengths of which some say a unit and some do not.
pub(super) fn shared_unit(names: &[&str]) -> Option<String> {
    let says = |name: &&str| without_unit(name, known_unit).1;
    let (said, silent): (Vec<&str>, Vec<&str>) =
        names.iter().partition(|name| says(name).is_some());
    let first = said.first().filter(|_| !silent.is_empty())?;
    let silent: Vec<String> = silent.iter().map(|name| format!("`{name}`")).collect();
    Some(format!("{} are taken to be in {}, as `{first}` says", silent.join(", "), says(first)?))
}

/// The parts of a name of a length, without words that say where it is measured.
fn length_name(name: &str) -> Vec<String> {
    let mut parts = tokens(name);
    parts.retain(|part| !["world", "w", "obj", "object"].contains(&part.as_str()));
    if let [one] = &mut parts[..]
        && ["xw", "yw", "zw"].contains(&one.as_str())
    {
        one.truncate(1);
    }
    parts
}

/// A name and the unit behind it, where that is known: `X [mm]`, `X (mm)`, `X_mm`, `X mm`, `X in mm`.
fn without_unit(
    name: &str,
    known: impl Fn(&str) -> Option<&'static str>,
) -> (&str, Option<&'static str>) {
    let name = name.trim();
    let parts = name.trim_end_matches([']', ')']).rsplit_once(['[', '(', '_', ' ', '/']);
    match parts.and_then(|(name, unit)| Some((name.trim_end(), known(unit)?))) {
        Some((name, unit)) => {
            let before = name.strip_suffix("in").and_then(|name| name.strip_suffix([' ', '_']));
            (before.map_or(name, str::trim_end), Some(unit))
        }
        None => (name, None),
    }
}

/// The words and numbers of a name, in small letters.
fn tokens(name: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut last = None;
    for character in name.chars() {
        let kind = match character {
            _ if character.is_alphabetic() => Some(false),
            _ if character.is_ascii_digit() => Some(true),
            _ => None,
        };
        if kind.is_some() {
            if kind != last {
                tokens.push(String::new());
            }
            if let Some(token) = tokens.last_mut() {
                token.extend(character.to_lowercase());
            }
        }
        last = kind;
    }
    tokens
}
