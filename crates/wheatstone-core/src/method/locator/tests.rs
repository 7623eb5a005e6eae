use super::*;
use crate::{
    camera::pinhole::Pinhole,
    method::{
        AnyMethod,
        fitted_cameras::tests::{rig, staged},
    },
};
use wheatstone_numeric::progress::Silent;

#[test]
fn formulas_need_no_boxes() {
    let cameras = rig(vec![Pinhole { focal: [690.0; 2], principal: [320.0, 240.0] }; 2]);
    let train = staged(&cameras, 0.3, (0.1, 3), |world| world);
    for name in ["dlt", "soloff"] {
        let fit = AnyMethod::named(name).unwrap().fit_checked(&train, 0, &Silent).unwrap();
        assert!(Locator::new(&*fit.reconstructor, None).spreads.is_none(), "{name}");
    }
}
