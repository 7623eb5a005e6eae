//! What happened in a trial as one page that plays it: both pictures with what was matched in them, the
//! map as it grew, the way that was meant and the way that was gone.

mod code;
mod page;

use super::{
    PlanarPose,
    map::CELL,
    navigator::{Activity, Decision},
    scene::Trust,
    seeing::HealthWarning,
    trial::{Look, Observer, Outcome, Trial},
    world::{Obstacle, ROBOT_RADIUS, World},
};
use code::{Changes, marks};
use serde::Serialize;
use std::path::PathBuf;
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{Result, storage};
use wheatstone_report::html::{base64, jpeg};

/// Quality of JPEG at which the floor's grain is gone and edges still look sharp at half size.
const QUALITY: u8 = 60;

/// A page of more characters than this is slow to open; of a longer film every n-th look is shown.
const MOST: usize = 14_000_000;

/// Records a trial and writes its page in the end.
pub struct Film {
    path: PathBuf,
    reel: Reel,
    changes: Changes,
}

/// All that the page shows.
#[derive(Serialize)]
struct Reel {
    seed: u64,
    method: String,
    outcome: Option<Outcome>,
    world: Stand,
    map: Raster,
    /// Width and height of the cameras' pictures.
    size: [usize; 2],
    frames: Vec<Frame>,
    /// Every so many looks are shown.
    every: usize,
}

/// What stands where.
#[derive(Serialize)]
struct Stand {
    walls: [f64; 4],
    obstacles: Vec<Obstacle>,
    goal: [f64; 2],
    robot: f64,
}

/// How the map's cells lie.
#[derive(Serialize)]
struct Raster {
    /// The corner with the least x and z.
    corner: [f64; 2],
    cell: f64,
    columns: usize,
    rows: usize,
}

/// A look.
#[derive(Serialize)]
struct Frame {
    number: usize,
    pictures: [String; 2],
    /// See [`marks`].
    marks: String,
    /// Corners, edges of the floor, edges of what stands on it.
    counts: [usize; 3],
    /// See [`Changes`]; more than one where looks were left out.
    map: Vec<String>,
    truth: [f64; 3],
    believed: [f64; 3],
    way: Vec<[f64; 2]>,
    activity: &'static str,
    why: String,
    /// Forward in centimetres a second and to the right in degrees a second.
    command: Option<[f64; 2]>,
    /// Whether the robot found its own motion.
    found: bool,
    trust: &'static str,
    complaint: Option<String>,
}

impl Film {
    /// Of a trial, into a file.
    #[must_use]
    pub fn new(path: PathBuf, trial: &Trial, world: &World) -> Self {
        let reel = Reel {
            seed: trial.seed,
            method: trial.method.name().to_owned(),
            outcome: None,
            world: Stand {
                walls: world.walls,
                obstacles: world.obstacles.clone(),
                goal: world.goal,
                robot: ROBOT_RADIUS,
            },
            map: Raster { corner: [0.0; 2], cell: CELL, columns: 0, rows: 0 },
            size: [0; 2],
            frames: Vec::new(),
            every: 1,
        };
        Self { path, reel, changes: Changes::default() }
    }
}

impl Observer for Film {
    fn look(&mut self, look: &Look) -> Result<()> {
        let map = look.pilot.navigator().map();
        let first = map.place(0, 0);
        let corner = [first.x, first.y].map(|middle| middle - CELL / 2.0);
        self.reel.map = Raster { corner, cell: CELL, columns: map.columns(), rows: map.rows() };
        self.reel.size = [look.pictures[0].width(), look.pictures[0].height()];
        let changes = self.changes.since(map);
        self.reel.frames.push(frame(look, changes));
        Ok(())
    }

    fn ended(mut self: Box<Self>, outcome: &Outcome) -> Result<()> {
        self.reel.outcome = Some(outcome.clone());
        self.reel.shorten(MOST);
        storage::write(&self.path, page::page(&self.reel).as_bytes())
    }
}

