//! Other programs' files, in and out: calibrations as a [`Rig`], tables of points as a [`Dataset`].
//!
//! To add a format: write `formats/<name>.rs` with a [`Format`], then add its `mod` line and its row in
//! [`FORMATS`]. Readers and writers are pure: bytes to values and back; files are touched here alone.

mod anipose;
mod approximation;
mod cloud;
mod colmap;
mod dlt;
mod dltdv_points;
mod files;
mod guess;
mod import;
mod kalibr;
mod mayacam;
mod mrcal;
mod myptv;
mod myptv_cameras;
mod npy;
mod opencv;
mod openptv;
mod proptv;
mod remap;
mod rig;
mod ros;
mod table;
mod targets;
mod text;
mod tree;
mod units;
mod vnl;
mod yaml;

pub use approximation::{Approximation, Fold, Loss, approximate, approximate_rig, exact};
pub use files::{InputFile, OutputFile, gather, save};
pub use guess::guess;
pub use import::{Imported, calibration};
pub use npy::{npy_float32, npy_float64, read_npy};
pub use rig::{Form, Optics, Rig, RigCamera, coefficients};

use crate::tables::ColumnNames;
use wheatstone_core::{
    Error, Result,
    dataset::Dataset,
    error::{Hint, Remedy},
    rectification::Rectification,
};

/// A format of files.
pub struct Format {
    /// What it is called on the command line.
    pub name: &'static str,
    /// In one line, what it is.
    pub about: &'static str,
    /// How its files lie on the disk.
    pub layout: Layout,
    /// What is in it, and how it is read and written.
    pub content: Content,
}

/// How a format's files lie on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Layout {
    /// One file with this extension.
    File(&'static str),
    /// A folder with a file a camera, each with this extension.
    Cameras(&'static str),
    /// A folder with these files, and any that end so, be it before the number of a frame.
    Folder(&'static [&'static str]),
}

/// Cameras from files.
pub type ReadRig = fn(&[InputFile], &Given) -> Result<Rig>;

/// Files from cameras.
pub type WriteRig = fn(&Rig) -> Result<Vec<OutputFile>>;

/// What cameras lose in files; `None` for nothing.
pub type LossOf = fn(&Rig) -> Option<Loss>;

/// A table of points from files.
pub type ReadPoints = fn(&[InputFile], &Given) -> Result<Dataset>;

/// Files from a table of points.
pub type WritePoints = fn(&Dataset, &Given) -> Result<Vec<OutputFile>>;

/// Files from a rectified pair.
pub type WritePair = fn(&Rectification) -> Result<Vec<OutputFile>>;

/// What a format holds.
#[non_exhaustive]
pub enum Content {
    /// Cameras.
    Calibration {
        /// Reads them, where the format can be read.
        read: Option<ReadRig>,
        /// Writes them, where it can be written.
        write: Option<WriteRig>,
        /// What of cameras it can hold, what is preferred first.
        forms: &'static [Form],
        /// The unit of its lengths, where it knows only one.
        unit: Option<&'static str>,
        /// What cameras in its forms lose in its files, where they may lose something.
        loss: Option<LossOf>,
    },
    /// A rectified pair of cameras; not read.
    Pair {
        /// Writes it.
        write: WritePair,
    },
    /// Matched pixels, points in the world, or both.
    Points {
        /// Reads them, where the format can be read.
        read: Option<ReadPoints>,
        /// Writes them, where it can be written.
        write: Option<WritePoints>,
        /// Whether it holds only points whose X, Y, Z are known: others are left out.
        known_only: bool,
    },
}

/// What some files do not say of themselves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// The unit of world lengths: files that say theirs, or whose format has only one, are converted to it, others
    /// are in it.
    pub unit: Option<String>,
    /// Width and height of each camera's pictures in pixels; one for all cameras, or one each.
    pub sizes: Vec<[u32; 2]>,
    /// Columns of a chart and the distance between them, for lists of its corners that do not say it.
    pub board: Option<(usize, f64)>,
    /// What a table calls its columns.
    pub columns: Option<ColumnNames>,
}

