//! Matches that another program found, as files.

use crate::failure::{Failure, Outcome};
use std::path::Path;
use wheatstone::{
    Pixel,
    formats::read_npy,
    stereo::DisparityMap,
    tables::{TableOptions, TableReader},
};

/// What a file of matches holds.
pub(crate) enum GivenMatches {
    /// Disparities of the left rectified picture.
    Disparities(DisparityMap),
    /// Matched pixels, one row a point, of each camera that was asked for.
    Pixels(Vec<Vec<Option<Pixel>>>),
}

impl GivenMatches {
    /// Reads a NumPy array of disparities, or a table of pixels of all of a model's cameras, of which `cameras` are wanted;
    /// `sigma` is the standard deviation of both, in pixels.
    pub(crate) fn read(path: &Path, sigma: f64, cameras: &[usize]) -> Outcome<Self> {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy")) {
            let (values, width) = read_npy(path)?;
            let values = values.into_iter().map(|value| value as f32).collect();
            let map = DisparityMap::given(width, values, sigma as f32).ok_or_else(|| {
                Failure::usage("the array of disparities is empty", "give one a rectified pixel")
            })?;
            return Ok(Self::Disparities(map));
        }
        let mut reader = TableReader::open(path, &TableOptions::default())?;
        let most = cameras.iter().copied().max().unwrap_or_default();
        if reader.cameras() <= most {
            return Err(Failure::usage(
                format!("{} has pixels of {} cameras", path.display(), reader.cameras()),
                format!("give those of camera {}, too, or name cameras with `--cameras`", most + 1),
            ));
        }
        let mut pixels = Vec::new();
        while let Some(rows) = reader.next_rows()? {
            let columns = rows.pixels();
            for index in 0..columns.points() {
                let row: Vec<Option<Pixel>> = columns.point(index).collect();
                pixels.push(cameras.iter().map(|camera| row[*camera]).collect());
            }
        }
        Ok(Self::Pixels(pixels))
    }
}
