//! Models of charts whose places on a stage are uncertain.

use crate::program::done;

#[test]
fn error_bars_of_a_stage_are_with_its_frame_or_within_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "--count", "200", "-o", "train.csv"]);
    let fit = ["fit", "train.csv", "--method", "dlt", "--no-validation", "-o", "model.json"];
    done(at, &[&fit[..], &["--stage-sigma", "0.05"]].concat());
    let columns = |more: &[&str]| -> Vec<[f64; 2]> {
        let (text, _) = done(at, &[&["locate", "model.json", "train.csv"], more].concat());
        let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let [place, sigma] = ["X", "sX"].map(|name| names.iter().position(|n| *n == name).unwrap());
        let rows = text.lines().skip(1).map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            [place, sigma].map(|column| cells[column].parse().unwrap())
        });
        rows.collect()
    };
    let (whole, within) = (columns(&[]), columns(&["--relative"]));
    assert_eq!(whole.len(), 200);
    for (whole, within) in whole.iter().zip(&within) {
        // Places are written to three digits beyond their standard deviation.
        assert!((whole[0] - within[0]).abs() < 0.01 * within[1]);
        // The shift alone is known to 0.05 cm over the root of seven views; text has four digits.
        let [whole, within] = [whole, within].map(|row| row[1].powi(2));
        let rounding = 1e-3 * (whole + within);
        assert!(whole - within > 0.99 * 0.05_f64.powi(2) / 7.0 - rounding);
    }
}
