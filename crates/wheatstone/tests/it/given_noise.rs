//! Pixels that are better or noisier than those of the fit: error bars for a noise that is given, and noise that is
//! noticed.

use rayon::prelude::*;
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    geometry::{Pixel, PixelColumns, columns_of},
    method::{
        AnyMethod, AnyReconstructor, CalibratedMap, LocatedBatch, Locator, PixelSigmas,
        Reconstructor,
        mismatch::{MismatchTest, noisier_pixels},
    },
    numeric::{progress::Silent, random::Random},
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

const POINTS: usize = 2000;

fn rig() -> Rig {
    Rig::named("paper", 2).unwrap()
}

fn chart(rig: &Rig) -> AnyChart {
    LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into()
}

/// Fitted to pixels that are off by 0.1.
fn fitted(method: &str, count: usize, seed: u64) -> AnyReconstructor {
    let (rig, views) = (rig(), Stage::default().views().unwrap());
    let noise = (Noise::Normal(0.1), seed);
    let data = chart_correspondences(&rig, &chart(&rig), &views, noise, Some(count));
    AnyMethod::named(method).unwrap().fit_checked(&data, 0, &Silent).unwrap().reconstructor
}

fn exam(sigma: f64, seed: u64) -> Dataset {
    let rig = rig();
    let noise = (Noise::Normal(sigma), seed);
    random_correspondences(&rig, &chart(&rig), (60.0, 130.0), noise, POINTS)
}

fn rows(data: &Dataset) -> Vec<Vec<Option<Pixel>>> {
    data.correspondences.iter().map(|row| row.pixels.clone()).collect()
}

fn in_batch(map: &dyn Reconstructor, rows: &[Vec<Option<Pixel>>], sigma: f64) -> LocatedBatch {
    let columns = columns_of(rows, map.cameras());
    let columns = columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect();
    let mut found = LocatedBatch::default();
    let sigmas = PixelSigmas::One(sigma);
    Locator::new(map, None).locate_noisy_into(
        &PixelColumns::new(columns),
        Some(&sigmas),
        &mut found,
    );
    found
}

/// How many of the errors along each axis are below one and below 1.96 standard deviations, and how many matches are
/// called mismatches: one at a time, and in batch.
fn held(map: &AnyReconstructor, sigma: f64, seed: u64) -> [[f64; 7]; 2] {
    let (data, test) = (exam(sigma, seed), MismatchTest::new(0.001, 2));
    let one = CalibratedMap::new(&**map).with_pixel_sigma(Some(sigma));
    let batch = in_batch(&**map, &rows(&data), sigma);
    let mut held = [[0.0; 7]; 2];
    for (index, (world, row)) in data.known().enumerate() {
        let found = [one.locate(&row.pixels).unwrap(), batch.get(index).unwrap()];
        for (held, found) in held.iter_mut().zip(found) {
            for axis in 0..3 {
                let error = (found.point[axis] - world[axis]).abs();
                let told = found.covariance[(axis, axis)].sqrt();
                held[axis] += f64::from(error < told) / POINTS as f64;
                held[3 + axis] += f64::from(error < 1.96 * told) / POINTS as f64;
            }
            held[6] += f64::from(test.is_mismatch(&found, 2)) / POINTS as f64;
        }
    }
    held
}

