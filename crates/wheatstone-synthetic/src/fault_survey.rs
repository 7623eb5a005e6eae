//! How often the clinic names what is wrong, and cries where nothing is: over random captures, clean,
//! with harmless errors, and with one fault each.

use super::{
    faults::{Faulty, inject, names},
    random_capture::RandomCapture,
};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use wheatstone_core::{
    dataset::Dataset,
    fit::bundle::BundleSettings,
    geometry::{Pixel, Vector3},
    preparation::{
        self,
        checks::{Finding, Severity, examine},
    },
};
use wheatstone_numeric::{progress::Silent, random::Random};

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
    /// What was named, and how often: a row of the confusion matrix. Several names of one capture are one
    /// entry.
    pub named: BTreeMap<String, usize>,
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

/// The place of errors of the stage among them.
const STAGE_ERRORS: usize = 1;

/// What is done to captures that have no fault.
const DISTRACTIONS: [&str; 3] = ["clean", "stage errors", "gross outliers (10 %)"];

/// What the captures of a survey are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recorded {
    /// Charts at known places.
    Charts,
    /// Points at random places, of which no two views share one.
    Scattered,
    /// Charts held by hand, whose poses are estimated.
    HeldByHand,
}

/// Tries the checks on so many captures with faults, and on a quarter as many of each kind without.
#[must_use]
pub fn survey(captures: usize, seed: u64, recorded: Recorded) -> Survey {
    let draw = match recorded {
        Recorded::Charts => RandomCapture::new,
        Recorded::Scattered => RandomCapture::scattered,
        Recorded::HeldByHand => RandomCapture::held_by_hand,
    };
    let outcomes: Vec<(usize, Outcome)> = (0..captures)
        .into_par_iter()
        .filter_map(|index| {
            let fault = index % names().len();
            let mut random = Random::stream(seed, index as u64);
            let capture = draw(seed.wrapping_mul(1_000_003).wrapping_add(index as u64));
            let faulty = inject(&capture, fault, random.below(3), &mut random)?;
            Some((fault, judged(&capture, &faulty, index)))
        })
        .collect();
    let faults = names().into_iter().enumerate().map(|(fault, name)| {
        tally(name, outcomes.iter().filter(|(f, _)| *f == fault).map(|(_, outcome)| outcome))
    });
    // Charts of no given place have no errors of it.
    let has = |kind: &usize| recorded != Recorded::HeldByHand || *kind != STAGE_ERRORS;
    let kinds = (0..DISTRACTIONS.len()).filter(has);
    let clean = kinds.map(|kind| {
        let outcomes: Vec<Outcome> = (0..captures.div_ceil(4))
            .into_par_iter()
            .map(|index| harmless(kind, draw, (seed, index)))
            .collect();
        tally(DISTRACTIONS[kind], outcomes.iter())
    });
    Survey { faults: faults.collect(), clean: clean.collect() }
}

/// What the findings were called, and whether that was right.
struct Outcome {
    named: String,
    kind: Kind,
}

enum Kind {
    Rightly,
    Otherwise(String),
    Missed(String),
}

fn tally<'a>(name: &str, outcomes: impl Iterator<Item = &'a Outcome>) -> Tally {
    let mut tally = Tally { fault: name.into(), ..Tally::default() };
    for outcome in outcomes {
        tally.captures += 1;
        *tally.named.entry(outcome.named.clone()).or_default() += 1;
        match &outcome.kind {
            Kind::Rightly => tally.rightly += 1,
            Kind::Otherwise(said) => {
                tally.otherwise += 1;
                tally.wrong.push(said.clone());
            }
            Kind::Missed(which) => {
                tally.missed += 1;
                tally.wrong.push(which.clone());
            }
        }
    }
    tally
}

/// Findings that ask for something to be done. Of charts held by hand those that stop a fit, and those of `codes`: of most
/// random captures more views would be better.
fn alarms(capture: &RandomCapture, data: &Dataset, codes: &[&str]) -> Vec<Finding> {
    let data = capture.as_filed(data.clone());
    let mut findings = if capture.held_by_hand {
        let found = preparation::examine(&data, BundleSettings::default(), &Silent);
        let mut findings = found.map(|found| found.findings).unwrap_or_default();
        findings.retain(|f| f.severity == Severity::Fatal || codes.contains(&f.code));
        findings
    } else {
        examine(&data).findings
    };
    findings.retain(|finding| finding.severity > Severity::Information);
    findings
}

