//! Trials of a few looks, and summaries of made-up ones.

use wheatstone_core::method::AnyMethod;
use wheatstone_numeric::progress::Silent;
use wheatstone_robot::trial::{Detected, Distribution, Ended, Outcome, Summary, Trial, run_all};

fn trials(steps: usize) -> Vec<Trial> {
    let method = AnyMethod::named("brown").unwrap();
    [4, 2]
        .map(|seed| Trial { seed, simple: false, method: method.clone(), steps, trouble: None })
        .into()
}

fn made_up(ended: Ended, collided: bool, noticed: Option<Detected>) -> Outcome {
    Outcome {
        seed: 0,
        obstacles: 6,
        ended,
        why: String::new(),
        reached: ended == Ended::Arrived && !collided,
        collided,
        clearance: 1.0,
        steps: 10,
        lost: 0,
        false_alarms: 1,
        position_error: 2.0,
        goal_distance: 6.0,
        map_error: Distribution::default(),
        noticed,
        map_errors: vec![1.0, 3.0],
        seconds: vec![0.1, 0.2, 0.3],
    }
}

#[test]
fn trials_are_the_same_whatever_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run_all(&trials(2), &|_, _| None, &|| 0.0, &Silent)).unwrap()
    };
    let one = run(1);
    assert_eq!(one.iter().map(|outcome| outcome.seed).collect::<Vec<_>>(), [4, 2]);
    for outcome in &one {
        assert_eq!((outcome.steps, outcome.ended), (2, Ended::Underway));
        assert!(!outcome.reached && !outcome.collided && outcome.clearance > 20.0);
        // Two looks, and after each a step of 5 cm at most, as wheels go that are not exact.
        assert!((286.0..=310.0).contains(&outcome.goal_distance), "{}", outcome.goal_distance);
        // Broken off after a step that it has not looked back at: it believes to be where it was.
        assert!(outcome.position_error < 7.0, "{}", outcome.position_error);
        assert_eq!(outcome.seconds, [0.0, 0.0]);
        assert_eq!(outcome.map_error, Distribution::of(&outcome.map_errors));
    }
    assert_eq!(one, run(3));
}

#[test]
fn summaries_count_what_was() {
    let noticed = |after| Some(Detected { at: 20, after });
    let all = [
        made_up(Ended::Arrived, false, None),
        made_up(Ended::Arrived, true, None),
        made_up(Ended::Broken, false, noticed(Some(3))),
        made_up(Ended::Lost, true, noticed(None)),
        made_up(Ended::Underway, false, noticed(Some(1))),
    ];
    let told = Summary::of(&all);
    assert_eq!((told.worlds, told.reached, told.collisions, told.stopped_safely), (5, 1, 2, 1));
    assert_eq!((told.mishaps, told.noticed, told.noticed_after), (3, 2, Some(2.0)));
    assert_eq!((told.false_alarms, told.position_error.median), (5, 2.0));
    assert_eq!(told.arrival_error, Some(Distribution { median: 6.0, p95: 6.0 }));
    assert_eq!((told.map_error.median, told.steps_per_second), (2.0, Some(5.0)));
    let nobody = Summary::of(&all[3..]);
    assert!(nobody.arrival_error.is_none());
}
