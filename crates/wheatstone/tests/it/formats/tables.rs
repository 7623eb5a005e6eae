//! Tables as users write them: what is read, what is refused and how, and that what is written is read back.

use std::{
    io::Write,
    path::{Path, PathBuf},
    sync::Arc,
};
use wheatstone::{
    Error,
    dataset::Dataset,
    error::Remedy,
    geometry::{Pixel, Point3},
    numeric::random::Random,
    tables::{
        self, ArrayRef, ColumnNames, Duplicates, Float64Array, StringArray, TableOptions,
        TableReader, TableStyle, TableWriter,
    },
};

/// The same two points, whatever a table looks like.
fn plain() -> Dataset {
    parse("x1,y1,x2,y2,X,Y,Z\n1.5,2,3,4,5,6,7\n8,9,10,11,12.25,13,14\n").unwrap()
}

fn parse(text: &str) -> Result<Dataset, Error> {
    parse_with(text.as_bytes(), None)
}

fn parse_with(bytes: &[u8], columns: Option<&str>) -> Result<Dataset, Error> {
    let columns = columns.map(|names| ColumnNames::parse(names).unwrap());
    let options = TableOptions { columns, ..TableOptions::default() };
    let reader = TableReader::of_bytes(Path::new("points.csv"), bytes.into(), &options)?;
    reader.needs_points()?;
    reader.gather(&options)
}

fn refused(text: &str) -> (Option<u64>, String, Option<Remedy>) {
    match parse(text) {
        Err(Error::Malformed { line, problem, hint, .. }) => (line, problem, hint.remedy()),
        other => panic!("{text:?}: {other:?}"),
    }
}

#[test]
fn usual_spellings_are_understood() {
    let rows = "1.5,2,3,4,5,6,7\n8,9,10,11,12.25,13,14\n";
    let headers = [
        "x1,y1,x2,y2,X,Y,Z",
        "u1,v1,u2,v2,X,Y,Z",
        "x_1,y_1,x_2,y_2,x,y,z",
        "xa,ya,xb,yb,X,Y,Z",
        "x1 [px],y1 [px],x2 [px],y2 [px],X,Y,Z",
        "left_x,left_y,right_x,right_y,X,Y,Z",
        "u_left,v_left,u_right,v_right,world_x,world_y,world_z",
        "xl,yl,xr,yr,Xw,Yw,Zw",
        "cam1_x,cam1_y,cam2_x,cam2_y,X,Y,Z",
        "x0,y0,x1,y1,X,Y,Z",
        "X1,Y1,X2,Y2,X,Y,Z",
        "x1_px,y1_px,x2_px,y2_px,X_mm,Y_mm,Z_mm",
        "x1,y1,x2,y2,X [mm],Y [mm],Z [mm]",
        "x1,y1,x2,y2,X millimetres,Y (mm),z_mm",
    ];
    for header in headers {
        assert_eq!(parse(&format!("{header}\n{rows}")).unwrap(), plain(), "{header}");
    }
    let own = "x1,y1,x2,y2,X,Y,Z\n";
    for text in [
        format!("\u{feff}{}", format!("{own}{rows}").replace('\n', "\r\n")),
        format!("# measured on Tuesday\n\n# unit: mm\n{own}# the first\n{rows}"),
        format!("# {own}{rows}"),
        format!("{own}{rows}").replace(',', "\t"),
        format!("{own}{rows}").replace(',', ";").replace('.', ","),
        format!("{own}{rows}").replace(',', " ,  "),
        format!("{own},,,,nan,NaN,\n{rows}").replace(",,,,nan,NaN,\n", ""),
        "weight,Z,Y,X,y2,x2,y1,x1\n0.5,7,6,5,4,3,2,1.5\n,14,13,12.25,\"11\",10,9,8\n".into(),
    ] {
        assert_eq!(parse(&text).unwrap(), plain(), "{text:?}");
    }
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(format!("{own}{rows}").as_bytes()).unwrap();
    assert_eq!(parse_with(&packed.finish().unwrap(), None).unwrap(), plain());
}

