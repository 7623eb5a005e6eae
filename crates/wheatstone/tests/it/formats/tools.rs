//! Files that other tools wrote, and pixels that they project: OpenCV 5.0.0, aniposelib 0.8.0, pycolmap 4.2.1;
//! for Kalibr, ROS, mrcal and DLTdv OpenCV's projection of the same numbers (of ROS by `stereoRectify`), for
//! OpenPTV a transcription of liboptv's formulas.

use super::{file, format, given};
use wheatstone::{
    Error,
    formats::{Given, InputFile, Optics},
    geometry::{Pixel, Point3},
};

const WORLD: [[f64; 3]; 3] = [[12.5, -40.0, 30.0], [-90.0, 55.25, -20.0], [140.0, -80.5, 75.0]];

/// The same in the frame of the first camera.
const IN_FIRST: [[f64; 3]; 3] = [
    [38.74336882566043, -62.37916404886938, 927.9966061532016],
    [-57.469020966385614, 33.42364589979227, 867.6326255319403],
    [157.14693775604758, -102.26195674557411, 993.6582975056084],
];

/// And in the frame that OpenCV rectifies it to, in metres.
const RECTIFIED: [[f64; 3]; 3] = [
    [0.19189856710960596, -0.05317575038593261, 0.9093498717652245],
    [0.08829619137865509, 0.0434788205447645, 0.8645921443753568],
    [0.319027330660085, -0.0942117454717901, 0.9549110897629896],
];

type Pixels = [[f64; 2]; 3];

const RATIONAL: Pixels = [
    [678.9641700048237, 443.7073629177467],
    [560.3007451139285, 560.1311714349542],
    [805.7513285953848, 405.14797797617155],
];
const FIVE: Pixels = [
    [465.82065499047735, 475.0227076244589],
    [340.8734492744731, 591.7328226077263],
    [615.7341997410705, 423.13843941682063],
];
const FOUR: Pixels = [
    [678.9635240156967, 443.7090954494946],
    [560.3002233779158, 560.1321228040149],
    [805.7446691989692, 405.15624558934184],
];
const FIVE_OF_FIRST: Pixels = [
    [678.9635238691058, 443.70909568599774],
    [560.3002235696651, 560.1321226922666],
    [805.7445671153451, 405.15631215519096],
];
const FISHEYE: Pixels = [
    [466.52114625406085, 475.1238204870001],
    [344.474756244036, 590.6554377291568],
    [615.7587548356557, 423.20122516353547],
];
const STRAIGHT: [Pixels; 2] = [
    [
        [679.0348571619621, 443.5908621994197],
        [560.2231988544695, 560.1713969024952],
        [807.1044024189467, 404.23664182645336],
    ],
    [
        [464.8413580526797, 474.7974369859595],
        [335.7870349988517, 593.0347318602091],
        [615.6956932645741, 422.99376687996124],
    ],
];
const OPENPTV: Pixels = [
    [890.3316331343049, 108.46603636422168],
    [241.53961457930546, 742.4982493128142],
    [1587.0001020888226, -103.79134682339372],
];

/// Reads, and holds pixels against those of the tool.
fn agrees(name: &str, files: &[&str], scale: f64, world: [[f64; 3]; 3], pixels: &[Pixels]) {
    let files: Vec<InputFile> = files.iter().map(|name| file(name)).collect();
    let rig =
        format(name).read_rig(&files, &Given { sizes: vec![[1280, 1024]], ..given(2) }).unwrap();
    assert_eq!(rig.cameras.len(), pixels.len(), "{name}");
    for (camera, pixels) in rig.cameras.iter().zip(pixels) {
        assert_eq!(camera.size, Some([1280, 1024]), "{name}");
        for (world, pixel) in world.iter().zip(pixels) {
            let found = camera.optics.project(Point3::from(*world) * scale).unwrap();
            let off = (found - Pixel::from(*pixel)).norm();
            assert!(off < 1e-9, "{name}, {}: {off} px", camera.name);
        }
    }
}

#[test]
fn points_fall_where_the_files_own_tools_see_them() {
    agrees("opencv", &["opencv.yml"], 1.0, IN_FIRST, &[RATIONAL, FIVE]);
    agrees("opencv", &["opencv.json"], 1.0, IN_FIRST, &[RATIONAL, FIVE]);
    agrees("anipose", &["anipose.toml"], 1.0, WORLD, &[FIVE_OF_FIRST, FISHEYE]);
    let colmap = ["colmap/cameras.txt", "colmap/images.txt"];
    agrees("colmap", &colmap, 1.0, WORLD, &[FOUR, FISHEYE]);
    agrees("kalibr", &["kalibr.yaml"], 1e-3, IN_FIRST, &[FOUR, FISHEYE]);
    agrees("ros", &["ros-left.yaml", "ros-right.yaml"], 1.0, RECTIFIED, &[RATIONAL, FIVE]);
    let mrcal = ["mrcal-0.cameramodel", "mrcal-1.cameramodel"];
    agrees("mrcal", &mrcal, 1.0, WORLD, &[RATIONAL, FIVE]);
    agrees("dlt", &["dlt.csv"], 1.0, WORLD, &STRAIGHT);
    agrees("dltdv", &["dltdv.csv"], 1.0, WORLD, &STRAIGHT);
    let openptv = ["openptv/cam1.tif.ori", "openptv/cam1.tif.addpar", "openptv/ptv.par"];
    agrees("openptv", &openptv, 1.0, WORLD, &[OPENPTV]);
}

