//! How often the clinic names what is wrong, and cries where nothing is: over random captures, clean,
//! with harmless errors, and with one fault each.

use super::{
    faults::{Faulty, inject, names},
    random_capture::RandomCapture,
};
use rayon::prelude::*;
use serde::Serialize;
use wheatstone_core::{
    dataset::Dataset,
    geometry::{Pixel, Vector3},
    preparation::checks::{Finding, Severity, examine},
};
use wheatstone_numeric::random::Random;

/// What became of one fault, or of captures without one.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Tally {
    /// The fault; or what was done to captures that have none.
    pub fault: String,
    /// Captures.
    pub captures: usize,
    /// Named, with its place.
    pub rightly: usize,
    /// Something else was named, or another place.
    pub otherwise: usize,
    /// Nothing was named. For captures without fault that is what is right.
    pub missed: usize,
    /// Which captures were not right: seed, and what was said.
    pub wrong: Vec<String>,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Survey {
    /// One row a fault.
    pub faults: Vec<Tally>,
    /// Captures without fault: `rightly` counts those of which nothing was said.
    pub clean: Vec<Tally>,
}

/// What is done to captures that have no fault.
const DISTRACTIONS: [&str; 3] = ["clean", "stage errors", "gross outliers (10 %)"];

/// Tries the clinic on so many captures with faults, and on a quarter as many of each kind without.
#[must_use]
pub fn survey(captures: usize, seed: u64) -> Survey {
    let outcomes: Vec<(usize, Outcome)> = (0..captures)
        .into_par_iter()
        .filter_map(|index| {
            let fault = index % names().len();
            let mut random = Random::stream(seed, index as u64);
            let capture =
                RandomCapture::new(seed.wrapping_mul(1_000_003).wrapping_add(index as u64));
            let faulty = inject(&capture, fault, random.below(3), &mut random)?;
            Some((fault, judged(&capture, &faulty, index)))
        })
        .collect();
    let faults = names().into_iter().enumerate().map(|(fault, name)| {
        tally(name, outcomes.iter().filter(|(f, _)| *f == fault).map(|(_, outcome)| outcome))
    });
    let clean = DISTRACTIONS.iter().enumerate().map(|(kind, name)| {
        let outcomes: Vec<Outcome> = (0..captures.div_ceil(4))
            .into_par_iter()
            .map(|index| harmless(kind, seed, index))
            .collect();
        tally(name, outcomes.iter())
    });
    Survey { faults: faults.collect(), clean: clean.collect() }
}

enum Outcome {
    Rightly,
    Otherwise(String),
    Missed(String),
}

fn tally<'a>(name: &str, outcomes: impl Iterator<Item = &'a Outcome>) -> Tally {
    let mut tally = Tally { fault: name.into(), ..Tally::default() };
    for outcome in outcomes {
        tally.captures += 1;
        match outcome {
            Outcome::Rightly => tally.rightly += 1,
            Outcome::Otherwise(said) => {
                tally.otherwise += 1;
                tally.wrong.push(said.clone());
            }
            Outcome::Missed(which) => {
                tally.missed += 1;
                tally.wrong.push(which.clone());
            }
        }
    }
    tally
}

/// Findings that ask for something to be done.
fn alarms(data: &Dataset) -> Vec<Finding> {
    let mut findings = examine(data).findings;
    findings.retain(|finding| finding.severity > Severity::Information);
    findings
}

fn said(findings: &[Finding]) -> String {
    let each = findings.iter().map(|f| {
        let cameras: Vec<usize> = f.cameras.iter().map(|camera| camera + 1).collect();
        format!("{} {:?} cameras {cameras:?}", f.code, f.views)
    });
    each.collect::<Vec<_>>().join("; ")
}

fn judged(capture: &RandomCapture, faulty: &Faulty, index: usize) -> Outcome {
    // Which view is meant must be told; other captures may leave views out.
    let keep_views = !faulty.views.is_empty();
    let mut filed = capture.clone();
    filed.named[1] |= keep_views || faulty.data.views.len() < 2;
    let data = filed.as_filed(faulty.data.clone());
    let findings = alarms(&data);
    let mut views: Vec<&String> = faulty.views.iter().map(|v| &faulty.data.views[*v]).collect();
    views.sort();
    let named = |finding: &&Finding| {
        faulty.codes.contains(&finding.code)
            && (faulty.cameras.is_empty() || finding.cameras == faulty.cameras)
            && (views.is_empty() || finding.views.iter().all(|view| views.contains(&view)))
    };
    // Several findings of one name may share the views.
    let mut found: Vec<&String> = findings.iter().filter(named).flat_map(|f| &f.views).collect();
    found.sort();
    found.dedup();
    let right = findings.iter().any(|f| named(&f)) && (views.is_empty() || found == views);
    let expected = format!(
        "#{index} expected {:?} {:?} cameras {:?}, said: {}",
        faulty.codes[0],
        views,
        faulty.cameras.iter().map(|c| c + 1).collect::<Vec<_>>(),
        said(&findings)
    );
    // Naming it and crying about something else too is no right answer.
    if right && findings.iter().all(|finding| named(&finding)) {
        Outcome::Rightly
    } else if findings.is_empty() {
        Outcome::Missed(expected)
    } else {
        Outcome::Otherwise(expected)
    }
}

fn harmless(kind: usize, seed: u64, index: usize) -> Outcome {
    let capture_seed = seed.wrapping_mul(1_000_003).wrapping_add(500_000 + index as u64);
    let mut capture = RandomCapture::new(capture_seed);
    let mut random = Random::stream(seed ^ 0x5eed, index as u64);
    let mut data = capture.dataset();
    if kind == 1 {
        // 0.4 mm at a metre: a good ruler's and a bad stage's.
        let distance = capture.placements[0].translation.norm();
        let truth = data.clone();
        for placement in &mut capture.placements {
            let mut any = || 0.0004 * distance * random.normal();
            placement.translation += Vector3::new(any(), any(), any());
        }
        let shaken = capture.dataset();
        let place = |row: &wheatstone_core::dataset::Correspondence| {
            truth.correspondences.iter().find(|c| c.view == row.view && c.id == row.id)?.world
        };
        data = shaken;
        for row in &mut data.correspondences {
            row.world = place(row).or(row.world);
        }
    }
    if kind == 2 {
        for row in &mut data.correspondences {
            for pixel in row.pixels.iter_mut().flatten() {
                if random.uniform(0.0, 1.0) < 0.1 {
                    let mut any = || random.uniform(-40.0, 40.0);
                    *pixel = Pixel::new(pixel.x + any(), pixel.y + any());
                }
            }
        }
    }
    let findings = alarms(&capture.as_filed(data));
    if findings.is_empty() {
        Outcome::Rightly
    } else {
        Outcome::Otherwise(format!("#{index} said: {}", said(&findings)))
    }
}
