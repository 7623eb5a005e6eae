//! proPTV's lists of markers: `markers_c0.txt`, `markers_c1.txt`, …, a file a camera, a heading and lines
//! `x y X Y Z`.
//!
//! Source: proPTV 1.0 (github.com/RobinBarta/proPTV), its README and the scripts `getmarker`, `combineMarker` and
//! `calibration` of its preprocessing, which write these lists with `numpy.savetxt` and read them without their
//! first line. Pixels are OpenCV's: (0, 0) the centre of the top-left pixel, x along columns. Points of
//! different cameras are one where X, Y and Z are the same numbers.

use super::{Content, Format, Layout, myptv};

pub(super) const FORMAT: Format = Format {
    name: "proptv",
    about: "proPTV's lists of markers, one file per camera: x y X Y Z",
    layout: Layout::Folder(&[
        "markers_c0.txt",
        "markers_c1.txt",
        "markers_c2.txt",
        "markers_c3.txt",
        "markers_c4.txt",
        "markers_c5.txt",
        "markers_c6.txt",
        "markers_c7.txt",
    ]),
    content: Content::Points {
        read: Some(myptv::read),
        write: Some(|data, _| {
            let name = |camera: usize| format!("markers_c{camera}.txt");
            Ok(myptv::lists(data, name, ("# x,y,X,Y,Z\n", " ")))
        }),
        known_only: true,
    },
};
