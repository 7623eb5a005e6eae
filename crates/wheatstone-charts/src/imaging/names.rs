//! What the name of a picture's file tells.

use std::{cmp::Ordering, path::Path};

/// Whether a file's name is that of a picture which can be read: one with a usual ending. What systems put beside pictures
/// (`.DS_Store`, `._001.png`, `Thumbs.db`) is none.
#[must_use]
pub fn is_picture(path: &Path) -> bool {
    const ENDINGS: [&str; 10] =
        ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm", "ppm", "pbm", "pnm"];
    ends_in(path, &ENDINGS)
}

/// Whether a file's name is that of a picture which cannot be read, but may be saved as one that can.
#[must_use]
pub fn is_other_picture(path: &Path) -> bool {
    const ENDINGS: [&str; 21] = [
        "webp", "heic", "heif", "avif", "gif", "jxl", "jp2", "j2k", "tga", "exr", "raw", "dng",
        "cr2", "cr3", "nef", "arw", "orf", "rw2", "raf", "pef", "srw",
    ];
    ends_in(path, &ENDINGS)
}

/// Whether a file's name is that of a video.
pub(super) fn is_video(path: &Path) -> bool {
    const ENDINGS: [&str; 8] = ["mp4", "avi", "mov", "mkv", "webm", "m4v", "wmv", "mpg"];
    ends_in(path, &ENDINGS)
}

fn ends_in(path: &Path, endings: &[&str]) -> bool {
    let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    !is_hidden && ending.is_some_and(|ending| endings.contains(&ending.as_str()))
}

/// The order in which people count files: numbers in names by their values, so that `img_99` comes before
/// `img_100`.
#[must_use]
pub fn in_counting_order(a: &Path, b: &Path) -> Ordering {
    runs(a).cmp(&runs(b)).then_with(|| a.cmp(b))
}

/// A path as texts and the numbers after them; numbers by their count of digits first, without zeros before.
fn runs(path: &Path) -> Vec<(String, usize, String)> {
    let path = path.to_string_lossy();
    let mut rest = &*path;
    let mut all = Vec::new();
    while !rest.is_empty() {
        let (text, after) =
            rest.split_at(rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len()));
        let end = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        let (digits, after) = after.split_at(end);
        let digits = digits.trim_start_matches('0');
        all.push((text.to_owned(), digits.len(), digits.to_owned()));
        rest = after;
    }
    all
}
