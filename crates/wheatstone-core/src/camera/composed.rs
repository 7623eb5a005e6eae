//! Lenses composed of parts: a projection lays directions out on a plane, a distortion bends the plane,
//! a sensor stands behind it, focal lengths and principal point make pixels of its places. Each part has
//! its derivatives; the chain rule is here, once for all lenses, for one point or a register of them.

use super::{
    AdjustableCamera, CameraModel,
    batch_projection::{BatchProjection, MOST_NUMBERS, ProjectedBatch},
    distortion::{Distortion, Undistorted},
    newton,
    pinhole::Pinhole,
    projection::Projection,
    sensor::{Image, Orientation, Tilted, Upright},
};
use crate::geometry::{Pixel, Point3, Ray};
use nalgebra::{Matrix2, Matrix2x3, Vector2};
use wheatstone_numeric::{
    number::{Doubles, Number},
    simd::Simd,
};

/// The numbers of a pinhole, which come first.
const PINHOLE: usize = 4;

/// Which parts a lens has. Its numbers are its pinhole's, its distortion's, and its tilt where it has one.
pub(crate) trait Composed: Clone + Send + Sync {
    /// How directions are mapped.
    type Projection: Projection;

    /// How the picture is distorted.
    type Distortion: Distortion;

    /// What bends the picture.
    fn distortion(&self) -> Self::Distortion;

    /// Focal lengths and principal point.
    fn pinhole(&self) -> &Pinhole;

    /// The angles of a sensor that may be tilted.
    fn tilt(&self) -> Option<[f64; 2]> {
        None
    }

    /// All numbers.
    fn numbers_mut(&mut self) -> Vec<&mut f64>;
}

/// What becomes of a place on the plane.
struct Pictured<N, I> {
    pixel: [N; 2],
    /// Derivatives of the distorted place by the place, row by row.
    stretch: [[N; 2]; 2],
    /// Those of the pixel by the distorted place.
    image: I,
    seen: N,
}

/// From the plane to the pixel, with the derivatives by all numbers.
#[inline(always)]
fn picture<L: Composed, N: Number, S: Orientation>(
    (lens, orientation): (&L, &S),
    (place, square): ([N; 2], N),
    mut slopes: Option<&mut [[N; 2]; MOST_NUMBERS]>,
) -> Pictured<N, S::Image<N>> {
    let others = slopes.as_deref_mut().map(|all| &mut all[PINHOLE..]);
    let distorted = lens.distortion().distort(place, square, others);
    // Arrays element by element here and in the parts: a closure would not be compiled for wide registers.
    let [fx, fy] = lens.pinhole().focal;
    let on_sensor = orientation.project(distorted.place, [square.all(fx), square.all(fy)]);
    if let Some(slopes) = slopes {
        let (own, others) = slopes.split_at_mut(PINHOLE);
        own.copy_from_slice(&Pinhole::slopes(on_sensor.place));
        let (of_lens, of_tilt) = others.split_at_mut(L::Distortion::NUMBERS);
        of_lens.iter_mut().for_each(|slope| *slope = on_sensor.image.carry(*slope));
        of_tilt.iter_mut().zip(on_sensor.by_tilt).for_each(|(slope, by)| *slope = by);
    }
    let pixel = lens.pinhole().pixels(on_sensor.place);
    Pictured {
        pixel,
        stretch: distorted.stretch,
        image: on_sensor.image,
        seen: distorted.seen + on_sensor.seen,
    }
}

/// From the point to the pixel; last the squared distance from the axis on the plane.
#[inline(always)]
fn chain<L: Composed, N: Number, S: Orientation>(
    lens_and_orientation: (&L, &S),
    point: [N; 3],
    slopes: Option<&mut [[N; 2]; MOST_NUMBERS]>,
) -> (ProjectedBatch<N>, N) {
    let normalised = L::Projection::normalise(point);
    let found = picture(lens_and_orientation, (normalised.place, normalised.square), slopes);
    let by_point = L::Projection::by_point(point, &normalised, found.stretch, found.image);
    let (pixel, seen) = (found.pixel, normalised.seen + found.seen);
    (ProjectedBatch { pixel, by_point, seen }, normalised.square)
}

