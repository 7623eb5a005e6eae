//! Matches that are true and others that are not.

use wheatstone_charts::chart::line_grid::LineGrid;
use wheatstone_core::method::{
    AnyMethod, Located, Residual,
    mismatch::{MismatchTest, exchanged_cameras, mismatched_share},
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences};

#[test]
fn true_matches_are_called_false_at_the_stated_rate_or_less() {
    for (cameras, noise) in
        [(2, Noise::Normal(0.1)), (2, Noise::Quantised), (4, Noise::Normal(0.3))]
    {
        let rig = Rig::named("paper", cameras).unwrap();
        let chart = LineGrid::default().into();
        let views = Stage::default().views().unwrap();
        let train = chart_correspondences(&rig, &chart, &views, (noise, 3), None);
        let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
        let fit = &*fit.reconstructor;
        let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 4), 10_000);
        for rate in [0.01_f64, 0.001] {
            let test = MismatchTest::new(rate, cameras);
            let flagged = exam
                .correspondences
                .iter()
                .filter(|row| test.is_mismatch(&fit.locate(&row.pixels).unwrap(), cameras));
            let (count, expected) = (flagged.count() as f64, 10_000.0 * rate);
            // Four standard deviations of a count, and that of sigma's own error.
            let most = expected * 1.25 + 4.0 * expected.sqrt();
            assert!(count <= most, "{cameras}, {noise}: {count} at {rate}");
            let least = if noise == Noise::Quantised { 0.0 } else { 0.5 * expected - 3.0 };
            assert!(count >= least, "{cameras}, {noise}: {count} at {rate}");
        }
    }
}

#[test]
fn false_matches_are_told() {
    let rig = Rig::named("paper", 2).unwrap();
    let (chart, noise) = (LineGrid::default().into(), Noise::Normal(0.1));
    let views = Stage::default().views().unwrap();
    let train = chart_correspondences(&rig, &chart, &views, (noise, 3), None);
    let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let rows = &train.correspondences;
    let test = MismatchTest::new(0.001, 2);
    let false_pairs = rows.iter().zip(rows.iter().skip(40)).filter(|(one, other)| {
        let pair = [one.pixels[0], other.pixels[1]];
        fit.reconstructor.locate(&pair).is_none_or(|found| test.is_mismatch(&found, 2))
    });
    // Some points of a chart lie on each other's epipolar lines.
    assert!(false_pairs.count() > (rows.len() - 40) * 95 / 100);
    let found = fit.reconstructor.locate(&rows[0].pixels).unwrap();
    let none = Located { residual: None, ..found };
    assert!(!test.is_mismatch(&none, 2));
    let exact = Located { residual: Some(Residual { rms: 1e-9, sigma: 0.0 }), ..found };
    assert!(!test.is_mismatch(&exact, 2), "exact data is not a mismatch by rounding");
    assert_eq!(test.largest_residual(0.1, 1), f64::INFINITY);
}

#[test]
fn exchanged_cameras_are_told_apart_from_plain_mismatches() {
    let rig = Rig::named("paper", 3).unwrap();
    let (chart, noise) = (LineGrid::default().into(), Noise::Normal(0.1));
    let views = Stage::default().views().unwrap();
    let train = chart_correspondences(&rig, &chart, &views, (noise, 3), None);
    let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let pixels: Vec<_> = train.correspondences.iter().map(|row| row.pixels.clone()).collect();
    assert_eq!(exchanged_cameras(&*fit.reconstructor, &pixels, 1e-3), None);
    let mut exchanged = pixels.clone();
    exchanged.iter_mut().for_each(|row| row.swap(0, 2));
    assert_eq!(exchanged_cameras(&*fit.reconstructor, &exchanged, 1e-3), Some((0, 2)));
    let mut shifted = pixels.clone();
    let last = pixels.len() - 1;
    shifted.iter_mut().zip(&pixels).for_each(|(row, _)| row[1] = pixels[last][1]);
    assert_eq!(exchanged_cameras(&*fit.reconstructor, &shifted, 1e-3), None);
    assert!(mismatched_share(&*fit.reconstructor, &shifted, 1e-3).unwrap() > 0.9);
}
