//! What the stars of a pattern stand for in the files that it names.

use regex_lite::Regex;
use std::path::{Component, Path};

/// What the stars stand for in a file's name and in those of its folders.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Starred {
    /// A text for each part of the pattern's folders that has stars.
    pub(super) folders: Vec<String>,
    /// Text in the file's name without its extension; none where that part of the pattern has no star.
    pub(super) file: Option<String>,
}

/// What the stars of a pattern stand for in a file of a folder.
pub(super) fn starred(folder: &Path, pattern: &str, file: &Path) -> Starred {
    let pattern = Path::new(pattern);
    let before = if pattern.is_absolute() { 0 } else { parts(folder).len() };
    let (pattern, file) = (parts(pattern), parts(file));
    let (Some((last, folders)), Some((name, within))) =
        (pattern.split_last(), file.get(before..).and_then(<[String]>::split_last))
    else {
        return Starred::default();
    };
    let stem = |text: &str| {
        let dot = text.rfind('.').filter(|at| *at > 0);
        text[..dot.unwrap_or(text.len())].to_owned()
    };
    // `*` alone stands for the extension, too.
    let text = has_stars(last).then(|| in_part(last, name)).flatten();
    let is_whole = !last.contains('.');
    let file = text.map(|text| if is_whole { stem(&text) } else { text });
    Starred { folders: in_folders(folders, within).unwrap_or_default(), file }
}

fn parts(path: &Path) -> Vec<String> {
    let named = path.components().filter(|part| *part != Component::CurDir);
    named.map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
}

fn has_stars(part: &str) -> bool {
    part.contains(['*', '?', '['])
}

fn in_folders(pattern: &[String], folders: &[String]) -> Option<Vec<String>> {
    let Some((first, rest)) = pattern.split_first() else {
        return folders.is_empty().then(Vec::new);
    };
    let after = |text: String, rest: &[String], folders: &[String]| {
        let mut all = vec![text];
        all.extend(in_folders(rest, folders)?);
        Some(all)
    };
    if first == "**" {
        // Two in a row stand for what one does.
        let rest = if rest.first() == Some(first) { &rest[1..] } else { rest };
        let mut counts = 0..=folders.len();
        return counts.find_map(|count| after(folders[..count].join("/"), rest, &folders[count..]));
    }
    let (folder, others) = folders.split_first()?;
    if has_stars(first) {
        return after(in_part(first, folder)?, rest, others);
    }
    (first == folder).then(|| in_folders(rest, others)).flatten()
}

/// What the stars of a part of a pattern stand for in a name, with `/` between what does not touch. Each star stands for as
/// little as it can.
fn in_part(part: &str, name: &str) -> Option<String> {
    let found = Regex::new(&expression(part)?).ok()?.captures(name)?;
    let texts = found.iter().skip(1).flatten().map(|text| text.as_str());
    Some(texts.filter(|text| !text.is_empty()).collect::<Vec<_>>().join("/"))
}

/// A part of a pattern as a regular expression, with a group for stars that touch.
fn expression(part: &str) -> Option<String> {
    let (mut text, mut rest, mut in_group) = (String::from("^"), part, false);
    while let Some(letter) = rest.chars().next() {
        // The first letter between brackets may be a bracket itself.
        let first = if rest.starts_with("[!") { 3 } else { 2 };
        let end = match letter {
            '[' => first + rest.get(first..)?.find(']')? + 1,
            _ => letter.len_utf8(),
        };
        let (own, after) = rest.split_at(end);
        if has_stars(own) != in_group {
            text.push(if in_group { ')' } else { '(' });
            in_group = !in_group;
        }
        text += &match letter {
            '*' => ".*?".to_owned(),
            '?' => ".".to_owned(),
            '[' => class(&own[1..end - 1]),
            _ => regex_lite::escape(own),
        };
        rest = after;
    }
    Some(text + if in_group { ")$" } else { "$" })
}

/// The letters that brackets allow.
fn class(letters: &str) -> String {
    let (not, letters) = letters.strip_prefix('!').map_or(("", letters), |rest| ("^", rest));
    let meant = |letter: char| match letter {
        '-' => "-".to_owned(),
        letter => format!("\\x{{{:X}}}", u32::from(letter)),
    };
    format!("[{not}{}]", letters.chars().map(meant).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_what_is_between_the_letters_of_the_pattern() {
        for (pattern, file, folders, name) in [
            ("left/*.png", "left/0.png", &[][..], Some("0")),
            ("left/*", "left/a.b.png", &[], Some("a.b")),
            ("*/left/*.png", "mon/left/0.png", &["mon"], Some("0")),
            ("day*_run*/l_*.png", "day1_run12/l_07.png", &["1/12"], Some("07")),
            ("**/left/*.png", "left/0.png", &[""], Some("0")),
            ("**/left/*.png", "a/left/left/0.png", &["a/left"], Some("0")),
            ("./*/left.png", "v1/left.png", &["v1"], None),
            ("s[0-9]?/[[]x.png", "s12/[x.png", &["12"], Some("[")),
            ("*aab/*ab.png", "aaab/aab.png", &["a"], Some("a")),
        ] {
            let file = Path::new("in/[a]").join(file);
            let found = starred(Path::new("./in/[a]"), pattern, &file);
            assert_eq!(found.folders, folders, "{pattern}");
            assert_eq!(found.file.as_deref(), name, "{pattern}");
        }
    }
}