impl Given {
    /// The unit of world lengths; millimetres where none was given.
    #[must_use]
    pub fn unit(&self) -> &str {
        self.unit.as_deref().unwrap_or("mm")
    }

    /// The size of a camera's pictures, counted from 0.
    #[must_use]
    pub fn size(&self, camera: usize) -> Option<[u32; 2]> {
        match &self.sizes[..] {
            [one] => Some(*one),
            sizes => sizes.get(camera).copied(),
        }
    }
}

/// Every format that is read or written.
pub const FORMATS: &[Format] = &[
    opencv::FORMAT,
    opencv::FISHEYE,
    ros::FORMAT,
    kalibr::FORMAT,
    mrcal::FORMAT,
    colmap::FORMAT,
    anipose::FORMAT,
    dlt::FORMAT,
    dlt::DLTDV,
    dlt::DLTDV8,
    mayacam::FORMAT,
    openptv::FORMAT,
    myptv_cameras::FORMAT,
    remap::FORMAT,
    table::TEXT,
    npy::FORMAT,
    table::PARQUET,
    table::ARROW,
    cloud::PLY,
    cloud::PCD,
    dltdv_points::FORMAT,
    targets::FORMAT,
    myptv::FORMAT,
    proptv::FORMAT,
    vnl::FORMAT,
];

