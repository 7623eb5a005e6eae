//! Plain columns of pixels in.

use super::{LocatedBatch, Locator};
use crate::{Error, Result, geometry::PixelColumns};
use wheatstone_numeric::progress::Progress;

impl Locator<'_> {
    /// Locates the points of plain columns: x and y of the first camera, x and y of the second, and so on,
    /// in pixels, one row a point. NaN stands where a camera did not see a point. Runs in parallel, and
    /// tells `progress` every 2^16 points, where it may also be stopped.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] where there are not two columns for each camera, [`Error::Setting`] where they
    /// differ in length, [`Error::Cancelled`].
    pub fn locate_columns(
        &mut self,
        columns: &[&[f64]],
        progress: &dyn Progress,
    ) -> Result<LocatedBatch> {
        const PART: usize = 1 << 16;
        let pixels = self.paired(columns)?;
        let (mut batch, mut part) = (LocatedBatch::default(), LocatedBatch::default());
        let count = pixels.points();
        let mut done = 0;
        while done < count {
            progress.check()?;
            let end = count.min(done + PART);
            self.locate_into(&pixels.part(done..end), &mut part);
            batch.append(&part);
            done = end;
            progress.report("locating", done as u64, count as u64);
        }
        Ok(batch)
    }

    /// The columns, camera by camera.
    fn paired<'c>(&self, columns: &[&'c [f64]]) -> Result<PixelColumns<'c>> {
        let need = 2 * self.map.reconstructor.cameras();
        if columns.len() != need {
            return Err(Error::Mismatch {
                what: "number of pixel columns",
                model: need.to_string(),
                data: columns.len().to_string(),
            });
        }
        let count = columns.first().map_or(0, |column| column.len());
        if let Some(other) = columns.iter().find(|column| column.len() != count) {
            return Err(Error::Setting {
                setting: "the length of a pixel column".into(),
                value: other.len().to_string(),
                need: format!("columns of one length; the first has {count} rows"),
            });
        }
        let pairs = columns.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
        Ok(PixelColumns::new(pairs.collect()))
    }
}
