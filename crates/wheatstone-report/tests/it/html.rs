//! Pages that cannot be broken out of.

use maud::PreEscaped;
use wheatstone_report::html::{escape, json, policy};

/// The digest of `abc` in NIST's FIPS 180-4 test vectors, in base 64.
#[test]
fn policies_name_digests() {
    let digest = "sha256-ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=";
    for (policy, of) in [(policy("abc", ""), "style"), (policy("", "abc"), "script")] {
        assert!(policy.contains(&format!("; {of}-src '{digest}';")), "{policy}");
    }
}

#[test]
fn nothing_escapes() {
    assert_eq!(
        escape("<a href='x'>\"&\u{0}\u{202e}").0,
        "&lt;a href='x'&gt;&quot;&amp;\u{fffd}\u{fffd}"
    );
    let PreEscaped(coded) = json(&"</script><!--\u{2028}&");
    assert!(!coded.contains(['<', '>', '&', '\u{2028}']));
    assert_eq!(serde_json::from_str::<String>(&coded).unwrap(), "</script><!--\u{2028}&");
}
