//! Points by column, as Parquet has them.

use std::ops::Range;

/// One column, with a cell for each row.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Numbers; NaN stands in cells that hold none.
    Numbers(Cells<f64>),
    /// Whole numbers.
    Integers(Cells<i64>),
    /// Text.
    Texts(Texts),
    /// A few words, again and again.
    Words(Words),
}

/// Values one below the other, and which of the rows hold one.
#[derive(Clone, Debug, Default)]
pub struct Cells<V> {
    values: Vec<V>,
    /// None where all do.
    held: Option<Vec<bool>>,
}

/// Text of many rows in one piece, and which of the rows hold some.
#[derive(Clone, Debug, Default)]
pub struct Texts {
    text: String,
    /// Where each row's text ends.
    ends: Vec<usize>,
    /// None where all do.
    held: Option<Vec<bool>>,
}

/// For each row one of a few words, or nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// The words.
    pub words: &'static [&'static str],
    /// 0 for nothing, 1 for the first word and so on.
    pub places: Vec<u8>,
}

impl<V> Cells<V> {
    /// Of values that are all there.
    #[must_use]
    pub fn whole(values: Vec<V>) -> Self {
        Self { values, held: None }
    }

    /// Of values for all rows, those that are not there included, and whether each is.
    #[must_use]
    pub(super) fn partial(values: Vec<V>, held: Vec<bool>) -> Self {
        debug_assert_eq!(values.len(), held.len());
        let all = held.iter().all(|held| *held);
        Self { values, held: (!all).then_some(held) }
    }

    /// A value for each row, which means nothing where none is held.
    #[must_use]
    pub fn values(&self) -> &[V] {
        &self.values
    }

    /// Whether each row holds a value; `None` where all do.
    #[must_use]
    pub fn held(&self) -> Option<&[bool]> {
        self.held.as_deref()
    }

    /// The cell of a row.
    #[must_use]
    pub fn get(&self, row: usize) -> Option<&V> {
        let held = self.held.as_ref().is_none_or(|held| held[row]);
        held.then(|| &self.values[row])
    }
}

impl Cells<f64> {
    /// Of numbers that stand for nothing where they are not finite.
    #[must_use]
    pub fn finite(values: Vec<f64>) -> Self {
        // Without a way out of the loop, which registers of several numbers can take at once.
        if values.iter().fold(true, |all, value| all & value.is_finite()) {
            return Self::whole(values);
        }
        let held = values.iter().map(|value| value.is_finite()).collect();
        Self { values, held: Some(held) }
    }
}

impl FromIterator<Option<f64>> for Cells<f64> {
    fn from_iter<I: IntoIterator<Item = Option<f64>>>(cells: I) -> Self {
        let (values, held) =
            cells.into_iter().map(|cell| (cell.unwrap_or(f64::NAN), cell.is_some())).unzip();
        Self::partial(values, held)
    }
}

impl<V: PartialEq> PartialEq for Cells<V> {
    fn eq(&self, other: &Self) -> bool {
        self.values.len() == other.values.len()
            && (0..self.values.len()).all(|row| self.get(row) == other.get(row))
    }
}

impl Texts {
    /// Room for so many rows.
    pub(super) fn with_capacity(rows: usize) -> Self {
        Self { text: String::new(), ends: Vec::with_capacity(rows), held: None }
    }

    /// Adds a row.
    pub fn push(&mut self, cell: Option<&str>) {
        if cell.is_none() && self.held.is_none() {
            self.held = Some(vec![true; self.ends.len()]);
        }
        if let Some(held) = &mut self.held {
            held.push(cell.is_some());
        }
        self.text += cell.unwrap_or_default();
        self.ends.push(self.text.len());
    }

    /// The cell of a row.
    #[must_use]
    pub fn get(&self, row: usize) -> Option<&str> {
        let held = self.held.as_ref().is_none_or(|held| held[row]);
        held.then(|| &self.text[self.range(row)])
    }

    /// Where the text of a row stands in the whole.
    pub(super) fn range(&self, row: usize) -> Range<usize> {
        row.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[row]
    }

    pub(super) fn held(&self) -> Option<&[bool]> {
        self.held.as_deref()
    }

    pub(super) fn rows(&self) -> usize {
        self.ends.len()
    }

    /// The text of all rows.
    pub(super) fn whole(&self) -> &str {
        &self.text
    }
}

impl<T: AsRef<str>> FromIterator<Option<T>> for Texts {
    fn from_iter<I: IntoIterator<Item = Option<T>>>(cells: I) -> Self {
        let cells = cells.into_iter();
        let mut texts = Self::with_capacity(cells.size_hint().0);
        cells.for_each(|cell| texts.push(cell.as_ref().map(AsRef::as_ref)));
        texts
    }
}

impl PartialEq for Texts {
    fn eq(&self, other: &Self) -> bool {
        self.rows() == other.rows() && (0..self.rows()).all(|row| self.get(row) == other.get(row))
    }
}

impl Words {
    /// The cell of a row.
    #[must_use]
    pub fn get(&self, row: usize) -> Option<&'static str> {
        usize::from(self.places[row]).checked_sub(1).map(|word| self.words[word])
    }
}

impl Column {
    /// Its rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(cells) => cells.values.len(),
            Self::Integers(cells) => cells.values.len(),
            Self::Texts(texts) => texts.rows(),
            Self::Words(words) => words.places.len(),
        }
    }

    /// Whether it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A cell as a number; the cell itself where it is none.
    ///
    /// # Errors
    ///
    /// The text that is no number.
    pub fn number(&self, row: usize) -> Result<Option<f64>, &str> {
        let text = match self {
            Self::Numbers(cells) => {
                return Ok(cells.get(row).copied().filter(|value| !value.is_nan()));
            }
            Self::Integers(cells) => return Ok(cells.get(row).map(|value| *value as f64)),
            Self::Texts(texts) => texts.get(row),
            Self::Words(words) => words.get(row),
        };
        match text {
            None | Some("") => Ok(None),
            Some(text) => text.trim().parse().map(Some).map_err(|_| text),
        }
    }

    /// A cell as a table of text has it; empty for nothing.
    #[must_use]
    pub fn text(&self, row: usize) -> String {
        match self {
            Self::Numbers(cells) => {
                let cell = cells.get(row).filter(|value| !value.is_nan());
                cell.map(f64::to_string).unwrap_or_default()
            }
            Self::Integers(cells) => cells.get(row).map(i64::to_string).unwrap_or_default(),
            Self::Texts(texts) => texts.get(row).unwrap_or_default().to_owned(),
            Self::Words(words) => words.get(row).unwrap_or_default().to_owned(),
        }
    }
}

/// Columns with their names, all of the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Name and cells.
    pub columns: Vec<(String, Column)>,
}

impl Columns {
    /// Rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.len())
    }
}