#[test]
fn columns_are_named_by_the_user() {
    let rows = "1.5,2,3,4,5,6,7\n8,9,10,11,12.25,13,14\n";
    let told = "x1=a,y1=b,x2=c,y2=d,X=e,Y=f,Z=g";
    assert_eq!(
        parse_with(format!("a,b,c,d,e,f,g\n{rows}").as_bytes(), Some(told)).unwrap(),
        plain()
    );
    // What was called so by itself is another column then.
    let text = format!("left u,left v,x2,y2,X,Y,Z\n{rows}");
    assert_eq!(parse_with(text.as_bytes(), Some("x1=left u,y1=left v")).unwrap(), plain());
    for head in ["", "first,line,is,a,header,of,another\n"] {
        let text = format!("{head}{rows}");
        assert_eq!(parse_with(text.as_bytes(), Some("x1,y1,x2,y2,X,Y,Z")).unwrap(), plain());
    }
    let text = "1,5;2;0;3;4;5;6;7\n8;9;0;10;11;12,25;13;14\n";
    assert_eq!(parse_with(text.as_bytes(), Some("x1,y1,_,x2,y2,X,Y,Z")).unwrap(), plain());
    let error = parse_with(rows.as_bytes(), Some("x1,y1,x2,y2")).unwrap_err().to_string();
    assert!(error.contains("7 columns, 4 were named"), "{error}");
    let error = parse_with(b"a,b\n1,2\n", Some("x1=c,y1=b")).unwrap_err().to_string();
    assert!(error.contains("no column `c`; found: a, b"), "{error}");
    for wrong in ["x1=a,y1", "colour=a", "x1,q"] {
        assert!(matches!(ColumnNames::parse(wrong), Err(Error::Setting { .. })), "{wrong}");
    }
    for names in [told, "x1,y1,_,x2,y2"] {
        assert_eq!(ColumnNames::parse(names).unwrap().to_string(), names);
    }
}

#[test]
fn nothing_seen_and_three_cameras() {
    for nothing in ["", "nan", "NaN", "NA", "null", " "] {
        let text = format!(
            "x1,y1,x2,y2,x3,y3,X,Y,Z,id\n1,2,3,4,{nothing},{nothing},5,6,7,a\n,,1,2,3,4,,,,b\n"
        );
        let data = parse(&text).unwrap();
        assert_eq!(data.cameras, 3);
        let [first, second] = &data.correspondences[..] else { panic!("two rows") };
        assert_eq!(first.pixels, [Some(Pixel::new(1.0, 2.0)), Some(Pixel::new(3.0, 4.0)), None]);
        assert_eq!((first.world, second.world), (Some(Point3::new(5.0, 6.0, 7.0)), None));
        assert_eq!((first.id.as_deref(), second.id.as_deref()), (Some("a"), Some("b")));
    }
    // Cameras that count from 0 are three here, not two and something else.
    assert_eq!(parse("x0,y0,x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7,8,9\n").unwrap().cameras, 3);
}

