//! Files of clouds. A format is one file here and one row of [`CLOUD_FORMATS`].

mod e57;
mod laz;
mod pcd;
mod ply;

use crate::cloud::Cloud;
use std::{
    fmt::{self, Debug, Formatter},
    io::{self, BufWriter, Write},
    path::Path,
};
use wheatstone_core::{Error, Result, storage::Output};

pub use ply::write_ply;

/// A format for clouds. All hold X, Y, Z, the colour, the standard deviations of X, Y and Z, and the confidence of every
/// point.
pub struct CloudFormat {
    /// Its name, which is also the extension of its files.
    pub name: &'static str,
    /// What it is, in a few words.
    pub about: &'static str,
    /// Whether X, Y and Z have single precision, however far from the origin.
    pub is_single: bool,
    write: fn(&Cloud, &str, &mut dyn Write) -> io::Result<()>,
}

/// The formats, the usual one first.
pub const CLOUD_FORMATS: &[CloudFormat] = &[
    CloudFormat { name: "ply", about: "Stanford PLY, binary", is_single: false, write: ply::write },
    CloudFormat {
        name: "pcd",
        about: "of the Point Cloud Library, binary",
        is_single: true,
        write: pcd::write,
    },
    CloudFormat { name: "e57", about: "ASTM E57, in metres", is_single: false, write: e57::write },
    CloudFormat {
        name: "laz",
        about: "compressed ASPRS LAS, in metres",
        is_single: false,
        write: laz::write,
    },
];

impl Debug for CloudFormat {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl CloudFormat {
    /// The format of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        CLOUD_FORMATS.iter().find(|format| format.name.eq_ignore_ascii_case(name))
    }

    /// The format that a file's extension says.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`], where it is none of them.
    pub fn of_file(path: &Path) -> Result<&'static Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        Self::named(&extension).ok_or_else(|| {
            let names: Vec<_> = CLOUD_FORMATS.iter().map(|format| format.name).collect();
            Error::Unsupported {
                format: path.display().to_string(),
                what: "clouds: its extension is that of none of their formats".into(),
                hint: format!("choose one of these extensions: {}", names.join(", ")).into(),
            }
        })
    }

    /// Writes a cloud whose lengths have a unit. Formats that are in metres get metres; lengths of a unit that is not known go
    /// there as they are.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn encode(&self, cloud: &Cloud, unit: &str, out: &mut impl Write) -> io::Result<()> {
        (self.write)(cloud, unit, out)
    }

    /// As [`CloudFormat::encode`], into a file, which is whole or not there.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn save(&self, cloud: &Cloud, unit: &str, path: &Path) -> Result<()> {
        save(path, |out| (self.write)(cloud, unit, out))
    }
}

/// Writes a file that is whole, or not there.
fn save(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let failed = |source| Error::Io { action: "write", path: path.into(), source };
    let mut output = Output::create(path)?;
    let mut buffered = BufWriter::new(&mut output);
    write(&mut buffered).and_then(|()| buffered.flush()).map_err(failed)?;
    drop(buffered);
    output.commit()
}

/// Columns beside X, Y, Z and the colour, in this order in every format.
const SCALARS: [&str; 4] = ["sigma_x", "sigma_y", "sigma_z", "confidence"];

/// The values of [`SCALARS`] of a point, lengths multiplied by a factor.
fn scalars(cloud: &Cloud, index: usize, factor: f64) -> [f32; 4] {
    let [x, y, z] = cloud.sigmas[index].map(|sigma| (f64::from(sigma) * factor) as f32);
    [x, y, z, cloud.confidence[index]]
}
