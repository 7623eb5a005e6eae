//! `wheatstone reproduce`.

use super::{
    print_json,
    report::{quoted, write as write_report},
};
use crate::verbosity::say;
use crate::{
    browser::Showing,
    failure::Outcome,
    progress::Bar,
    table::{figure, table},
};
use clap::Args;
use std::path::PathBuf;
use wheatstone::{
    method::AnyMethod,
    report::{
        Report,
        reproduction::{Drives, Effort, Reproduction, reproduce, write},
    },
    robot::trial::{Summary, Trial, run_all},
};

/// Reproduce the 2001 paper: its figures and claims, each beside what is measured
///
/// Every claim is tested as the paper words it, by a criterion that is printed beside it. What was not
/// run - shorter training, no drives - is not tested.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone reproduce\n  wheatstone reproduce --seeds 1 --epochs 20000 --worlds 0 --out quick/"
)]
pub(crate) struct Reproduce {
    /// The folder for figures, tables, reproduction.json and report.html
    #[arg(long, value_name = "DIR", default_value = "reproduction")]
    out: PathBuf,
    /// Seeds of the paper's network
    #[arg(long, default_value_t = Effort::default().seeds)]
    seeds: u64,
    /// Epochs of its training; claims of longer training are not tested
    #[arg(long, default_value_t = Effort::default().epochs)]
    epochs: u64,
    /// Simple worlds that the robot drives in with the paper's recipe; 0 leaves its claim untested
    #[arg(long, value_name = "N", default_value_t = 10)]
    worlds: u64,
    /// Print everything as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    showing: Showing,
}

impl Reproduce {
    pub(crate) fn run(self) -> Outcome {
        let bar = Bar::new();
        let mut all = reproduce(Effort { seeds: self.seeds, epochs: self.epochs }, &bar)?;
        if self.worlds > 0 {
            all = all.with_drives(drives(self.worlds, &bar)?);
        }
        drop(bar);
        write(&all, &self.out)?;
        say!("{}", as_text(&all).trim_end());
        say!("");
        let report =
            Report::of_reproduction(&all, "The 2001 paper, reproduced", Some(self.command()));
        write_report(&report, &self.out.join("report.html"), &self.showing)?;
        say!("Figures and tables  {}", self.out.display());
        if self.json {
            print_json(&all)?;
        }
        Ok(())
    }

    /// What to type to get it again.
    fn command(&self) -> String {
        let Self { seeds, epochs, worlds, .. } = self;
        let out = quoted(&self.out);
        format!(
            "wheatstone reproduce --seeds {seeds} --epochs {epochs} --worlds {worlds} --out {out}"
        )
    }
}

/// Drives the robot by the paper's recipe.
fn drives(worlds: u64, bar: &Bar) -> Outcome<Drives> {
    let method = AnyMethod::named("network")?.preset("paper")?;
    // More than the robot itself dares.
    const STEPS: usize = 1001;
    let trial =
        |seed| Trial { seed, simple: true, method: method.clone(), steps: STEPS, trouble: None };
    let trials: Vec<Trial> = (0..worlds).map(trial).collect();
    let summary = Summary::of(&run_all(&trials, &|_, _| None, &|| 0.0, bar)?);
    let Summary { worlds, reached, collisions, .. } = summary;
    Ok(Drives { worlds, reached, collisions })
}

fn as_text(all: &Reproduction) -> String {
    let nets: Vec<Vec<String>> = all
        .architectures
        .iter()
        .map(|net| {
            let hidden: Vec<String> = net.hidden.iter().map(usize::to_string).collect();
            let p = net.exam_percent;
            vec![
                hidden.join("-"),
                figure(p.median),
                figure(p.least),
                figure(p.greatest),
                net.epochs_to_5_percent.map_or_else(|| "never".into(), |epochs| epochs.to_string()),
            ]
        })
        .collect();
    let rivals: Vec<Vec<String>> = all
        .comparison
        .iter()
        .map(|row| {
            vec![
                row.method.clone(),
                figure(row.inside_percent),
                figure(row.beyond_percent),
                figure(row.inside_ratio_to_floor),
            ]
        })
        .collect();
    let mut text = format!("{} pairs at whole pixels; errors in % of the distance\n\n", all.pairs);
    text += &table(&["hidden units", "median", "least", "greatest", "epochs to 5 %"], &nets);
    text.push('\n');
    text += &table(&["rival", "50 to 140 cm", "150 to 200 cm", "x floor"], &rivals);
    for claim in &all.claims {
        let verdict = claim.verdict.words();
        let measured = Some(&claim.measured).filter(|text| !text.is_empty());
        let found = measured.map_or_else(|| verdict.into(), |text| format!("{verdict}: {text}"));
        text += &format!("\n{}\n  {found}\n  {}\n", claim.claim, claim.why);
    }
    text
}
