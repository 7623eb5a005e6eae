//! From pixels and targets to what a network takes and gives, and back.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Maps a range of values to 0..1 and back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Scale {
    pub(super) fn to_unit(self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    pub(super) fn restore(self, value: f64) -> f64 {
        self.low + value * (self.high - self.low)
    }

    pub(super) fn is_sound(self) -> bool {
        self.high > self.low && (self.high - self.low).is_finite()
    }
}

/// How `(column of values) -> scale` is chosen.
pub(super) type Scaling = fn(&[f64]) -> Scale;

/// A scale a column; refuses columns that are all equal.
pub(super) fn scales(rows: &[Vec<f64>], what: &[&str], scaling: Scaling) -> Result<Vec<Scale>> {
    let of = |column: usize| {
        let values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        let scale = scaling(&values);
        if scale.is_sound() {
            return Ok(scale);
        }
        Err(Error::Degenerate {
            problem: format!("{} is the same for all points", what[column % what.len()]),
            hint: "points must differ in every coordinate".into(),
        })
    };
    (0..rows.first().map_or(0, Vec::len)).map(of).collect()
}

pub(super) fn scaled(rows: &[Vec<f64>], scales: &[Scale]) -> Vec<Vec<f64>> {
    let row = |row: &Vec<f64>| {
        row.iter().zip(scales).map(|(value, scale)| scale.to_unit(*value)).collect()
    };
    rows.iter().map(row).collect()
}
