//! Memory that begins with a cache line.

use wheatstone_numeric::aligned::AlignedVec;

/// Bytes of a cache line.
const LINE: usize = 64;

fn begins_a_line<T>(values: &[T]) -> bool {
    (values.as_ptr() as usize).is_multiple_of(LINE)
}

#[test]
fn all_begin_with_a_line_and_keep_their_numbers() {
    for length in [0, 1, 15, 16, 400, 70_000] {
        let values: Vec<f64> = (0..length).map(|number| number as f64).collect();
        let own = AlignedVec::of(&values);
        let copies = [own.clone(), own.clone(), own];
        assert!(copies.iter().all(|copy| begins_a_line(copy) && **copy == values[..]));
        let zeros = AlignedVec::<f32>::zeros(length);
        assert!(begins_a_line(&zeros) && zeros.len() == length);
        assert!(zeros.iter().all(|value| *value == 0.0));
        let mut other = AlignedVec::of(&[1.0, 2.0]);
        other.clear(length);
        assert!(begins_a_line(&other) && *other == vec![0.0; length]);
    }
}
