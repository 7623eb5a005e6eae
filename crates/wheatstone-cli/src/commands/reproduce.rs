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
use wheatstone::report::Report;
use wheatstone::report::reproduction::{Effort, Reproduction, Verdict, reproduce, write};

/// Reproduce the 2001 paper: its figures and claims, each beside what is measured
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone reproduce\n  wheatstone reproduce --seeds 1 --epochs 20000 --out quick/"
)]
pub(crate) struct Reproduce {
    /// The folder for figures, tables, reproduction.json and report.html
    #[arg(long, value_name = "DIR", default_value = "reproduction")]
    out: PathBuf,
    /// Seeds of the paper's network
    #[arg(long, default_value_t = Effort::default().seeds)]
    seeds: u64,
    /// Epochs of its training
    #[arg(long, default_value_t = Effort::default().epochs)]
    epochs: u64,
    /// Print everything as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    showing: Showing,
}

impl Reproduce {
    pub(crate) fn run(self) -> Outcome {
        let bar = Bar::new();
        let all = reproduce(Effort { seeds: self.seeds, epochs: self.epochs }, &bar)?;
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
        let Self { seeds, epochs, .. } = self;
        let out = quoted(&self.out);
        format!("wheatstone reproduce --seeds {seeds} --epochs {epochs} --out {out}")
    }
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
        let verdict = match claim.verdict {
            Verdict::Confirmed => "confirmed",
            Verdict::NotConfirmed => "not confirmed",
        };
        text += &format!("\n{}\n  {verdict}: {}\n", claim.claim, claim.measured);
    }
    text
}
