//! A locator that is made ready once beside the map itself.

use crate::worlds::{chart, gaps, world};
use wheatstone_core::{
    dataset::volume::Volume,
    geometry::{Pixel, PixelColumns, columns_of},
    method::{
        AnyMethod, AnyReconstructor, LocatedBatch, Locator, SettledLocator, network::Training,
    },
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, random_correspondences};

type Rows = Vec<Vec<Option<Pixel>>>;

/// A map, the pixels that it was fitted to, and its volume.
struct Fitted {
    map: AnyReconstructor,
    shown: Rows,
    volume: Volume,
}

fn fitted(method: &str, rig: &str) -> Fitted {
    let (_, _, train) = world(rig, 2);
    let preset = if method == "network" { "paper" } else { "default" };
    let mut fitting = AnyMethod::named(method).unwrap().preset(preset).unwrap();
    if let AnyMethod::Network(network) = &mut fitting
        && let Training::Backpropagation(training) = &mut network.training
    {
        training.epochs = 200;
    }
    let map = fitting.fit_checked(&train, 0, &Silent).unwrap().reconstructor;
    let volume = Volume::of(&train);
    let shown = train.correspondences.into_iter().map(|row| row.pixels).collect();
    Fitted { map, shown, volume }
}

impl Fitted {
    fn settled(&self) -> SettledLocator<'_> {
        let columns = columns_of(&self.shown, 2);
        Locator::new(&*self.map, Some(&self.volume)).settled(&borrowed(&columns))
    }
}

fn borrowed(columns: &[[Vec<f64>; 2]]) -> PixelColumns<'_> {
    PixelColumns::new(columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect())
}

fn located(locator: &SettledLocator, rows: &Rows) -> LocatedBatch {
    locator.locate(&borrowed(&columns_of(rows, 2)))
}

/// Points between and beyond the chart's places, some of them far outside, mismatched or not seen.
fn exam(rig: &str, count: usize) -> Rows {
    let rig = Rig::named(rig, 2).unwrap();
    let chart = chart(&rig);
    let exam = random_correspondences(&rig, &chart, (45.0, 160.0), (Noise::Normal(0.1), 4), count);
    let mut rows: Rows = exam.correspondences.into_iter().map(|row| row.pixels).collect();
    for (index, row) in rows.iter_mut().enumerate() {
        match index % 23 {
            0 => row[index % 2] = None,
            1 => *row = vec![None; 2],
            2 => row[1] = row[1].map(|pixel| Pixel::new(pixel.x + 30.0, pixel.y - 50.0)),
            3 => row.iter_mut().flatten().for_each(|pixel| *pixel *= 3.0),
            _ => {}
        }
    }
    rows
}

/// Every method that locates many points in a way of its own, with the rig that it is tried on.
const METHODS: [(&str, &str); 7] = [
    ("dlt", "paper"),
    ("brown", "paper"),
    ("kannala-brandt", "fisheye"),
    ("soloff", "water"),
    ("network", "paper"),
    ("neural-camera", "water"),
    ("interpolation", "paper"),
];

/// Bits of all figures of a row.
fn bits(places: &LocatedBatch, row: usize) -> Vec<u64> {
    let figures = places.point.iter().chain(&places.covariance);
    let columns = figures.chain([&places.residual, &places.residual_sigma]);
    columns.map(|column| column[row].to_bits()).chain([places.trust[row] as u64]).collect()
}

#[test]
fn can_be_shared_between_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Locator>();
    shared::<SettledLocator>();
}

#[test]
fn points_are_where_the_map_has_them_and_each_row_is_by_itself() {
    for (method, rig) in METHODS {
        let fitted = fitted(method, rig);
        let locator = fitted.settled();
        let rows = exam(rig, if method == "interpolation" { 300 } else { 3000 });
        let whole = located(&locator, &rows);
        let [point, sigma, residual] = gaps(&*fitted.map, &rows, &whole);
        // Of rays without a common centre, pixels are weighed as at the middle of the depths.
        let most = if method == "neural-camera" { 0.02 } else { 2e-3 };
        assert!(point < most, "{method}: {point} standard deviations");
        assert!(sigma < 0.01, "{method}: {sigma} of a standard deviation");
        assert!(residual < 1e-3, "{method}: {residual} pixels");
        for (row, trust) in rows.iter().zip(&whole.trust) {
            assert_eq!(*trust, fitted.volume.trust(row));
        }
        // In another order, some twice, cut into calls, by other threads, after other questions.
        let order: Vec<usize> = (0..rows.len() + 99).map(|k| k * 1217 % rows.len()).collect();
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for (threads, lengths) in [(1, [1, 130, 1500]), (3, [7, 2049, 64])] {
            let mut left = &order[..];
            for length in lengths.into_iter().cycle() {
                let (own, others) = left.split_at(length.min(left.len()));
                left = others;
                let part: Rows = own.iter().map(|row| rows[*row].clone()).collect();
                let part = pool(threads).install(|| located(&locator, &part));
                for (index, row) in own.iter().enumerate() {
                    assert_eq!(bits(&part, index), bits(&whole, *row), "{method}: row {row}");
                }
                if left.is_empty() {
                    break;
                }
            }
        }
        assert!(bits(&located(&fitted.settled(), &rows), 5) == bits(&whole, 5));
    }
}

#[test]
fn points_alone_need_no_error_bars() {
    let fitted = fitted("brown", "paper");
    let columns = columns_of(&fitted.shown, 2);
    let alone = Locator::new(&*fitted.map, None).points_only().settled(&borrowed(&columns));
    let rows = exam("paper", 2000);
    let (whole, alone) = (located(&fitted.settled(), &rows), located(&alone, &rows));
    assert!(alone.residual.is_empty() && alone.covariance[0].is_empty() && alone.trust.is_empty());
    for axis in 0..3 {
        let variances = &whole.covariance[[0, 3, 5][axis]];
        for ((a, b), variance) in whole.point[axis].iter().zip(&alone.point[axis]).zip(variances) {
            assert_eq!(a.is_nan(), b.is_nan());
            assert!(a.is_nan() || (a - b).abs() < 2e-3 * variance.sqrt(), "{a} {b} {variance}");
        }
    }
}

#[test]
fn a_locator_that_was_shown_nothing_is_the_map_itself() {
    let fitted = fitted("brown", "paper");
    let nothing = columns_of(&[], 2);
    let locator = Locator::new(&*fitted.map, None).settled(&borrowed(&nothing));
    let rows = exam("paper", 200);
    let places = located(&locator, &rows);
    for (index, row) in rows.iter().enumerate() {
        assert_eq!(places.get(index), fitted.map.locate(row));
    }
}
