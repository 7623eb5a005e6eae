//! Derivatives of the outputs beside differences.

use wheatstone_numeric::{
    perceptron::{OutputActivation, Perceptron},
    random::Random,
};

#[test]
fn derivatives_agree_with_differences() {
    for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
        let mut net = Perceptron::nguyen_widrow(&[4, 5, 6, 3], 1.4, output, &mut Random::new(2));
        let inputs = [0.2, 0.7, 0.4, 0.9];
        let weights = net.weights().to_vec();
        let mut rows = vec![0.0; 3 * weights.len()];
        assert_eq!(net.jacobian(&inputs, &mut rows), net.evaluate(&inputs));
        let mut by_input = vec![0.0; 3 * inputs.len()];
        assert_eq!(net.input_jacobian(&inputs, &mut by_input), net.evaluate(&inputs));
        for index in 0..inputs.len() {
            let at = |step: f64| {
                let mut moved = inputs;
                moved[index] += step;
                net.evaluate(&moved)
            };
            let (ahead, behind) = (at(1e-5), at(-1e-5));
            for output in 0..3 {
                let difference = (ahead[output] - behind[output]) / 2e-5;
                assert!((difference - by_input[output * inputs.len() + index]).abs() < 1e-8);
            }
        }
        for index in 0..weights.len() {
            let mut at = |step: f64| {
                let mut moved = weights.clone();
                moved[index] += step;
                net.set_weights(&moved);
                net.evaluate(&inputs)
            };
            let (ahead, behind) = (at(1e-5), at(-1e-5));
            for output in 0..3 {
                let difference = (ahead[output] - behind[output]) / 2e-5;
                assert!((difference - rows[output * weights.len() + index]).abs() < 1e-8);
            }
        }
    }
}
