//! The Stanford PLY format, binary: what CloudCompare, MeshLab, Open3D and PCL open.

use super::save;
use crate::{cloud::Cloud, mesh::Mesh};
use std::{
    io::{self, Write},
    path::Path,
};
use wheatstone_core::Result;

/// Binary little-endian PLY: x y z, red green blue, standard deviations and confidence. What stands beside x y z and the
/// colours opens as scalar fields. x y z are doubles where floats would be coarse against the error bars. With a mesh, normals `nx` `ny` `nz` of the points, and triangles as faces.
fn ply(cloud: &Cloud, mesh: Option<&Mesh>, unit: &str, out: &mut dyn Write) -> io::Result<()> {
    let normals = "property float nx\nproperty float ny\nproperty float nz\n";
    let faces = mesh.map_or_else(String::new, |mesh| {
        let count = mesh.triangles.len();
        format!("element face {count}\nproperty list uchar uint vertex_indices\n")
    });
    let is_double = cloud.float_rounding().is_some();
    let kind = if is_double { "double" } else { "float" };
    let header = format!(
        "ply\nformat binary_little_endian 1.0\n\
         comment x, y, z and their standard deviations in {}; confidence: probability of a disparity error below 1 px\n\
         element vertex {}\n\
         property {kind} x\nproperty {kind} y\nproperty {kind} z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         property float sigma_x\nproperty float sigma_y\nproperty float sigma_z\n\
         property float confidence\n{}{faces}end_header\n",
        unit.replace(['\n', '\r'], " "),
        cloud.len(),
        if mesh.is_some() { normals } else { "" }
    );
    out.write_all(header.as_bytes())?;
    let columns = cloud.points.iter().zip(&cloud.colours).zip(&cloud.sigmas).zip(&cloud.confidence);
    let mut row = Vec::new();
    for (index, (((point, colour), sigma), confidence)) in columns.enumerate() {
        row.clear();
        if is_double {
            row.extend(point.iter().flat_map(|value| value.to_le_bytes()));
        } else {
            row.extend(point.iter().flat_map(|value| (*value as f32).to_le_bytes()));
        }
        row.extend(colour);
        row.extend(sigma.iter().chain([confidence]).flat_map(|value| value.to_le_bytes()));
        let normal = mesh.iter().flat_map(|mesh| mesh.normals[index]);
        row.extend(normal.flat_map(f32::to_le_bytes));
        out.write_all(&row)?;
    }
    for triangle in mesh.iter().flat_map(|mesh| &mesh.triangles) {
        out.write_all(&[3])?;
        for point in triangle {
            out.write_all(&point.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Writes a cloud as binary PLY, with a mesh as normals of its points and triangles; the file is whole, or not there.
///
/// # Errors
///
/// [`Error::Io`](wheatstone_core::Error::Io).
pub fn write_ply(cloud: &Cloud, mesh: Option<&Mesh>, unit: &str, path: &Path) -> Result<()> {
    save(path, |out| ply(cloud, mesh, unit, out))
}

pub(super) fn write(cloud: &Cloud, unit: &str, out: &mut dyn Write) -> io::Result<()> {
    ply(cloud, None, unit, out)
}
