//! The part of YAML that calibration files are written in, which JSON and Python literals are parts of as
//! well.
//!
//! Blocks by indentation, flow collections over any number of lines, quoted and plain scalars, comments,
//! directives and tags are read; anchors, aliases, block scalars and scalars over several lines are
//! refused. Depth and size are limited, so that a damaged file costs no more than a good one.

use super::{
    InputFile,
    tree::{Node, Value},
};
use wheatstone_core::{Error, Result};

/// Calibrations nest four deep; the stack bears far more than this.
const MOST_DEPTH: usize = 32;

/// A camera takes some hundreds of nodes.
const MOST_NODES: usize = 1 << 20;

const HINT: &str = "is this the file that you meant?";

/// Reads a text.
pub(super) fn parse(file: &InputFile) -> Result<Node> {
    let text = file.text()?;
    let mut reader = Reader { file, text, at: 0, line: 1, start: 0, depth: 0, nodes: 0 };
    reader.skip_heading();
    let node = reader.block(0)?;
    reader.skip_blank();
    if reader.rest().starts_with("...") || reader.rest().is_empty() {
        return Ok(node);
    }
    Err(reader.error("something else begins here, where the text should end"))
}

/// A walk over a text.
struct Reader<'a> {
    file: &'a InputFile,
    text: &'a str,
    at: usize,
    line: u64,
    /// Where the line begins.
    start: usize,
    depth: usize,
    nodes: usize,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn column(&self) -> usize {
        self.at - self.start
    }

    fn error(&self, problem: &str) -> Error {
        self.file.error(self.line, problem.into(), HINT)
    }

    fn node(&mut self, line: u64, value: Value) -> Result<Node> {
        self.nodes += 1;
        if self.nodes > MOST_NODES {
            return Err(self.error("there is more here than a calibration takes"));
        }
        Ok(Node { line, value })
    }

    /// Steps over one character of ASCII.
    fn step(&mut self) {
        if self.peek() == Some(b'\n') {
            self.line += 1;
            self.start = self.at + 1;
        }
        self.at += 1;
    }

    fn skip_line(&mut self) {
        self.at += self.rest().find('\n').unwrap_or(self.rest().len());
    }

    fn skip_spaces(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\r')) {
            self.at += 1;
        }
    }

    /// To the next thing that is neither space nor comment.
    fn skip_blank(&mut self) {
        loop {
            self.skip_spaces();
            match self.peek() {
                Some(b'\n') => self.step(),
                Some(b'#') => self.skip_line(),
                _ => break,
            }
        }
    }

    /// Byte order mark, directives and the mark of a document's beginning.
    fn skip_heading(&mut self) {
        if self.rest().starts_with('\u{feff}') {
            self.at += '\u{feff}'.len_utf8();
            self.start = self.at;
        }
        loop {
            self.skip_blank();
            if self.rest().starts_with('%') || self.rest().starts_with("---") {
                self.skip_line();
            } else {
                break;
            }
        }
    }

    /// `!!opencv-matrix` and the like say nothing that is not known.
    fn skip_tag(&mut self) {
        self.skip_spaces();
        if self.peek() == Some(b'!') {
            let rest = self.rest();
            self.at += rest.find(|c: char| c.is_whitespace()).unwrap_or(rest.len());
            self.skip_spaces();
        }
    }

    fn descend<T>(&mut self, read: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.depth == MOST_DEPTH {
            return Err(self.error("nested deeper than any calibration"));
        }
        self.depth += 1;
        let read = read(self);
        self.depth -= 1;
        read
    }

    fn at_dash(&self) -> bool {
        let mut bytes = self.rest().bytes();
        bytes.next() == Some(b'-')
            && matches!(bytes.next(), None | Some(b' ' | b'\n' | b'\r' | b'\t'))
    }

    /// Whatever begins at the next column, if that is at least `least`; nothing otherwise.
    fn block(&mut self, least: usize) -> Result<Node> {
        self.skip_blank();
        if self.rest().is_empty() || self.column() < least || self.rest().starts_with("...") {
            return self.node(self.line, Value::Scalar(String::new()));
        }
        self.descend(|reader| {
            if reader.at_dash() {
                return reader.block_list();
            }
            if matches!(reader.peek(), Some(b'{' | b'[')) {
                return reader.flow();
            }
            let before = (reader.at, reader.line, reader.start);
            let key = reader.key();
            (reader.at, reader.line, reader.start) = before;
            if key.is_some() { reader.block_map() } else { reader.inline() }
        })
    }

    fn block_list(&mut self) -> Result<Node> {
        let (line, column, mut items) = (self.line, self.column(), Vec::new());
        while self.column() == column && self.at_dash() {
            self.step();
            self.skip_tag();
            items.push(self.block(column + 1)?);
            self.skip_blank();
        }
        self.node(line, Value::List(items))
    }

    fn block_map(&mut self) -> Result<Node> {
        let (line, column) = (self.line, self.column());
        let mut entries: Vec<(String, Node)> = Vec::new();
        while !self.rest().is_empty() && self.column() == column && !self.rest().starts_with("...")
        {
            let Some(key) = self.key() else {
                return Err(self.error("a name and a colon should stand here"));
            };
            self.refuse_twice(&entries, &key)?;
            self.skip_tag();
            let value = match self.peek() {
                None | Some(b'\n' | b'#') => {
                    self.skip_blank();
                    // A list may stand as far left as the key that it belongs to.
                    self.block(if self.at_dash() { column } else { column + 1 })?
                }
                Some(b'{' | b'[') => self.descend(Self::flow)?,
                _ => self.inline()?,
            };
            entries.push((key, value));
            self.skip_blank();
        }
        if !self.rest().is_empty() && self.column() > column {
            return Err(self.error("this line is indented further than it can be"));
        }
        self.node(line, Value::Map(entries))
    }

    fn refuse_twice(&self, entries: &[(String, Node)], key: &str) -> Result<()> {
        // Keys are few; a file that has thousands is no calibration.
        const MOST_KEYS: usize = 1000;
        if entries.len() >= MOST_KEYS {
            return Err(self.error("there are more names here than a calibration has"));
        }
        match entries.iter().find(|(name, _)| name == key) {
            Some((_, first)) => {
                Err(self.error(&format!("`{key}` stands in line {} already", first.line)))
            }
            None => Ok(()),
        }
    }

    /// A key with its colon, which goes to the end of neither line nor file without a space after it
    /// unless the key is quoted.
    fn key(&mut self) -> Option<String> {
        if matches!(self.peek(), Some(b'"' | b'\'')) {
            let key = self.quoted().ok()?;
            self.skip_spaces();
            return (self.peek() == Some(b':')).then(|| {
                self.at += 1;
                key
            });
        }
        let line = self.rest().split(['\n', ',', '{', '}', '[', ']']).next().unwrap_or("");
        let ends = |(index, _): &(usize, &str)| {
            matches!(line.as_bytes().get(index + 1), None | Some(b' ' | b'\t' | b'\r'))
        };
        let (colon, _) = line.match_indices(':').find(ends)?;
        if line[..colon].contains(" #") {
            return None;
        }
        self.at += colon + 1;
        Some(line[..colon].trim().to_owned())
    }

    /// A scalar on the rest of a line.
    fn inline(&mut self) -> Result<Node> {
        let line = self.line;
        if matches!(self.peek(), Some(b'"' | b'\'')) {
            let text = self.quoted()?;
            self.skip_spaces();
            if !matches!(self.peek(), None | Some(b'\n' | b'#')) {
                return Err(self.error("something follows the closing quotation mark"));
            }
            return self.node(line, Value::Scalar(text));
        }
        let text = self.rest().split('\n').next().unwrap_or("");
        let text = text.split(" #").next().unwrap_or("");
        self.plain(text)
    }

    fn plain(&mut self, text: &str) -> Result<Node> {
        let line = self.line;
        if text.starts_with(['&', '*', '|', '>', '@', '`']) {
            return Err(self.error("anchors and text over several lines are not understood here"));
        }
        self.at += text.len();
        self.node(line, Value::Scalar(text.trim().to_owned()))
    }

    /// A quoted scalar on one line, its quotation marks stripped.
    fn quoted(&mut self) -> Result<String> {
        let mark = if self.peek() == Some(b'"') { '"' } else { '\'' };
        let mut text = String::new();
        let mut characters = self.rest().char_indices().skip(1).peekable();
        while let Some((index, character)) = characters.next() {
            let next = characters.peek().map(|(_, next)| *next);
            match character {
                '\n' => break,
                '\\' if mark == '"' => {
                    let escaped = match next {
                        Some('n') => '\n',
                        Some('t') => '\t',
                        Some(other @ ('"' | '\\' | '/')) => other,
                        _ => return Err(self.error("this escape is not understood")),
                    };
                    text.push(escaped);
                    characters.next();
                }
                '\'' if mark == '\'' && next == Some('\'') => {
                    text.push('\'');
                    characters.next();
                }
                _ if character == mark => {
                    self.at += index + 1;
                    return Ok(text);
                }
                other => text.push(other),
            }
        }
        Err(self.error("a quotation mark is not closed"))
    }

    /// `[…]`, `{…}` or a scalar among them.
    fn flow(&mut self) -> Result<Node> {
        let line = self.line;
        match self.peek() {
            Some(b'[') => {
                let mut items = Vec::new();
                self.members(b']', |reader| {
                    items.push(reader.descend(Self::flow)?);
                    Ok(())
                })?;
                self.node(line, Value::List(items))
            }
            Some(b'{') => {
                let mut entries: Vec<(String, Node)> = Vec::new();
                self.members(b'}', |reader| {
                    let Some(key) = reader.key() else {
                        return Err(reader.error("a name and a colon should stand here"));
                    };
                    reader.refuse_twice(&entries, &key)?;
                    reader.skip_blank();
                    entries.push((key, reader.descend(Self::flow)?));
                    Ok(())
                })?;
                self.node(line, Value::Map(entries))
            }
            // Python's bytes.
            Some(b'b') if self.rest().starts_with("b'") || self.rest().starts_with("b\"") => {
                self.at += 1;
                self.flow()
            }
            Some(b'"' | b'\'') => {
                let text = self.quoted()?;
                self.node(line, Value::Scalar(text))
            }
            _ => {
                let text = self.rest().split([',', ']', '}', '\n', '#']).next().unwrap_or("");
                if text.trim().is_empty() {
                    return Err(self.error("a value should stand here"));
                }
                self.plain(text)
            }
        }
    }

    /// The members of a flow collection, separated by commas; one more comma may end it.
    fn members(&mut self, end: u8, mut member: impl FnMut(&mut Self) -> Result<()>) -> Result<()> {
        self.step();
        loop {
            self.skip_blank();
            if self.peek() == Some(end) {
                self.step();
                return Ok(());
            }
            member(self)?;
            self.skip_blank();
            match self.peek() {
                Some(b',') => self.step(),
                Some(other) if other == end => {}
                _ => return Err(self.error("a comma or a closing bracket should stand here")),
            }
        }
    }
}
