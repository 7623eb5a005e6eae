//! The robot on the command line: one world, broken off early, with all that it writes.

use crate::program::{done, refused};

#[test]
fn a_world_is_driven_and_filmed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let arguments =
        ["drive", "--method", "brown", "--seed", "3", "--steps", "4", "--json", "-o", "drive"];
    let (told, _) = done(here, &arguments);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["worlds"], 1);
    for name in ["reached", "collisions", "stopped_safely"] {
        assert_eq!(told[name], 0, "{name}");
    }
    for name in ["position_error", "map_error"] {
        let [median, p95] = ["median", "p95"].map(|share| told[name][share].as_f64().unwrap());
        assert!(0.0 < median && median <= p95, "{name}: {told}");
    }
    assert!(told["steps_per_second"].as_f64().unwrap() > 0.0);
    // Four looks from the start nobody is far astray.
    assert!(told["position_error"]["p95"].as_f64().unwrap() < 5.0, "{told}");
    let trial = &told["trials"][0];
    assert_eq!((&trial["seed"], &trial["steps"]), (&3.into(), &4.into()));
    assert_eq!(trial["ended"], "underway");

    let saved: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("drive/summary.json")).unwrap())
            .unwrap();
    assert_eq!(saved["trials"], told["trials"]);
    let table = std::fs::read_to_string(here.join("drive/worlds.csv")).unwrap();
    let mut lines = table.lines();
    assert!(lines.next().unwrap().starts_with("seed,obstacles,ended,reached,"));
    assert!(lines.next().unwrap().starts_with("3,") && lines.next().is_none());

    let film = std::fs::read_to_string(here.join("drive/world-0003.html")).unwrap();
    assert!(film.contains("default-src 'none'") && !film.contains("http://"), "asks for more");
    assert_eq!(film.matches("data:image/jpeg;base64,").count(), 8, "two pictures a look");
    let data = film.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["frames"].as_array().unwrap().len(), 4);
    assert_eq!(data["outcome"], *trial);
    assert_eq!(data["frames"][0]["truth"], serde_json::json!([0.0, 0.0, 0.0]));
}

#[test]
fn what_cannot_be_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, word) in [
        (vec!["drive", "--knock", "0"], "turned by 0 degrees"),
        (vec!["drive", "--knock", "1", "--cover"], "--cover"),
        (vec!["drive", "--worlds", "0"], "0 is not in"),
        (vec!["drive", "--films", "2"], "--output"),
        (vec!["drive", "--preset", "none"], "unknown preset `none`"),
    ] {
        let said = refused(folder.path(), &arguments);
        assert!(said.contains(word), "{arguments:?}: {said}");
    }
    assert!(folder.path().read_dir().unwrap().next().is_none());
}
