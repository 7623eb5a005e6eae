//! A model's locator that is made ready once.

use wheatstone::{
    AnyMethod, Calibration, LineGrid, PixelColumns, PointNoise, Prepared, Silent,
    calibration::Imported,
    geometry::columns_of,
    synthetic::{Noise, Rig, Stage, chart_correspondences},
};

#[test]
fn a_model_s_points_are_those_of_each_by_itself_whoever_made_it() {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 3), Some(80));
    let method = AnyMethod::named("brown").unwrap();
    let prepared = Prepared::as_given(data.clone());
    let fitted = Calibration::fit(&method, &prepared, 0, false, &Silent).unwrap();
    let imported = |sizes| {
        let mut model = fitted.clone();
        model.data.pixels.clear();
        model.imported = Some(Imported {
            format: "opencv".into(),
            files: Vec::new(),
            cameras: Vec::new(),
            sizes,
            pixel_sigma: 0.1,
        });
        model
    };
    let noise: PointNoise = serde_json::from_str("4.0").unwrap();
    let noisy = Calibration { point_noise: Some(noise), ..fitted.clone() };
    // Of a lens that this model lacks.
    let linear = AnyMethod::named("dlt").unwrap();
    let scaled = Calibration::fit(&linear, &prepared, 0, false, &Silent).unwrap();
    assert!(scaled.covariance_scale.is_some());
    let models = [
        fitted.clone(),
        noisy,
        scaled,
        imported(vec![Some([640, 480]); 2]),
        imported(vec![None; 2]),
    ];
    let rows: Vec<_> = data.correspondences.iter().map(|row| row.pixels.clone()).collect();
    let columns = columns_of(&rows, 2);
    let pixels =
        PixelColumns::new(columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect());
    for model in models {
        let whole = model.settled_locator(true).locate(&pixels);
        let alone = model.settled_locator(false).locate(&pixels);
        assert!(alone.covariance[0].is_empty() && alone.trust.is_empty());
        for (index, row) in rows.iter().enumerate() {
            let (exact, own) = (model.locate(row).unwrap(), whole.get(index).unwrap());
            for axis in 0..3 {
                let sigma = exact.covariance[(axis, axis)].sqrt();
                let off = own.point[axis] - exact.point[axis];
                let off_alone = alone.point[axis][index] - exact.point[axis];
                assert!(off.abs().max(off_alone.abs()) < 2e-3 * sigma);
                assert!((own.covariance[(axis, axis)].sqrt() / sigma - 1.0).abs() < 0.01);
            }
        }
    }
}
