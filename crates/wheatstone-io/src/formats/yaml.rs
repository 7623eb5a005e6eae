//! YAML as calibration files are written in it, of which JSON and Python literals are nearly parts.
//!
//! `saphyr-parser` reads; aliases are refused, and depth and size are limited, so that a damaged file
//! costs no more than a good one.

use super::{
    InputFile,
    tree::{Node, Value},
};
use saphyr_parser::{Event, Parser, ScalarStyle};
use wheatstone_core::{Error, Result};

/// Calibrations nest four deep; the stack bears far more than this.
const MOST_DEPTH: usize = 32;

/// A camera takes some hundreds of nodes.
const MOST_NODES: usize = 1 << 20;

/// Keys of one map are few; a file that has thousands is no calibration.
const MOST_KEYS: usize = 1000;

const HINT: &str = "is this the file that you meant?";

/// Reads a text.
pub(super) fn parse(file: &InputFile) -> Result<Node> {
    let text = file.text()?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let error = |line: usize, problem: &str| file.error(line as u64, problem.into(), HINT);
    if let Some(at) = text.find('\0') {
        return Err(error(text[..at].matches('\n').count() + 1, "not text"));
    }
    // OpenCV's `%YAML:1.0` is no directive of YAML; as a comment it keeps the lines' numbers.
    let text = if text.starts_with("%YAML:") { format!("#{text}") } else { text.into() };
    let mut builder = Builder { file, open: Vec::new(), root: None, nodes: 0 };
    let mut documents = 0;
    for event in Parser::new_from_str(&text) {
        let (event, span) =
            event.map_err(|e| error(e.marker().line(), &format!("not YAML: {}", e.info())))?;
        if matches!(event, Event::DocumentStart(_)) {
            documents += 1;
        }
        if documents > 1 {
            let problem = "unexpected content after the end of the document";
            return Err(error(span.start.line(), problem));
        }
        builder.take(event, span.start.line() as u64)?;
    }
    let empty = || Node { line: 1, value: Value::Scalar(String::new()) };
    Ok(builder.root.unwrap_or_else(empty))
}

/// A map or a list whose end has not come yet, and the key whose value comes next.
struct Open {
    node: Node,
    key: Option<String>,
}

/// What the events so far have made.
struct Builder<'a> {
    file: &'a InputFile,
    open: Vec<Open>,
    root: Option<Node>,
    nodes: usize,
}

impl Builder<'_> {
    fn error(&self, line: u64, problem: &str) -> Error {
        self.file.error(line, problem.into(), HINT)
    }

    fn take(&mut self, event: Event<'_>, line: u64) -> Result<()> {
        match event {
            Event::Scalar(text, style, ..) => {
                let text = if style == ScalarStyle::Plain { unprefixed(&text) } else { &text };
                self.add(Node { line, value: Value::Scalar(text.into()) })
            }
            Event::SequenceStart(..) => self.begin(Node { line, value: Value::List(Vec::new()) }),
            Event::MappingStart(..) => self.begin(Node { line, value: Value::Map(Vec::new()) }),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                Some(ended) => self.add(ended.node),
                None => Ok(()),
            },
            Event::Alias(_) => Err(self.error(line, "references to anchors are not supported")),
            _ => Ok(()),
        }
    }

    fn begin(&mut self, node: Node) -> Result<()> {
        if self.open.len() == MOST_DEPTH {
            return Err(self.error(node.line, "nested too deeply for a calibration"));
        }
        self.open.push(Open { node, key: None });
        Ok(())
    }

    /// Puts a finished node where it belongs: a key, the value of one, a member or the whole.
    fn add(&mut self, node: Node) -> Result<()> {
        self.nodes += 1;
        if self.nodes > MOST_NODES {
            return Err(self.error(node.line, "too large for a calibration"));
        }
        let Some(Open { node: parent, key }) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        match (&mut parent.value, key.take()) {
            (Value::List(items), _) => items.push(node),
            (Value::Map(entries), Some(name)) => entries.push((name, node)),
            (Value::Map(entries), None) => {
                let problem = match node.text() {
                    None => "expected a name before the colon".into(),
                    Some(_) if entries.len() >= MOST_KEYS => {
                        "too many names for a calibration".into()
                    }
                    Some(name) => match entries.iter().find(|(known, _)| known == name) {
                        Some((_, first)) => {
                            format!("`{name}` is in line {} already", first.line)
                        }
                        None => {
                            *key = Some(name.into());
                            return Ok(());
                        }
                    },
                };
                return Err(self.error(node.line, &problem));
            }
            (Value::Scalar(_), _) => {}
        }
        Ok(())
    }
}

/// What stands in the quotation marks of Python's bytes, `b'…'`.
fn unprefixed(text: &str) -> &str {
    let quoted = |mark: char| text.strip_prefix('b')?.strip_prefix(mark)?.strip_suffix(mark);
    quoted('\'').or_else(|| quoted('"')).unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Node> {
        parse(&InputFile { path: "a.yml".into(), bytes: text.as_bytes().into() })
    }

    fn refused(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn directives_tags_and_pythons_literals_are_read() {
        let file =
            "\u{feff}%YAML:1.0\n---\nK: !!opencv-matrix\n   data: [ 1., 2.,\n      3. ]\n...\n";
        let node = read(file).unwrap();
        let data = node.get("K").and_then(|k| k.get("data")).unwrap();
        let file = InputFile { path: "a".into(), bytes: Vec::new() };
        assert_eq!((data.line, data.exactly(&file).unwrap()), (4, [1.0, 2.0, 3.0]));
        let node = read("{\n  'model': b'PINHOLE', # a comment\n  'size': [ 1, 2,]\n}\n").unwrap();
        assert_eq!(node.get("model").and_then(Node::text), Some("PINHOLE"));
    }

    #[test]
    fn what_is_refused_names_its_line() {
        assert_eq!(refused("a: 1\nb: 2\na: 3\n"), "a.yml:3: `a` is in line 1 already");
        assert!(refused("a: &x [1]\nb: *x\n").starts_with("a.yml:2: references"));
        assert!(refused("a: 1\n---\nb: 2\n").starts_with("a.yml:2: unexpected content"));
        assert!(refused("a: 1\nb: [1, 2\n").starts_with("a.yml:3: not YAML"));
        assert!(refused("a: 1\nb: \0\n").starts_with("a.yml:2: not text"));
        assert!(refused(&"[".repeat(40)).contains("nested too deeply"));
    }
}
