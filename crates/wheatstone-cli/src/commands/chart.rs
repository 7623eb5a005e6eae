//! `wheatstone chart`.

use crate::failure::{Failure, Outcome};
use crate::verbosity::say;
use clap::{Args, builder::PossibleValuesParser};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use wheatstone::{
    chart::{AnyChart, svg},
    storage,
};

/// Write a chart to print, to true scale
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    wheatstone chart chessboard --columns 9 --rows 6 --pitch 25 --unit mm -o chart.svg\n  \
    wheatstone chart line-grid --columns 9 --rows 7 --pitch 5 --unit cm -o chart.svg\n  \
    wheatstone chart dot-grid --columns 4 --rows 11 --pitch 20 --asymmetric -o chart.svg\n  \
    wheatstone chart charuco --columns 8 --rows 6 --pitch 30 --marker 22 --dictionary DICT_5X5_100 -o chart.svg\n  \
    wheatstone chart april-grid --columns 6 --rows 6 --tag 30 --spacing 0.3 -o chart.svg\n\n\
    Print it at 100 %, and check the ruler along its lower edge.")]
pub(crate) struct Chart {
    /// The kind of chart
    #[arg(value_parser = PossibleValuesParser::new(AnyChart::NAMES))]
    kind: String,
    /// Unit of the pitch
    #[arg(long, default_value = "mm", value_parser = PossibleValuesParser::new(svg::UNITS))]
    unit: String,
    /// The file to write, an SVG drawing
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    options: ChartOptions,
}

/// What a chart looks like.
#[derive(Args, Clone)]
pub(crate) struct ChartOptions {
    /// Inner corners, crossings or dots across; squares of a charuco board, tags of an april-grid
    #[arg(long)]
    columns: Option<usize>,
    /// Inner corners, crossings or dots down; squares of a charuco board, tags of an april-grid
    #[arg(long)]
    rows: Option<usize>,
    /// Distance between neighbouring points
    #[arg(long)]
    pub(crate) pitch: Option<f64>,
    /// Width of a line as a fraction of the pitch (line-grid)
    #[arg(long)]
    line_width: Option<f64>,
    /// Diameter of a dot (dot-grid)
    #[arg(long)]
    diameter: Option<f64>,
    /// Every second row is shifted by the pitch (dot-grid)
    #[arg(long)]
    asymmetric: bool,
    /// The first dot is larger (dot-grid)
    #[arg(long)]
    first_larger: bool,
    /// Side of a tag (april-grid)
    #[arg(long)]
    tag: Option<f64>,
    /// Gap between tags as a fraction of their side (april-grid)
    #[arg(long)]
    spacing: Option<f64>,
    /// Side of a marker (charuco)
    #[arg(long)]
    marker: Option<f64>,
    /// The markers' dictionary, by OpenCV's name (charuco)
    #[arg(long)]
    dictionary: Option<String>,
    /// Boards with an even count of rows begin with a light square (charuco)
    #[arg(long)]
    legacy: bool,
    /// The kind of chart, if the command does not name it
    #[arg(long = "chart", value_name = "KIND", value_parser = PossibleValuesParser::new(AnyChart::NAMES))]
    chart_kind: Option<String>,
}

impl ChartOptions {
    /// The chart that these options describe: `kind` unless they name another, its defaults for
    /// what they leave out.
    pub(crate) fn chart(&self, kind: &str) -> Outcome<AnyChart> {
        let kind = self.chart_kind.as_deref().unwrap_or(kind);
        let default = AnyChart::all()
            .into_iter()
            .map(|chart| serde_json::to_value(chart).unwrap_or_default())
            .find(|chart| chart["type"] == kind);
        let mut fields: Map<String, Value> = match default {
            Some(Value::Object(fields)) => fields,
            _ => Map::new(),
        };
        let number = |name: &str| fields.get(name).and_then(Value::as_f64);
        let marker_share =
            number("marker").zip(number("pitch")).map(|(marker, pitch)| marker / pitch);
        let given = [
            ("columns", self.columns.map(|n| json!(n))),
            ("rows", self.rows.map(|n| json!(n))),
            ("pitch", self.pitch.map(|n| json!(n))),
            ("line_width", self.line_width.map(|n| json!(n))),
            ("diameter", self.diameter.map(|n| json!(n))),
            ("asymmetric", self.asymmetric.then_some(json!(true))),
            ("first_larger", self.first_larger.then_some(json!(true))),
            ("marker", self.marker.map(|n| json!(n))),
            ("dictionary", self.dictionary.as_ref().map(|name| json!(name))),
            ("tag", self.tag.map(|n| json!(n))),
            ("spacing", self.spacing.map(|n| json!(n))),
            ("legacy", self.legacy.then_some(json!(true))),
        ];
        for (name, value) in given {
            if let Some(value) = value {
                fields.insert(name.into(), value);
            }
        }
        // Markers as large a part of their squares as on the default board.
        if let (Some(pitch), None, Some(marker)) = (self.pitch, self.marker, marker_share) {
            fields.insert("marker".into(), json!(marker * pitch));
        }
        let chart: AnyChart = serde_json::from_value(Value::Object(fields)).map_err(|e| {
            Failure::usage(format!("no {kind}: {e}"), "`wheatstone chart --help` lists the options")
        })?;
        chart.validate()?;
        Ok(chart)
    }
}

impl Chart {
    pub(crate) fn run(self) -> Outcome {
        let chart = self.options.chart(&self.kind)?;
        let title = format!("{} {}", self.kind, self.output.display());
        let drawing = svg::draw(&*chart, &self.unit, &title)?;
        storage::write(&self.output, drawing.as_bytes())?;
        say!("Wrote {}; print it at 100 %", self.output.display());
        Ok(())
    }
}
