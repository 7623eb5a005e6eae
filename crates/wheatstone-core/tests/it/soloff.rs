//! Soloff's polynomials of a made world.

use crate::worlds::charts;
use wheatstone_charts::chart::line_grid::LineGrid;
use wheatstone_core::{
    evaluate::{evaluate, floor},
    method::{Method, soloff::Soloff},
};
use wheatstone_numeric::progress::Silent;
use wheatstone_synthetic::{Noise, Rig, Stage, random_correspondences};

#[test]
fn near_the_floor_between_the_planes_and_sane_with_two() {
    let rig = Rig::named("paper", 2).unwrap();
    // A depth range that a quadratic can follow.
    for (step, bar) in [(5.0, 1.3), (20.0, 6.0)] {
        let stage = Stage { near: 90.0, far: 110.0, step };
        let data = charts(&rig, stage, Noise::Quantised, 400);
        let fit = Soloff {}.fit(&data, 0, &Silent).unwrap();
        let chart = LineGrid::default().into();
        let test = random_correspondences(&rig, &chart, (90.0, 110.0), (Noise::Quantised, 5), 500);
        let own = evaluate(&*fit.reconstructor, &test, None).unwrap().rms;
        let ratio = own / floor(&rig.cameras, &test).unwrap().rms;
        assert!(ratio < bar, "every {step}: {ratio}");
    }
}
