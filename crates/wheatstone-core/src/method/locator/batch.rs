//! Plain columns of pixels in, plain columns of points out.

use super::{super::Located, Locator, Places, located_batch::LOWER};
use crate::{Error, Result, dataset::volume::Trust, geometry::PixelColumns};
use wheatstone_numeric::progress::Progress;

/// Located points, column by column: row `i` of every column belongs to row `i` of the pixels. NaN stands
/// where a point was not located, and for figures that do not exist.
///
/// Made by [`Locator::locate_columns`].
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LocatedBatch {
    /// X in the world frame, in world units.
    pub x: Vec<f64>,
    /// Y, likewise.
    pub y: Vec<f64>,
    /// Z, likewise.
    pub z: Vec<f64>,
    /// Standard deviation of X, in world units; empty after [`Locator::points_only`], as are all columns
    /// below but the last.
    pub sigma_x: Vec<f64>,
    /// Standard deviation of Y.
    pub sigma_y: Vec<f64>,
    /// Standard deviation of Z.
    pub sigma_z: Vec<f64>,
    /// Covariance XX, XY, XZ, YY, YZ, ZZ, in squared world units.
    pub covariance: [Vec<f64>; 6],
    /// Reprojection error in pixels: root mean square over the pixel coordinates of the point.
    pub residual: Vec<f64>,
    /// The standard deviation that is expected of one pixel coordinate in it.
    pub residual_sigma: Vec<f64>,
    /// Whether the point lies where the fit had data; empty where the locator has no volume.
    pub trust: Vec<Trust>,
}

impl LocatedBatch {
    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// How many points were located.
    #[must_use]
    pub fn located(&self) -> usize {
        self.x.iter().filter(|x| !x.is_nan()).count()
    }

    /// One row; `None` where the point was not located, or without covariances.
    #[must_use]
    pub fn get(&self, row: usize) -> Option<Located> {
        let x = self.x.get(row).copied().filter(|x| !x.is_nan())?;
        let mut covariance = nalgebra::Matrix3::zeros();
        for ((a, b), column) in LOWER.into_iter().zip(&self.covariance) {
            let value = *column.get(row)?;
            (covariance[(a, b)], covariance[(b, a)]) = (value, value);
        }
        Some(Located {
            point: [x, *self.y.get(row)?, *self.z.get(row)?].into(),
            covariance,
            residual: *self.residual.get(row)?,
            residual_sigma: *self.residual_sigma.get(row)?,
        })
    }

    fn append(&mut self, places: &Places) {
        let [x, y, z] = &places.point;
        self.x.extend_from_slice(x);
        self.y.extend_from_slice(y);
        self.z.extend_from_slice(z);
        let [xx, _, _, yy, _, zz] = &places.covariance;
        let variances = [(&mut self.sigma_x, xx), (&mut self.sigma_y, yy), (&mut self.sigma_z, zz)];
        for (sigma, variance) in variances {
            sigma.extend(variance.iter().map(|variance| variance.sqrt()));
        }
        for (all, part) in self.covariance.iter_mut().zip(&places.covariance) {
            all.extend_from_slice(part);
        }
        self.residual.extend_from_slice(&places.residual);
        self.residual_sigma.extend_from_slice(&places.residual_sigma);
        self.trust.extend_from_slice(&places.trust);
    }
}

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
        let (mut batch, mut places) = (LocatedBatch::default(), Places::default());
        let count = pixels.points();
        let mut done = 0;
        while done < count {
            progress.check()?;
            let end = count.min(done + PART);
            self.locate_into(&pixels.part(done..end), &mut places);
            batch.append(&places);
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
