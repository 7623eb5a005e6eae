//! What is held out.

use wheatstone_core::{
    dataset::{
        Correspondence, Dataset,
        split::{FoldKind, fewest_layers, folds, grouped},
    },
    geometry::{Pixel, Point3},
};
use wheatstone_numeric::random::Random;

fn dataset(views: &[&str], world: &[(usize, [f64; 3])]) -> Dataset {
    let row = |(view, p): &(usize, [f64; 3])| Correspondence {
        view: *view,
        id: None,
        pixels: vec![Some(Pixel::origin()); 2],
        world: Some(Point3::from(*p)),
        board: None,
    };
    Dataset {
        unit: "mm".into(),
        cameras: 2,
        views: views.iter().map(|v| (*v).to_string()).collect(),
        correspondences: world.iter().map(row).collect(),
    }
}

#[test]
fn views_are_held_out_whole_and_the_outermost_extrapolate() {
    let data = dataset(
        &["far", "near", "middle"],
        &[(0, [0.0, 0.0, 9.0]), (1, [0.0, 0.0, 1.0]), (2, [5.0, 0.0, 5.0]), (1, [1.0, 0.0, 1.0])],
    );
    let folds = folds(&data);
    let names: Vec<_> = folds.iter().map(|f| f.view.as_str()).collect();
    assert_eq!(names, ["near", "middle", "far"]);
    assert_eq!(folds[0].held_out, [1, 3]);
    use FoldKind::{Extrapolation as Out, Interpolation as In};
    assert_eq!(folds.iter().map(|f| f.kind).collect::<Vec<_>>(), [Out, In, Out]);
}

#[test]
fn slabs_follow_the_longest_axis_and_never_divide_a_level() {
    let mut random = Random::new(1);
    let points: Vec<(usize, [f64; 3])> = (0..300)
        .map(|i| {
            (0, [random.uniform(0.0, 5.0), f64::from(i % 10) * 10.0, random.uniform(0.0, 9.0)])
        })
        .collect();
    let data = dataset(&[], &points);
    let folds = folds(&data);
    assert_eq!(folds.len(), 7);
    let mut seen: Vec<usize> = folds.iter().flat_map(|f| f.held_out.clone()).collect();
    seen.sort_unstable();
    assert_eq!(seen, (0..300).collect::<Vec<_>>(), "every point is held out once");
    for fold in &folds {
        for level in 0..10 {
            let inside = fold.held_out.iter().filter(|i| *i % 10 == level).count();
            assert!(inside == 0 || inside == 30, "level {level} is divided");
        }
    }
    assert!(folds[0].view.starts_with("Y = 0"), "{}", folds[0].view);
}

#[test]
fn layers_are_counted_along_the_axis_that_has_fewest() {
    let mut random = Random::new(4);
    let mut points = |layers: usize| -> Vec<(usize, [f64; 3])> {
        (0..300)
            .map(|i| {
                let height = (i % layers) as f64 * 7.0 + random.uniform(-0.1, 0.1);
                (0, [random.uniform(0.0, 50.0), random.uniform(0.0, 40.0), height])
            })
            .collect()
    };
    assert_eq!(fewest_layers(&dataset(&[], &points(3))), Some(3));
    assert_eq!(fewest_layers(&dataset(&[], &points(7))), Some(7));
    assert_eq!(fewest_layers(&dataset(&[], &points(1))), None);
}

#[test]
fn many_views_share_folds() {
    let names: Vec<String> = (0..50).map(|i| format!("v{i}")).collect();
    let points: Vec<(usize, [f64; 3])> = (0..50).map(|i| (i, [0.0, 0.0, i as f64])).collect();
    let data = dataset(&names.iter().map(String::as_str).collect::<Vec<_>>(), &points);
    let folds = folds(&data);
    assert_eq!(folds.len(), 12);
    assert!(folds.iter().all(|f| (4..=5).contains(&f.held_out.len())));
    assert_eq!(grouped(folds.iter().map(|fold| fold.view.as_str())), Some([50, 12]));
    assert_eq!(grouped(["front", "back"]), None);
}
