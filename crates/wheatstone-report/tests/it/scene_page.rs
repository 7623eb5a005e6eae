//! The page of a cloud of points: a wavy surface before two cameras.

use super::browser::{
    EVIL, chromium, names_no_address, stays_whole, works_on_a_phone_and_on_a_desk,
};
use wheatstone_report::{CloudCamera, SceneCloud};

/// Millimetres between the cameras, to the surface, and pixels of a focal length.
const BASELINE: f32 = 120.0;
const DEPTH: f32 = 900.0;
const FOCAL: f32 = 1200.0;

/// A camera of 1280 by 960 pixels that looks along Z, with Y down.
fn camera(name: &str, x: f32) -> CloudCamera {
    let corner = |[x, y]: [f64; 2]| {
        let length = (x * x + y * y + 1.0).sqrt();
        [x / length, y / length, 1.0 / length]
    };
    let corners = [[-0.53, -0.4], [0.53, -0.4], [0.53, 0.4], [-0.53, 0.4]].map(corner);
    CloudCamera { name: name.into(), centre: Some([x.into(), 0.0, 0.0]), corners: corners.to_vec() }
}

/// `wide` by `high` points of the surface. Of standard deviation, that of depth grows with its square.
fn cloud(wide: usize, high: usize) -> SceneCloud {
    let mut cloud = SceneCloud {
        title: "waves & <more>".into(),
        unit: "mm".into(),
        pixels: vec![Vec::new(); 2],
        cameras: vec![camera("left", 0.0), camera("right", BASELINE)],
        ..SceneCloud::default()
    };
    for index in 0..wide * high {
        let across = (index % wide) as f32 / wide as f32;
        let down = (index / wide) as f32 / high as f32;
        let [x, y] = [(across - 0.42) * 560.0, (down - 0.5) * 420.0];
        let wave = libm::sinf(x / 40.0) + libm::cosf(y / 55.0 + x / 90.0);
        let z = DEPTH + 35.0 * wave;
        let sigma = z * z / FOCAL / BASELINE * 0.1;
        let stripe = (x / 25.0) as i32 + (y / 25.0) as i32;
        let light = 150 + (wave * 40.0) as i32;
        cloud.points.push([x, y, z]);
        cloud.colours.push([
            light as u8,
            if stripe % 2 == 0 { 150 } else { 70 },
            (across * 200.0) as u8,
        ]);
        cloud.sigmas.push([sigma * x.abs() / z + 0.05, sigma * y.abs() / z + 0.05, sigma]);
        cloud.confidence.push(0.55 + 0.2 * wave);
        let row = y / z * FOCAL + 479.5;
        cloud.pixels[0].push([x / z * FOCAL + 639.5, row]);
        cloud.pixels[1].push([(x - BASELINE) / z * FOCAL + 639.5, row]);
    }
    cloud
}

#[test]
fn the_page_works_on_a_phone_and_on_a_desk_and_asks_nobody() {
    let Some(chromium) = chromium() else { return };
    // All by keys and controls: a point in the middle, another one after a move, and all colours.
    let act = "
        const window = frame.contentWindow, view = page.getElementById('canvas');
        const press = (key, shiftKey) => view.dispatchEvent(new window.KeyboardEvent('keydown', { key, shiftKey, bubbles: true }));
        const set = (id, value) => { const it = page.getElementById(id); it.value = value;
            it.dispatchEvent(new window.Event('input')); it.dispatchEvent(new window.Event('change')); };
        const text = (id) => page.getElementById(id).textContent;
        if (page.body.dataset.ready === '3d') {
            press('m'); press('Enter');
            told.point = text('facts');
            press('ArrowRight', true); press('ArrowRight', true); press('Enter');
            told.distance = text('distance');
            told.scales = ['depth', 'sigma', 'confidence', 'picture'].map((mode) => {
                set('colour', mode); return text('scale-low') + ' ' + text('scale-high'); });
            set('limit', '500'); told.hidden = text('note');
            set('limit', '1000'); told.none = text('note');
            press('Escape'); told.cleared = text('point-title');
        }
        told.language = page.documentElement.lang; told.title = page.title;";
    let frames = works_on_a_phone_and_on_a_desk(&chromium, &cloud(240, 180).page(), act);
    for frame in frames {
        assert_eq!(frame["language"], "en");
        assert_eq!(frame["title"], "waves & <more> · Wheatstone points in space");
        if frame["ready"] != "3d" {
            continue;
        }
        let point = frame["point"].as_str().unwrap();
        for part in ["X", "Y", "Z", " ± ", " mm", "confidence", "left", "right", " px"] {
            assert!(point.contains(part), "{part}: {frame}");
        }
        assert!(frame["distance"].as_str().unwrap().contains(" ± "), "{frame}");
        let scale = |index: usize| frame["scales"][index].as_str().unwrap();
        assert!(scale(0).starts_with("depth 8") && scale(0).ends_with(" mm"), "{frame}");
        assert!(scale(1).starts_with("standard deviation 0."), "{frame}");
        assert!(scale(2).starts_with("confidence 0."), "{frame}");
        assert!(frame["hidden"].as_str().unwrap().ends_with(" points are hidden."), "{frame}");
        assert_eq!((&frame["none"], &frame["cleared"]), (&"".into(), &"No point selected".into()));
    }
}

#[test]
fn any_number_of_points_makes_a_page_below_15_megabytes() {
    let page = cloud(1000, 450).page();
    assert!(page.contains("400000 of 450000 points shown"));
    assert!((12_000_000..15_000_000).contains(&page.len()), "{}", page.len());
    assert!(!cloud(100, 10).page().contains("points shown</p>"));
    // More cameras leave room for fewer points.
    let mut many = cloud(1000, 401);
    many.pixels = vec![many.pixels[0].clone(); 5];
    assert!(many.page().len() < 15_000_000);
}

#[test]
fn names_cannot_break_out_of_the_page_and_name_no_address() {
    let mut cloud = cloud(20, 20);
    names_no_address(&cloud.page());
    cloud.title = EVIL.into();
    cloud.unit = format!("mm{EVIL}");
    cloud.cameras[0].name = EVIL.into();
    stays_whole(&cloud.page());
}

#[test]
fn points_without_anything_else_and_none_at_all_make_a_page() {
    let bare = SceneCloud { points: cloud(20, 20).points, ..SceneCloud::default() };
    assert!(bare.page().contains("400 points"));
    // A page of one point, with numbers that are none beside it.
    let one = SceneCloud {
        points: vec![[1.0, 2.0, 3.0], [f32::NAN; 3]],
        sigmas: vec![[f32::NAN; 3]],
        confidence: vec![f32::INFINITY],
        ..SceneCloud::default()
    };
    let page = one.page();
    let words = page.split("<script").next().unwrap();
    assert!(words.contains("1 of 2 points shown") && !words.contains("NaN"));
    let page = SceneCloud::default().page();
    assert!(page.contains("There are no points to show."));
    // The same again, byte for byte.
    assert_eq!(cloud(30, 30).page(), cloud(30, 30).page());
    let Some(chromium) = chromium() else { return };
    works_on_a_phone_and_on_a_desk(&chromium, &bare.page(), "");
}
