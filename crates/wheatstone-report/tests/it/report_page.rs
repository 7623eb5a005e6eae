//! The report's page in a browser, where there is one.

use super::browser::{chromium, works_on_a_phone_and_on_a_desk};
use wheatstone_charts::chart::line_grid::LineGrid;
use wheatstone_core::{Calibration, method::AnyMethod, preparation::Prepared};
use wheatstone_numeric::progress::Silent;
use wheatstone_report::{Material, Report, Wording};
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences};

fn html() -> String {
    let rig = Rig::named("paper", 3).unwrap();
    let chart = LineGrid::default().into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), Some(150));
    let method = AnyMethod::named("dlt").unwrap();
    let model =
        Calibration::fit(&method, &Prepared::as_given(data.clone()), 0, false, &Silent).unwrap();
    let material = Material {
        wording: Wording::default(),
        title: "a <model> & \"more\"".into(),
        command: None,
        model: &model,
        comparison: None,
        truth: Some(&rig.cameras),
        seen: None,
        held_out: true,
    };
    Report::of(&material, &Silent).unwrap().html()
}

#[test]
fn the_page_works_on_a_phone_and_on_a_desk_and_asks_nobody() {
    let Some(chromium) = chromium() else { return };
    // The panels of a figure are drawn to one scale, the last one alone in its row too.
    let act = "const uneven = (panels) => {
        const widths = [...panels.querySelectorAll('svg')].map((plot) => plot.getBoundingClientRect().width);
        return Math.max(...widths) - Math.min(...widths) > 1;
    };
    told.panels = page.querySelectorAll('.panels').length;
    told.uneven = [...page.querySelectorAll('.panels:not(.natural)')].filter(uneven).length;";
    for frame in works_on_a_phone_and_on_a_desk(&chromium, &html(), act) {
        assert!(frame["panels"].as_u64().unwrap() > 1, "{frame}");
        assert_eq!(frame["uneven"], 0, "{frame}");
    }
}
