//! `wheatstone chart`.

use crate::failure::{Failure, Outcome};
use crate::verbosity::say;
use clap::{Args, builder::PossibleValuesParser};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use wheatstone::{
    chart::{
        AnyChart,
        sheet::{self, Paper, Sheet},
    },
    storage,
};

/// Write a chart to print, to true scale, with its name and a ruler
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    wheatstone chart --paper a4 -o board.pdf\n  \
    wheatstone chart chessboard --columns 9 --rows 6 --pitch 25 --unit mm -o chart.pdf\n  \
    wheatstone chart line-grid --columns 9 --rows 7 --pitch 5 --unit cm -o chart.pdf\n  \
    wheatstone chart dot-grid --columns 4 --rows 11 --pitch 20 --asymmetric -o chart.pdf\n  \
    wheatstone chart charuco --columns 8 --rows 6 --pitch 30 --marker 22 --dictionary DICT_5X5_100 -o chart.pdf\n  \
    wheatstone chart april-grid --columns 6 --rows 6 --tag 30 --spacing 0.3 -o chart.pdf\n\n\
    Print it at 100 %, and check the ruler along its lower edge.")]
pub(crate) struct Chart {
    /// The kind of chart
    #[arg(default_value = "chessboard", value_parser = PossibleValuesParser::new(AnyChart::NAMES))]
    kind: String,
    /// Unit of the pitch
    #[arg(long, default_value = "mm", value_parser = PossibleValuesParser::new(sheet::UNITS))]
    unit: String,
    /// The paper that it must fit; without a size, the chart is as large as fits
    #[arg(long, value_parser = PossibleValuesParser::new(Paper::NAMES))]
    paper: Option<String>,
    /// The file to write, a PDF or an SVG drawing by its extension
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
    /// Whether no length of the chart is given.
    fn sizes_are_free(&self) -> bool {
        [self.pitch, self.tag, self.marker, self.diameter].iter().all(Option::is_none)
    }

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
        let pitch = fields.get("pitch").and_then(Value::as_f64);
        let times = self.pitch.zip(pitch).map_or(1.0, |(given, default)| given / default);
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
        // Markers, and the way to a second level, as large a part of the pitch as on the default chart.
        for name in ["marker", "second"] {
            if let Some(value) = fields.get_mut(name) {
                *value = scaled(value, times);
            }
        }
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

/// A number, or each of a list, so many times as large.
fn scaled(value: &Value, times: f64) -> Value {
    match value {
        Value::Array(values) => values.iter().map(|value| scaled(value, times)).collect(),
        value => value.as_f64().map_or_else(|| value.clone(), |number| json!(times * number)),
    }
}

impl Chart {
    pub(crate) fn run(mut self) -> Outcome {
        let extension = self.output.extension().and_then(|end| end.to_str()).map(str::to_lowercase);
        let paper = self.paper.as_deref().map(Paper::named).transpose()?;
        if let Some(paper) = paper {
            self.fill(paper)?;
        }
        let chart = self.options.chart(&self.kind)?;
        let sheet = Sheet::new(&chart, &self.unit, paper)?;
        let bytes = match extension.as_deref() {
            Some("pdf") => sheet.pdf(),
            Some("svg") => sheet.svg().into_bytes(),
            _ => {
                return Err(Failure::usage(
                    format!("`{}` is neither a PDF nor an SVG file", self.output.display()),
                    "let its name end in `.pdf` or `.svg`",
                ));
            }
        };
        storage::write(&self.output, &bytes)?;
        say!("Wrote {}: {}", self.output.display(), sheet.title());
        say!("Print it at 100 %, and measure its ruler");
        Ok(())
    }

    /// Makes a chart whose size is not given as large as fits.
    fn fill(&mut self, paper: Paper) -> Outcome {
        let chart = self.options.chart(&self.kind)?;
        let options = &mut self.options;
        let size = match chart.size() {
            Some(("pitch", size)) if options.sizes_are_free() => (&mut options.pitch, size),
            Some(("tag", size)) if options.sizes_are_free() => (&mut options.tag, size),
            _ => return Ok(()),
        };
        let most = size.1 * sheet::largest(&chart, &self.unit, paper)?;
        *size.0 = Some(sheet::rounded_down(most, &self.unit));
        Ok(())
    }
}
