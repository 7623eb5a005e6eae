//! Which point of a lattice is which.

use wheatstone_charts::{
    chart::{
        ChartSearch,
        lattice::{Labelled, Lattice, Origin, size_in_reason},
    },
    imaging::GrayImage,
};
use wheatstone_core::geometry::Pixel;

const LATTICE: Lattice = Lattice { columns: 5, rows: 4, pitch: 2.0, origin: Origin::Centre };

fn picture() -> GrayImage {
    GrayImage::from_fn(200, 180, |_, _| 0.0)
}

/// The lattice drawn 30 px apart from `(x, y)`, as far as it is in the picture, labels scrambled.
fn seen_from(x: f64, y: f64) -> (Vec<Labelled>, Vec<usize>) {
    let (mut found, mut ids) = (Vec::new(), Vec::new());
    for id in 0..20 {
        let (row, column) = (id / 5, id % 5);
        let pixel = Pixel::new(x + 30.0 * column as f64, y + 30.0 * row as f64);
        if picture().contains(pixel, 5.0) {
            // Labels run upwards and begin anywhere.
            found.push(Labelled { column: 7 - row, row: column + 3, pixel });
            ids.push(id as usize);
        }
    }
    (found, ids)
}

#[test]
fn a_whole_lattice_reads_upright_first_and_upside_down_second() {
    let (found, ids) = seen_from(35.0, 45.0);
    let ChartSearch::Found(readings) = LATTICE.place(&found, &picture(), None) else { panic!() };
    assert_eq!(readings.len(), 2);
    assert_eq!(readings[0].points.iter().map(|p| p.0).collect::<Vec<_>>(), ids);
    assert_eq!(readings[0].points[0].1, Pixel::new(35.0, 45.0));
    assert_eq!(readings[1].points[0].1, Pixel::new(155.0, 135.0));
}

#[test]
fn a_lattice_that_leaves_the_picture_on_one_side_is_still_decided_up_to_symmetry() {
    // The two left columns lie outside.
    let (found, ids) = seen_from(-40.0, 45.0);
    assert_eq!(ids.len(), 12);
    let ChartSearch::Found(readings) = LATTICE.place(&found, &picture(), None) else { panic!() };
    assert_eq!(readings[0].points.iter().map(|p| p.0).collect::<Vec<_>>(), ids);
    assert_eq!(readings.len(), 2);
}

#[test]
fn points_missing_inside_the_picture_are_no_chart_of_this_size() {
    let (mut found, _) = seen_from(35.0, 45.0);
    found.retain(|point| point.pixel.x > 50.0);
    let ChartSearch::NotFound(why) = LATTICE.place(&found, &picture(), None) else { panic!() };
    assert_eq!(size_in_reason(&why), Some((4, 4)), "{why}");
}

#[test]
fn colours_tell_a_turned_board() {
    let lattice = Lattice { columns: 4, rows: 3, ..LATTICE };
    let found: Vec<Labelled> = (0..12)
        .map(|id| Labelled {
            column: id % 4,
            row: id / 4,
            pixel: Pixel::new(30.0 + 30.0 * f64::from(id % 4), 30.0 + 30.0 * f64::from(id / 4)),
        })
        .collect();
    let read = |dark| match lattice.place(&found, &picture(), Some(dark)) {
        ChartSearch::Found(readings) => readings,
        ChartSearch::NotFound(why) => panic!("{why}"),
    };
    // 4 x 3 corners make 5 x 4 squares: half a turn exchanges the colours.
    assert_eq!(read((0, 0))[0].points[0].1, Pixel::new(30.0, 30.0));
    assert_eq!(read((1, 0))[0].points[0].1, Pixel::new(120.0, 90.0));
    assert_eq!((read((0, 0)).len(), read((1, 0)).len()), (1, 1));
}
