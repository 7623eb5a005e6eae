//! The distortion behind a known pose and pinhole that follows a model best, and can be undone all over the
//! picture.
//!
//! With pose and pinhole known the pixel is linear in the coefficients. Terms that were fitted to a part of the
//! picture may fold the rest of it over (the distorted radius turns round), or bend it so much that its pixels
//! jump. Where they would, slope or curvature is held at what is allowed, and the fit is made again.

use super::lens_fit::{Pairs, terms};
use crate::formats::{Form, Optics};
use nalgebra::{DMatrix, DVector};
use wheatstone_core::{
    camera::{
        brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt, picture_domain::Area,
        pinhole::Pinhole,
    },
    geometry::{Pixel, Point3, Pose},
    method::{FittedCamera, brown::Brown},
};

/// The slope of the distorted radius by the undistorted one is kept above this; half of it still has a ray.
const LEAST_SLOPE: f64 = 0.1;

/// Its curvature in pixels, from one pixel to the next, is kept below this; what lenses really do is a tenth.
const MOST_BENT: f64 = 0.07;

/// A limit is held as if so many pixels had told it, each as well as all that were seen.
const HELD: f64 = 1e4;

/// How often a limit may be held; where one more is wanted the terms cannot do it.
const ROUNDS: usize = 12;

/// Radii that are looked at.
const STEPS: usize = 200;

/// Beyond the picture's corner by this share of its distance, as lenses of other programs are asked for.
const BEYOND: f64 = 1.2;

/// The lens of this form behind a pose and a pinhole, over the picture. `None` for terms that are not linear, and
/// where points do not tell.
pub(super) fn distortion(
    (camera_from_world, pinhole): (Pose, Pinhole),
    pairs: &Pairs,
    form: Form,
    picture: Area,
) -> Option<Optics> {
    let (radial, tangential) = match form {
        Form::Brown(count) => {
            let Brown { radial, tangential, rational, .. } = terms(count);
            (radial, if rational { return None } else { tangential })
        }
        Form::KannalaBrandt(count) => (count, false),
        Form::Linear => return None,
    };
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for (world, pixel) in pairs {
        let point = camera_from_world.transform(*world);
        let place = place(form, point)?;
        let ideal = pinhole.pixel(place[0], place[1]);
        let columns = columns(place, radial, tangential);
        for axis in 0..2 {
            values.push(pixel[axis] - ideal[axis]);
            rows.push(columns.iter().map(|c| pinhole.focal[axis] * c[axis]).collect::<Vec<_>>());
        }
    }
    let corner = far_corner(&pinhole, picture);
    let weight = HELD * pinhole.focal[0] * libm::sqrt(pairs.len() as f64);
    let bent = MOST_BENT * pinhole.focal[0];
    let others = vec![0.0; if tangential { 2 } else { 0 }];
    let mut found = solved(&rows, &values)?;
    let mut limits: [Option<Limit>; 2] = [None, None];
    for _ in 0..ROUNDS {
        let Some((kind, limit)) = exceeded(&found[..radial], corner, bent) else { break };
        // Held at two places, two coefficients would have nothing left to follow the points with.
        limits[kind] = Some(limit);
        let (mut rows, mut values) = (rows.clone(), values.clone());
        for limit in limits.iter().flatten() {
            let all = limit.columns.iter().chain(&others);
            rows.push(all.map(|column| weight * limit.by * column).collect());
            values.push(weight * limit.by * limit.value);
        }
        found = solved(&rows, &values)?;
    }
    Some(match form {
        Form::KannalaBrandt(_) => {
            let mut model = KannalaBrandt { pinhole, coefficients: [0.0; 4] };
            model.coefficients[..radial].copy_from_slice(&found);
            Optics::KannalaBrandt(FittedCamera { model, camera_from_world, mirrored: false })
        }
        _ => {
            let mut model = BrownConrady::ideal(pinhole);
            model.radial[..radial].copy_from_slice(&found[..radial]);
            if tangential {
                model.tangential.copy_from_slice(&found[radial..]);
            }
            Optics::Brown(FittedCamera { model, camera_from_world, mirrored: false })
        }
    })
}

/// Where an ideal lens of the form has a point of the camera's frame, over the focal length.
fn place(form: Form, point: Point3) -> Option<[f64; 2]> {
    if let Form::KannalaBrandt(_) = form {
        let aside = libm::hypot(point.x, point.y);
        let share = if aside > 0.0 { libm::atan2(aside, point.z) / aside } else { 0.0 };
        return Some([point.x * share, point.y * share]);
    }
    (point.z > 0.0).then(|| [point.x / point.z, point.y / point.z])
}

/// What each coefficient adds to the place, over itself.
fn columns([x, y]: [f64; 2], radial: usize, tangential: bool) -> Vec<[f64; 2]> {
    let s = x * x + y * y;
    let power = |power: &f64| [x * power, y * power];
    let mut all: Vec<_> =
        [s, s * s, s * s * s, s * s * s * s][..radial].iter().map(power).collect();
    if tangential {
        all.extend([[2.0 * x * y, s + 2.0 * y * y], [s + 2.0 * x * x, 2.0 * x * y]]);
    }
    all
}

