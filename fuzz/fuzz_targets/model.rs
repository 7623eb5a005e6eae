//! Model files.
#![no_main]
use libfuzzer_sys::fuzz_target;
use wheatstone::{Calibration, Locator, Pixel, Silent};

fuzz_target!(|data: &[u8]| {
    let Ok(model) = Calibration::from_bytes(data) else { return };
    let cameras = model.reconstructor.cameras();
    for place in [[320.0, 240.0], [0.0, 0.0], [1e9, -1e9]] {
        let pixels = vec![Some(Pixel::new(place[0], place[1])); cameras];
        let _ = model.reconstructor.locate(&pixels);
        let _ = model.volume.trust(&pixels);
    }
    let columns: Vec<[f64; 2]> = vec![[320.0, f64::NAN]; 2 * cameras];
    let columns: Vec<&[f64]> = columns.iter().map(|column| &column[..]).collect();
    let _ = Locator::new(&*model.reconstructor, Some(&model.volume)).locate_columns(&columns, &Silent);
    let bytes = model.to_bytes().expect("what is read is written");
    Calibration::from_bytes(&bytes).expect("and read again");
});
