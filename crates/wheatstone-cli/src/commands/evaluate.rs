//! `wheatstone evaluate`.

use super::{compare::budget_as_text, print_json};
use crate::{
    failure::Outcome,
    input::{Reading, load},
    progress::Bar,
    table::figure,
};
use clap::Args;
use std::path::PathBuf;
use wheatstone::{
    Calibration,
    evaluate::{Budget, Evaluation, evaluate},
};

/// Judge a model on points whose places are known
#[derive(Args)]
#[command(after_help = "Example:\n  wheatstone evaluate model.json exam.csv --json")]
pub(crate) struct Evaluate {
    /// The model file
    model: PathBuf,
    /// A capture or a points file with X, Y, Z; not the one that was fitted
    input: PathBuf,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
}

/// The figures as JSON.
#[derive(serde::Serialize)]
struct Judged<'a> {
    #[serde(flatten)]
    found: &'a Evaluation,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<&'a Budget>,
}

impl Evaluate {
    pub(crate) fn run(mut self) -> Outcome {
        let bar = Bar::new();
        let model = Calibration::load(&self.model)?;
        // A points file's numbers are in the model's unit unless it says otherwise.
        self.reading.unit.get_or_insert_with(|| model.unit.clone());
        let data = load(&self.input, &self.reading, &bar)?.data;
        if data.unit != model.unit {
            drop(bar);
            return Err(wheatstone::Error::Mismatch {
                what: "unit",
                model: model.unit,
                data: data.unit,
            }
            .into());
        }
        let found = evaluate(&*model.reconstructor, &data, model.viewpoint)?;
        let budget = model.budget(&data, &bar)?;
        drop(bar);
        if self.json {
            return print_json(&Judged { found: &found, budget: budget.as_ref() });
        }
        let unit = &found.unit;
        let [x, y, z] = found.rms_xyz.map(figure);
        eprintln!("{} of {} points located", found.located, found.n);
        eprintln!(
            "Error {} {unit} rms, {} {unit} median, 95 % below {} {unit}; {} % of the distance on average",
            figure(found.rms),
            figure(found.median),
            figure(found.p95),
            figure(found.mean_percent)
        );
        eprintln!("Along X {x}, Y {y}, Z {z} {unit} rms");
        if let Some(budget) = &budget {
            eprint!("{}", budget_as_text(budget, unit));
        }
        Ok(())
    }
}
