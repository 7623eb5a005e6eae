//! Pictures that are too dark or too bright to show anything.

use std::path::Path;
use wheatstone::imaging::GrayImage;

/// What is said of a picture nine tenths of which are too dark or too bright to show anything.
pub(crate) fn badly_exposed(path: &Path, picture: &GrayImage) -> Option<String> {
    /// A sixteenth of the levels at either end.
    const DARK: f32 = 16.0;
    const BRIGHT: f32 = 239.0;
    let mut levels: Vec<f32> = picture.values().to_vec();
    levels.sort_by(f32::total_cmp);
    let at = |tenths: usize| levels[(levels.len() - 1) * tenths / 10];
    let how = match (at(1), at(9)) {
        (_, bright) if bright < DARK => "dark",
        (dark, _) if dark > BRIGHT => "overexposed",
        _ => return None,
    };
    Some(format!("; {} is {how}: {:.0} of 255 grey levels in the median", path.display(), at(5)))
}
