//! Many points at once beside each by itself.

use crate::worlds::{gaps, world};
use wheatstone_charts::chart::AnyChart;
use wheatstone_core::{
    dataset::volume::Volume,
    geometry::{Pixel, PixelColumns, columns_of},
    method::{AnyMethod, LocatedBatch, Locator, Plan, Reconstructor, network::Training},
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, random_correspondences};

/// So many points see what has come to pay made.
const PIECE: usize = 8 * 2048;

/// So many points see sheets over the whole picture made.
const MANY: usize = 4 * PIECE;

/// Enough points in a part of the space that patches and boxes are made.
fn crowd(rig: &Rig, chart: &AnyChart, count: usize) -> Vec<Vec<Option<Pixel>>> {
    crowd_between(rig, chart, (80.0, 100.0), count)
}

fn crowd_between(
    rig: &Rig,
    chart: &AnyChart,
    depths: (f64, f64),
    count: usize,
) -> Vec<Vec<Option<Pixel>>> {
    let exam = random_correspondences(rig, chart, depths, (Noise::Normal(0.1), 4), count);
    exam.correspondences.into_iter().map(|row| row.pixels).collect()
}

fn borrowed(columns: &[[Vec<f64>; 2]]) -> PixelColumns<'_> {
    PixelColumns::new(columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect())
}

#[test]
fn many_points_are_where_each_is_by_itself() {
    for (method, preset, rig, cameras) in [
        ("dlt", "default", "paper", 2),
        ("brown", "default", "paper", 3),
        ("kannala-brandt", "default", "fisheye", 2),
        ("soloff", "default", "water", 2),
        ("neural-camera", "default", "water", 2),
        ("network", "paper", "paper", 2),
        ("interpolation", "default", "paper", 2),
    ] {
        let (rig, chart, train) = world(rig, cameras);
        let mut fitting = AnyMethod::named(method).unwrap().preset(preset).unwrap();
        if let AnyMethod::Network(network) = &mut fitting
            && let Training::Backpropagation(training) = &mut network.training
        {
            training.epochs = 200;
        }
        let fit = fitting.fit_checked(&train, 0, &Silent).unwrap();
        let map = &*fit.reconstructor;
        // Again and again, until patches, boxes and sheets are made, and once over them.
        let rows = crowd(&rig, &chart, PIECE);
        let columns = columns_of(&rows, cameras);
        let pixels = borrowed(&columns);
        let mut locator = Locator::new(map, None);
        let mut places = LocatedBatch::default();
        if !matches!(map.plan(), Plan::PointByPoint) {
            for _ in 0..MANY / PIECE {
                locator.locate_into(&pixels, &mut places);
            }
        }
        locator.locate_into(&pixels, &mut places);
        let [point, sigma, residual] = gaps(map, &rows[..1500], &places);
        // Of rays without a common centre, pixels are weighed as at the middle of the depths.
        let most = if method == "neural-camera" { 0.02 } else { 2e-3 };
        assert!(point < most, "{method}: {point} standard deviations");
        assert!(sigma < 0.01, "{method}: {sigma} of a standard deviation");
        assert!(residual < 1e-3, "{method}: {residual} pixels");
    }
}

#[test]
fn what_is_far_off_or_not_seen_is_as_the_map_has_it() {
    let (rig, chart, train) = world("paper", 3);
    let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let map = &*fit.reconstructor;
    let mut rows = crowd(&rig, &chart, PIECE);
    for (index, row) in rows.iter_mut().enumerate() {
        match index % 5 {
            0 => row[index % 3] = None,
            1 => (row[0], row[1]) = (None, None),
            2 => row[1] = row[1].map(|pixel| Pixel::new(pixel.x + 30.0, pixel.y - 50.0)),
            3 => row.iter_mut().flatten().for_each(|pixel| *pixel *= 1e6),
            _ => {}
        }
    }
    let columns = columns_of(&rows, 3);
    let volume = Volume::of(&train);
    let mut locator = Locator::new(map, Some(&volume));
    let _ = locator.locate(&borrowed(&columns));
    let _ = locator.locate(&borrowed(&columns));
    let places = locator.locate(&borrowed(&columns));
    let [point, sigma, residual] = gaps(map, &rows[..3000], &places);
    assert!(point < 2e-3 && sigma < 0.01 && residual < 1e-3, "{point} {sigma} {residual}");
    for (row, trust) in rows[..3000].iter().zip(&places.trust) {
        assert_eq!(*trust, volume.trust(row));
    }
}

