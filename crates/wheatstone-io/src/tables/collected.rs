//! Rows of a points file put together to a dataset.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use wheatstone_core::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    error::{Hint, Remedy},
    geometry::Pixel,
    limits,
};

/// What to do with rows that stand in a file twice, to the last digit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Duplicates {
    /// Refuse the file, naming both lines: a copy in the training and the validation part would
    /// make an error look small.
    #[default]
    Refuse,
    /// Keep the first of each.
    Drop,
    /// Keep all: the table only passes through.
    Keep,
}

/// What was read so far.
pub(super) struct Collected {
    path: PathBuf,
    data: Dataset,
    duplicates: Duplicates,
    view_index: BTreeMap<String, usize>,
    lines: BTreeMap<Vec<u64>, u64>,
}

impl Collected {
    pub(super) fn new(path: &Path, unit: &str, cameras: usize, duplicates: Duplicates) -> Self {
        Self {
            path: path.into(),
            data: Dataset {
                unit: unit.into(),
                cameras,
                views: Vec::new(),
                correspondences: Vec::new(),
            },
            duplicates,
            view_index: BTreeMap::new(),
            lines: BTreeMap::new(),
        }
    }

    /// Adds a row that stands in this line.
    pub(super) fn push(
        &mut self,
        mut row: Correspondence,
        view: Option<&str>,
        line: u64,
    ) -> Result<()> {
        let cells = (self.data.correspondences.len() + 1) * 2 * self.data.cameras;
        limits::CELLS.allow(&self.path, cells as u64)?;
        if let Some(name) = view {
            let data = &mut self.data;
            row.view = *self.view_index.entry(name.to_owned()).or_insert_with(|| {
                data.views.push(name.to_owned());
                data.views.len() - 1
            });
            limits::VIEWS.allow(&self.path, self.data.views.len() as u64)?;
        }
        if self.duplicates != Duplicates::Keep
            && let Some(first) = self.lines.insert(fingerprint(&row), line)
        {
            if self.duplicates == Duplicates::Refuse {
                return Err(Error::Malformed {
                    path: self.path.clone(),
                    line: Some(line),
                    problem: format!("the same row is in line {first}"),
                    hint: Hint::new("remove it, or keep the first of each", Remedy::DropDuplicates),
                });
            }
            return Ok(());
        }
        self.data.correspondences.push(row);
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Dataset> {
        if self.data.correspondences.is_empty() {
            return Err(Error::Malformed {
                path: self.path,
                line: None,
                problem: "the table has a header, but no points".into(),
                hint: "give one line per point".into(),
            });
        }
        Ok(self.data)
    }
}

/// Equal for rows that are equal to the last bit.
fn fingerprint(row: &Correspondence) -> Vec<u64> {
    let pixel = |p: &Option<Pixel>| p.map_or([u64::MAX; 2], |p| [p.x.to_bits(), p.y.to_bits()]);
    let mut bits: Vec<u64> = row.pixels.iter().flat_map(pixel).collect();
    bits.extend(row.world.iter().flat_map(|w| w.iter().map(|v| v.to_bits()).collect::<Vec<_>>()));
    bits.extend(row.board.iter().flatten().map(|v| v.to_bits()));
    bits.push(row.view as u64);
    bits
}
