//! The paper's figures as pictures and tables.

use super::Reproduction;
use plotters::prelude::{
    ChartBuilder, Color, IntoDrawingArea, LineSeries, PathElement, RGBColor, SVGBackend, WHITE,
};
use std::path::Path;
use wheatstone_core::{Error, Result, storage};

/// A named curve.
struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
}

/// Okabe and Ito's colours, which colour-blind readers can tell apart
/// (doi:10.1038/nmeth.1618).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// Writes `figure-5` and `figure-6` as SVG and CSV, the tables as CSV, and everything as
/// `reproduction.json`.
///
/// # Errors
///
/// [`Error::Io`].
pub fn write(all: &Reproduction, folder: &Path) -> Result<()> {
    storage::create_folder(folder)?;
    let save = |name: &str, text: String| storage::write(&folder.join(name), text.as_bytes());
    let mut json = serde_json::to_string_pretty(all)
        .map_err(|e| Error::writing(folder.join("reproduction.json"), e.into()))?;
    json.push('\n');
    save("reproduction.json", json)?;
    let (learning, beyond) = (learning(all), beyond(all));
    let axes = ["epochs", "mean error, % of the distance"];
    save("figure-5.svg", plot(&learning, "Figure 5: learning", axes, folder)?)?;
    let axes = ["Z, cm", "mean error of Z, %"];
    save("figure-6.svg", plot(&beyond, "Figure 6: beyond the trained range", axes, folder)?)?;
    save("figure-5.csv", table("epoch", &learning))?;
    save("figure-6.csv", table("Z", &beyond))?;
    save("architectures.csv", architectures(all))?;
    save("comparison.csv", comparison(all))
}

fn learning(all: &Reproduction) -> Vec<Curve> {
    let curve = |name: &str, pick: fn(&super::LearningPoint) -> f64| Curve {
        name: name.into(),
        points: all.figure_5.iter().map(|point| (point.epoch as f64, pick(point))).collect(),
    };
    vec![
        curve("exam, median of the seeds", |point| point.exam_percent.median),
        curve("exam, best seed", |point| point.exam_percent.least),
        curve("exam, worst seed", |point| point.exam_percent.greatest),
        curve("training pairs, median", |point| point.training_percent.median),
    ]
}

fn beyond(all: &Reproduction) -> Vec<Curve> {
    let curve = |curve: &super::BeyondCurve| Curve {
        name: curve.method.clone(),
        points: curve.points.iter().map(|point| (point.distance, point.percent)).collect(),
    };
    all.figure_6.iter().map(curve).collect()
}

fn plot(curves: &[Curve], title: &str, axes: [&str; 2], folder: &Path) -> Result<String> {
    let mut text = String::new();
    draw(&mut text, curves, title, axes)
        .map_err(|e| Error::writing(folder, std::io::Error::other(e)))?;
    Ok(text)
}

/// Draws lines from zero upwards; values beyond three times the last ones are cut off, so that the
/// first epochs do not flatten the rest.
fn draw(
    text: &mut String,
    curves: &[Curve],
    title: &str,
    [across, up]: [&str; 2],
) -> std::result::Result<(), String> {
    let points = || curves.iter().flat_map(|curve| curve.points.iter());
    let left = points().map(|p| p.0).fold(f64::INFINITY, f64::min);
    let right = points().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    let last = curves.iter().filter_map(|curve| curve.points.last()).map(|p| p.1);
    let highest = points().map(|p| p.1).fold(0.0, f64::max);
    let top = (3.0 * last.fold(0.0, f64::max)).min(1.05 * highest);
    let area = SVGBackend::with_string(text, (820, 480)).into_drawing_area();
    let failed = |e: &dyn std::fmt::Display| e.to_string();
    area.fill(&WHITE).map_err(|e| failed(&e))?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .margin_right(36)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d(left..right, 0.0..top)
        .map_err(|e| failed(&e))?;
    chart
        .configure_mesh()
        .x_desc(across)
        .y_desc(up)
        .x_label_formatter(&f64::to_string)
        .y_label_formatter(&f64::to_string)
        .light_line_style(WHITE)
        .draw()
        .map_err(|e| failed(&e))?;
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let inside = curve.points.iter().copied().filter(|point| point.1 <= top);
        chart
            .draw_series(LineSeries::new(inside, colour.stroke_width(2)))
            .map_err(|e| failed(&e))?
            .label(curve.name.clone())
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(160, 160, 160))
        .draw()
        .map_err(|e| failed(&e))?;
    area.present().map_err(|e| failed(&e))
}

/// Curves over common abscissas as a table.
fn table(first: &str, curves: &[Curve]) -> String {
    let mut text = first.to_owned();
    for curve in curves {
        text += &format!(",\"{}\"", curve.name);
    }
    text.push('\n');
    for index in 0..curves.first().map_or(0, |curve| curve.points.len()) {
        text += &curves[0].points[index].0.to_string();
        for curve in curves {
            text += &format!(",{}", curve.points[index].1);
        }
        text.push('\n');
    }
    text
}

fn architectures(all: &Reproduction) -> String {
    let mut text =
        String::from("hidden,median_percent,least_percent,greatest_percent,epochs_to_5_percent\n");
    for net in &all.architectures {
        let hidden: Vec<String> = net.hidden.iter().map(usize::to_string).collect();
        let p = net.exam_percent;
        let epochs = net.epochs_to_5_percent.map_or_else(String::new, |epochs| epochs.to_string());
        text += &format!("{},{},{},{},{epochs}\n", hidden.join("-"), p.median, p.least, p.greatest);
    }
    text
}

fn comparison(all: &Reproduction) -> String {
    let mut text = String::from("method,inside_percent,beyond_percent,inside_ratio_to_floor\n");
    for row in &all.comparison {
        text += &format!(
            "{},{},{},{}\n",
            row.method, row.inside_percent, row.beyond_percent, row.inside_ratio_to_floor
        );
    }
    text
}
