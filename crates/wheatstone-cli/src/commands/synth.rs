//! `wheatstone synth`.

use super::chart::ChartOptions;
use crate::{
    failure::{Failure, Outcome},
    progress::Bar,
    verbosity::say,
};
use clap::{Args, builder::PossibleValuesParser};
use std::path::PathBuf;
use wheatstone::{
    chart::AnyChart,
    storage::write_folder,
    synthetic::{
        HandHeld, Noise, Placement, Rig, Scene, Sensor, Stage, chart_correspondences,
        hand_held_correspondences, random_correspondences, write_capture, write_points,
        write_scene,
    },
};

/// Make synthetic data with known truth: rendered pictures or correspondences
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    wheatstone synth -o capture/                                      pictures, as in the 2001 paper\n  \
    wheatstone synth --points --noise quantised --count 400 -o train.csv\n  \
    wheatstone synth --rig water --random 2000 --noise 0.1 --seed 1 -o exam.csv\n  \
    wheatstone synth --scene -o capture/                              with a scene to reconstruct\n\n\
    Lengths are centimetres. The true cameras go into truth.json beside the data.")]
pub(crate) struct Synth {
    /// The cameras and the optics in front of them
    #[arg(long, default_value = "paper", value_parser = PossibleValuesParser::new(
        Rig::NAMES.iter().copied().chain(["brown"])))]
    rig: String,
    /// How many cameras
    #[arg(long, default_value_t = 2)]
    cameras: usize,
    /// Chart points without pictures, as a points file
    #[arg(long)]
    points: bool,
    /// This many points at random positions in the calibrated volume, as a points file
    #[arg(long, value_name = "N", conflicts_with = "points")]
    random: Option<usize>,
    /// A hand-held chart in this many views, its poses not given, instead of one on a stage
    #[arg(long, value_name = "N", conflicts_with = "random")]
    hand_held: Option<usize>,
    /// Also a textured scene, 55 to 135 cm away: in scene/ a picture of each camera, and the world point
    /// that each of its pixels shows
    #[arg(long, conflicts_with_all = ["points", "random"])]
    scene: bool,
    /// A part of the scene's wall without texture, where nothing can be matched
    #[arg(long, requires = "scene")]
    blank_patch: bool,
    /// Error of the pixels of a points file: none, quantised, or a standard deviation in pixels
    #[arg(long, default_value = "quantised")]
    noise: String,
    /// Keep at most this many chart points, chosen at random
    #[arg(long, value_name = "N")]
    count: Option<usize>,
    /// Nearest distance of the chart
    #[arg(long, default_value_t = Stage::default().near)]
    near: f64,
    /// Farthest distance
    #[arg(long, default_value_t = Stage::default().far)]
    far: f64,
    /// Step from one distance to the next
    #[arg(long, default_value_t = Stage::default().step)]
    step: f64,
    /// Blur of the lens in pictures: standard deviation in pixels
    #[arg(long, default_value_t = Sensor::default().blur)]
    blur: f64,
    /// Read-out noise in pictures: standard deviation in grey levels
    #[arg(long, default_value_t = Sensor::default().read_noise)]
    sensor_noise: f64,
    /// Nothing in the background
    #[arg(long)]
    no_clutter: bool,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The capture's folder, or the points file
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    #[command(flatten)]
    chart: ChartOptions,
}

impl Synth {
    pub(crate) fn run(self) -> Outcome {
        let rig = Rig::named(&self.rig, self.cameras)?;
        let chart = self.chart_for(&rig)?;
        let noise: Noise = self.noise.parse()?;
        let stage = Stage { near: self.near, far: self.far, step: self.step };
        if let Some(count) = self.random {
            let data = random_correspondences(
                &rig,
                &chart,
                (self.near, self.far),
                (noise, self.seed),
                count,
            );
            if data.correspondences.len() < count {
                return Err(Failure::usage(
                    format!(
                        "the cameras see only {} of {count} points",
                        data.correspondences.len()
                    ),
                    "choose other distances",
                ));
            }
            return Ok(write_points(&self.output, &data, &rig, (noise, self.seed))?);
        }
        let placements = match self.hand_held {
            Some(views) => {
                HandHeld::between([self.near, self.far], views).placements(&chart, self.seed)?
            }
            None => stage.views()?,
        };
        if self.points {
            let data = match self.hand_held {
                Some(_) => {
                    hand_held_correspondences(&rig, &chart, &placements, (noise, self.seed)).0
                }
                None => {
                    chart_correspondences(&rig, &chart, &placements, (noise, self.seed), self.count)
                }
            };
            return Ok(write_points(&self.output, &data, &rig, (noise, self.seed))?);
        }
        self.write_pictures(&rig, &chart, &placements)
    }

    /// The capture, and the scene beside its charts.
    fn write_pictures(&self, rig: &Rig, chart: &AnyChart, placements: &[Placement]) -> Outcome {
        let sensor = Sensor {
            blur: self.blur,
            read_noise: self.sensor_noise,
            clutter: !self.no_clutter,
            ..Sensor::default()
        };
        let bar = Bar::new();
        let views = (placements, self.hand_held.is_none());
        let sensor = (sensor, self.seed);
        if !self.scene {
            return Ok(write_capture(&self.output, (rig, chart), views, sensor, &bar)?);
        }
        let mut scene = Scene::before(rig, self.seed);
        if self.blank_patch {
            scene = scene.with_blank_patch();
        }
        write_folder(&self.output, |folder| {
            write_capture(folder, (rig, chart), views, sensor, &bar)?;
            write_scene(folder, (rig, &scene), sensor, &bar)
        })?;
        drop(bar);
        say!(
            "Wrote {}: {} pictures of a chart, and in scene/ one of the scene and its points for each of {} cameras",
            self.output.display(),
            placements.len() * rig.cameras.len(),
            rig.cameras.len()
        );
        Ok(())
    }

    /// The chart asked for; by default one whose pitch fills the rig's field of view.
    fn chart_for(&self, rig: &Rig) -> Outcome<AnyChart> {
        let share = if self.hand_held.is_some() { HandHeld::SIZE } else { 1.0 };
        self.chart.chart("line-grid", Some(share * rig.chart_pitch()))
    }
}
