//! Streams of random numbers.

use wheatstone_numeric::random::Random;

#[test]
fn moments_are_those_of_the_distribution() {
    let mut random = Random::new(1);
    let n = 100_000;
    let normals: Vec<f64> = (0..n).map(|_| random.normal()).collect();
    let mean = normals.iter().sum::<f64>() / f64::from(n);
    let variance = normals.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
    // Five standard errors.
    assert!(mean.abs() < 5.0 / f64::from(n).sqrt());
    assert!((variance - 1.0).abs() < 5.0 * (2.0 / f64::from(n)).sqrt());
    let mean = (0..n).map(|_| random.uniform(-1.0, 3.0)).sum::<f64>() / f64::from(n);
    assert!((mean - 1.0).abs() < 5.0 * (16.0 / 12.0 / f64::from(n)).sqrt());
}

#[test]
fn streams_differ_and_repeat() {
    let draw = |stream| Random::stream(7, stream).uniform(0.0, 1.0);
    assert_eq!(draw(3).to_bits(), draw(3).to_bits());
    assert_ne!(draw(3).to_bits(), draw(4).to_bits());
}

#[test]
fn shuffling_keeps_every_item() {
    let mut items: Vec<usize> = (0..50).collect();
    Random::new(2).shuffle(&mut items);
    assert_ne!(items, (0..50).collect::<Vec<_>>());
    items.sort_unstable();
    assert_eq!(items, (0..50).collect::<Vec<_>>());
}
