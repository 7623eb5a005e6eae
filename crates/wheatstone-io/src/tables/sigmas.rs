//! Columns of a table that say how noisy its pixels are.

use super::{cells::malformed, layout::Header, reader::TableReader, rows::Rows};
use wheatstone_core::Result;

/// Columns of a table with the standard deviations of its pixels, one for each camera.
#[derive(Clone, Debug)]
pub struct SigmaColumns {
    columns: Vec<usize>,
}

impl TableReader {
    /// The columns of these names: one for all cameras, or one for each.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`](wheatstone_core::Error::Malformed) where there is no such column, and for another number of them.
    pub fn sigma_columns(&self, names: &[String]) -> Result<SigmaColumns> {
        let own: Vec<String> = self.names().map(str::to_owned).collect();
        let header = Header { path: self.path(), line: None, names: &own };
        let column = |name: &String| {
            let found = own.iter().position(|own| own == name);
            found.ok_or_else(|| header.missing(&[name]))
        };
        let columns: Vec<usize> = names.iter().map(column).collect::<Result<_>>()?;
        match &columns[..] {
            [one] => Ok(SigmaColumns { columns: vec![*one; self.cameras()] }),
            several if several.len() == self.cameras() => Ok(SigmaColumns { columns }),
            several => Err(malformed(
                self.path(),
                None,
                format!(
                    "{} columns are named for the standard deviations of the pixels of {} cameras",
                    several.len(),
                    self.cameras()
                ),
                "name one column for all cameras, or one for each",
            )),
        }
    }
}

impl Rows {
    /// Standard deviations of the pixels, in pixels: a column a camera. Where a table is read leniently, infinity stands
    /// where there is none above 0.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`](wheatstone_core::Error::Malformed) for what is no standard deviation of a pixel that was seen, naming its place.
    pub fn pixel_sigmas(&self, of: &SigmaColumns) -> Result<Vec<Vec<f64>>> {
        let pixels = self.pixels();
        let mut found = Vec::with_capacity(of.columns.len());
        for (column, [x, _]) in of.columns.iter().zip(pixels.cameras()) {
            let mut values = self.numbers(*column)?.values().to_vec();
            for (row, value) in values.iter_mut().enumerate() {
                if *value > 0.0 {
                    continue;
                }
                if !x[row].is_nan() && !self.is_lenient() {
                    return Err(self.no_sigma(*value, row, *column));
                }
                *value = f64::INFINITY;
            }
            found.push(values);
        }
        Ok(found)
    }
}
