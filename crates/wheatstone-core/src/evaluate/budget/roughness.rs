//! Pixel noise from what is rough within a picture.

use crate::{
    dataset::Dataset,
    geometry::{Pixel, Point3, Vector3},
};
use wheatstone_numeric::least_squares::solve;

/// Monomials up to the third degree: all that a chart's displacement and turning make of its picture but
/// for a few hundredths.
const TERMS: [[i32; 2]; 10] =
    [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2], [3, 0], [2, 1], [1, 2], [0, 3]];

/// Standard deviation of a pixel coordinate of one camera, from what `project` leaves unexplained in
/// each view and is no smooth function of the place in the picture. `None` where the views hold too few
/// points to tell.
pub(super) fn within_views(
    project: impl Fn(Point3) -> Option<Pixel>,
    camera: usize,
    data: &Dataset,
) -> Option<f64> {
    // Then the standard deviation is known to a tenth.
    const ENOUGH: usize = 50;
    let (mut squares, mut freedom) = (0.0, 0);
    for view in 0..data.views.len() {
        let missed: Vec<(Pixel, [f64; 2])> = data
            .known()
            .filter(|(_, row)| row.view == view)
            .filter_map(|(world, row)| {
                let seen = row.pixels.get(camera).copied().flatten()?;
                let expected = project(world)?;
                Some((seen, [seen.x - expected.x, seen.y - expected.y]))
            })
            .collect();
        if let Some((sum, count)) = rough(&missed) {
            squares += sum;
            freedom += count;
        }
    }
    (freedom >= ENOUGH).then(|| (squares / freedom as f64).sqrt())
}

/// Sum of squares about the best cubic, with the degrees of freedom; `None` where there are not three
/// times as many points as terms.
fn rough(missed: &[(Pixel, [f64; 2])]) -> Option<(f64, usize)> {
    if missed.len() < 3 * TERMS.len() {
        return None;
    }
    let count = missed.len() as f64;
    let centre = missed.iter().map(|(p, _)| Vector3::new(p.x, p.y, 0.0)).sum::<Vector3>() / count;
    let size = missed
        .iter()
        .map(|(p, _)| (p.x - centre.x).abs().max((p.y - centre.y).abs()))
        .fold(f64::MIN_POSITIVE, f64::max);
    let terms: Vec<f64> = missed
        .iter()
        .flat_map(|(p, _)| {
            let (x, y) = ((p.x - centre.x) / size, (p.y - centre.y) / size);
            TERMS.map(|[i, j]| x.powi(i) * y.powi(j))
        })
        .collect();
    let sides: Vec<f64> = missed.iter().flat_map(|(_, miss)| *miss).collect();
    let found = solve(&terms, TERMS.len(), &sides, 2)?;
    let mut squares = 0.0;
    for (row, (_, miss)) in terms.chunks_exact(TERMS.len()).zip(missed) {
        for (axis, value) in miss.iter().enumerate() {
            let smooth: f64 =
                row.iter().zip(found.column(axis).iter()).map(|(term, factor)| term * factor).sum();
            squares += (value - smooth).powi(2);
        }
    }
    Some((squares, 2 * (missed.len() - TERMS.len())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Correspondence;
    use wheatstone_numeric::random::Random;

    #[test]
    fn what_is_rough_is_the_noise_and_nothing_is_said_of_few_points() {
        let mut random = Random::new(3);
        let row = |index: usize| {
            let place = [random.uniform(0.0, 640.0), random.uniform(0.0, 480.0)];
            let noise = [0.2 * random.normal(), 0.2 * random.normal()];
            Correspondence {
                view: index % 2,
                id: None,
                // A smooth displacement is no noise.
                pixels: vec![Some(Pixel::new(
                    place[0] + 3.0 + 1e-5 * place[0] * place[1] + noise[0],
                    place[1] - 2.0 + noise[1],
                ))],
                world: Some(Point3::new(place[0], place[1], 100.0)),
                board: None,
            }
        };
        let views = vec!["near".into(), "far".into()];
        let correspondences = (0..400).map(row).collect();
        let data = Dataset { unit: "mm".into(), cameras: 1, views, correspondences };
        let project = |world: Point3| Some(Pixel::new(world.x, world.y));
        let found = within_views(project, 0, &data).unwrap();
        assert!((found / 0.2 - 1.0).abs() < 0.1, "{found}");
        assert_eq!(within_views(|_| None, 0, &data), None);
        let few = data.subset(|index, _| index % 50 == 0);
        assert_eq!(within_views(project, 0, &few), None);
        assert_eq!(within_views(|_| None, 0, &few), None);
    }
}