#[test]
fn units_are_those_of_the_format_unless_told() {
    let kalibr = [file("kalibr.yaml")];
    let unit = |given: &Given| format("kalibr").read_rig(&kalibr, given).unwrap().unit.unwrap();
    assert_eq!(unit(&Given::default()), "m");
    assert_eq!(unit(&Given { unit: Some("ft".into()), ..Given::default() }), "ft");
    let rig = format("kalibr").read_rig(&kalibr, &Given::default()).unwrap();
    let near = rig.in_unit("mm", "kalibr").unwrap();
    let moved = |optics: &Optics| optics.pose().unwrap().translation;
    let (metres, millimetres) = (moved(&rig.cameras[1].optics), moved(&near.cameras[1].optics));
    assert!((metres * 1000.0 - millimetres).norm() < 1e-9);
    // A unit that is given converts, as the format says its own.
    let given = Given { unit: Some("ft".into()), ..Given::default() };
    let feet = format("kalibr").read_rig(&kalibr, &given).unwrap();
    assert!((metres / 0.3048 - moved(&feet.cameras[1].optics)).norm() < 1e-9);
    assert!(matches!(rig.in_unit("cubit", "kalibr"), Err(Error::Unsupported { .. })));
}

#[test]
fn intrinsics_and_extrinsics_may_lie_apart_as_in_opencvs_sample() {
    let whole = String::from_utf8(file("opencv.yml").bytes).unwrap();
    let at = whole.find("\nR: ").unwrap() + 1;
    let end = whole.find("image_width").unwrap();
    let part = |text: String| InputFile { path: "part.yml".into(), bytes: text.into_bytes() };
    let intrinsics = whole[..at].replace("K1:", "M1:").replace("K2:", "M2:");
    let extrinsics = format!("%YAML:1.0\n---\n{}", &whole[at..end]);
    let read = |files: &[InputFile]| format("opencv").read_rig(files, &given(2));
    let both = read(&[part(intrinsics.clone()), part(extrinsics)]).unwrap();
    let one = read(&[file("opencv.yml")]).unwrap();
    let optics = |rig: &wheatstone::formats::Rig| {
        rig.cameras.iter().map(|camera| camera.optics.clone()).collect::<Vec<_>>()
    };
    assert_eq!(optics(&both), optics(&one));
    let alone = read(&[part(intrinsics)]).unwrap_err();
    assert!(alone.to_string().contains("`R` and `T`") && alone.hint().is_some(), "{alone}");
}

#[test]
fn what_is_not_read_is_named_with_its_line() {
    let tilted = |from: &str, to: &str, name: &str, source: &str| {
        let mut source = file(source);
        let text = String::from_utf8(source.bytes).unwrap();
        assert!(text.contains(from), "{from}");
        source.bytes = text.replacen(from, to, 1).into_bytes();
        match format(name).read_rig(&[source], &given(2)) {
            Err(Error::Malformed { line, problem, hint, .. }) => {
                assert!(!hint.is_empty() && !problem.is_empty());
                (line, problem)
            }
            other => panic!("{name}: {other:?}"),
        }
    };
    let (line, problem) = tilted("radtan", "fov", "kalibr", "kalibr.yaml");
    assert!(line == Some(10) && problem.contains("`fov`"), "{line:?} {problem}");
    let (line, problem) = tilted("pinhole", "omni", "kalibr", "kalibr.yaml");
    assert!(line.is_some() && problem.contains("`omni`"), "{problem}");
    let (line, problem) = tilted("OPENCV8", "CAHVORE", "mrcal", "mrcal-0.cameramodel");
    assert!(line == Some(2) && problem.contains("CAHVORE"), "{line:?} {problem}");
    let (_, problem) = tilted("1100.25, 0.", "1100.25, 3.5", "opencv", "opencv.json");
    assert!(problem.contains("skew"), "{problem}");
}

#[test]
fn cameras_of_myptv_show_points_where_its_own_projection_does() {
    // Pixels by the formulas of MyPTV's `camera_Tsai.projection`.
    let seen = [
        ([0.0, 0.0, 50.0], [345.028_740_384_970_5, 235.319_521_056_314_76]),
        ([10.0, -5.0, 80.0], [412.490_541_951_661_67, 192.822_213_334_570_16]),
        ([-12.0, 8.0, 110.0], [243.636_999_000_380_88, 285.485_846_994_878_56]),
    ];
    let rig = format("myptv-cameras").read_rig(&[file("myptv/cam1")], &Given::default()).unwrap();
    assert_eq!((&*rig.cameras[0].name, rig.cameras[0].size), ("cam1", Some([640, 480])));
    for (place, pixel) in seen {
        let found = rig.cameras[0].optics.project(place.into()).unwrap();
        assert!((found - Pixel::from(pixel)).norm() < 1e-9, "{found}");
    }
}
