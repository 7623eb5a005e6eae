//! Tables that are written and read again, in every form.

use super::config;
use proptest::{collection::vec, option, prelude::*};
use std::{collections::BTreeSet, path::Path};
use wheatstone::{
    Pixel,
    dataset::{Correspondence, Dataset},
    geometry::Point3,
    tables::{self, Duplicates, TableOptions},
};

/// Any number that is a place: up to 1e9, and as small as there are.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -2000.0..2000.0_f64,
        (-1e9..1e9_f64),
        prop::num::f64::SUBNORMAL,
        Just(0.0),
        Just(-0.0),
        Just(1e9),
        Just(1.0 / 3.0),
    ]
}

/// A name as people give them: with blanks inside, commas, quotes, lines, letters of any script.
fn name() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-z0-9]{1,6}",
        "[-a-zA-Z0-9,;'\"\t .äßµ中🦀#=+]{1,12}",
        "\\PC{1,8}",
        Just("nan".to_owned()),
        Just("a\nb".to_owned()),
        Just("\"".to_owned()),
        Just("1e5".to_owned()),
        Just("007".to_owned()),
    ]
    .prop_map(|name| name.trim().to_owned())
    .prop_filter("a name is not empty", |name| !name.is_empty())
}

/// A row's pixels, places and id; its view is settled afterwards.
fn row(cameras: usize) -> impl Strategy<Value = (Correspondence, prop::sample::Index)> {
    let pixel = || option::weighted(0.8, (number(), number()).prop_map(|(x, y)| Pixel::new(x, y)));
    let world = (number(), number(), number()).prop_map(|(x, y, z)| Point3::new(x, y, z));
    let row = (vec(pixel(), cameras), option::of(world), option::of([number(), number()]));
    (row, option::of(name()), any::<prop::sample::Index>()).prop_map(
        |((pixels, world, board), id, view)| {
            (Correspondence { view: 0, id, pixels, world, board }, view)
        },
    )
}

/// Any table: views in the order in which their first rows come, as a reader numbers them.
fn table() -> impl Strategy<Value = Dataset> {
    let unit = prop::sample::select(vec!["mm", "cm", "m", "in"]);
    let rows = (2..5_usize).prop_flat_map(|cameras| vec(row(cameras), 1..50));
    (unit, rows, vec(name(), 0..5)).prop_map(|(unit, rows, names)| {
        let names: Vec<String> = names.into_iter().collect::<BTreeSet<_>>().into_iter().collect();
        let (mut views, mut correspondences): (Vec<String>, Vec<_>) = Default::default();
        for (mut row, index) in rows {
            if !names.is_empty() {
                let name = index.get(&names);
                row.view = views.iter().position(|known| known == name).unwrap_or_else(|| {
                    views.push(name.clone());
                    views.len() - 1
                });
            }
            correspondences.push(row);
        }
        let cameras = correspondences[0].pixels.len();
        Dataset { unit: unit.into(), cameras, views, correspondences }
    })
}

/// All of a table, numbers by their bits.
fn bits(data: &Dataset) -> Vec<String> {
    let row = |row: &Correspondence| {
        let pixels: Vec<_> =
            row.pixels.iter().map(|p| p.map(|p| [p.x.to_bits(), p.y.to_bits()])).collect();
        let world = row.world.map(|p| [0, 1, 2].map(|axis| p[axis].to_bits()));
        let board = row.board.map(|place| place.map(f64::to_bits));
        format!("{:?} {:?} {pixels:?} {world:?} {board:?}", data.views.get(row.view), row.id)
    };
    data.correspondences.iter().map(row).collect()
}

fn come_back(data: &Dataset, name: &str) -> Result<(), TestCaseError> {
    let bytes = tables::encode(data, Path::new(name)).unwrap();
    let options = TableOptions {
        unit: Some(data.unit.clone()),
        duplicates: Duplicates::Keep,
        ..TableOptions::default()
    };
    let again = tables::read_bytes(Path::new(name), bytes, &options);
    let again = again.map_err(|error| TestCaseError::fail(format!("{name}: {error}")))?;
    prop_assert_eq!(&again.unit, &data.unit);
    prop_assert_eq!(again.cameras, data.cameras);
    prop_assert_eq!(&again.views, &data.views);
    prop_assert_eq!(bits(&again), bits(data));
    Ok(())
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn text_comes_back(data in table()) {
        come_back(&data, "points.csv")?;
    }

    #[test]
    fn gzipped_text_comes_back(data in table()) {
        come_back(&data, "points.csv.gz")?;
    }

    #[test]
    fn parquet_comes_back(data in table()) {
        come_back(&data, "points.parquet")?;
    }

    #[test]
    fn arrow_comes_back(data in table()) {
        come_back(&data, "points.arrow")?;
    }

    /// Files by column say their unit, and are converted to the one that is wanted.
    #[test]
    fn units_convert(data in table(), name in prop::sample::select(vec!["p.parquet", "p.arrow"])) {
        let bytes = tables::encode(&data, Path::new(name)).unwrap();
        let options = TableOptions {
            unit: Some("mm".into()),
            duplicates: Duplicates::Keep,
            ..TableOptions::default()
        };
        let again = tables::read_bytes(Path::new(name), bytes, &options).unwrap();
        let factor = match data.unit.as_str() {
            "mm" => 1.0,
            "cm" => 10.0,
            "m" => 1000.0,
            _ => 25.4,
        };
        prop_assert_eq!(&again.unit, "mm");
        for (new, old) in again.correspondences.iter().zip(&data.correspondences) {
            prop_assert_eq!(&new.pixels, &old.pixels);
            let (Some(new), Some(old)) = (new.world, old.world) else {
                prop_assert_eq!(new.world.is_some(), old.world.is_some());
                continue;
            };
            prop_assert!((new - old * factor).norm() <= 1e-12 * factor * old.coords.norm());
        }
    }
}
