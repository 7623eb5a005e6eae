//! `wheatstone drive`: the robot that has nothing but its two cameras.

use super::print_json;
use crate::{
    failure::{Failure, Outcome},
    progress::Bar,
    table::{figure, figure_or_dash, table},
    verbosity::say,
};
use clap::{Args, builder::PossibleValuesParser, value_parser};
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};
use wheatstone::{
    Error,
    method::AnyMethod,
    robot::{
        film::Film,
        trial::{self, Distribution, Ended, Fault, Observer, Summary, Trial, run_all},
        world::World,
    },
    storage,
};

/// Drive a simulated robot to a goal by its two cameras alone
///
/// In each world the robot looks at a chart of lines at the 2001 paper's distances, fits a method to
/// its crossings, and drives 3 m among boxes and cylinders to a goal. Its wheels slip; nothing tells it
/// where it is but its pictures. With -o everything is written to a folder, and the first worlds as
/// films: pages that play what the robot saw, matched, believed and did.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    wheatstone drive -o drive/                            one world, and its film\n  \
    wheatstone drive --worlds 20 --method brown --json\n  \
    wheatstone drive --seed 7 --knock 1 -o knocked/       a camera is turned by a degree half-way\n\n\
    Lengths are centimetres. Times are those of this computer, with one world per processor\n\
         at once.")]
pub(crate) struct Drive {
    /// How many worlds, of this seed and those after it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u64).range(1..))]
    worlds: u64,
    /// Seed of the first world: of what stands in it, its light and the slip of the wheels
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Simple worlds, like those of the 2001 paper's robot: a few square boxes, gaps of three robot widths
    #[arg(long)]
    simple: bool,
    /// The method; `wheatstone list methods` describes them
    #[arg(long, default_value = "network", value_parser = PossibleValuesParser::new(AnyMethod::NAMES))]
    method: String,
    /// Ready-made settings of the method, such as `paper` for the network
    #[arg(long)]
    preset: Option<String>,
    /// End a world after this many frames; the robot itself gives up after 1000
    #[arg(long, value_name = "N", default_value_t = 1001, value_parser = value_parser!(u64).range(1..))]
    steps: u64,
    /// Turn a camera by this many degrees half-way, about a random axis
    #[arg(long, value_name = "DEGREES", conflicts_with = "cover")]
    knock: Option<f64>,
    /// Cover a camera half-way
    #[arg(long)]
    cover: bool,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
    /// A folder for summary.json, worlds.csv and the films
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Number of worlds with a film, some megabytes each
    #[arg(long, value_name = "N", default_value_t = 4, requires = "output")]
    films: u64,
}

/// What `--json` prints, and `summary.json`.
#[derive(Serialize)]
struct DriveSummary<'a> {
    unit: &'static str,
    method: &'a str,
    preset: Option<&'a str>,
    seed: u64,
    #[serde(flatten)]
    summary: Summary,
    trials: &'a [trial::Outcome],
}

impl Drive {
    pub(crate) fn run(self) -> Outcome {
        let trials = self.trials()?;
        let outcomes = match &self.output {
            Some(folder) => {
                storage::write_folder(folder, |beside| self.drive(&trials, Some(beside)))?
            }
            None => self.drive(&trials, None)?,
        };
        let told = self.told(&outcomes);
        if self.json {
            return print_json(&told);
        }
        say!("{}", as_text(&told).trim_end());
        if let Some(folder) = &self.output {
            self.name_files(folder);
        }
        Ok(())
    }

    /// Drives in all worlds; films and figures go into the folder.
    fn drive(&self, trials: &[Trial], folder: Option<&Path>) -> Outcome<Vec<trial::Outcome>> {
        let observers = |trial: &Trial, world: &World| -> Option<Box<dyn Observer>> {
            let folder = folder?;
            (trial.seed - self.seed < self.films).then(|| {
                let path = folder.join(film_name(trial.seed));
                Box::new(Film::new(path, trial, world)) as Box<dyn Observer>
            })
        };
        let (bar, began) = (Bar::new(), Instant::now());
        let outcomes = run_all(trials, &observers, &|| began.elapsed().as_secs_f64(), &bar)?;
        if let Some(folder) = folder {
            let told = self.told(&outcomes);
            let json = serde_json::to_vec_pretty(&told).map_err(std::io::Error::from)?;
            storage::write(&folder.join("summary.json"), &json)?;
            storage::write(&folder.join("worlds.csv"), &as_csv(&outcomes)?)?;
        }
        Ok(outcomes)
    }

    fn told<'a>(&'a self, outcomes: &'a [trial::Outcome]) -> DriveSummary<'a> {
        DriveSummary {
            unit: "cm",
            method: &self.method,
            preset: self.preset.as_deref(),
            seed: self.seed,
            summary: Summary::of(outcomes),
            trials: outcomes,
        }
    }