impl Reel {
    /// Leaves looks out where they take more than so many characters, but never the last one.
    fn shorten(&mut self, most: usize) {
        let weight = |frame: &Frame| {
            let pictures: usize = frame.pictures.iter().map(String::len).sum();
            pictures + frame.marks.len() + frame.map.iter().map(String::len).sum::<usize>()
        };
        let total: usize = self.frames.iter().map(weight).sum();
        self.every = total.div_ceil(most).max(1);
        let (count, every) = (self.frames.len(), self.every);
        let (mut kept, mut changes) = (Vec::new(), Vec::new());
        for (index, mut frame) in std::mem::take(&mut self.frames).into_iter().enumerate() {
            changes.append(&mut frame.map);
            if index % every == 0 || index + 1 == count {
                frame.map = std::mem::take(&mut changes);
                kept.push(frame);
            }
        }
        self.frames = kept;
    }
}

fn frame(look: &Look, changes: Option<Vec<u8>>) -> Frame {
    let navigator = look.pilot.navigator();
    let observation = &look.step.observation;
    let (marks, counts) = marks(observation);
    Frame {
        number: look.number,
        pictures: [0, 1].map(|eye| jpeg(&halved(&look.pictures[eye]), QUALITY).unwrap_or_default()),
        marks: base64(&marks),
        counts,
        map: changes.iter().map(|bytes| base64(bytes)).collect(),
        truth: rounded(look.pose),
        believed: rounded(look.pilot.pose()),
        way: navigator.path().iter().map(|place| [place.x, place.y].map(tenth)).collect(),
        activity: activity(navigator.activity()),
        why: navigator.why().to_owned(),
        command: match look.step.decision {
            Decision::Drive(velocity) => {
                Some([velocity.forward, velocity.turn.to_degrees()].map(tenth))
            }
            _ => None,
        },
        found: look.step.found.is_some(),
        trust: match observation.scene.trust {
            Trust::Sound => "sound",
            Trust::Poor => "poor",
            Trust::Broken => "broken",
        },
        complaint: observation.complaint.as_ref().map(HealthWarning::to_string),
    }
}

fn activity(activity: Activity) -> &'static str {
    match activity {
        Activity::Looking => "Looking about",
        Activity::Turning => "Turning",
        Activity::Driving => "Driving",
        Activity::Backing => "Backing away",
        Activity::Waiting => "Standing still",
        Activity::Arrived => "Arrived",
        Activity::Stopped => "Stopped for good",
    }
}

/// Averages of two by two pixels.
fn halved(picture: &GrayImage) -> GrayImage {
    GrayImage::from_fn(picture.width() / 2, picture.height() / 2, |x, y| {
        let pair = |row: usize| picture.row(row)[2 * x] + picture.row(row)[2 * x + 1];
        (pair(2 * y) + pair(2 * y + 1)) / 4.0
    })
}

/// To a tenth: what is drawn is a few pixels a centimetre.
fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

/// x and z to a tenth of a millimetre, the heading to a thousandth of a radian.
fn rounded(pose: PlanarPose) -> [f64; 3] {
    [(pose.x, 100.0), (pose.z, 100.0), (pose.heading, 1000.0)]
        .map(|(value, parts)| (value * parts).round() / parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made_up(number: usize) -> Frame {
        Frame {
            number,
            pictures: ["1234".into(), "1234".into()],
            marks: "1".into(),
            counts: [0; 3],
            map: vec![number.to_string()],
            truth: [0.0; 3],
            believed: [0.0; 3],
            way: Vec::new(),
            activity: "",
            why: "</script>".into(),
            command: None,
            found: true,
            trust: "sound",
            complaint: None,
        }
    }

    #[test]
    fn long_films_leave_looks_out_but_nothing_of_the_map() {
        let method = wheatstone_core::method::AnyMethod::named("dlt").unwrap();
        let trial = Trial { seed: 0, simple: false, method, steps: 9, trouble: None };
        let mut reel = Film::new("none".into(), &trial, &World::new(0)).reel;
        reel.frames = (1..=9).map(made_up).collect();
        // Ninety characters.
        reel.shorten(30);
        assert_eq!(reel.every, 3);
        let kept: Vec<(usize, String)> =
            reel.frames.iter().map(|frame| (frame.number, frame.map.concat())).collect();
        let wanted = [(1, "1"), (4, "234"), (7, "567"), (9, "89")];
        assert_eq!(kept, wanted.map(|(number, map)| (number, map.to_owned())));
        // Nothing that is shown ends the script that holds it.
        let page = page::page(&reel);
        assert_eq!(page.matches("</script>").count(), 2);
    }
}
