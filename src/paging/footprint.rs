//! How many texels of a map a pixel is as large as, at a receiver. Twin of `shaders/lib/footprint.wgsl`.
//!
//! Both are measured across their rays, whatever the surface between them: the perspective error is matched, not the one of
//! projection (Lloyd et al., "Warping and partitioning for low error shadow maps", 2006, section 3). A measure on the
//! surface would give neighbours that are turned another way levels of their own, and so pages.

use crate::lanes::{Lane, V3};
use glam::{DVec3, DVec4};

/// How many pixels of an image, or texels of a map, there are to a unit of area across a ray.
///
/// With x, y and w the rows of its matrix, each a function of a point, x.p + x0 and so on, the gradients of column and row
/// are (x - column w) / w and (y - row w) / w. Their cross product, times the normal of a surface, is the density on it.
/// Along a ray r, times the third power of w, that is
///
///   r . ((x.p + x0) y x w + (y.p + y0) w x x + (w.p + w0) x x y) = r . (c + d p),
///
/// with d the determinant of x, y and w and c the same sum of the constants alone, by Cramer's rule. Nothing cancels in it
/// where the rays begin at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Density<L> {
    /// c.
    pub constant: V3<L>,
    /// d.
    pub growth: L,
    /// The row w, and its constant.
    pub width: V3<L>,
    pub least_width: L,
}

impl Density<f64> {
    /// Of an image whose column, row and w are functions of (point, 1), the point relative to the eye.
    pub fn new([x, y, w]: [DVec4; 3]) -> Self {
        let [u, v, s] = [x, y, w].map(DVec4::truncate);
        let across = [v.cross(s), s.cross(u), u.cross(v)];
        Self {
            constant: (across[0] * x.w + across[1] * y.w + across[2] * w.w).into(),
            growth: s.dot(across[2]),
            width: s.into(),
            least_width: w.w,
        }
    }

    /// For rows that are relative to another origin, from which the eye is so far.
    pub fn moved(rows: [DVec4; 3], eye: DVec3) -> Self {
        let moved = |row: DVec4| row.truncate().extend(row.w + row.truncate().dot(eye));
        Self::new(rows.map(moved))
    }

    #[inline(always)]
    pub fn in_lanes<L: Lane>(&self, like: L) -> Density<L> {
        let vector =
            |v: V3<f64>| V3::new(like.constant(v.x), like.constant(v.y), like.constant(v.z));
        Density {
            constant: vector(self.constant),
            growth: like.constant(self.growth),
            width: vector(self.width),
            least_width: like.constant(self.least_width),
        }
    }
}

impl<L: Lane> Density<L> {
    #[inline(always)]
    fn width_at(&self, point: V3<L>) -> L {
        self.width.dot(point) + self.least_width
    }

    /// Across a ray of any length, times the third power of the width.
    #[inline(always)]
    fn across(&self, ray: V3<L>, point: V3<L>) -> L {
        let along = self.constant + point * self.growth;
        (ray / ray.length()).dot(along).abs()
    }
}

/// At a point relative to the eye, across the rays there from the camera and from the light, of any length.
#[inline(always)]
pub fn texels_of_pixel<L: Lane>(
    [image, map]: [&Density<L>; 2],
    [from_eye, from_light]: [V3<L>; 2],
    point: V3<L>,
) -> L {
    let share = map.across(from_light, point) / image.across(from_eye, point);
    let width = (image.width_at(point) / map.width_at(point)).abs();
    share * width * width * width
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::Shader;
    use crate::twin::{Random, Twin, assert_twins};

    /// By the areas of small parallelograms across the rays, in the image and in the map.
    #[test]
    fn areas_are_those_of_small_parallelograms() {
        let mut random = Random(31);
        let mut vector = || DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0));
        for case in 0..200 {
            let mut rows = |is_central: bool| {
                let w = match is_central {
                    true => (3.0 * DVec3::Z + 0.3 * vector()).extend(0.2 * vector().x),
                    false => DVec4::W,
                };
                let mut row = || (9.0 * vector()).extend(vector().x);
                [row(), row(), w]
            };
            let image = rows(case % 2 == 0);
            let map = rows(case % 3 == 0);
            let point = DVec3::Z * 2.0 + vector();
            let rays = [vector(), vector()];
            let place = |rows: [DVec4; 3], point: DVec3| {
                let [x, y, w] = rows.map(|row| row.dot(point.extend(1.0)));
                DVec3::new(x / w, y / w, 0.0)
            };
            // Across the ray, per unit of area.
            let density = |rows: [DVec4; 3], ray: DVec3| {
                let first = ray.cross(DVec3::new(0.3, 0.8, -0.5)).normalize() * 1e-5;
                let second = ray.normalize().cross(first);
                let [a, b, c] = [point, point + first, point + second].map(|at| place(rows, at));
                (b - a).cross(c - a).z.abs() / 1e-10
            };
            let expected = density(map, rays[1]) / density(image, rays[0]);
            let densities = [&Density::new(image), &Density::new(map)];
            let found = texels_of_pixel(densities, rays.map(V3::from), point.into());
            assert!((found / expected - 1.0).abs() < 1e-2, "{found} {expected}");
        }
    }

    const WGSL: &str = "
fn vector(i: u32) -> vec3<f32> {
    return vec3<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u]);
}

fn density(i: u32) -> Density {
    return Density(vector(i), inputs[i + 3u], vec4<f32>(vector(i + 4u), inputs[i + 7u]));
}

fn twin(i: u32) -> array<f32, 1> {
    let share = texels_of_pixel(density(i), density(i + 8u), vector(i + 16u), vector(i + 19u), vector(i + 22u));
    return array<f32, 1>(share);
}
";

    struct Footprint;

    impl Twin for Footprint {
        fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
            let vector = |i: usize| V3::new(inputs[i], inputs[i + 1], inputs[i + 2]);
            let density = |i: usize| Density {
                constant: vector(i),
                growth: inputs[i + 3],
                width: vector(i + 4),
                least_width: inputs[i + 7],
            };
            let densities = [&density(0), &density(8)];
            let rays = [vector(16), vector(19)];
            vec![texels_of_pixel(densities, rays, vector(22))]
        }
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn the_shader_measures_as_rust_does() {
        let mut random = Random(32);
        let cases: Vec<[f32; 25]> = (0..20_000)
            .map(|_| std::array::from_fn(|_| random.number()))
            .collect();
        let source = Shader::new("lib/footprint").compose() + WGSL;
        assert_twins(&source, &Footprint, &cases, &[]);
    }
}
