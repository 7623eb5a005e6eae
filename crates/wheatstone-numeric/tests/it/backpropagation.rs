//! Gradient descent on a curve that is known.

use wheatstone_numeric::{
    Error,
    backpropagation::{Backpropagation, Precision},
    perceptron::{Batch, OutputActivation, Perceptron, Workspace},
    progress::{Progress, Silent},
    random::Random,
};

fn task() -> (Perceptron, Batch) {
    let mut random = Random::new(4);
    let inputs: Vec<Vec<f64>> =
        (0..60).map(|_| (0..2).map(|_| random.uniform(0.0, 1.0)).collect()).collect();
    let targets: Vec<Vec<f64>> = inputs.iter().map(|x| vec![0.2 + 0.6 * x[0] * x[1]]).collect();
    let sizes = [2, 6, 1];
    let net = Perceptron::nguyen_widrow(&sizes, 1.0, OutputActivation::Linear, &mut random);
    (net, Batch::new(&inputs, &targets))
}

#[test]
fn the_error_falls_and_a_step_too_far_is_taken_back() {
    let ways = [(0.0, Precision::Double), (0.9, Precision::Double), (0.0, Precision::Single)];
    for (momentum, precision) in ways {
        let (mut net, batch) = task();
        // A first rate that is far too large must be recovered from.
        let settings =
            Backpropagation { epochs: 5_000, rate: 1e3, momentum, precision, ..Default::default() };
        let mut curve = Vec::new();
        settings.train(&mut net, &batch, &Silent, &mut |point, _| curve.push(point)).unwrap();
        let (first, last) = (curve[0], curve[curve.len() - 1]);
        assert_eq!(last.epoch, 5_000);
        assert!(last.mean_square_error < 0.1 * first.mean_square_error);
        let mut gradient = vec![0.0; net.weights().len()];
        let error = net.mean_square_error(&batch, &mut gradient, &mut Workspace::new(net.sizes()));
        let digits = if precision == Precision::Double { 1e-12 } else { 1e-4 };
        let wrong = (error / last.mean_square_error - 1.0).abs();
        assert!(wrong < digits, "the network is not the one that was scored: {wrong}");
    }
}

#[test]
fn training_stops_when_asked() {
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _: &str, _: u64, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let (mut net, batch) = task();
    let outcome = Backpropagation::default().train(&mut net, &batch, &Stop, &mut |_, _| ());
    assert!(matches!(outcome, Err(Error::Cancelled)));
}
