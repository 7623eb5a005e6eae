//! What the pilot would do on recorded pictures.
//!
//! ```sh
//! cargo run --release --example drive_recorded -- FOLDER MODEL [GOAL_X GOAL_Z]
//! ```
//!
//! `FOLDER` holds pairs of pictures in `left/` and `right/`, which pair up in the order of their names;
//! `MODEL` is a calibration (`wheatstone fit capture/ -o MODEL`) whose world is the robot's own frame, in
//! centimetres: origin on the floor midway between the wheels, x right, y down, z forward. The goal, in
//! the same unit, is 3 m ahead unless it is given. A robot of your own is another `Vehicle`: see
//! `docs/robot.md`.

#![expect(clippy::print_stdout, reason = "a program speaks")]

use std::{error::Error, path::Path};
use wheatstone::{
    Calibration,
    numeric::progress::Silent,
    robot::{
        Ground, Vehicle,
        navigator::Decision,
        pilot::{Pilot, Step},
        recorded::Recording,
    },
};

/// Seconds from one pair to the next.
const PERIOD: f64 = 0.25;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (folder, model, goal) = match &words[..] {
        [folder, model] => (folder, model, Ground::new(0.0, 300.0)),
        [folder, model, x, z] => (folder, model, Ground::new(x.parse()?, z.parse()?)),
        _ => return Err("give FOLDER MODEL [GOAL_X GOAL_Z]".into()),
    };
    let calibration = Calibration::load(Path::new(model))?;
    let mut recording = Recording::open(Path::new(folder), PERIOD)?;
    let goal = (goal, recording.period());
    let mut pilot = Pilot::new(&calibration, recording.size()?, goal, (0, &Silent))?;
    let mut number = 0;
    let ended = pilot.drive(&mut recording, &mut |recording, pilot, _, step| {
        let [left, _] = &recording.pairs()[number];
        number += 1;
        println!("{}", line(&left.file_name().unwrap_or_default().to_string_lossy(), pilot, step));
        Ok(())
    })?;
    match ended {
        Some(Decision::Arrived) => println!("arrived"),
        Some(_) => println!("stopped: {}", pilot.navigator().why()),
        None => println!("the recording has ended"),
    }
    Ok(())
}

/// A look in a line.
fn line(name: &str, pilot: &Pilot, step: &Step) -> String {
    let (pose, seen) = (pilot.pose(), &step.observation);
    let command = match step.decision {
        Decision::Drive(velocity) => {
            format!("{:5.1} cm/s {:+6.1} deg/s", velocity.forward, velocity.turn.to_degrees())
        }
        _ => "stand".into(),
    };
    let complaint = seen.complaint.as_ref().map_or_else(String::new, |what| format!("; {what}"));
    format!(
        "{name}: {command}  at x {:.1} z {:.1} cm, {:+.1} deg; {} corners, {} obstacle points; {}{complaint}",
        pose.x,
        pose.z,
        pose.heading.to_degrees(),
        seen.corners.len(),
        seen.scene.obstacles.len(),
        pilot.navigator().why(),
    )
}
