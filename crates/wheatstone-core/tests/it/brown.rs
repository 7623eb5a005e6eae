//! Brown's terms, as many as a lens needs.

use crate::staged::{rig, staged};
use wheatstone_core::{
    Error,
    camera::brown_conrady::BrownConrady,
    method::{AnyMethod, AnyReconstructor, Method, brown::Brown},
};
use wheatstone_numeric::progress::Silent;

#[test]
fn a_camera_takes_no_more_terms_than_it_needs() {
    let terms = |radial: [f64; 3], tangential| {
        let lens = BrownConrady { radial, tangential, ..BrownConrady::default() };
        let data = staged(&rig(vec![lens; 2]), 0.4, (0.1, 1), |p| p);
        let method = AnyMethod::named("brown").unwrap();
        let fit = method.fit_checked(&data, 0, &Silent).unwrap();
        let AnyReconstructor::Brown(fitted) = fit.reconstructor else { unreachable!() };
        assert!((fitted.pixel_sigma - 0.1).abs() < 0.01, "{}", fitted.pixel_sigma);
        fitted.cameras[0].model
    };
    let plain = terms([0.0; 3], [0.0; 2]);
    assert_eq!((plain.radial, plain.tangential), ([0.0; 3], [0.0; 2]));
    let barrel = terms([-0.2, 0.0, 0.0], [0.0; 2]);
    assert_eq!((barrel.radial[1], barrel.tangential), (0.0, [0.0; 2]));
    assert!((barrel.radial[0] + 0.2).abs() < 0.005);
    let full = terms([-0.23, 0.12, -0.02], [1e-3, -5e-4]);
    assert!(full.radial[1] != 0.0 && (full.tangential[0] - 1e-3).abs() < 3e-4, "{full:?}");
}

#[test]
fn every_preset_fits_its_own_terms() {
    let lens = BrownConrady {
        rational: [0.05, 0.02, 0.0],
        prism: [2e-3, 0.0, -1e-3, 0.0],
        ..BrownConrady::default()
    };
    let data = staged(&rig(vec![lens; 2]), 0.4, (0.02, 2), |p| p);
    let sigma = |preset: &str| {
        let method = Brown::default().preset(preset).unwrap();
        match method.fit_checked(&data, 0, &Silent).unwrap().reconstructor {
            AnyReconstructor::Brown(fitted) => {
                let model = fitted.cameras[0].model;
                if preset == "pinhole" {
                    assert_eq!(model, BrownConrady::ideal(model.pinhole));
                }
                fitted.pixel_sigma
            }
            other => panic!("{other:?}"),
        }
    };
    assert!(sigma("full") < 0.022 && sigma("full") < sigma("default"));
    assert!(sigma("default") < sigma("radial") && sigma("radial") < sigma("pinhole"));
    assert!(sigma("fixed") < 2.0 * sigma("default") && sigma("rational") < sigma("radial"));
    let odd = Brown { radial: 4, ..Brown::default() };
    assert!(matches!(odd.fit(&data, 0, &Silent), Err(Error::Setting { .. })));
    assert!(matches!(odd.preset("wide"), Err(Error::UnknownName { .. })));
}
