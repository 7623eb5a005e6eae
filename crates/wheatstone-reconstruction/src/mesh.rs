//! Surfaces through the points of a cloud.

use crate::cloud::Cloud;
use nalgebra::Vector3;
use wheatstone_core::geometry::Point3;

/// Triangles between neighbours, and a normal for every point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Points of the cloud, three a triangle, counter-clockwise for who looks at the side that the cameras see.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals towards the cameras; zero for points without a triangle.
    pub normals: Vec<[f32; 3]>,
}

/// Sides of a triangle are at most so many times as long as the shortest: as on a surface that slants by 80 degrees. Longer
/// ones lead from one surface to another.
const MOST_STRETCH: f64 = 6.0;

impl Mesh {
    /// Of a dense cloud: its points are joined as the pixels of the rectified picture, `width` of them a row, lie beside
    /// each other, where no edge of depth is between them. The left virtual camera stands at `centre`, in the world.
    #[must_use]
    pub fn of(cloud: &Cloud, width: usize, centre: Point3) -> Self {
        let rows = cloud.places.iter().max().map_or(0, |last| *last as usize / width + 1);
        let mut point_of = vec![None; width * rows];
        for (index, place) in cloud.places.iter().enumerate() {
            point_of[*place as usize] = Some(index as u32);
        }
        let mut mesh = Self { triangles: Vec::new(), normals: vec![[0.0; 3]; cloud.len()] };
        for corner in 0..(width * rows).saturating_sub(width + 1) {
            if (corner + 1) % width == 0 {
                continue;
            }
            let [a, b, c, d] =
                [corner, corner + 1, corner + width, corner + width + 1].map(|at| point_of[at]);
            let along_first = a.is_some() && d.is_some();
            let halves = if along_first { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] };
            for half in halves {
                if let [Some(a), Some(b), Some(c)] = half {
                    mesh.join(cloud, [a, b, c], centre);
                }
            }
        }
        for normal in &mut mesh.normals {
            let sum = Vector3::from(*normal);
            *normal = sum.try_normalize(0.0).unwrap_or_default().into();
        }
        mesh
    }

    fn join(&mut self, cloud: &Cloud, mut triangle: [u32; 3], centre: Point3) {
        let [a, b, c] = triangle.map(|point| Vector3::from(cloud.points[point as usize]));
        let sides = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
        let shortest = sides.iter().copied().fold(f64::INFINITY, f64::min);
        if sides.iter().any(|side| *side > MOST_STRETCH * shortest) {
            return;
        }
        // As long as the triangle is large, so that large ones count for more.
        let mut across = (b - a).cross(&(c - a));
        if across.dot(&(centre.coords - a)) < 0.0 {
            across = -across;
            triangle.swap(1, 2);
        }
        for point in triangle {
            for axis in 0..3 {
                self.normals[point as usize][axis] += across[axis] as f32;
            }
        }
        self.triangles.push(triangle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_joined_but_not_over_an_edge_of_depth() {
        // Four columns and three rows; the last two columns are farther away, and one pixel has no point.
        let mut cloud = Cloud::default();
        for place in (0..12_u32).filter(|place| *place != 4) {
            let (x, y) = (place % 4, place / 4);
            let z = if x < 2 { 10.0 } else { 30.0 };
            cloud.points.push([f64::from(x), f64::from(y), z]);
            cloud.places.push(place);
        }
        let centre = Point3::new(1.5, 1.0, -5.0);
        let mesh = Mesh::of(&cloud, 4, centre);
        // Four on the far surface, two beside the hole of the near one.
        assert_eq!(mesh.triangles.len(), 6);
        for triangle in &mesh.triangles {
            let depths = triangle.map(|point| cloud.points[point as usize][2]);
            assert!(depths.iter().all(|depth| *depth == depths[0]));
        }
        assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 0.0, -1.0]));
        assert_eq!(Mesh::of(&Cloud::default(), 4, centre), Mesh::default());
    }
}