#[test]
fn any_number_of_threads_and_of_calls_gives_the_same_bits() {
    let (rig, chart, train) = world("paper", 2);
    let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let columns = columns_of(&crowd(&rig, &chart, MANY + PIECE + 9000), 2);
    let pixels = borrowed(&columns);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Locator::new(&*fit.reconstructor, None).locate(&pixels))
    };
    let whole = with(1);
    assert!(whole == with(3));
    let mut locator = Locator::new(&*fit.reconstructor, None);
    let mut start = 0;
    for length in [1000, PIECE + 77, 13, pixels.points() - PIECE - 1090] {
        let part = locator.locate(&pixels.part(start..start + length));
        assert!(part.point[2] == whole.point[2][start..start + length]);
        assert!(part.covariance[4] == whole.covariance[4][start..start + length]);
        start += length;
    }
    assert_eq!(start, pixels.points());
}

/// By what share each point's error bars, or the residual to be expected, differ at most from those of the point by
/// itself; sorted.
fn gaps_of_error_bars(
    map: &dyn Reconstructor,
    rows: &[Vec<Option<Pixel>>],
    places: &LocatedBatch,
) -> Vec<f64> {
    let gap = |(index, row): (usize, &Vec<Option<Pixel>>)| {
        let exact = map.locate(row).unwrap();
        let mut most = (places.residual_sigma[index] / exact.residual.unwrap().sigma - 1.0).abs();
        for (axis, place) in [0, 3, 5].into_iter().enumerate() {
            let sigma = exact.covariance[(axis, axis)].sqrt();
            most = most.max((places.covariance[place][index].sqrt() / sigma - 1.0).abs());
        }
        most
    };
    let mut gaps: Vec<f64> = rows.iter().enumerate().map(gap).collect();
    gaps.sort_by(f64::total_cmp);
    gaps
}

#[test]
fn formulas_say_of_many_points_what_they_say_of_each() {
    for (name, range) in [("dlt", (50.0, 140.0)), ("soloff", (90.0, 110.0))] {
        let (rig, chart, train) = world("paper", 2);
        let fit = AnyMethod::named(name).unwrap().fit_checked(&train, 0, &Silent).unwrap();
        let rows = crowd_between(&rig, &chart, range, PIECE);
        let mut locator = Locator::new(&*fit.reconstructor, None);
        let places = locator.locate(&borrowed(&columns_of(&rows, 2)));
        let gaps = gaps_of_error_bars(&*fit.reconstructor, &rows[..4000], &places);
        // Both are of a point that is the same but for a thousandth of its error bar.
        assert!(gaps[3999] < 1e-4, "{name}: {:?}", &gaps[3990..]);
    }
}

#[test]
fn points_alone_are_those_with_error_bars() {
    let (rig, chart, train) = world("paper", 2);
    let fit = AnyMethod::named("dlt").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let columns = columns_of(&crowd(&rig, &chart, 2 * PIECE), 2);
    let whole = Locator::new(&*fit.reconstructor, None).locate(&borrowed(&columns));
    let alone = Locator::new(&*fit.reconstructor, None).points_only().locate(&borrowed(&columns));
    assert!(alone.residual.is_empty() && alone.covariance[0].is_empty());
    for axis in 0..3 {
        let variances = &whole.covariance[[0, 3, 5][axis]];
        let pairs = whole.point[axis].iter().zip(&alone.point[axis]);
        for ((a, b), variance) in pairs.zip(variances) {
            // The first are the map's own where error bars are asked for as well.
            assert!((a - b).abs() < 5e-4 * variance.sqrt(), "{a} {b} {variance}");
        }
    }
}

#[test]
fn where_a_box_does_not_hold_its_eighths_do() {
    let (rig, chart, train) = world("paper", 2);
    let fit = AnyMethod::named("dlt").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    // The nearest points, whose error bars change the fastest.
    let rows = crowd_between(&rig, &chart, (50.0, 60.0), PIECE);
    let columns = columns_of(&rows, 2);
    let mut locator = Locator::new(&*fit.reconstructor, None).with_boxes();
    let mut places = LocatedBatch::default();
    for round in 0.. {
        if locator.made_eighths() >= 8 {
            break;
        }
        assert!(round < 100);
        locator.locate_into(&borrowed(&columns), &mut places);
    }
    locator.locate_into(&borrowed(&columns), &mut places);
    // Between the places at which a box is tried the law of the noise may bend.
    let gaps = gaps_of_error_bars(&*fit.reconstructor, &rows[..4000], &places);
    assert!(gaps[3990] < 0.01 && gaps[3999] < 0.025, "{:?}", &gaps[3990..]);
}
