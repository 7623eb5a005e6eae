//! Outputs of many samples.

use wheatstone_numeric::{
    perceptron::{Forward, OutputActivation, Perceptron},
    random::Random,
};

#[test]
fn columns_that_are_missing_change_nothing() {
    let network =
        Perceptron::nguyen_widrow(&[2, 3, 1], 1.0, OutputActivation::Linear, &mut Random::new(1));
    let mut column = [7.0; 4];
    Forward::new(&network).columns(&[&[1.0; 4]], &mut [&mut column]);
    assert_eq!(column, [7.0; 4]);
    Forward::new(&network).columns(&[&[1.0; 4], &[0.5; 3]], &mut [&mut column]);
    assert!(column[2] != 7.0 && column[3] == 7.0);
}