#[test]
fn error_bars_and_mismatches_are_those_of_the_noise_that_is_given() {
    const FITS: u64 = 4;
    let mut wrong = Vec::new();
    for method in ["brown", "neural-camera"] {
        let maps: Vec<AnyReconstructor> =
            (0..FITS).into_par_iter().map(|seed| fitted(method, 700, seed)).collect();
        for sigma in [0.05, 0.1, 0.3, 0.5] {
            let of = |(seed, map): (usize, &AnyReconstructor)| held(map, sigma, 100 + seed as u64);
            let all: Vec<_> = maps.par_iter().enumerate().map(of).collect();
            for (way, name) in ["one at a time", "in batch"].into_iter().enumerate() {
                let mean: [f64; 7] = std::array::from_fn(|place| {
                    all.iter().map(|held| held[way][place]).sum::<f64>() / FITS as f64
                });
                let holds = mean[..3].iter().all(|share| (0.64..0.72).contains(share))
                    && mean[3..6].iter().all(|share| (0.93..0.97).contains(share))
                    && mean[6] < 0.003;
                if !holds {
                    wrong.push(format!("{method}, {sigma} px, {name}: {mean:.3?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Each pixel has a noise of its own: error bars hold for points with good pixels and for those with bad ones, which one
/// standard deviation for all of them does not do.
#[test]
fn error_bars_are_those_of_each_pixels_own_noise() {
    const LEVELS: [f64; 3] = [0.05, 0.2, 0.8];
    let rig = Rig::named("pinhole", 3).unwrap();
    let views = Stage::default().views().unwrap();
    let train = chart_correspondences(&rig, &chart(&rig), &views, (Noise::Normal(0.1), 1), None);
    let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let mut data =
        random_correspondences(&rig, &chart(&rig), (60.0, 130.0), (Noise::None, 2), 3 * POINTS);
    let mut random = Random::new(3);
    let mut sigmas = vec![Vec::new(); 3];
    for row in &mut data.correspondences {
        for (camera, pixel) in row.pixels.iter_mut().enumerate() {
            let sigma = LEVELS[random.below(3)];
            sigmas[camera].push(sigma);
            if let Some(pixel) = pixel {
                *pixel = Noise::Normal(sigma).apply(*pixel, &mut random);
            }
        }
    }
    let rows = rows(&data);
    let columns = columns_of(&rows, 3);
    let pixels = columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect();
    let pixels = PixelColumns::new(pixels);
    let mut locator = Locator::new(&*fit.reconstructor, None);
    let mut found = LocatedBatch::default();
    let given = PixelSigmas::Each(sigmas.iter().map(Vec::as_slice).collect());
    locator.locate_noisy_into(&pixels, Some(&given), &mut found);
    let typical = LEVELS.map(|sigma| sigma * sigma).iter().sum::<f64>() / 3.0;
    let mut alike = LocatedBatch::default();
    let one = PixelSigmas::One(typical.sqrt());
    locator.locate_noisy_into(&pixels, Some(&one), &mut alike);
    assert_eq!(found.point, alike.point);
    let worst = |row: usize| sigmas.iter().map(|own| own[row]).fold(0.0, f64::max);
    for level in LEVELS {
        let held = |batch: &LocatedBatch| {
            let (mut held, mut count) = (0.0, 0.0);
            for (row, (world, _)) in data.known().enumerate().filter(|it| worst(it.0) == level) {
                let at = batch.get(row).unwrap();
                for axis in 0..3 {
                    let error = (at.point[axis] - world[axis]).abs();
                    held += f64::from(error < at.covariance[(axis, axis)].sqrt());
                    count += 1.0;
                }
            }
            assert!(count > 500.0, "{level} px: {count}");
            held / count
        };
        let (own, same) = (held(&found), held(&alike));
        assert!((0.63..0.73).contains(&own), "{level} px: {own}");
        assert!(level == 0.8 || same > 0.8, "{level} px: {same} of one standard deviation");
    }
    let mismatches = MismatchTest::new(0.001, 3).mismatches(&pixels, &found);
    let share = mismatches.iter().filter(|is| **is).count() as f64 / mismatches.len() as f64;
    assert!(share < 0.01, "{share}");
}

/// Whatever the map is, the two ways say the same, points stay where they are, and covariances stay positive definite.
#[test]
fn every_method_takes_a_noise_that_is_given() {
    let data = rows(&exam(0.1, 7))[..300].to_vec();
    for method in ["dlt", "tsai", "soloff", "interpolation", "network", "kannala-brandt"] {
        let map = fitted(method, 400, 3);
        let plain = CalibratedMap::new(&*map);
        for sigma in [0.02, 0.1, 5.0] {
            let batch = in_batch(&*map, &data, sigma);
            let one = CalibratedMap::new(&*map).with_pixel_sigma(Some(sigma));
            for (index, row) in data.iter().enumerate() {
                let Some(known) = plain.locate(row) else { continue };
                let (one, batch) = (one.locate(row).unwrap(), batch.get(index).unwrap());
                assert_eq!(one.point, known.point, "{method}");
                let definite = |of: &nalgebra::Matrix3<f64>| of.cholesky().is_some();
                assert!(definite(&one.covariance) && definite(&batch.covariance), "{method}");
                let ratio = one.covariance.trace() / batch.covariance.trace();
                assert!((0.9..1.1).contains(&ratio), "{method}, {sigma} px: {ratio}");
                let grown = one.covariance.trace() / known.covariance.trace();
                assert!(sigma < 5.0 || grown > 1.0, "{method}: {grown}");
            }
        }
    }
}

#[test]
fn noisier_pixels_are_noticed_and_told_apart_from_a_wrong_model() {
    let map = fitted("brown", 700, 1);
    for sigma in [0.05, 0.1] {
        assert_eq!(noisier_pixels(&*map, &rows(&exam(sigma, 2))), None, "{sigma}");
    }
    for sigma in [0.2, 0.3, 0.5, 1.5] {
        for count in [60, 512] {
            let found = noisier_pixels(&*map, &rows(&exam(sigma, 3))[..count]);
            let found = found.unwrap_or_else(|| panic!("{sigma}, {count}"));
            // Sixty residuals tell a standard deviation to a seventh.
            let ratio = found.sigma / sigma;
            assert!((0.65..1.5).contains(&ratio), "{sigma}, {count}: {ratio}");
            assert!((found.assumed - 0.1).abs() < 0.01, "{found:?}");
        }
        let known = CalibratedMap::new(&*map).with_pixel_sigma(Some(sigma));
        assert_eq!(noisier_pixels(&known, &rows(&exam(sigma, 4))), None, "{sigma}");
    }
    let good = rows(&exam(0.1, 5));
    // One camera's picture shifted by a pixel, few points, a tenth of gross mismatches, and rows that are shifted by one.
    let mut moved = good.clone();
    moved.iter_mut().for_each(|row| row[1].as_mut().unwrap().y += 1.0);
    assert_eq!(noisier_pixels(&*map, &moved), None);
    assert_eq!(noisier_pixels(&*map, &rows(&exam(0.5, 5))[..29]), None);
    let mut some = good.clone();
    some.iter_mut().step_by(10).for_each(|row| row[1].as_mut().unwrap().y += 20.0);
    assert_eq!(noisier_pixels(&*map, &some), None);
    let mut shifted = good.clone();
    for (row, next) in shifted.iter_mut().zip(&good[1..]) {
        row[1] = next[1];
    }
    assert_eq!(noisier_pixels(&*map, &shifted), None);
}
