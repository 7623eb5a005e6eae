//! Calibrates two cameras from a chart held by hand: its places are not known and are solved for.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use wheatstone::{
    AnyMethod, Calibration, LineGrid, Preparation, Silent,
    fit::bundle::{BundleSettings, Gauge},
    synthetic::{HandHeld, Noise, Rig, hand_held_correspondences},
};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // Points on the chart, in centimetres, with their pixels; no world coordinates.
    let rig = Rig::named("paper", 2)?;
    let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let hand = HandHeld { views: 12, ..HandHeld::default() };
    let places = hand.placements(&chart, 0)?;
    let (data, _) = hand_held_correspondences(&rig, &chart, &places, (Noise::Normal(0.1), 0));

    // Bundle adjustment places the charts. The world is the frame of the first camera.
    let bundle_settings = BundleSettings { gauge: Gauge::FirstCamera, ..BundleSettings::default() };
    let prepared =
        Preparation { bundle_settings, ..Preparation::default() }.run(data, 0, &Silent)?;
    let placed = prepared.placed.as_ref().ok_or("no chart was placed")?;
    println!("{} views placed with the lens `{}`", placed.views.len(), placed.lens);
    println!("reprojection error {:.3} px rms", placed.rms);

    let centres: Vec<_> = rig.cameras.iter().map(|camera| camera.centre()).collect();
    let baseline = (centres[1] - centres[0]).norm();
    println!("baseline {:.3} cm, in truth {baseline:.3} cm", placed.baselines[0]);

    let method = AnyMethod::named("brown")?;
    let model = Calibration::fit(&method, &prepared, 0, true, &Silent)?;
    let validation = model.validation.as_ref().ok_or("not validated")?;
    println!("on views left out: {:.4} cm rms", validation.all.rms);
    Ok(())
}
