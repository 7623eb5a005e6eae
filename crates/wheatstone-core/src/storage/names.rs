//! Names of files that are made of names of other things.

use std::fmt::Write;

/// Names that mean devices on Windows, whatever their extension.
const RESERVED: [&str; 6] = ["con", "prn", "aux", "nul", "com", "lpt"];

/// Bytes of a name at most: half of what file systems take, so that others can be joined with it.
const LONGEST: usize = 120;

/// A name for a file that no folder, device or hidden file has, on any system: letters, digits, `-`, `_`, `.` and spaces
/// stay, all else is written as `%` and two digits a byte. Different names stay different, but for capitals where the
/// system does not tell them apart, and for what differs after 120 bytes.
#[must_use]
pub fn file_name(name: &str) -> String {
    let mut plain = String::new();
    let last = name.chars().count().saturating_sub(1);
    for (place, letter) in name.chars().enumerate() {
        let inside = place > 0 && place < last;
        let stays = letter.is_alphanumeric()
            || "-_".contains(letter)
            // Windows takes these away at the end; at the beginning they hide a file or lead up.
            || (". ".contains(letter) && inside);
        if plain.len() + 4 > LONGEST {
            break;
        }
        if stays {
            plain.push(letter);
        } else {
            let mut bytes = [0; 4];
            for byte in letter.encode_utf8(&mut bytes).bytes() {
                let _ = write!(plain, "%{byte:02x}");
            }
        }
    }
    let stem = plain.split('.').next().unwrap_or("").to_ascii_lowercase();
    let stem = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    if plain.is_empty() || RESERVED.contains(&stem) {
        plain.insert(0, '_');
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::file_name;
    use std::path::{Component, Path};

    #[test]
    fn usual_names_stay() {
        for name in ["left", "cam-1", "050", "007.500", "vue gauche", "Ansicht_ü", "左"] {
            assert_eq!(file_name(name), name);
        }
    }

    #[test]
    fn hostile_names_are_one_plain_part_of_a_path() {
        let hostile = [
            "",
            ".",
            "..",
            "/",
            "../victim/rel",
            "/../../x",
            "a/b",
            "a\\b",
            "C:\\x",
            "\0",
            "a\nb",
            "~",
            "-",
            "CON",
            "con.png",
            "Com1",
            "lpt9.txt",
            "nul",
            "a.",
            "a ",
            " a",
            ".hidden",
            "a:b",
            "a*?<>|\"",
            "%2e%2e",
            "\u{202e}x",
        ];
        let long = "ä/".repeat(400);
        let mut seen = std::collections::BTreeSet::new();
        for name in hostile.into_iter().chain([&*long]) {
            let plain = file_name(name);
            let parts: Vec<_> = Path::new(&plain).components().collect();
            assert!(matches!(parts[..], [Component::Normal(_)]), "{name:?}: {plain:?}");
            assert!(plain.len() < 130 && !plain.starts_with('.'), "{name:?}: {plain:?}");
            assert!(plain.chars().all(|c| c.is_alphanumeric() || "-_.% ".contains(c)), "{plain:?}");
            assert!(seen.insert(plain.to_lowercase()), "{name:?} is taken for another");
        }
        assert_eq!(file_name("../x"), "%2e.%2fx");
        assert_eq!(file_name("CON"), "_CON");
    }
}
