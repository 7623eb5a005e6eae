//! The format of the Point Cloud Library, version 0.7, binary (<https://pointclouds.org/documentation/tutorials/pcd_file_format.html>).

use super::{SCALARS, scalars};
use crate::cloud::Cloud;
use std::io::{self, Write};

/// Writes x y z, the packed colour, standard deviations and confidence, all in four bytes: readers of the
/// format take x y z of no other kind. The format has no unit.
pub(super) fn write(cloud: &Cloud, unit: &str, out: &mut dyn Write) -> io::Result<()> {
    let points = cloud.len();
    let unit = unit.replace(['\n', '\r'], " ");
    let scalars_named = SCALARS.join(" ");
    write!(
        out,
        "# .PCD v0.7 - lengths in {unit}\nVERSION 0.7\nFIELDS x y z rgb {scalars_named}\n\
         SIZE 4 4 4 4 4 4 4 4\nTYPE F F F U F F F F\nCOUNT 1 1 1 1 1 1 1 1\n\
         WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
    )?;
    for (index, (point, [red, green, blue])) in cloud.points.iter().zip(&cloud.colours).enumerate()
    {
        for value in point {
            out.write_all(&(*value as f32).to_le_bytes())?;
        }
        out.write_all(&[*blue, *green, *red, 0])?;
        for value in scalars(cloud, index, 1.0) {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(())
}