#[test]
fn places_on_a_flat_chart_are_told_from_points() {
    let text = "view,X_mm,Y_mm,x1,y1,x2,y2\n0,30,60,1,2,3,4\n";
    let (_, problem, remedy) = refused(text);
    assert!(problem.contains("no column `Z`; found: view, X_mm"), "{problem}");
    assert_eq!(remedy, Some(Remedy::BoardColumns));
    // Pixels can be located without Z.
    let reader = TableReader::of_bytes(Path::new("points.csv"), text.into(), &Default::default());
    assert!(reader.unwrap().gather(&TableOptions::default()).is_ok());
    let told = Some("board_x=X_mm,board_y=Y_mm");
    for text in [text, "view,X_mm,Y_mm,Z_mm,x1,y1,x2,y2\n0,30,60,0,1,2,3,4\n"] {
        let data = parse_with(text.as_bytes(), told).unwrap();
        assert_eq!(data.correspondences[0].board, Some([30.0, 60.0]));
        assert_eq!((data.correspondences[0].world, &data.unit[..]), (None, "mm"));
    }
    // A column that is given another name keeps its unit, and is found without it.
    for told in ["board_x=X_cm,board_y=Y_cm", "board_x=X,board_y=Y"] {
        let text = "view,X_cm,Y_cm,x1,y1,x2,y2\n0,3,6,1,2,3,4\n";
        let data = parse_with(text.as_bytes(), Some(told)).unwrap();
        assert_eq!((data.correspondences[0].board, &data.unit[..]), (Some([3.0, 6.0]), "cm"));
    }
    // Without such a mapping a lone Z is not passed over.
    let (_, problem, _) = refused("view,board_x,board_y,Z,x1,y1,x2,y2\n0,30,60,0,1,2,3,4\n");
    assert!(problem.contains("no column `X`, `Y`"), "{problem}");
}

#[test]
fn faults_are_named_with_line_and_column() {
    let header = "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n";
    let cases: [(String, Option<u64>, &str); 19] = [
        (String::new(), Some(1), "empty"),
        ("1,2,3,4,5,6,7\n".into(), Some(1), "the header is missing"),
        ("x1,y1,X,Y,Z\n".into(), Some(1), "no column `x2`, `y2`; found: x1, y1, X, Y, Z"),
        ("é,µ\n".into(), Some(1), "no column `x1`, `y1`, `x2`, `y2`; found: é, µ"),
        ("x1,y1,x2,y2,x4,y4\n".into(), Some(1), "`x4` has no partner: the next camera needs `x3`"),
        ("x1,y1,x2,y2,X,Y\n".into(), Some(1), "no column `Z`; found: x1, y1, x2, y2, X, Y"),
        ("x1,y1,x2,y2\n1,2,3,4\n".into(), None, "no column `X`, `Y`, `Z`; found: x1, y1, x2, y2"),
        ("x1,y1,x2,y2,x1\n".into(), Some(1), "two columns"),
        (
            "u1,v1,u2,v2,left_x,left_y,right_x,right_y,X,Y,Z\n".into(),
            Some(1),
            "`left_x` and similar columns",
        ),
        (
            "x1,y1,x2,y2,X_mm,Y_cm,Z_mm\n".into(),
            Some(1),
            "some lengths are in `mm` and some in `cm`",
        ),
        ("x1,y1,x2,y2,X,Y,Z\n".into(), None, "no points"),
        (
            format!("{header}1,2,three,4,5,6,7\n"),
            Some(3),
            "column `x2` is `three`, which is not a number",
        ),
        (
            format!("# a\n\n{header}# b\n\n1,2,3,nan,5,6,7\n"),
            Some(7),
            "column `y2` is empty, but its",
        ),
        (
            format!("{header}1,2,3,4,5,6,1e999\n"),
            Some(3),
            "column `Z` is `inf`, which is out of range",
        ),
        (format!("{header}1,2,3,4,5,6\n"), Some(3), "6 cells, the header has 7"),
        (format!("{header}1,2,3,4,5,6,NaN\n"), Some(3), "column `Z` is empty, but its"),
        (format!("{header}1,2,3,4,5,6,8\n1,2,3,4,5,6,7\n"), Some(4), "is in line 2"),
        (format!("{header}1.2.3,2,3,4,5,6,8"), Some(3), "column `x1` is `1.2.3`"),
        (header.replace(',', ";") + "1.234,5;2;3;4;5;6;7", Some(3), "is `1.234,5`"),
    ];
    for (text, line, words) in cases {
        let (at, problem, _) = refused(&text);
        assert_eq!(at, line, "{text:?}: {problem}");
        assert!(problem.contains(words), "{text:?}: {problem}");
    }
    assert_eq!(refused("a,b\n").2, Some(Remedy::Columns));
    let twice = format!("{header}1,2,3,4,5,6,7\n");
    assert_eq!(refused(&twice).2, Some(Remedy::DropDuplicates));
}

