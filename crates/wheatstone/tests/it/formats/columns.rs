//! Parquet by column: what is written is what is read, to the last bit, however it is cut.

use std::path::Path;
use wheatstone::{
    Error,
    numeric::random::Random,
    tables::{Cells, Column, Columns, ColumnsReader, ColumnsWriter, Texts, Words},
};

const WORDS: &[&str] = &["inside", "edge", "outside"];

/// Columns with all that cells can hold; every so manieth is empty, none where that is 0.
fn columns(random: &mut Random, rows: usize, empty: usize) -> Columns {
    let mut gap = |row: usize| empty > 0 && row % empty == random.below(empty);
    let mut numbers = |scale: f64| {
        let odd = [f64::NAN, -0.0, f64::INFINITY, 5e-324, 1e300];
        let cell = |row: usize| {
            (!gap(row)).then(|| odd.get(row % 97).copied().unwrap_or(row as f64 * scale))
        };
        Column::Numbers((0..rows).map(cell).collect())
    };
    let places = [("x1", 0.1), ("y1", 0.3), ("x2", 0.7), ("y2", 0.9)];
    let mut columns: Vec<(String, Column)> =
        places.map(|(name, scale)| (name.to_owned(), numbers(scale))).into();
    let text = |row: usize| (!gap(row)).then(|| "ab,é\n".repeat(row % 3));
    columns.push(("note".into(), Column::Texts((0..rows).map(text).collect())));
    let frames = (0..rows as i64).map(|row| row * row - 5).collect();
    columns.push(("frame".into(), Column::Integers(Cells::whole(frames))));
    let mut random = Random::new(rows as u64);
    for (name, words, runs) in
        [("trust", WORDS, 1), ("long", WORDS, 600), ("flag", &["yes"][..], 40)]
    {
        let mut place = 0;
        let places = (0..rows).map(|row| {
            if row % runs == 0 {
                place = random.below(words.len() + 1) as u8;
            }
            place
        });
        columns.push((name.into(), Column::Words(Words { words, places: places.collect() })));
    }
    columns.push(("never".into(), Column::Words(Words { words: &["yes"], places: vec![0; rows] })));
    Columns { columns }
}

/// Words as the text that they are read as.
fn as_read(columns: &Columns) -> Columns {
    let column = |(name, column): &(String, Column)| {
        let column = match column {
            Column::Words(words) => {
                Column::Texts((0..words.places.len()).map(|row| words.get(row)).collect::<Texts>())
            }
            other => other.clone(),
        };
        (name.clone(), column)
    };
    Columns { columns: columns.columns.iter().map(column).collect() }
}

fn same(one: &Column, other: &Column, rows: usize) -> bool {
    match (one, other) {
        (Column::Numbers(one), Column::Numbers(other)) => {
            let bits = |cells: &Cells<f64>, row| cells.get(row).map(|value| value.to_bits());
            (0..rows).all(|row| bits(one, row) == bits(other, row))
        }
        _ => one == other,
    }
}

#[test]
fn columns_come_back_to_the_last_bit_in_slices_of_any_size() {
    let mut random = Random::new(27);
    // Around the sizes of a packed run, a page and a group.
    for (parts, empty) in [
        (vec![0], 0),
        (vec![1], 1),
        (vec![7, 504, 505, 1009], 3),
        (vec![65_535, 2, 65_535, 3], 0),
        (vec![200_000, 1, 70_001], 5),
    ] {
        let all = columns(&mut random, parts.iter().sum(), empty);
        let mut writer =
            ColumnsWriter::new(Path::new("a"), Vec::new(), &columns(&mut random, 0, 0)).unwrap();
        let mut begin = 0;
        for part in &parts {
            writer.write(part_of(&all, begin..begin + part)).unwrap();
            begin += part;
        }
        let bytes = writer.finish().unwrap();
        for most in [1 << 16, 1000, 131_072] {
            let mut reader =
                ColumnsReader::of_bytes(Path::new("a.parquet"), bytes.clone()).unwrap();
            let (all, mut begin) = (as_read(&all), 0);
            while let Some(read) = reader.next(most).unwrap() {
                let rows = read.rows();
                let expected = part_of(&all, begin..begin + rows);
                for ((name, one), (_, other)) in read.columns.iter().zip(&expected.columns) {
                    assert!(
                        same(one, other, rows),
                        "{name} in {begin}..{} of {parts:?}",
                        begin + rows
                    );
                }
                begin += rows;
            }
            assert_eq!(begin, all.rows());
        }
    }
}

fn part_of(columns: &Columns, rows: std::ops::Range<usize>) -> Columns {
    let part = |(name, column): &(String, Column)| {
        let column = match column {
            Column::Numbers(cells) => {
                Column::Numbers(rows.clone().map(|row| cells.get(row).copied()).collect())
            }
            Column::Texts(texts) => Column::Texts(rows.clone().map(|row| texts.get(row)).collect()),
            Column::Words(words) => Column::Words(Words {
                words: words.words,
                places: words.places[rows.clone()].into(),
            }),
            Column::Integers(cells) => {
                Column::Integers(Cells::whole(cells.values()[rows.clone()].into()))
            }
        };
        (name.clone(), column)
    };
    Columns { columns: columns.columns.iter().map(part).collect() }
}

#[test]
fn a_cell_that_is_no_place_is_named_by_its_row() {
    let number = |bad: f64, at: usize| {
        let cell = |row: usize| Some(if row == at { bad } else { 5.0 });
        Column::Numbers((0..150_000).map(cell).collect())
    };
    let texts: Texts =
        (0..150_000).map(|row| Some(if row == 140_000 { "here" } else { " 5 " })).collect();
    for (bad, words) in [
        (number(f64::INFINITY, 140_000), "row 140001: column `y2` is `inf`, which is no place"),
        (number(-1e10, 2), "row 3: column `y2` is `-10000000000`, which is no place"),
        (number(f64::NAN, 131_072), "row 131073: column `y2` is empty, but its partner is not"),
        (Column::Texts(texts), "row 140001: column `y2` is `here`, which is not a number"),
    ] {
        let good = number(0.0, 0);
        let names = ["x1", "y1", "x2"].map(|name| (name.to_owned(), good.clone()));
        let mut columns = Columns { columns: names.into() };
        columns.columns.push(("y2".into(), bad));
        let mut writer = ColumnsWriter::new(Path::new("a"), Vec::new(), &columns).unwrap();
        writer.write(columns).unwrap();
        let bytes = writer.finish().unwrap();
        let mut reader = ColumnsReader::of_bytes(Path::new("a.parquet"), bytes).unwrap();
        let error = loop {
            match reader.next_rows(10_000) {
                Ok(Some(rows)) => assert_eq!(rows.pixels().points(), rows.count()),
                Ok(None) => panic!("{words} was passed over"),
                Err(error) => break error,
            }
        };
        assert!(
            matches!(error, Error::Malformed { .. }) && error.to_string().contains(words),
            "{error}"
        );
    }
}
