//! How data are divided, and what the volume says of what it was shown.

use super::config;
use proptest::{collection::vec, option, prelude::*};
use wheatstone::{
    Pixel,
    chart::line_grid::LineGrid,
    dataset::{
        Correspondence, Dataset,
        split::{FoldKind, folds, folds_across},
        volume::{Trust, Volume},
    },
    geometry::Point3,
    synthetic::{Noise, Rig, random_correspondences},
};

/// Points of up to 20 views, some at no known place.
fn data() -> impl Strategy<Value = Dataset> {
    let place = (-50.0..50.0_f64, -40.0..40.0_f64, 0..8_i32);
    let row = (option::weighted(0.9, place), any::<prop::sample::Index>());
    (0..20_usize, vec(row, 1..120)).prop_map(|(views, rows)| {
        let correspondence =
            |(place, view): (Option<(f64, f64, i32)>, prop::sample::Index)| Correspondence {
                view: if views == 0 { 0 } else { view.index(views) },
                id: None,
                pixels: vec![Some(Pixel::new(1.0, 2.0)); 2],
                world: place.map(|(x, y, layer)| Point3::new(x, y, f64::from(15 * layer))),
                board: None,
            };
        Dataset {
            unit: "mm".into(),
            cameras: 2,
            views: (0..views).map(|view| format!("view {view}")).collect(),
            correspondences: rows.into_iter().map(correspondence).collect(),
        }
    })
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn every_known_point_is_held_out_once(data in data()) {
        let folds = folds(&data);
        let mut held: Vec<usize> = folds.iter().flat_map(|fold| fold.held_out.clone()).collect();
        held.sort_unstable();
        let known: Vec<usize> = (0..data.correspondences.len())
            .filter(|index| data.correspondences[*index].world.is_some())
            .collect();
        prop_assert_eq!(held, known);
        prop_assert!(folds.len() <= 12);
        prop_assert!(folds.iter().all(|fold| !fold.held_out.is_empty()));
        for (place, fold) in folds.iter().enumerate() {
            let outermost = place == 0 || place + 1 == folds.len();
            prop_assert_eq!(fold.kind == FoldKind::Extrapolation, outermost);
            let (fitted, judged) = fold.divide(&data);
            prop_assert_eq!(judged.correspondences.len(), fold.held_out.len());
            let all = fitted.correspondences.len() + judged.correspondences.len();
            prop_assert_eq!(all, data.correspondences.len());
        }
    }

    /// Points of one view are near-copies of each other.
    #[test]
    fn no_fold_divides_a_view(data in data()) {
        prop_assume!(data.views.len() >= 2);
        let mut owner = std::collections::BTreeMap::new();
        for (place, fold) in folds(&data).into_iter().enumerate() {
            for index in fold.held_out {
                let view = data.correspondences[index].view;
                prop_assert_eq!(*owner.entry(view).or_insert(place), place);
            }
        }
    }

    #[test]
    fn slabs_across_are_two_divisions_of_the_known_points(data in data()) {
        let mut times = vec![0; data.correspondences.len()];
        for fold in folds_across(&data) {
            fold.held_out.iter().for_each(|index| times[*index] += 1);
        }
        for (row, times) in data.correspondences.iter().zip(times) {
            prop_assert_eq!(times, if row.world.is_some() { 2 } else { 0 });
        }
    }

    #[test]
    fn a_subset_keeps_rows_and_their_order(data in data(), stride in 1..5_usize) {
        let kept = data.subset(|index, _| index % stride == 0);
        let due: Vec<_> = data.correspondences.iter().step_by(stride).cloned().collect();
        prop_assert_eq!(kept.correspondences, due);
        prop_assert_eq!(&kept.views, &data.views);
    }

    #[test]
    fn units_there_and_back(data in data(), unit in prop::sample::select(vec!["cm", "m", "in"])) {
        let back = data.clone().in_unit(unit).unwrap().in_unit("mm").unwrap();
        for (new, old) in back.correspondences.iter().zip(&data.correspondences) {
            let (Some(new), Some(old)) = (new.world, old.world) else {
                prop_assert_eq!(new.world, old.world);
                continue;
            };
            prop_assert!((new - old).norm() <= 1e-13 * (1.0 + old.coords.norm()));
        }
    }

    /// What was shown is inside; what is far beyond is not, nor what one camera sees alone.
    #[test]
    fn a_volume_trusts_what_it_was_shown(seed in 0..1000_u64, count in 40..120_usize) {
        let (rig, chart) = (Rig::named("paper", 2).unwrap(), LineGrid::default().into());
        let exact = (Noise::None, seed);
        let data = random_correspondences(&rig, &chart, (60.0, 120.0), exact, count);
        let volume = Volume::of(&data);
        prop_assert!(volume.is_consistent());
        prop_assert_eq!(volume.cameras(), 2);
        let pixels: Vec<_> = data.correspondences.iter().map(|row| row.pixels.clone()).collect();
        let inside = volume.trust_all(&pixels).iter().filter(|t| **t == Trust::Inside).count();
        prop_assert!(10 * inside >= 9 * count, "{inside} of {count}");
        for row in &pixels {
            let alone = [row[0], None];
            prop_assert_eq!(volume.trust(&alone), Trust::Outside);
        }
        let beyond = random_correspondences(&rig, &chart, (200.0, 220.0), exact, 10);
        for row in beyond.correspondences {
            prop_assert_eq!(volume.trust(&row.pixels), Trust::Outside);
        }
        let saved: Volume = serde_json::from_slice(&serde_json::to_vec(&volume).unwrap()).unwrap();
        prop_assert_eq!(saved, volume);
    }
}