/// What each coefficient adds to the slope of the distorted radius, over itself: 3 r^2, 5 r^4 and on.
fn slopes(radius: f64, radial: usize) -> Vec<f64> {
    let square = radius * radius;
    let powers = std::iter::successors(Some(square), move |power| Some(power * square));
    powers.zip([3.0, 5.0, 7.0, 9.0]).map(|(power, by)| by * power).take(radial).collect()
}

/// The same of its curvature: 6 r, 20 r^3 and on.
fn curvatures(radius: f64, radial: usize) -> Vec<f64> {
    let by = [2.0, 4.0, 6.0, 8.0].map(|power| power / radius);
    slopes(radius, radial).into_iter().zip(by).map(|(slope, by)| by * slope).collect()
}

/// The distance of the picture's farthest corner from the principal point, and some more, over the focal length.
fn far_corner(pinhole: &Pinhole, [left, top, right, bottom]: Area) -> f64 {
    let corner = |x: f64, y: f64| {
        let [x, y] = pinhole.place(Pixel::new(x, y));
        libm::hypot(x, y)
    };
    let all = [(left, top), (right, top), (left, bottom), (right, bottom)];
    BEYOND * all.into_iter().map(|(x, y)| corner(x, y)).fold(0.0, f64::max)
}

/// A linear function of the radial coefficients that is to have a value.
struct Limit {
    columns: Vec<f64>,
    value: f64,
    /// Its weight, that limits of different kinds count alike.
    by: f64,
}

/// The limit that these coefficients exceed most, slopes (0) before curvatures (1), until the distorted radius has
/// reached the corner; `None` where they exceed none.
fn exceeded(radial: &[f64], corner: f64, bent: f64) -> Option<(usize, Limit)> {
    let sum = |columns: &[f64]| columns.iter().zip(radial).map(|(by, k)| by * k).sum::<f64>();
    // Wide lenses reach the corner of their picture at several times its distance on the plane, or never.
    let step = corner / STEPS as f64;
    let (mut reached, mut flat, mut curved) = (0.0, (LEAST_SLOPE, None), (bent, None));
    for index in 0..4 * STEPS {
        let radius = (index as f64 + 0.5) * step;
        if reached >= corner && radius >= corner {
            break;
        }
        let slope = 1.0 + sum(&slopes(radius, radial.len()));
        if slope < flat.0 {
            flat = (slope, Some(radius));
        }
        let curvature = sum(&curvatures(radius, radial.len()));
        if radius < corner && curvature.abs() > curved.0 {
            curved = (curvature.abs(), Some((radius, curvature.signum())));
        }
        reached += slope * step;
    }
    if let Some(radius) = flat.1 {
        let columns = slopes(radius, radial.len());
        return Some((0, Limit { columns, value: 2.0 * LEAST_SLOPE - 1.0, by: 1.0 }));
    }
    let (radius, sign) = curved.1?;
    let columns = curvatures(radius, radial.len());
    Some((1, Limit { columns, value: 0.9 * sign * bent, by: 0.1 / bent }))
}

fn solved(rows: &[Vec<f64>], values: &[f64]) -> Option<Vec<f64>> {
    let unknowns = rows.first()?.len();
    if unknowns == 0 {
        return Some(Vec::new());
    }
    let matrix = DMatrix::from_row_iterator(rows.len(), unknowns, rows.iter().flatten().copied());
    let found = matrix.svd(true, true).solve(&DVector::from_column_slice(values), f64::EPSILON);
    Some(found.ok()?.as_slice().to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_core::camera::picture_domain::undistorts;
    use wheatstone_numeric::random::Random;

    const PICTURE: Area = [-0.5, -0.5, 1279.5, 959.5];

    /// A fisheye's points about its axis, in pixels that err by one.
    fn pairs(pinhole: &Pinhole, seed: u64) -> Pairs {
        let mut random = Random::new(seed);
        let mut pair = || {
            let [x, y] = [0, 1].map(|_| random.uniform(-0.25, 0.25));
            let world = Point3::new(x, y, 1.0);
            let [x, y] = place(Form::KannalaBrandt(0), world).unwrap();
            let noise = nalgebra::Vector2::new(random.normal(), random.normal());
            (world, pinhole.pixel(x, y) + noise)
        };
        (0..400).map(|_| pair()).collect()
    }

    #[test]
    fn a_lens_that_would_fold_the_picture_is_held_open() {
        let pinhole = Pinhole { focal: [420.0, 420.0], principal: [640.0, 480.0] };
        let mut folded = 0;
        for seed in 0..10 {
            let pairs = pairs(&pinhole, seed);
            let own = (Pose::default(), pinhole);
            // Without a picture nothing is asked of the lens beyond the points.
            let middle = [639.0, 479.0, 641.0, 481.0];
            let free = distortion(own, &pairs, Form::Brown(2), middle).unwrap();
            let held = distortion(own, &pairs, Form::Brown(2), PICTURE).unwrap();
            let (Optics::Brown(free), Optics::Brown(held)) = (free, held) else { panic!() };
            folded += usize::from(!undistorts(&free.model, PICTURE));
            assert!(undistorts(&held.model, PICTURE), "{seed}: {:?}", held.model.radial);
            let apart = |(world, _): &(Point3, Pixel)| {
                (held.project(*world).unwrap() - free.project(*world).unwrap()).norm()
            };
            let most = pairs.iter().map(apart).fold(0.0, f64::max);
            assert!(most < 1.5, "{seed}: {most} px");
        }
        assert!(folded > 0);
    }
}
