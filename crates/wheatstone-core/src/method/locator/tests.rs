use super::*;
use crate::{
    camera::{brown_conrady::BrownConrady, pinhole::Pinhole},
    dataset::Dataset,
    geometry::{Point3, columns_of},
    method::{
        AnyMethod, FittedCamera,
        fitted_cameras::tests::{rig, staged},
    },
};
use wheatstone_numeric::{progress::Silent, random::Random};

/// So many points see what has come to pay made.
const PIECE: usize = PIECES[0];

/// Two cameras whose lenses bend, and points that others are fitted to: what these miss differs over the picture.
fn world() -> (Vec<FittedCamera<BrownConrady>>, Dataset) {
    let lens = BrownConrady {
        pinhole: Pinhole { focal: [690.0; 2], principal: [320.0, 240.0] },
        radial: [-0.23, 0.12, -0.02],
        ..BrownConrady::default()
    };
    let cameras = rig(vec![lens; 2]);
    let train = staged(&cameras, 0.3, (0.1, 5), |world| world);
    (cameras, train)
}

/// Pixels of points between two depths.
fn crowd_between(
    cameras: &[FittedCamera<BrownConrady>],
    (near, far): (f64, f64),
    count: usize,
) -> Vec<Vec<Option<Pixel>>> {
    let mut random = Random::new(4);
    let mut row = || {
        let world = Point3::new(
            random.uniform(-20.0, 20.0),
            random.uniform(-15.0, 15.0),
            random.uniform(near, far),
        );
        let mut noisy = |pixel: Pixel| {
            Pixel::new(pixel.x + 0.1 * random.normal(), pixel.y + 0.1 * random.normal())
        };
        cameras.iter().map(|camera| camera.project(world).map(&mut noisy)).collect()
    };
    (0..count).map(|_| row()).collect()
}

fn borrowed(columns: &[[Vec<f64>; 2]]) -> PixelColumns<'_> {
    PixelColumns::new(columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect())
}

#[test]
fn where_a_box_does_not_hold_its_eighths_do() {
    let (cameras, train) = world();
    let fit = AnyMethod::named("dlt").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    // The nearest points, whose error bars change the fastest.
    let rows = crowd_between(&cameras, (50.0, 60.0), PIECE);
    let columns = columns_of(&rows, 2);
    let mut locator = Locator::new(&*fit.reconstructor, None);
    // As if these cameras did not say themselves how sure points are.
    let Plan::Formulas(given) = fit.reconstructor.plan() else { panic!("cameras are formulas") };
    locator.spreads = Some(Spreads::new(&given.placed[0]));
    locator.map.base = Some(Rig::new(given.placed));
    let mut places = Places::default();
    while locator.spreads.as_ref().unwrap().made_eighths() < 8 {
        assert!(locator.done < 100 * PIECE);
        locator.locate_into(&borrowed(&columns), &mut places);
    }
    locator.locate_into(&borrowed(&columns), &mut places);
    // Between the places at which a box is tried the law of the noise may bend.
    let gaps = gaps_of_error_bars(&*fit.reconstructor, &rows[..4000], &places);
    assert!(gaps[3990] < 0.01 && gaps[3999] < 0.025, "{:?}", &gaps[3990..]);
}

/// By what share each point's error bars, or the residual to be expected, differ at most from those of the point by
/// itself; sorted.
fn gaps_of_error_bars(
    map: &dyn Reconstructor,
    rows: &[Vec<Option<Pixel>>],
    places: &Places,
) -> Vec<f64> {
    let gap = |(index, row): (usize, &Vec<Option<Pixel>>)| {
        let exact = map.locate(row).unwrap();
        let mut most = (places.residual_sigma[index] / exact.residual_sigma - 1.0).abs();
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
fn formulas_need_no_boxes() {
    let (_, train) = world();
    for name in ["dlt", "soloff"] {
        let fit = AnyMethod::named(name).unwrap().fit_checked(&train, 0, &Silent).unwrap();
        assert!(Locator::new(&*fit.reconstructor, None).spreads.is_none(), "{name}");
    }
}
