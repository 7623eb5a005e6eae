//! A recording: pairs of pictures in a folder, to show what the pilot would have done.

use super::{Vehicle, Velocity};
use std::path::{Path, PathBuf};
use wheatstone_charts::imaging::{GrayImage, Limits, read_image, read_size};
use wheatstone_core::{Error, Result};

/// Pictures are files with one of these endings.
const ENDINGS: [&str; 7] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm"];

/// A vehicle that shows what was recorded and does not move.
///
/// It shows one pair after the other, wherever it is told to drive: what the pilot believes holds only
/// where the recording robot was told the same, or moved little from one pair to the next.
#[derive(Clone, Debug)]
pub struct Recording {
    pairs: Vec<[PathBuf; 2]>,
    next: usize,
    period: f64,
}

impl Recording {
    /// The pictures in `left/` and `right/` of a folder, in the order of their names; `period` is the
    /// seconds from one pair to the next.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] where a folder cannot be read, [`Error::Malformed`] where there are no pictures, or
    /// not as many left as right.
    pub fn open(folder: &Path, period: f64) -> Result<Self> {
        let [left, right] = [pictures(&folder.join("left"))?, pictures(&folder.join("right"))?];
        let counts = [left.len(), right.len()];
        if counts[0] != counts[1] || counts[0] == 0 {
            return Err(Error::Malformed {
                path: folder.into(),
                line: None,
                problem: format!("{} pictures in `left`, {} in `right`", counts[0], counts[1]),
                hint: "both need as many pictures, whose names sort in the order of time".into(),
            });
        }
        let pairs = left.into_iter().zip(right).map(|(left, right)| [left, right]).collect();
        Ok(Self { pairs, next: 0, period })
    }

    /// The files of the pairs, in the order in which they are shown.
    #[must_use]
    pub fn pairs(&self) -> &[[PathBuf; 2]] {
        &self.pairs
    }

    /// Width and height of the first picture.
    ///
    /// # Errors
    ///
    /// Those of [`read_size`].
    pub fn size(&self) -> Result<[usize; 2]> {
        let size = read_size(&self.pairs[0][0])?;
        Ok(size.map(|length| length as usize))
    }
}

impl Vehicle for Recording {
    fn look(&mut self) -> Result<Option<[GrayImage; 2]>> {
        let Some([left, right]) = self.pairs.get(self.next) else {
            return Ok(None);
        };
        self.next += 1;
        let read = |path: &Path| read_image(path, Limits::default());
        let pair = [read(left)?, read(right)?];
        let sizes = [&pair[0], &pair[1]].map(|picture| [picture.width(), picture.height()]);
        if sizes[0] != sizes[1] || sizes[0] != self.size()? {
            return Err(Error::Image {
                path: right.clone(),
                problem: format!("{:?} pixels beside {:?}", sizes[1], sizes[0]),
                hint: "all pictures of a recording need the same size".into(),
            });
        }
        Ok(Some(pair))
    }

    fn drive(&mut self, _: Velocity) -> Result<()> {
        Ok(())
    }

    fn period(&self) -> f64 {
        self.period
    }
}

/// The pictures of a folder, by name.
fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |source| Error::Io { action: "read", path: folder.into(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        if ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str())) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_come_in_the_order_of_their_names_until_they_end() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        for (side, grey) in [("left", 10.0), ("right", 100.0)] {
            std::fs::create_dir(at.join(side)).unwrap();
            for number in [2, 0, 1] {
                let picture = GrayImage::from_fn(8, 6, |_, _| grey + number as f32);
                picture.write_png(&at.join(side).join(format!("{number:03}.png"))).unwrap();
            }
        }
        std::fs::write(at.join("left/notes.txt"), "no picture").unwrap();
        let mut recording = Recording::open(at, 0.25).unwrap();
        assert_eq!((recording.pairs().len(), recording.size().unwrap()), (3, [8, 6]));
        for number in 0..3 {
            let [left, right] = recording.look().unwrap().unwrap();
            assert_eq!(
                (left.values()[0], right.values()[0]),
                (10.0 + number as f32, 100.0 + number as f32)
            );
            recording.drive(Velocity::STOP).unwrap();
        }
        assert!(recording.look().unwrap().is_none());
        std::fs::remove_file(at.join("right/001.png")).unwrap();
        let Err(Error::Malformed { problem, .. }) = Recording::open(at, 0.25) else { panic!() };
        assert!(problem.contains("3 pictures in `left`, 2 in `right`"), "{problem}");
        let odd = GrayImage::from_fn(9, 6, |_, _| 0.0);
        odd.write_png(&at.join("right/001.png")).unwrap();
        let mut recording = Recording::open(at, 0.25).unwrap();
        assert!(recording.look().is_ok() && matches!(recording.look(), Err(Error::Image { .. })));
        assert!(matches!(Recording::open(&at.join("none"), 0.25), Err(Error::Io { .. })));
    }
}
