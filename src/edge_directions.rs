//! Which way the edges of the scene's triangles run.

use glam::DVec3;

/// Triangles that are asked at most; of larger scenes one in so many.
const MAX_TRIANGLES: usize = 1 << 16;

/// Coefficients of the terms xx, yy, zz, yz, xz, xy.
type Quadratic = [f64; 6];

/// The moments of fourth order of the directions of all edges, weighted by their lengths.
#[derive(Debug, Clone, Default)]
pub struct EdgeDirections {
    moments: [Quadratic; 6],
}

impl EdgeDirections {
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        // Odd, since grids list their triangles in pairs.
        let step = triangles.len().div_ceil(MAX_TRIANGLES) | 1;
        let mut sum = Self::default();
        for triangle in triangles.iter().step_by(step) {
            let [a, b, c] = triangle.map(|i| vertices[i as usize]);
            for edge in [b - a, c - b, a - c] {
                sum.add(edge);
            }
        }
        sum
    }

    fn add(&mut self, edge: DVec3) {
        let direction = edge.normalize_or_zero();
        let squares = direction * direction;
        let products = [
            squares.x,
            squares.y,
            squares.z,
            direction.y * direction.z,
            direction.x * direction.z,
            direction.x * direction.y,
        ];
        let length = edge.length();
        for (sums, product) in self.moments.iter_mut().zip(products) {
            for (sum, other) in sums.iter_mut().zip(products) {
                *sum += length * product * other;
            }
        }
    }

    /// How far the edges, projected on the plane of two unit axes, lie along these: 1 where all lie along one
    /// or the other, -1 where all lie midway. The mean of cos 4a over their angles, weighted by length and by
    /// the fourth power of what the projection leaves of it; 0 where it leaves nothing.
    pub fn alignment(&self, x: DVec3, y: DVec3) -> f64 {
        // An edge's place in the plane is r (cos a, sin a): r² cos 2a and r² sin 2a are quadratic.
        let (xx, yy, xy) = (product(x, x), product(y, y), product(x, y));
        let cosine: Quadratic = std::array::from_fn(|i| xx[i] - yy[i]);
        let sine = xy.map(|term| 2.0 * term);
        let (cosines, sines) = (self.second_moment(cosine), self.second_moment(sine));
        if cosines + sines > 0.0 {
            (cosines - sines) / (cosines + sines)
        } else {
            0.0
        }
    }

    /// The sum of the squares of a quadratic function of the directions.
    fn second_moment(&self, function: Quadratic) -> f64 {
        let dot = |a: &Quadratic| -> f64 { a.iter().zip(function).map(|(a, b)| a * b).sum() };
        dot(&self.moments.each_ref().map(dot))
    }
}

/// The product of two linear functions of a direction.
fn product(a: DVec3, b: DVec3) -> Quadratic {
    [
        a.x * b.x,
        a.y * b.y,
        a.z * b.z,
        a.y * b.z + a.z * b.y,
        a.x * b.z + a.z * b.x,
        a.x * b.y + a.y * b.x,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// Triangles whose three corners lie on a line.
    fn bars(directions: &[DVec3]) -> EdgeDirections {
        let ends = directions
            .iter()
            .flat_map(|&d| [DVec3::ONE, DVec3::ONE + d]);
        let triangles = (0..directions.len() as u32).map(|i| [2 * i, 2 * i + 1, 2 * i]);
        EdgeDirections::new(&ends.collect::<Vec<_>>(), &triangles.collect::<Vec<_>>())
    }

    #[test]
    fn alignment_is_the_mean_of_cosines() {
        let directions: Vec<_> = (0..40)
            .map(|i| {
                DQuat::from_rotation_y(1.3 * f64::from(i)) * DVec3::new(2.0, f64::from(i), 0.4)
            })
            .collect();
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.0, 0.7);
        let (x, y) = (turn * DVec3::X, turn * DVec3::Y);
        let (mut sum, mut weights) = (0.0, 0.0);
        for d in &directions {
            let (along_x, along_y) = (d.dot(x), d.dot(y));
            let weight = d.length() * (along_x.hypot(along_y) / d.length()).powi(4);
            sum += weight * (4.0 * along_y.atan2(along_x)).cos();
            weights += weight;
        }
        let found = bars(&directions).alignment(x, y);
        assert!((found - sum / weights).abs() < 1e-12, "{found}");
    }

    #[test]
    fn edges_along_an_axis_are_aligned_and_midway_are_not() {
        let along = bars(&[DVec3::X, -3.0 * DVec3::Y, 9.0 * DVec3::Z]);
        let diagonal = (DVec3::X + DVec3::Y).normalize();
        assert!((along.alignment(DVec3::X, DVec3::Y) - 1.0).abs() < 1e-12);
        assert!((along.alignment(diagonal, DVec3::Z.cross(diagonal)) + 1.0).abs() < 1e-12);
        assert_eq!(bars(&[DVec3::Z]).alignment(DVec3::X, DVec3::Y), 0.0);
    }
}