impl Format {
    /// The format of this name.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<&'static Self> {
        FORMATS.iter().find(|format| format.name == name).ok_or_else(|| Error::UnknownName {
            kind: "format",
            name: name.into(),
            known: FORMATS.iter().map(|format| format.name.to_owned()).collect(),
        })
    }

    /// Whether it holds cameras, be it as a rectified pair.
    #[must_use]
    pub fn is_calibration(&self) -> bool {
        !matches!(self.content, Content::Points { .. })
    }

    /// Whether it is a table of our own.
    #[must_use]
    pub fn is_table(&self) -> bool {
        table::NAMES.contains(&self.name)
    }

    /// Whether it holds a rectified pair.
    #[must_use]
    pub fn is_pair(&self) -> bool {
        matches!(self.content, Content::Pair { .. })
    }

    /// Whether it is read.
    #[must_use]
    pub fn reads(&self) -> bool {
        match &self.content {
            Content::Calibration { read, .. } => read.is_some(),
            Content::Pair { .. } => false,
            Content::Points { read, .. } => read.is_some(),
        }
    }

    /// Whether it is written.
    #[must_use]
    pub fn writes(&self) -> bool {
        match &self.content {
            Content::Calibration { write, .. } => write.is_some(),
            Content::Pair { .. } => true,
            Content::Points { write, .. } => write.is_some(),
        }
    }

    /// What it can hold of cameras; nothing for tables of points.
    #[must_use]
    pub fn forms(&self) -> &'static [Form] {
        match &self.content {
            Content::Calibration { forms, .. } => forms,
            Content::Pair { .. } | Content::Points { .. } => &[],
        }
    }

    /// A table of points from files.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] with file and line, [`Error::Unsupported`] where the format is not one that
    /// is read as points.
    pub fn read_points(&self, files: &[InputFile], given: &Given) -> Result<Dataset> {
        let Content::Points { read: Some(read), .. } = &self.content else {
            return Err(self.cannot("points to be read"));
        };
        let first = files.first().ok_or_else(|| self.cannot("nothing: there are no files"))?;
        let data = read(files, given)?;
        if data.correspondences.is_empty() {
            return Err(first.error(
                0,
                "there are no points in it".into(),
                "is this the file that you meant?",
            ));
        }
        Ok(data)
    }

    /// The unit of lengths in files of points: the one that was given, or that a table of ours says.
    ///
    /// # Errors
    ///
    /// As [`Format::read_points`].
    pub fn unit_of_points(&self, files: &[InputFile], given: &Given) -> Result<Option<String>> {
        match (&given.unit, files.first()) {
            (None, Some(file)) if self.is_table() => table::unit(file, given),
            (given, _) => Ok(given.clone()),
        }
    }

    /// Files from a table of points, in the unit that was given where that is said.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] with what does not go in.
    pub fn write_points(&self, data: &Dataset, given: &Given) -> Result<Vec<OutputFile>> {
        match &self.content {
            Content::Points { write: Some(write), .. } if self.left_out(data) == 0 => {
                write(data, given)
            }
            Content::Points { write: Some(write), .. } => {
                let mut known = data.clone();
                known.correspondences.retain(|row| row.world.is_some());
                if known.correspondences.is_empty() {
                    return Err(Self::unsupported(
                        self.name,
                        "points without X, Y, Z".into(),
                        Hint::new("locate them first", Remedy::Locate),
                    ));
                }
                write(&known, given)
            }
            _ => Err(self.cannot("points to be written")),
        }
    }

    /// How many of the points [`Format::write_points`] leaves out, for want of X, Y, Z.
    #[must_use]
    pub fn left_out(&self, data: &Dataset) -> usize {
        match self.content {
            Content::Points { known_only: true, .. } => {
                data.correspondences.len() - data.known().count()
            }
            _ => 0,
        }
    }

    /// Cameras from files; two of them at least.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] with file and line, [`Error::Unsupported`] where the format is not one that
    /// is read as cameras.
    pub fn read_rig(&self, files: &[InputFile], given: &Given) -> Result<Rig> {
        let Content::Calibration { read: Some(read), unit, .. } = &self.content else {
            return Err(self.cannot("cameras to be read"));
        };
        let first = files.first().ok_or_else(|| self.cannot("nothing: there are no files"))?;
        let mut rig = read(files, given)?;
        if rig.cameras.is_empty() {
            return Err(first.error(
                0,
                "there are no cameras in it".into(),
                "is this the file that you meant?",
            ));
        }
        rig.unit = rig.unit.or_else(|| unit.map(Into::into));
        rig = units::in_given(rig, given, first)?;
        for (index, camera) in rig.cameras.iter_mut().enumerate() {
            camera.size = camera.size.or_else(|| given.size(index));
        }
        Ok(rig)
    }

    /// Files from cameras that are in one of the format's forms.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] with what does not go in.
    pub fn write_rig(&self, rig: &Rig) -> Result<Vec<OutputFile>> {
        let Content::Calibration { write: Some(write), unit, .. } = &self.content else {
            return Err(self.cannot("cameras to be written"));
        };
        match unit {
            Some(unit) => write(&rig.in_unit(unit, self.name)?),
            None => write(rig),
        }
    }

    /// What cameras in one of the format's forms lose in its files; `None` where they lose nothing.
    #[must_use]
    pub fn loss(&self, rig: &Rig) -> Option<Loss> {
        match self.content {
            Content::Calibration { loss: Some(loss), .. } => loss(rig),
            _ => None,
        }
    }

    /// Files from a rectified pair.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] where the format is not one of rectified pairs.
    pub fn write_pair(&self, made: &Rectification) -> Result<Vec<OutputFile>> {
        match &self.content {
            Content::Pair { write } => write(made),
            _ => Err(self.cannot("a rectified pair")),
        }
    }

    fn cannot(&self, what: &str) -> Error {
        Error::Unsupported {
            format: self.name.into(),
            what: what.into(),
            hint: Hint::new("choose a format that holds it", Remedy::Formats),
        }
    }

    /// A refusal in this format's name.
    fn unsupported(name: &str, what: String, hint: impl Into<Hint>) -> Error {
        Error::Unsupported { format: name.into(), what, hint: hint.into() }
    }
}
