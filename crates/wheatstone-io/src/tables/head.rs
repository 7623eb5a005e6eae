//! What stands above the first row of a table of text.

use super::cells;
use wheatstone_core::unit;

/// What the lines before the first row say.
pub(super) struct Head {
    pub(super) delimiter: u8,
    pub(super) unit: Option<String>,
    /// The columns that the last comment before the first row may name, as NumPy writes a header.
    pub(super) comment: Option<Vec<String>>,
    /// Whether the first line is `sep=;`, by which Excel is told what separates cells.
    pub(super) has_separator: bool,
    /// Bytes of these lines.
    pub(super) bytes: usize,
}

impl Head {
    pub(super) fn of(first: &[u8]) -> Self {
        let mut head =
            Self { delimiter: b',', unit: None, comment: None, has_separator: false, bytes: 0 };
        let (mut last, mut is_found) = (None, false);
        for line in split(first) {
            let text = without_end(line);
            if let (0, Some(told)) = (head.bytes, separator(text)) {
                (head.delimiter, head.has_separator) = (told, true);
            } else if is_aside(text) {
                // Those behind the header say the unit as well.
                head.unit = said_unit(text).or(head.unit);
                last = comment_text(text).filter(|_| !is_found).or(last);
            } else if is_found {
                break;
            } else {
                is_found = true;
                head.delimiter = if head.has_separator { head.delimiter } else { delimiter(text) };
            }
            head.bytes += line.len();
        }
        head.comment = last.map(|text| {
            let cells = text.split(char::from(head.delimiter));
            cells.map(|cell| cell.trim().to_owned()).collect()
        });
        head
    }

    /// Whether the first row is among these lines.
    pub(super) fn is_whole(lines: &[u8]) -> bool {
        let mut lines = split(lines).map(without_end).enumerate();
        lines.any(|(index, line)| !is_aside(line) && (index > 0 || separator(line).is_none()))
    }
}

/// Lines with their ends, whatever those are.
pub(super) fn split(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split_inclusive(|byte| matches!(byte, b'\n' | b'\r'))
}

fn without_end(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\n").or_else(|| line.strip_suffix(b"\r")).unwrap_or(line)
}

/// Whether a line is empty or a comment.
fn is_aside(line: &[u8]) -> bool {
    line.is_empty() || line[0] == b'#'
}

fn comment_text(line: &[u8]) -> Option<String> {
    let text = line.strip_prefix(b"#")?;
    Some(String::from_utf8_lossy(text).trim_matches(['#', ' ', '\t']).to_owned())
}

/// The unit that a comment says: `# unit: cm`.
pub(super) fn said_unit(line: &[u8]) -> Option<String> {
    let text = comment_text(without_end(line))?;
    let (key, value) = text.split_once([':', '='])?;
    let key = key.trim().to_lowercase();
    (key == "unit" || key == "units").then(|| unit::canonical(value).to_owned())
}

/// What `sep=;` says.
fn separator(line: &[u8]) -> Option<u8> {
    match line {
        [b's' | b'S', b'e' | b'E', b'p' | b'P', b'=', told @ (b';' | b',' | b'\t' | b'|')] => {
            Some(*told)
        }
        _ => None,
    }
}

/// The character that separates the cells of a line.
fn delimiter(line: &[u8]) -> u8 {
    let count = |wanted: u8| line.iter().filter(|byte| **byte == wanted).count();
    // Between semicolons or tabs commas may be decimal ones.
    let text = String::from_utf8_lossy(line);
    let numbers = |delimiter: u8| {
        let mut cells = text.split(char::from(delimiter));
        count(delimiter) > 0 && cells.all(|cell| cells::number(cell.trim(), true).is_ok())
    };
    let surely = [b';', b'\t'].into_iter().find(|delimiter| numbers(*delimiter));
    surely.unwrap_or_else(|| {
        let most = [b';', b'\t', b','].into_iter().max_by_key(|delimiter| count(*delimiter));
        most.unwrap_or(b',')
    })
}