#[test]
fn a_table_remembers_its_unit_and_is_converted() {
    let rows = "1,2,3,4,5,6,7\n";
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let read = |path: &PathBuf, unit: Option<&str>| {
        let unit = unit.map(str::to_owned);
        let data = tables::read_with(path, &TableOptions { unit, ..TableOptions::default() })?;
        Ok::<_, Error>((data.unit.clone(), data.correspondences[0].world.unwrap()))
    };
    let metres = [
        file("a.csv", &format!("# unit: m\nx1,y1,x2,y2,X,Y,Z\n{rows}")),
        file("b.csv", &format!("x1,y1,x2,y2,X_m,Y_m,Z_m\n{rows}")),
        file("c.csv", &format!("x1,y1,x2,y2,X,Y,Z\n# units = metres\n{rows}")),
        file("i.csv", &format!("x1,y1,x2,y2,X (m),Y (m),Z (meters)\n{rows}")),
    ];
    let data = tables::read(&metres[0], "m", Duplicates::Refuse).unwrap();
    let columns = ["d.parquet", "e.arrow", "f.feather"].map(|name| {
        let path = folder.path().join(name);
        std::fs::write(&path, tables::encode(&data, &path).unwrap()).unwrap();
        path
    });
    for path in metres.iter().chain(&columns) {
        assert_eq!(read(path, None).unwrap(), ("m".into(), Point3::new(5.0, 6.0, 7.0)), "{path:?}");
        let converted = ("mm".into(), Point3::new(5000.0, 6000.0, 7000.0));
        assert_eq!(read(path, Some("mm")).unwrap(), converted, "{path:?}");
        // Not what is no unit of length that we know.
        assert!(matches!(read(path, Some("cubit")), Err(Error::Mismatch { what: "unit", .. })));
    }
    let silent = file("g.csv", &format!("x1,y1,x2,y2,X,Y,Z\n{rows}"));
    assert_eq!(read(&silent, None).unwrap().0, "mm");
    assert_eq!(read(&silent, Some("cm")).unwrap(), ("cm".into(), Point3::new(5.0, 6.0, 7.0)));
    let torn = file("h.csv", &format!("# unit: m\nx1,y1,x2,y2,X_mm,Y_mm,Z_mm\n{rows}"));
    assert!(read(&torn, None).unwrap_err().to_string().contains("in `mm`"));
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    let mut random = Random::new(3);
    let mut text = String::from("x1,y1,x2,y2,x3,y3,X,Y,Z,view,id\n");
    for row in 0..30_000 {
        let number = |random: &mut Random| {
            let value = random.normal() * 10_f64.powi(random.below(40) as i32 - 32);
            if value.abs() > 1e9 { 0.1 } else { value }
        };
        let numbers: Vec<String> = (0..9).map(|_| number(&mut random).to_string()).collect();
        let seen = if row % 7 == 0 { ",".into() } else { numbers[4..6].join(",") };
        text += &format!("{},{seen},{}", numbers[..4].join(","), numbers[6..].join(","));
        text += [",#1,7\n", ",\"b,c\",\"she said \"\"no\"\"\"\n", ",\"two\nlines\",\n"][row % 3];
    }
    let data = parse(&text).unwrap();
    assert_eq!(data.views, ["#1", "b,c", "two\nlines"]);
    for name in ["a.csv", "a.csv.gz", "a.parquet", "a.arrow"] {
        let bytes = tables::encode(&data, Path::new(name)).unwrap();
        let again = tables::read_bytes(Path::new(name), bytes, &TableOptions::default()).unwrap();
        assert_eq!(again, data, "{name}");
    }
    assert_eq!(parse(&tables::write(&data)).unwrap(), data);
    let board = parse("x1,y1,x2,y2,board_x,board_y,view\n1,2,3,4,30,60,0\n").unwrap();
    assert_eq!(board.correspondences[0].board, Some([30.0, 60.0]));
    assert_eq!(parse(&tables::write(&board)).unwrap(), board);
}