    fn trials(&self) -> Outcome<Vec<Trial>> {
        let mut method = AnyMethod::named(&self.method)?;
        if let Some(preset) = &self.preset {
            method = method.preset(preset)?;
        }
        let trouble = match self.knock {
            Some(degrees) if !(degrees > 0.0 && degrees <= 180.0) => {
                return Err(Failure::usage(
                    format!("a camera cannot be turned by {degrees} degrees"),
                    "give a value between 0 and 180; pulling a cable may turn a camera by 1",
                ));
            }
            Some(degrees) => Some(Fault::Knock(degrees)),
            None => self.cover.then_some(Fault::Cover),
        };
        let Some(end) = self.seed.checked_add(self.worlds) else {
            return Err(Failure::usage(
                "the seeds of these worlds are too large",
                "choose a smaller `--seed`",
            ));
        };
        let simple = self.simple;
        let steps = usize::try_from(self.steps).unwrap_or(usize::MAX);
        let trial = |seed| Trial { seed, simple, method: method.clone(), steps, trouble };
        Ok((self.seed..end).map(trial).collect())
    }

    /// Says what is in the folder.
    fn name_files(&self, folder: &Path) {
        say!("");
        say!("Figures  {}", folder.join("summary.json").display());
        say!("Worlds   {}", folder.join("worlds.csv").display());
        let films = self.films.min(self.worlds);
        for seed in self.seed..self.seed + films {
            say!("Film     {}", folder.join(film_name(seed)).display());
        }
        if films < self.worlds {
            say!("Only the first {films} worlds have a film: `--films N` asks for more");
        }
    }
}

fn film_name(seed: u64) -> String {
    format!("world-{seed:04}.html")
}

/// A row for each world.
fn as_csv(trials: &[trial::Outcome]) -> Outcome<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |e: csv::Error| Failure::Output(e.into());
    let heading = "seed,obstacles,ended,reached,collided,steps,lost,false_alarms,clearance_cm,\
        position_error_cm,goal_distance_cm,map_error_median_cm,map_error_p95_cm,mishap_at,\
        noticed_after,why";
    table.write_record(heading.split(',')).map_err(failed)?;
    for row in trials {
        let noticed = row.noticed;
        table
            .write_record([
                row.seed.to_string(),
                row.obstacles.to_string(),
                row.ended.words().to_owned(),
                row.reached.to_string(),
                row.collided.to_string(),
                row.steps.to_string(),
                row.lost.to_string(),
                row.false_alarms.to_string(),
                row.clearance.to_string(),
                row.position_error.to_string(),
                row.goal_distance.to_string(),
                row.map_error.median.to_string(),
                row.map_error.p95.to_string(),
                noticed.map_or_else(String::new, |mishap| mishap.at.to_string()),
                noticed.and_then(|mishap| mishap.after).map_or_else(String::new, |n| n.to_string()),
                row.why.clone(),
            ])
            .map_err(failed)?;
    }
    table.into_inner().map_err(|e| {
        Failure::Library(Error::Io {
            action: "write",
            path: "worlds.csv".into(),
            source: e.into_error(),
        })
    })
}

/// The table of worlds, and what became of all.
fn as_text(told: &DriveSummary) -> String {
    let rows: Vec<Vec<String>> = told.trials.iter().map(row).collect();
    let heading = [
        "world",
        "obstacles",
        "frames",
        "own position cm",
        "goal cm",
        "map cm",
        "clearance cm",
        "end",
    ];
    let all = &told.summary;
    let mut text = table(&heading, &rows);
    text += &format!(
        "\nReached the goal: {} of {}; collisions: {}; stopped safely before the goal: {}\n\n",
        all.reached, all.worlds, all.collisions, all.stopped_safely
    );
    let mut line = |name: &str, spread: &Distribution| {
        let (median, p95) = (figure(spread.median), figure(spread.p95));
        text += &format!("  {name:<42}{median:>6} cm (median) {p95:>6} cm (95 %)\n");
    };
    line("estimated position from the true one, at the end", &all.position_error);
    if let Some(error) = &all.arrival_error {
        line("goal from where it reported arrival", error);
    }
    line("occupied cells from true surfaces", &all.map_error);
    if all.mishaps > 0 {
        text += &format!(
            "  camera faults detected: {} of {}, after {} frames (median)\n",
            all.noticed,
            all.mishaps,
            figure_or_dash(all.noticed_after)
        );
    }
    let rate = figure_or_dash(all.steps_per_second);
    text + &format!("  {rate} steps a second from pictures to command\n")
}

fn row(trial: &trial::Outcome) -> Vec<String> {
    let end = match (trial.collided, trial.ended) {
        (true, _) => "collision",
        (false, Ended::Arrived) if !trial.reached => "reported arrival away from the goal",
        (false, ended) => ended.words(),
    };
    let mut cells =
        vec![trial.seed.to_string(), trial.obstacles.to_string(), trial.steps.to_string()];
    let lengths =
        [trial.position_error, trial.goal_distance, trial.map_error.median, trial.clearance];
    cells.extend(lengths.map(figure));
    cells.push(end.into());
    cells
}
