//! A rectified pair as OpenCV takes it: for each virtual camera the tables of `cv2.remap` as NumPy matrices
//! of float32, and the pair's calibration as its FileStorage.
//!
//! Source: the OpenCV documentation of `cv::remap`, `cv::stereoRectify` and `cv::reprojectImageTo3D`. The
//! tables hold x and y of the place in the model's picture, (0, 0) the centre of the top-left pixel, and -1
//! where there is none, which `remap` fills with its border value.

use super::{
    Content, Format, Layout, OutputFile, Rig, RigCamera,
    npy::npy_float32,
    opencv,
    rig::{Optics, rows},
};
use nalgebra::Matrix3;
use wheatstone_core::{
    Result, camera::pinhole::Pinhole, geometry::Pose, rectification::Rectification,
};

pub(super) const FORMAT: Format = Format {
    name: "remap",
    about: "a rectified pair of any model: maps for cv2.remap (NumPy) and P1 P2 Q",
    layout: Layout::Folder(&["pair.yml"]),
    content: Content::Pair { write },
};

fn write(made: &Rectification) -> Result<Vec<OutputFile>> {
    let mut files = Vec::with_capacity(5);
    for (side, name) in ["left", "right"].into_iter().enumerate() {
        let table = made.table(side);
        for (axis, values) in [("x", &table.x), ("y", &table.y)] {
            files.push(OutputFile {
                name: format!("{name}_map_{axis}.npy"),
                bytes: npy_float32((table.height, table.width), values),
            });
        }
    }
    files.push(OutputFile::named("pair.yml", calibration(made)?));
    Ok(files)
}

/// The virtual cameras as two pinholes, then what `cv::stereoRectify` would say of them.
fn calibration(made: &Rectification) -> Result<String> {
    let pair = &made.pair;
    // A rotation cannot say a left-handed world: the pair then stands in its own frame.
    let rotates = pair.rectified_from_world.rotation.determinant() > 0.0;
    let left = if rotates { pair.rectified_from_world } else { Pose::default() };
    let mut right = left;
    right.translation.x -= pair.baseline;
    let camera = |(side, pose): (usize, Pose)| {
        let lens = Pinhole { focal: [pair.focal; 2], principal: pair.principal[side] };
        let name = ["left", "right"][side];
        Some(RigCamera {
            name: format!("{name}, of camera {}", pair.cameras[side] + 1),
            size: Some(pair.size),
            optics: Optics::brown(lens, &[], pose)?,
        })
    };
    let cameras = [left, right].into_iter().enumerate().filter_map(camera).collect();
    let mut text = opencv::text(&Rig { unit: Some(pair.unit.clone()), cameras })?;
    for name in ["R1", "R2"] {
        opencv::matrix(&mut text, name, (3, 3), &rows(&Matrix3::identity()));
    }
    for (name, matrix) in ["P1", "P2"].into_iter().zip(pair.projections()) {
        opencv::matrix(&mut text, name, (3, 4), matrix.transpose().as_slice());
    }
    opencv::matrix(&mut text, "Q", (4, 4), pair.depth_matrix().transpose().as_slice());
    let world = pair.rectified_from_world;
    let mut placed = Vec::with_capacity(12);
    for row in 0..3 {
        placed.extend(world.rotation.row(row).iter());
        placed.push(world.translation[row]);
    }
    opencv::matrix(&mut text, "rectified_from_world", (3, 4), &placed);
    text.push_str(&format!("exact_depth: {:?}\n", pair.depth));
    Ok(text)
}
