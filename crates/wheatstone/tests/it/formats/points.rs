//! Tables of points, there and back.

use super::{format, given, places, written};
use crate::data;
use wheatstone::{
    Error,
    dataset::{Correspondence, Dataset},
    error::Remedy,
    formats::{FORMATS, Given, InputFile},
    geometry::Pixel,
    numeric::random::Random,
    tables::{self, Duplicates},
};

/// A table with what tables have: gaps, views, names, odd numbers.
fn table(views: bool) -> Dataset {
    let mut random = Random::new(21);
    let rows = places().into_iter().enumerate().map(|(index, world)| {
        let mut pixel = || Pixel::new(random.uniform(0.0, 1280.0), random.uniform(0.0, 1024.0));
        let mut pixels: Vec<Option<Pixel>> = (0..3).map(|_| Some(pixel())).collect();
        if index % 4 == 3 {
            pixels[index % 3] = None;
        }
        Correspondence {
            view: if views { index / 10 } else { 0 },
            id: views.then(|| format!("pt{}", index % 10 + 1)),
            pixels,
            world: Some(world),
            board: None,
        }
    });
    let correspondences = rows.collect();
    let names = if views { (1..=5).map(|view| view.to_string()).collect() } else { Vec::new() };
    Dataset { unit: "mm".into(), cameras: 3, views: names, correspondences }
}

fn back(name: &str, data: &Dataset) -> Dataset {
    let files = written(format(name).write_points(data, &given(3)).unwrap());
    format(name).read_points(&files, &given(3)).unwrap()
}

#[test]
fn tables_come_back() {
    for views in [false, true] {
        let data = table(views);
        assert_eq!(back("csv", &data), data);
        assert_eq!(back("parquet", &data), data);
        let npy = back("npy", &data);
        let bare = |row: &Correspondence| (row.pixels.clone(), row.world);
        let bares = |data: &Dataset| data.correspondences.iter().map(bare).collect::<Vec<_>>();
        assert_eq!(bares(&npy), bares(&data));
        for name in ["dltdv-points", "openptv-targets"] {
            let again = back(name, &data);
            assert_eq!(again.correspondences.len(), data.correspondences.len(), "{name}");
            for (new, old) in again.correspondences.iter().zip(&data.correspondences) {
                assert_eq!(new.world, old.world, "{name}");
                if name == "dltdv-points" && views {
                    assert_eq!((new.view, &new.id), (old.view, &old.id));
                }
                for (new, old) in new.pixels.iter().zip(&old.pixels) {
                    assert_eq!(new.is_some(), old.is_some(), "{name}");
                    let gap = new.zip(*old).map_or(0.0, |(new, old)| (new - old).norm());
                    assert!(gap < 1e-12 * 1280.0, "{name}: {gap}");
                }
            }
        }
        let key = |row: &(Vec<Option<Pixel>>, Option<wheatstone::geometry::Point3>)| {
            row.1.map(|p| [p.x.to_bits(), p.y.to_bits()])
        };
        let mut own = bares(&data);
        own.sort_by_key(key);
        for name in ["myptv", "proptv"] {
            let mut lists = bares(&back(name, &data));
            lists.sort_by_key(key);
            assert_eq!(lists, own, "{name}");
        }
    }
}

