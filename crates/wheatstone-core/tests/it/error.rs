//! Names that are close to a mistyped one.

use wheatstone_core::error::nearest;

#[test]
fn a_typing_slip_is_recognised_and_a_stranger_is_not() {
    let known = ["network", "dlt"].map(String::from);
    assert_eq!(nearest("netwrok", &known), Some("network"));
    assert_eq!(nearest("dtl", &known), Some("dlt"));
    assert_eq!(nearest("photogrammetry", &known), None);
}