/// The same with the sensor of the lens, which is tilted where it is so or where slopes by its angles are
/// among the first `asked`.
#[inline(always)]
fn trace<L: Composed, N: Number>(
    lens: &L,
    point: [N; 3],
    (slopes, asked): (Option<&mut [[N; 2]; MOST_NUMBERS]>, usize),
) -> (ProjectedBatch<N>, N) {
    let untilted = PINHOLE + L::Distortion::NUMBERS;
    match lens.tilt() {
        Some(tilt) if tilt != [0.0; 2] || asked > untilted => {
            chain((lens, &Tilted::new(tilt)), point, slopes)
        }
        _ => chain((lens, &Upright), point, slopes),
    }
}

/// One point, where the picture has not folded over before it.
#[inline(always)]
fn seen<L: Composed>(lens: &L, point: Point3) -> Option<ProjectedBatch<f64>> {
    let (found, square) = trace(lens, point.into(), (None, 0));
    (found.seen == 0.0 && lens.distortion().rises(square)).then_some(found)
}

/// A place on the plane, where the picture has not folded over before it.
#[inline(always)]
fn on_plane<L: Composed, S: Orientation>(
    lens_and_orientation: (&L, &S),
    place: Vector2<f64>,
) -> Option<Pictured<f64, S::Image<f64>>> {
    let square = place.x * place.x + place.y * place.y;
    let found = picture(lens_and_orientation, (place.into(), square), None);
    (found.seen == 0.0 && lens_and_orientation.0.distortion().rises(square)).then_some(found)
}

/// Where a pixel looks.
fn unprojected<L: Composed, S: Orientation>(
    lens: &L,
    orientation: &S,
    pixel: Pixel,
) -> Option<Ray> {
    let distorted = orientation.untilted(lens.pinhole().place(pixel))?;
    let at = |place: Vector2<f64>| Some(Pixel::from(on_plane((lens, orientation), place)?.pixel));
    let slopes = |place: Vector2<f64>| {
        let Pictured { stretch, image, .. } = on_plane((lens, orientation), place)?;
        let by = |k: usize| Vector2::from(image.carry([stretch[0][k], stretch[1][k]]));
        Some(Matrix2::from_columns(&[by(0), by(1)]))
    };
    let place = match lens.distortion().undistorted(distorted) {
        Undistorted::To(place) => Some(place),
        Undistorted::Nowhere => None,
        // The ideal lens's ray is near, but may be beyond a fold: the axis never is.
        Undistorted::ToBeSearched => newton(at, slopes, (distorted.into(), pixel))
            .or_else(|| newton(at, slopes, (Vector2::zeros(), pixel)))
            .map(Into::into),
    };
    Some(Ray { origin: Point3::origin(), direction: L::Projection::direction(place?)? })
}

impl<L: Composed> CameraModel for L {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.numbers_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        Some(Pixel::from(seen(self, point)?.pixel))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        match self.tilt() {
            Some(tilt) if tilt != [0.0; 2] => unprojected(self, &Tilted::new(tilt), pixel),
            _ => unprojected(self, &Upright, pixel),
        }
    }

    fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        seen(self, point)?.of_one()
    }
}

impl<L: Composed> AdjustableCamera for L {
    fn project_with_slopes(
        &self,
        point: Point3,
        slopes: &mut [[f64; 2]],
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        let mut all = [[0.0; 2]; MOST_NUMBERS];
        let (found, _) = trace(self, point.into(), (Some(&mut all), slopes.len()));
        slopes.iter_mut().zip(all).for_each(|(slope, found)| *slope = found);
        found.of_one()
    }
}

impl<L: Composed> BatchProjection for L {
    #[inline(always)]
    fn trace<S: Simd>(
        &self,
        point: [Doubles<S>; 3],
        (slopes, asked): (&mut [[Doubles<S>; 2]; MOST_NUMBERS], usize),
    ) -> ProjectedBatch<Doubles<S>> {
        trace(self, point, (Some(slopes), asked)).0
    }
}
