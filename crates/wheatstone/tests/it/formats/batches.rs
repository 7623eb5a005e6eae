//! Record batches in memory, as data frames hand them over, and what locating adds to them.

use std::{path::Path, sync::Arc};
use wheatstone::{
    Calibration, Error, Prepared, Silent,
    dataset::Dataset,
    geometry::{PixelColumns, columns_of},
    method::{AnyMethod, mismatch::MismatchTest},
    synthetic::{Noise, Rig, Stage, chart_correspondences},
    tables::{
        ArrayRef, ArrowError, DataType, Field, Float64Array, LocatedColumns, RecordBatch,
        RecordBatchIterator, Schema, SchemaRef, StringArray, TableOptions, TableReader,
        arrow_array::{
            Array, DictionaryArray, Float32Array, Int64Array, LargeStringArray, NullArray,
            StringViewArray,
            cast::AsArray,
            types::{Float64Type, Int32Type},
        },
    },
};

fn batch(columns: Vec<(&str, ArrayRef)>) -> RecordBatch {
    RecordBatch::try_from_iter_with_nullable(
        columns.into_iter().map(|(name, column)| (name, column, true)),
    )
    .unwrap()
}

fn reader(
    schema: SchemaRef,
    batches: Vec<Result<RecordBatch, ArrowError>>,
) -> Result<TableReader, Error> {
    let batches = Box::new(RecordBatchIterator::new(batches, schema));
    TableReader::of_batches(Path::new("frame"), batches, &TableOptions::default())
}

fn read(batches: &[RecordBatch]) -> Result<Dataset, Error> {
    let batches: Vec<_> = batches.iter().cloned().map(Ok).collect();
    let schema = batches[0].as_ref().map(RecordBatch::schema).unwrap();
    reader(schema, batches)?.gather(&TableOptions::default())
}

fn doubles(values: &[f64]) -> ArrayRef {
    Arc::new(Float64Array::from(values.to_vec()))
}

/// What pandas and polars hand over: numbers of all kinds, and text in all layouts.
#[test]
fn columns_of_every_kind_are_read_as_a_file_of_text_is() {
    let text = "x1,y1,x2,y2,X,Y,Z,view,id\n1.5,2,3,4,5,6,7,a,7\n8,9,,,12,13,14,b,\n";
    let options = TableOptions::default();
    let same = TableReader::of_bytes(Path::new("points.csv"), text.into(), &options).unwrap();
    let same = same.gather(&options).unwrap();
    let views: DictionaryArray<Int32Type> = ["a", "b"].into_iter().collect();
    let own = batch(vec![
        ("x1", Arc::new(Float32Array::from(vec![1.5, 8.0]))),
        ("y1", Arc::new(Int64Array::from(vec![2, 9]))),
        ("x2", Arc::new(Float64Array::from(vec![Some(3.0), None]))),
        ("y2", doubles(&[4.0, f64::NAN])),
        ("X", Arc::new(LargeStringArray::from(vec!["5", "12"]))),
        ("Y", Arc::new(StringViewArray::from(vec!["6", " 13"]))),
        ("Z", Arc::new(StringArray::from(vec!["7", "14"]))),
        ("view", Arc::new(views)),
        ("id", Arc::new(LargeStringArray::from(vec![Some("7"), None]))),
        ("note", Arc::new(NullArray::new(2))),
    ]);
    assert_eq!(read(std::slice::from_ref(&own)).unwrap(), same);
    // In parts as well, of which some are empty.
    let parts = [own.slice(0, 0), own.slice(0, 1), own.slice(1, 0), own.slice(1, 1)];
    assert_eq!(read(&parts).unwrap(), same);
}

#[test]
fn rows_pass_through_with_their_columns() {
    let pixels: Vec<f64> = (0..40_000).map(f64::from).collect();
    let columns = ["x1", "y1", "x2", "y2"].map(|name| (name, doubles(&pixels)));
    let words: ArrayRef = Arc::new(StringViewArray::from_iter_values(
        pixels.iter().map(|value| format!("number {value}")),
    ));
    let own = batch(columns.into_iter().chain([("note", Arc::clone(&words))]).collect());
    let mut reader = reader(own.schema(), vec![Ok(own.clone())]).unwrap();
    let mut done = 0;
    while let Some(rows) = reader.next_rows().unwrap() {
        assert_eq!(*rows.batch(), own.slice(done, rows.count()));
        assert_eq!(rows.pixels().cameras()[1][0], &pixels[done..done + rows.count()]);
        done += rows.count();
    }
    assert_eq!(done, pixels.len());
}

