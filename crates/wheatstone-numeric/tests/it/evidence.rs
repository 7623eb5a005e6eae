//! Training by the evidence on curves that are known.

use wheatstone_numeric::{
    evidence::{Evidence, TrainingCurve},
    perceptron::{Batch, OutputActivation, Perceptron},
    progress::Silent,
    random::Random,
};

/// 200 samples of a smooth curve and of a straight line, each with its own noise.
fn lesson(random: &mut Random) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    (0..200)
        .map(|_| {
            let x = random.uniform(-2.0, 2.0);
            let curve = libm::sin(2.0 * x) + 0.1 * random.normal();
            (vec![x], vec![curve, 0.5 * x + 0.02 * random.normal()])
        })
        .unzip()
}

fn start(random: &mut Random) -> Perceptron {
    Perceptron::nguyen_widrow(&[1, 12, 2], 1.0, OutputActivation::Linear, random)
}

#[test]
fn settings_of_earlier_files_are_read_and_unknown_ones_refused() {
    let read = |text: &str| serde_json::from_str::<Evidence>(text);
    let earlier = read(r#"{"starts":3,"first_steps":60,"steps":50,"least_gain":0.1}"#).unwrap();
    assert_eq!(earlier, Evidence { starts: 3, steps: 50, least_gain: 0.1 });
    assert_eq!(read(&serde_json::to_string(&earlier).unwrap()).unwrap(), earlier);
    assert_eq!(read("{}").unwrap(), Evidence::default());
    assert!(read(r#"{"frist_steps":60}"#).is_err());
}

#[test]
fn finds_each_outputs_noise_and_leaves_weights_that_the_data_do_not_need() {
    let mut random = Random::new(3);
    let (inputs, targets) = lesson(&mut random);
    let batch = Batch::new(&inputs, &targets);
    let mut course = TrainingCurve::new(start(&mut random), &batch);
    course.go_on((300, 0.01), &Silent).unwrap();
    let (network, trained) = course.finish().unwrap();
    // Two hundred samples tell a standard deviation to a twentieth.
    assert!((trained.noise[0].sqrt() / 0.1 - 1.0).abs() < 0.15, "{:?}", trained.noise);
    assert!((trained.noise[1].sqrt() / 0.02 - 1.0).abs() < 0.15, "{:?}", trained.noise);
    assert!(trained.effective_parameters < 0.8 * network.weights().len() as f64);
    for x in [-1.5, 0.3, 1.2] {
        let out = network.evaluate(&[x]);
        assert!((out[0] - libm::sin(2.0 * x)).abs() < 0.06 && (out[1] - 0.5 * x).abs() < 0.012);
    }
}
