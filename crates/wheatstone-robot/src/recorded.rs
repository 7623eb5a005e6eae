//! A recording: pairs of pictures in a folder, to show what the pilot would have done.

use super::{Vehicle, Velocity};
use std::path::{Path, PathBuf};
use wheatstone_charts::imaging::{GrayImage, Limits, is_picture, read_image, read_size};
use wheatstone_core::{Error, Result};

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
        found.extend(Some(entry.map_err(failed)?.path()).filter(|path| is_picture(path)));
    }
    found.sort();
    Ok(found)
}
