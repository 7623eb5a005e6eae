//! Counterparts of the 2001 paper's figures 1 to 4: the robot's cameras, the network, its sigmoid, and the chart.

use super::{
    super::plot::{HEIGHT, Panel, Plot, WIDTH, scale::Scale, short},
    Figure,
};
use crate::{Report, SetupFigures, text::escape};
use maud::html;

/// Half the width of the robot's body, in centimetres: that of the robot that `drive` simulates.
const BODY: f64 = 12.0;

/// Figure 1, from above.
pub(super) fn robot(report: &Report) -> Option<Figure> {
    let setup = report.setup.as_ref()?;
    let far = setup.stations.iter().copied().fold(0.0, f64::max) + 10.0;
    let [left, right] = setup.chart;
    let side = 2.0 * right.max(-left);
    let names = ["Z, cm", "X, cm"];
    let mut plot = Plot::square((-30.0, far), (-side, side), (true, None), names);
    let circle = (0..=60).map(|step| {
        let angle = std::f64::consts::TAU * f64::from(step) / 60.0;
        [BODY * libm::cos(angle) - BODY, BODY * libm::sin(angle)]
    });
    plot.line(&circle.collect::<Vec<_>>(), "ink", "");
    for station in &setup.stations {
        plot.line(&[[*station, left], [*station, right]], "c2", "");
    }
    for (camera, [[x, z], borders @ ..]) in setup.cameras.iter().enumerate() {
        let (line, dot) = (["c0 thin", "c1 thin"][camera % 2], ["f0", "f1"][camera % 2]);
        for [border_x, border_z] in borders {
            let by = [border_z - z, border_x - x];
            // As far as the drawing goes.
            let aside = (by[1].signum() * side - x) / by[1];
            let reach = ((far - z) / by[0]).min(aside);
            plot.line(&[[*z, *x], [z + reach * by[0], x + reach * by[1]]], line, "");
        }
        plot.dot([*z, *x], dot, (4.0, None));
    }
    let apart = match &setup.cameras[..] {
        [a, b, ..] => libm::hypot(a[0][0] - b[0][0], a[0][1] - b[0][1]),
        _ => 0.0,
    };
    Some(Figure {
        name: "paper-robot",
        title: "The robot's cameras (figure 1 of the 2001 paper)",
        how: format!(
            "From above: the robot's body (circle), its two cameras {apart:.1} cm apart with their fields of view, and the chart's {} places (green).",
            setup.stations.len()
        ),
        good: "Both fields of view hold all of the chart that is used; the axes need not be aligned.",
        panels: vec![plot.finish("", "Two cameras and the places of the chart, from above.")],
    })
}

/// Figure 2.
pub(super) fn network(report: &Report) -> Option<Figure> {
    let setup = report.setup.as_ref()?;
    let layers = &setup.layers;
    let place = |layer: usize, unit: usize| {
        let across = 90.0 + (WIDTH - 180.0) * layer as f64 / (layers.len() - 1).max(1) as f64;
        let step = (HEIGHT - 50.0) / layers.iter().copied().max().unwrap_or(1) as f64;
        [across, 0.5 * HEIGHT + step * (unit as f64 - 0.5 * (layers[layer] as f64 - 1.0))]
    };
    let mut links = String::new();
    for layer in 1..layers.len() {
        for from in 0..layers[layer - 1] {
            for to in 0..layers[layer] {
                let ([a, b], [c, d]) = (place(layer - 1, from), place(layer, to));
                links += &format!("M{} {}L{} {}", short(a), short(b), short(c), short(d));
            }
        }
    }
    let units =
        (0..layers.len()).flat_map(|layer| (0..layers[layer]).map(move |unit| (layer, unit)));
    let units = units.map(|(layer, unit)| place(layer, unit).map(short));
    let last = layers.len() - 1;
    let inputs = (0..layers[0]).map(|unit| {
        let [x, y] = place(0, unit);
        ([short(x - 14.0), short(y + 4.0)], format!("{}{}", ["x", "y"][unit % 2], unit / 2 + 1))
    });
    let outputs = (0..layers[last]).map(|unit| {
        let [x, y] = place(last, unit);
        ([short(x + 14.0), short(y + 4.0)], ["X", "Y", "Z"].get(unit).copied().unwrap_or(""))
    });
    let body = html! {
        path.grid d=(links) {}
        @for [x, y] in units { circle.f0 cx=(x) cy=(y) r="8" {} }
        @for ([x, y], name) in inputs { text x=(x) y=(y) class="name end" { (escape(&name)) } }
        @for ([x, y], name) in outputs { text x=(x) y=(y) class="name" { (escape(name)) } }
    };
    let sizes: Vec<String> = layers.iter().map(usize::to_string).collect();
    let weights: usize = layers.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum();
    let alternative = format!("A network of {} units.", sizes.join("-"));
    Some(Figure {
        name: "paper-network",
        title: "The network (figure 2 of the 2001 paper)",
        how: format!(
            "From the pixels of both cameras, left, to the point, right: {} units, {weights} weights.",
            sizes.join("-")
        ),
        good: "Fewer weights than the points have coordinates.",
        panels: vec![Panel { alternative, heading: String::new(), size: [WIDTH, HEIGHT], body }],
    })
}

/// Figure 3.
pub(super) fn sigmoid(report: &Report) -> Option<Figure> {
    report.setup.as_ref()?;
    let mut plot =
        Plot::new((Scale::exactly(-6.0, 6.0), "input s"), (Scale::exactly(0.0, 1.0), "output"));
    for (gain, look) in [(0.5, "c1 dashed"), (1.0, "c0"), (2.0, "c2 dotted")] {
        let at = |step: i32| {
            let input = 0.1 * f64::from(step);
            [input, 1.0 / (1.0 + libm::exp(-gain * input))]
        };
        plot.line(&(-60..=60).map(at).collect::<Vec<_>>(), look, &format!("a = {gain}"));
    }
    Some(Figure {
        name: "paper-sigmoid",
        title: "The sigmoid (figure 3 of the 2001 paper)",
        how: "What a hidden unit puts out, 1 / (1 + exp(-a s)), for three gains a; the recipe's is 1.".into(),
        good: "Inputs lie where the curve is steep: far out a unit saturates and learns nothing.",
        panels: vec![plot.finish("", "The log-sigmoid for gains of 0.5, 1 and 2.")],
    })
}

/// Figure 4, as both cameras see it.
pub(super) fn chart(report: &Report) -> Option<Figure> {
    let setup = report.setup.as_ref()?;
    Some(Figure {
        name: "paper-chart",
        title: "The chart (figure 4 of the 2001 paper)",
        how: "The grid of lines 50 cm ahead as camera 1 (blue) and camera 2 (orange) see it; the points are the crossings.".into(),
        good: "Crossings all over both pictures.",
        panels: vec![chart_panel(setup)],
    })
}

fn chart_panel(setup: &SetupFigures) -> Panel {
    let [width, height] = setup.picture;
    let names = ["x, pixels", "y, pixels"];
    let mut plot = Plot::square((0.0, width), (0.0, height), (true, None), names);
    for (camera, lines) in setup.lines.iter().enumerate() {
        let look = ["c0 thin", "c1 thin"][camera % 2];
        for line in lines {
            plot.line(line, look, "");
        }
    }
    plot.finish("", "A grid of lines as two cameras see it, shifted against each other.")
}
