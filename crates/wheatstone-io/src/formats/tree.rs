//! Maps, lists and scalars with their lines, as files of several kinds hold them.

use super::InputFile;
use wheatstone_core::{
    Result,
    error::{Hint, Remedy},
};

/// A value and the line on which it begins; 0 where that is not known.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) line: u64,
    pub(super) value: Value,
}

/// What a node is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Scalar(String),
    List(Vec<Node>),
    Map(Vec<(String, Node)>),
}

const HINT: &str = "is this the file that you meant?";

impl Node {
    /// The value of a key of a map.
    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        let Value::Map(entries) = &self.value else { return None };
        entries.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// The value of the first of several keys that there is.
    pub(super) fn any(&self, keys: &[String]) -> Option<&Self> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// The value of a key that must be there.
    pub(super) fn need(&self, key: &str, file: &InputFile) -> Result<&Self> {
        self.get(key).ok_or_else(|| {
            file.error(
                self.line,
                format!("the key `{key}` is missing"),
                Hint::new("give it, or choose another format", Remedy::SourceFormat),
            )
        })
    }

    /// The text of a scalar.
    pub(super) fn text(&self) -> Option<&str> {
        match &self.value {
            Value::Scalar(text) => Some(text),
            _ => None,
        }
    }

    /// A finite number.
    pub(super) fn number(&self, file: &InputFile) -> Result<f64> {
        let Some(text) = self.text() else {
            return Err(file.error(self.line, "expected a number".into(), HINT));
        };
        super::text::finite(text, file, self.line)
    }

    /// All numbers of a list, of lists of lists row by row, or the one number.
    pub(super) fn numbers(&self, file: &InputFile) -> Result<Vec<f64>> {
        match &self.value {
            Value::List(items) => {
                let mut all = Vec::with_capacity(items.len());
                for item in items {
                    all.extend(item.numbers(file)?);
                }
                Ok(all)
            }
            _ => Ok(vec![self.number(file)?]),
        }
    }

    /// As many numbers as there must be.
    pub(super) fn exactly<const N: usize>(&self, file: &InputFile) -> Result<[f64; N]> {
        let found = self.numbers(file)?;
        let count = found.len();
        found.try_into().map_err(|_| {
            file.error(self.line, format!("expected {N} numbers, found {count}"), HINT)
        })
    }
}