#[test]
fn a_cell_that_is_no_place_is_named_by_its_row() {
    const ROWS: usize = 150_000;
    let numbers = |bad: Option<f64>| -> ArrayRef {
        let cell = |row: usize| if row == 140_000 { bad } else { Some(5.0) };
        Arc::new((0..ROWS).map(cell).collect::<Float64Array>())
    };
    let texts = (0..ROWS).map(|row| Some(if row == 140_000 { "here" } else { " 5 " }));
    let texts: ArrayRef = Arc::new(texts.collect::<StringArray>());
    for (bad, words) in [
        (numbers(Some(f64::INFINITY)), "row 140001: column `y2` is `inf`, which is out of range"),
        (numbers(None), "row 140001: column `y2` is empty, but its partner is not"),
        (texts, "row 140001: column `y2` is `here`, which is not a number"),
    ] {
        for name in ["a.parquet", "a.arrow"] {
            let names = ["x1", "y1", "x2", "y2"].map(str::to_owned).to_vec();
            let style = TableStyle::default();
            let mut writer = TableWriter::new(Path::new(name), Vec::new(), names, style).unwrap();
            let good = numbers(Some(1.0));
            writer.write_columns(&[good.clone(), good.clone(), good, bad.clone()]).unwrap();
            let bytes = writer.finish().unwrap();
            let duplicates = Duplicates::Keep;
            let options = TableOptions { duplicates, ..TableOptions::default() };
            let error = tables::read_bytes(Path::new(name), bytes, &options);
            let error = error.unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}

/// A length that a file says of its parts is not believed: memory for it would end the program.
#[test]
fn parts_longer_than_the_file_are_refused() {
    let read = |name: &str, bytes: Vec<u8>| {
        tables::read_bytes(Path::new(name), bytes, &TableOptions::default())
    };
    // A stream whose first message has a gigabyte and a half.
    let stream = b"\xff\xff\xff\xff# \xdaX\x02\x07\0\0".to_vec();
    let error = read("points.arrow", stream).unwrap_err().to_string();
    assert!(error.contains("longer than the file"), "{error}");
    // A footer whose second field, the schema, is a list of 2^31 - 1 structures; and one where it is said to be a
    // number.
    for (kind, words) in [(9, "more members than the file has bytes"), (5, "footer is damaged")] {
        let mut footer = b"PAR1".to_vec();
        footer.extend([2 << 4 | kind, 0xFC, 0xFF, 0xFF, 0xFF, 0xFF, 0x07, 0]);
        footer.extend(*b"\x08\0\0\0PAR1");
        let error = read("points.parquet", footer).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    for name in ["points.arrow", "points.parquet"] {
        let good = tables::encode(&plain(), Path::new(name)).unwrap();
        let mut refused = 0;
        for place in 0..good.len() - 8 {
            let mut bytes = good.clone();
            bytes[place..place + 8].copy_from_slice(&(0x7fff_ffff_ffff_u64).to_le_bytes());
            refused += usize::from(read(name, bytes).is_err());
        }
        assert!(refused > good.len() / 20, "{refused} of {} {name}", good.len());
    }
}

#[test]
fn names_that_ask_for_another_kind_of_file_are_refused() {
    for (name, written) in [
        ("points.npy", false),
        ("points.XLSX", false),
        ("points.json", false),
        ("points", true),
        ("points.txt", true),
        ("points.csv.gz", true),
    ] {
        let names = vec!["x1".to_owned()];
        let made = TableWriter::new(Path::new(name), Vec::new(), names, TableStyle::default());
        assert_eq!(made.is_ok(), written, "{name}");
        if let Err(error) = made {
            assert!(error.to_string().contains("tables are not written as ."), "{error}");
        }
    }
}