#[test]
fn numpys_own_files_are_read() {
    // numpy.save of [[1, 2, 3, 4, 5, 6, 7]] as int16, big-endian float32, and by columns.
    let file = |descr: &str, fortran: &str, shape: &str, body: &[u8]| {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes.extend(body);
        InputFile { path: "table.npy".into(), bytes }
    };
    let read = |file: InputFile| format("npy").read_points(&[file], &Given::default());
    let row: Vec<i16> = vec![1, 2, 3, 4, 5, 6, -7];
    let small: Vec<u8> = row.iter().flat_map(|v| v.to_le_bytes()).collect();
    let found = read(file("<i2", "False", "(1, 7)", &small)).unwrap();
    assert_eq!(found.cameras, 2);
    assert_eq!(found.correspondences[0].pixels[1], Some(Pixel::new(3.0, 4.0)));
    assert_eq!(found.correspondences[0].world.unwrap().z, -7.0);
    let big: Vec<u8> = row.iter().flat_map(|v| f32::from(*v).to_be_bytes()).collect();
    assert_eq!(read(file(">f4", "False", "(1, 7)", &big)).unwrap(), found);
    let columns: Vec<u8> = [1.0, 10.0, 2.0, 20.0, 3.0, 30.0, 4.0, 40.0]
        .iter()
        .flat_map(|v: &f64| v.to_le_bytes())
        .collect();
    let two = read(file("<f8", "True", "(2, 4)", &columns)).unwrap();
    assert_eq!(two.correspondences[1].pixels[0], Some(Pixel::new(10.0, 20.0)));
    for (descr, shape) in
        [("<f8", "(1, 7)"), ("<c16", "(1, 7)"), ("<i2", "(7,)"), ("<i2", "(2, 7)")]
    {
        let error = read(file(descr, "False", shape, &small)).unwrap_err();
        assert!(error.hint().is_some(), "{error}");
    }
}

#[test]
fn parquet_of_other_programs_is_read() {
    // Written by pyarrow 26 in two groups, with Zstandard: null and NaN, narrow numbers, times and lists.
    let read = format("parquet").read_points(&[super::file("pyarrow.parquet")], &given(2)).unwrap();
    assert_eq!((read.cameras, &read.views[..]), (2, &["a".to_owned(), "b".to_owned()][..]));
    let rows = &read.correspondences;
    assert_eq!(rows[0].pixels, [Some(Pixel::new(1.5, 2.0)), Some(Pixel::new(10.0, 0.5))]);
    assert_eq!(rows[1].pixels, [None, Some(Pixel::new(20.0, 1.5))]);
    assert_eq!(rows[2].pixels, [Some(Pixel::new(3.25, 4.0)), Some(Pixel::new(30.0, 2.5))]);
    assert_eq!((rows[2].view, rows[2].world), (1, None));
    let world = rows[1].world.unwrap();
    assert_eq!([world.x, world.y, world.z], [2.0, 4.0, 6.0]);
}

#[test]
fn markers_of_proptv_have_its_heading() {
    let files = format("proptv").write_points(&table(false), &given(3)).unwrap();
    assert_eq!(files[2].name, "markers_c2.txt");
    let text = String::from_utf8(files[0].bytes.clone()).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("# x,y,X,Y,Z"));
    assert_eq!(lines.next().unwrap().split(' ').count(), 5);
}

#[test]
fn clouds_hold_what_is_known() {
    let mut data = table(false);
    data.correspondences[0].world = None;
    let ply = format("ply").write_points(&data, &given(3)).unwrap().remove(0).bytes;
    let text = String::from_utf8_lossy(&ply);
    assert!(text.starts_with("ply\nformat binary_little_endian 1.0\n"));
    assert!(text.contains("element vertex 49\n"));
    let last = f64::from_le_bytes(ply[ply.len() - 8..].try_into().unwrap());
    assert_eq!(last, data.correspondences[49].world.unwrap().z);
    let pcd = format("pcd").write_points(&data, &given(3)).unwrap().remove(0).bytes;
    let last = f32::from_le_bytes(pcd[pcd.len() - 4..].try_into().unwrap());
    assert_eq!(last, data.correspondences[49].world.unwrap().z as f32);
    for (name, bytes) in [("ply", ply), ("pcd", pcd)] {
        let read = |bytes: &[u8]| {
            let file = InputFile { path: name.into(), bytes: bytes.into() };
            format(name).read_points(&[file], &Given::default())
        };
        let again = read(&bytes).unwrap();
        for ((was, _), (is, _)) in data.known().zip(again.known()) {
            let single = |value: f64| if name == "ply" { value } else { f64::from(value as f32) };
            assert_eq!(was.map(single), is, "{name}");
        }
        assert_eq!((again.known().count(), format(name).left_out(&data)), (49, 1));
        assert!(read(&bytes[..bytes.len() - 1]).is_err() && read(&bytes[..100]).is_err());
    }
    data.correspondences.iter_mut().for_each(|row| row.world = None);
    assert!(matches!(format("ply").write_points(&data, &given(3)), Err(Error::Unsupported { .. })));
}