#[test]
fn faults_name_the_table_and_the_row() {
    let refused = |result: Result<Dataset, Error>| match result {
        Err(Error::Malformed { path, problem, .. }) => {
            assert_eq!(path, Path::new("frame"));
            problem
        }
        other => panic!("{other:?}"),
    };
    let with = |column: ArrayRef| {
        let [a, b, c] = ["x1", "y1", "x2"].map(|name| (name, doubles(&[1.0, 2.0])));
        batch(vec![a, b, c, ("y2", column)])
    };
    let sound = with(doubles(&[1.0, 2.0]));
    for (column, what) in [
        (Arc::new(StringViewArray::from(vec!["1", "left"])) as ArrayRef, "row 4: column `y2` is"),
        (doubles(&[1.0, 1e12]), "row 4: column `y2` is"),
        (doubles(&[f64::NAN, 1.0]), "row 3: column `y2` is empty"),
    ] {
        let schema = sound.schema();
        let read = reader(schema, vec![Ok(sound.clone()), Ok(with(column))]).unwrap();
        let problem = refused(read.gather(&TableOptions::default()));
        assert!(problem.starts_with(what), "{problem}");
    }
    let problem = refused(read(&[with(Arc::new(arrow_lists()))]));
    assert!(problem.contains("not numbers"), "{problem}");
    let broken = vec![Ok(sound.clone()), Err(ArrowError::ComputeError("gone".into()))];
    let read = reader(sound.schema(), broken).unwrap().gather(&TableOptions::default());
    let problem = refused(read);
    assert!(problem.contains("table in memory") && problem.contains("gone"), "{problem}");
    let problem = refused(self::read(&[batch(vec![("x1", doubles(&[1.0]))])]));
    assert!(problem.starts_with("no column"), "{problem}");
}

fn arrow_lists() -> wheatstone::tables::arrow_array::ListArray {
    wheatstone::tables::arrow_array::ListArray::from_iter_primitive::<Int32Type, _, _>([
        Some([Some(1)]),
        None,
    ])
}

#[test]
fn a_schema_says_its_unit() {
    let own = batch(["x1", "y1", "x2", "y2"].map(|name| (name, doubles(&[1.0]))).to_vec());
    let metadata = [("unit".to_owned(), "mm".to_owned())].into();
    let schema = Arc::new(own.schema().as_ref().clone().with_metadata(metadata));
    let own = own.with_schema(Arc::clone(&schema)).unwrap();
    let reader = reader(schema, vec![Ok(own)]).unwrap();
    assert_eq!(reader.unit().unwrap().as_deref(), Some("mm"));
}

#[test]
fn rows_get_their_points_and_keep_their_places() {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = wheatstone::LineGrid { pitch: rig.chart_pitch(), ..Default::default() }.into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 3), Some(60));
    let mut rows: Vec<_> = data.correspondences.iter().map(|row| row.pixels.clone()).collect();
    rows[3][1] = None;
    let method = AnyMethod::named("brown").unwrap();
    let model =
        Calibration::fit(&method, &Prepared::as_given(data.clone()), 0, false, &Silent).unwrap();
    let columns = columns_of(&rows, 2);
    let pixels =
        PixelColumns::new(columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect());
    let names = ["x1", "y1", "x2", "y2"].into_iter();
    let input = batch(names.zip(columns.iter().flatten().map(|v| doubles(v))).collect());
    let taken = Arc::new(Schema::new(vec![Field::new("X", DataType::Float64, true)]));
    let test = MismatchTest::new(0.001, 2);
    let added = LocatedColumns { covariance: true, rounded: false, test };
    assert_eq!(added.schema(&taken).field(0).name(), "input_X");
    for with_covariance in [true, false] {
        let locator = model.settled_locator(with_covariance);
        let mut places = locator.locate(&pixels);
        let whole = places.clone();
        let output = added.append(&input, &pixels, &mut places).unwrap();
        let names = added.names(input.schema().fields().iter().map(|field| field.name().as_str()));
        let schema = output.schema();
        assert!(schema.fields().iter().map(|field| field.name()).eq(&names));
        assert_eq!((output.num_rows(), output.num_columns()), (rows.len(), 4 + 9 + 6));
        let z = output.column_by_name("Z").unwrap();
        assert!(z.is_null(3) && z.null_count() == 1);
        assert_eq!(z.as_primitive::<Float64Type>().value(7), whole.point[2][7]);
        let sigma = output.column_by_name("sZ").unwrap();
        assert_eq!(sigma.null_count(), if with_covariance { 1 } else { rows.len() });
        let trust = output.column_by_name("trust").unwrap().as_string::<i32>();
        assert!(trust.is_null(3));
        // Who asks for points alone is told no trust.
        if with_covariance {
            assert_eq!(trust.value(7), "inside");
        } else {
            assert_eq!(trust.null_count(), rows.len());
        }
    }
    let mut few = model.settled_locator(true).locate(&pixels.part(0..5));
    assert!(matches!(added.append(&input, &pixels, &mut few), Err(Error::Mismatch { .. })));
}
