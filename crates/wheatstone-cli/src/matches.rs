//! Matches that another program found, as files.

use crate::{
    failure::{Failure, Outcome},
    verbosity::remark,
};
use std::path::Path;
use wheatstone::{
    Pixel,
    formats::read_npy,
    imaging::{is_other_picture, is_picture},
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
            let mut values: Vec<f32> = values.into_iter().map(|value| value as f32).collect();
            drop_no_match(path, &mut values);
            let map = DisparityMap::given(width, values, sigma as f32).ok_or_else(|| {
                Failure::usage("the array of disparities is empty", "give one a rectified pixel")
            })?;
            return Ok(Self::Disparities(map));
        }
        if is_picture(path) || is_other_picture(path) {
            return Err(Failure::usage(
                format!("{}: a picture, not matches", path.display()),
                "give a NumPy file (.npy) of disparities, one a pixel of the left rectified picture, or a table of \
                 matched pixels",
            ));
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

/// Takes out the value that stands for "no match", where one does: OpenCV's matchers write the whole number below the least
/// disparity that they search, which may be one that a point could have.
fn drop_no_match(path: &Path, values: &mut [f32]) {
    /// That many pixels have it, of a hundred.
    const LEAST_PERCENT: usize = 1;
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let lowest = finite().fold(f32::INFINITY, f32::min);
    let count = finite().filter(|value| *value == lowest).count();
    let is_apart = !finite().any(|value| value > lowest && value < lowest + 1.0);
    // Of whole disparities none lies between two whole numbers.
    let has_fractions = finite().any(|value| value.fract() != 0.0);
    let is_frequent = 100 * count > LEAST_PERCENT * values.len();
    if lowest.fract() != 0.0 || !is_apart || !has_fractions || !is_frequent {
        return;
    }
    remark!(
        "note",
        "{}: {count} of {} pixels have the disparity {lowest}, below all others; that is taken for \"no match\"",
        path.display(),
        values.len()
    );
    values.iter_mut().filter(|value| **value == lowest).for_each(|value| *value = f32::NAN);
}