#[test]
fn digitised_points_count_from_below() {
    let text = "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y\nNaN,NaN,NaN,NaN\n1,1024,101,1\n";
    let file = InputFile { path: "a_xypts.csv".into(), bytes: text.into() };
    let given = Given { sizes: vec![[1280, 1024]], ..Given::default() };
    let read = format("dltdv-points").read_points(std::slice::from_ref(&file), &given).unwrap();
    assert_eq!(read.views, ["2"]);
    let pixels = &read.correspondences[0].pixels;
    // The top-left pixel, and one of the bottom row.
    assert_eq!(pixels[0], Some(Pixel::new(0.0, 0.0)));
    assert_eq!(pixels[1], Some(Pixel::new(100.0, 1023.0)));
    let error = format("dltdv-points").read_points(&[file], &Given::default()).unwrap_err();
    assert!(error.hint().unwrap().remedy() == Some(Remedy::ImageSize));
}

#[test]
fn corners_of_a_board_are_sorted_into_cameras_and_views() {
    let text = "# filename x y level\nleft-01.jpg 10 20 0\nleft-01.jpg 11 20 0\nleft-01.jpg - - -\n\
                left-01.jpg 11 21 1\nright-01.jpg 5 6 0\nright-01.jpg - - -\nright-01.jpg 7 8 0\n\
                right-01.jpg 9 9 0\nleft-02.jpg - - -\n";
    let file = InputFile { path: "corners.vnl".into(), bytes: text.into() };
    let given = Given { board: Some((2, 77.0)), ..Given::default() };
    let read = format("vnl").read_points(std::slice::from_ref(&file), &given).unwrap();
    assert_eq!((read.cameras, &read.views[..]), (2, &["01".to_owned()][..]));
    let row = &read.correspondences[3];
    assert_eq!(row.board, Some([77.0, 77.0]));
    assert_eq!(row.pixels, [Some(Pixel::new(11.0, 21.0)), Some(Pixel::new(9.0, 9.0))]);
    assert_eq!(read.correspondences[2].pixels, [None, Some(Pixel::new(7.0, 8.0))]);
    assert!(format("vnl").read_points(&[file], &Given::default()).is_err());
}

#[test]
fn real_tables_pass_through_every_format_that_reads_and_writes() {
    for set in ["myptv-vee", "myptv-plate"] {
        let Some(folder) = data::folder(set) else { return };
        let data = tables::read(&folder.join("points.csv"), "mm", Duplicates::Refuse).unwrap();
        let formats = FORMATS.iter().filter(|f| !f.is_calibration() && f.reads() && f.writes());
        let formats = formats.filter(|f| !["ply", "pcd"].contains(&f.name));
        for format in formats {
            let given = Given { sizes: vec![[1280, 1024]], ..Given::default() };
            let files = written(format.write_points(&data, &given).unwrap());
            let again = format.read_points(&files, &given).unwrap();
            let sum = |data: &Dataset| -> f64 {
                let pixels =
                    data.correspondences.iter().flat_map(|row| row.pixels.iter().flatten());
                pixels.map(|p| p.x + 3.0 * p.y).sum()
            };
            assert_eq!(again.known().count(), data.known().count(), "{}", format.name);
            assert!((sum(&again) / sum(&data) - 1.0).abs() < 1e-12, "{}", format.name);
        }
    }
}
