//! Points by column, as Parquet has them.

/// One column; `None` where a cell is empty.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Numbers.
    Numbers(Vec<Option<f64>>),
    /// Whole numbers.
    Integers(Vec<Option<i64>>),
    /// Words.
    Texts(Vec<Option<String>>),
}

impl Column {
    /// Its rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Integers(values) => values.len(),
            Self::Texts(values) => values.len(),
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
        match self {
            Self::Numbers(values) => Ok(values[row].filter(|value| !value.is_nan())),
            Self::Integers(values) => Ok(values[row].map(|value| value as f64)),
            Self::Texts(values) => match values[row].as_deref() {
                None | Some("") => Ok(None),
                Some(text) => text.trim().parse().map(Some).map_err(|_| text),
            },
        }
    }

    /// A cell as a table of text has it; empty for nothing.
    #[must_use]
    pub fn text(&self, row: usize) -> String {
        match self {
            Self::Numbers(values) => {
                values[row].filter(|v| !v.is_nan()).map(|v| v.to_string()).unwrap_or_default()
            }
            Self::Integers(values) => values[row].map(|v| v.to_string()).unwrap_or_default(),
            Self::Texts(values) => values[row].clone().unwrap_or_default(),
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

    /// Puts the rows of others, of the same names and kinds, below.
    pub(super) fn extend(&mut self, below: Self) {
        if self.columns.is_empty() {
            *self = below;
            return;
        }
        for ((_, own), (_, more)) in self.columns.iter_mut().zip(below.columns) {
            match (own, more) {
                (Column::Numbers(own), Column::Numbers(more)) => own.extend(more),
                (Column::Integers(own), Column::Integers(more)) => own.extend(more),
                (Column::Texts(own), Column::Texts(more)) => own.extend(more),
                _ => {}
            }
        }
    }
}