fn names_of(findings: &[Finding]) -> String {
    let codes: BTreeSet<&str> = findings.iter().map(|finding| finding.code).collect();
    if codes.is_empty() {
        return "nothing".into();
    }
    codes.into_iter().collect::<Vec<_>>().join(" + ")
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
    let findings = alarms(&filed, &faulty.data, faulty.codes);
    // Where poses are estimated, of two cameras nobody can tell which was turned or moved.
    let is_either = |cameras: &[usize]| {
        capture.held_by_hand && capture.cameras.len() == 2 && *cameras == [0, 1]
    };
    let named = |finding: &&Finding| {
        faulty.codes.contains(&finding.code)
            && (faulty.cameras.is_empty()
                || finding.cameras == faulty.cameras
                || is_either(&finding.cameras))
    };
    // Several findings of one name may share the views.
    let mut found: Vec<&String> = findings.iter().filter(named).flat_map(|f| &f.views).collect();
    found.sort();
    found.dedup();
    let all = views_that_would_be_right(capture, faulty);
    let views = &all[0];
    let right = findings.iter().any(|f| named(&f)) && (views.is_empty() || all.contains(&found));
    let expected = format!(
        "#{index} expected {:?} {:?} cameras {:?}, said: {}",
        faulty.codes[0],
        views,
        faulty.cameras.iter().map(|c| c + 1).collect::<Vec<_>>(),
        said(&findings)
    );
    // Naming it and crying about something else too is no right answer.
    let kind = if right && findings.iter().all(|finding| named(&finding)) {
        Kind::Rightly
    } else if findings.is_empty() {
        Kind::Missed(expected)
    } else {
        Kind::Otherwise(expected)
    };
    Outcome { named: names_of(&findings), kind }
}

/// The views that have the fault, sorted; and others that would be as right. Where poses are estimated, a camera that moved
/// may as well have stood elsewhere before; and where pictures are paired one view off, those of the other camera are, too.
fn views_that_would_be_right<'a>(
    capture: &RandomCapture,
    faulty: &'a Faulty,
) -> Vec<Vec<&'a String>> {
    let names = |is_meant: &dyn Fn(usize) -> bool| -> Vec<&'a String> {
        let all = faulty.data.views.iter().enumerate();
        let mut names: Vec<&String> =
            all.filter(|(view, _)| is_meant(*view)).map(|(_, name)| name).collect();
        names.sort();
        names
    };
    let is_faulty = |view: usize| faulty.views.contains(&view);
    let mut all = vec![names(&is_faulty)];
    if capture.held_by_hand && faulty.codes.contains(&"camera-moved") {
        all.push(names(&|view| !is_faulty(view)));
    }
    if let (true, ["unsynchronised"], Some(first)) =
        (capture.held_by_hand, faulty.codes, faulty.views.first())
    {
        all.push(names(&|view| view >= *first));
    }
    all
}

fn harmless(
    distraction: usize,
    draw: fn(u64) -> RandomCapture,
    (seed, index): (u64, usize),
) -> Outcome {
    let capture_seed = seed.wrapping_mul(1_000_003).wrapping_add(500_000 + index as u64);
    let mut capture = draw(capture_seed);
    let mut random = Random::stream(seed ^ 0x5eed, index as u64);
    let mut data = capture.dataset();
    if distraction == STAGE_ERRORS {
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
    if distraction == 2 {
        for row in &mut data.correspondences {
            for pixel in row.pixels.iter_mut().flatten() {
                if random.uniform(0.0, 1.0) < 0.1 {
                    let mut any = || random.uniform(-40.0, 40.0);
                    *pixel = Pixel::new(pixel.x + any(), pixel.y + any());
                }
            }
        }
    }
    let findings = alarms(&capture, &data, &[]);
    let kind = if findings.is_empty() {
        Kind::Rightly
    } else {
        Kind::Otherwise(format!("#{index} said: {}", said(&findings)))
    };
    Outcome { named: names_of(&findings), kind }
}
