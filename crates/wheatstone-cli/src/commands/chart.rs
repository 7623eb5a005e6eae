//! `wheatstone chart`.

use crate::failure::{Failure, Outcome};
use crate::voice::say;
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
    wheatstone chart line-grid --columns 9 --rows 7 --pitch 5 --unit cm -o chart.svg\n\n\
    Print it at 100 %, and check the ruler along its lower edge.")]
pub(crate) struct Chart {
    /// The kind of chart
    #[arg(value_parser = PossibleValuesParser::new(AnyChart::NAMES))]
    kind: String,
    /// Unit of the pitch
    #[arg(long, default_value = "mm", value_parser = PossibleValuesParser::new(svg::UNITS))]
    unit: String,
    /// Where the drawing goes
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    options: ChartOptions,
}

/// What a chart looks like.
#[derive(Args, Clone)]
pub(crate) struct ChartOptions {
    /// Inner corners or crossings across
    #[arg(long)]
    columns: Option<usize>,
    /// Inner corners or crossings down
    #[arg(long)]
    rows: Option<usize>,
    /// Distance of neighbouring points
    #[arg(long)]
    pub(crate) pitch: Option<f64>,
    /// Width of a line as a share of the pitch (line-grid)
    #[arg(long)]
    line_width: Option<f64>,
    /// The kind of chart, where the command does not say
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
        let given = [
            ("columns", self.columns.map(|n| json!(n))),
            ("rows", self.rows.map(|n| json!(n))),
            ("pitch", self.pitch.map(|n| json!(n))),
            ("line_width", self.line_width.map(|n| json!(n))),
        ];
        for (name, value) in given {
            if let Some(value) = value {
                fields.insert(name.into(), value);
            }
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
