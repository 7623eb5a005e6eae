//! The paper's figures as pictures and tables.

use super::Reproduction;
use crate::{Report, figures};
use std::path::Path;
use wheatstone_core::{Error, Result, storage};

/// A named curve.
struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
}

/// Writes figures 1 to 6 as SVG, 5 and 6 as CSV too, the tables as CSV, and everything as
/// `reproduction.json`.
///
/// # Errors
///
/// [`Error::Io`].
pub fn write(all: &Reproduction, folder: &Path) -> Result<()> {
    storage::write_folder(folder, |folder| write_into(all, folder))
}

fn write_into(all: &Reproduction, folder: &Path) -> Result<()> {
    let save = |name: &str, text: String| storage::write(&folder.join(name), text.as_bytes());
    let mut json = serde_json::to_string_pretty(all)
        .map_err(|e| Error::writing(folder.join("reproduction.json"), e.into()))?;
    json.push('\n');
    save("reproduction.json", json)?;
    let (learning, beyond) = (learning(all), beyond(all));
    let report = Report::of_reproduction(all, "", None);
    for figure in figures::all(&report) {
        let file = match figure.name {
            "paper-robot" => "figure-1.svg",
            "paper-network" => "figure-2.svg",
            "paper-sigmoid" => "figure-3.svg",
            "paper-chart" => "figure-4.svg",
            "learning" => "figure-5.svg",
            "beyond" => "figure-6.svg",
            _ => continue,
        };
        for panel in &figure.panels {
            save(file, panel.standalone())?;
        }
    }
    save("figure-5.csv", table("epoch", &learning))?;
    save("figure-6.csv", table("Z", &beyond))?;
    save("claims.csv", claims(all))?;
    save("architectures.csv", architectures(all))?;
    save("comparison.csv", comparison(all))
}

fn learning(all: &Reproduction) -> Vec<Curve> {
    let curve = |name: &str, pick: fn(&super::LearningPoint) -> f64| Curve {
        name: name.into(),
        points: all.figure_5.iter().map(|point| (point.epoch as f64, pick(point))).collect(),
    };
    vec![
        curve("held-out, median of the seeds", |point| point.exam_percent.median),
        curve("held-out, best seed", |point| point.exam_percent.least),
        curve("held-out, worst seed", |point| point.exam_percent.greatest),
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

fn claims(all: &Reproduction) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let row = |claim: &super::Claim| {
        let cells: [&str; 4] = [&claim.claim, &claim.measured, claim.verdict.words(), &claim.why];
        cells.map(quoted).join(",") + "\n"
    };
    String::from("claim,measured,verdict,why\n") + &all.claims.iter().map(row).collect::<String>()
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
