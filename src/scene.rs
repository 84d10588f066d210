//! The scene: triangles in the world, validated once, in float64.

use crate::edge_directions::EdgeDirections;
use crate::error::{Result, ensure_value};
use crate::geometry::{bounds_of, farthest_in_box};
use crate::masks::{Mask, Masks};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Triangles in world space. Every triangle casts and receives, from both sides.
#[derive(Debug, Clone)]
pub struct Scene {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Whether each vertex is a corner of a triangle.
    uses_all: bool,
    /// Where no triangle has holes, nothing is looked up.
    masks: Option<Masks>,
    derived: Derived,
    generation: u64,
}

/// What follows from the vertices, computed anew when they move.
#[derive(Debug, Clone)]
struct Derived {
    bounds: (DVec3, DVec3),
    degenerate_count: usize,
    // Found when they are asked for: not every frame does.
    /// Unit normals by the right-hand rule, rounded from float64; zero where the area is zero.
    unit_normals: OnceLock<Vec<Vec3>>,
    edge_directions: OnceLock<EdgeDirections>,
    planes: OnceLock<Vec<Vec4>>,
}

impl Scene {
    /// Checks that every vertex is finite and every index in range. Triangles of zero area are
    /// allowed: they are counted, and neither cast nor receive.
    pub fn new(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        ensure_value!(
            !triangles.is_empty(),
            "faces must have at least one triangle, got none"
        );
        // A triangle index shares 32 bits with the marker "no triangle".
        ensure_value!(
            triangles.len() < u32::MAX as usize,
            "faces must have fewer than {} triangles, got {}",
            u32::MAX,
            triangles.len()
        );
        let count = vertices.len();
        if let Some(row) = triangles
            .par_iter()
            .position_first(|t| t.iter().any(|&i| i as usize >= count))
        {
            ensure_value!(
                false,
                "faces must index vertices: row {row} is {:?} but there are {count} vertices",
                triangles[row]
            );
        }
        let uses_all = uses_all(count, &triangles);
        let derived = Derived::new(&vertices, &triangles, uses_all)?;
        Ok(Self {
            vertices,
            triangles,
            uses_all,
            masks: None,
            derived,
            generation: 0,
        })
    }

    /// The same with triangles that have holes.
    pub fn with_masks(self, masks: Option<Masks>) -> Result<Self> {
        let triangles = self.triangles.len();
        let count = masks.as_ref().map_or(triangles, Masks::triangle_count);
        ensure_value!(
            count == triangles,
            "face_alpha must have one number for each of {triangles} faces, got {count}"
        );
        Ok(Self { masks, ..self })
    }

    /// Moves the vertices; the triangles stay.
    pub fn update_vertices(&mut self, vertices: Vec<DVec3>) -> Result<()> {
        ensure_value!(
            vertices.len() == self.vertices.len(),
            "vertices must keep their number, {}, when updated, got {}",
            self.vertices.len(),
            vertices.len()
        );
        self.derived = Derived::new(&vertices, &self.triangles, self.uses_all)?;
        self.vertices = vertices;
        self.generation += 1;
        Ok(())
    }

    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    pub fn masks(&self) -> Option<&Masks> {
        self.masks.as_ref()
    }

    /// What masks a triangle, if it has holes.
    #[inline]
    pub fn mask_of(&self, triangle: u32) -> Option<Mask<'_>> {
        self.masks.as_ref()?.of_triangle(triangle)
    }

    /// Whether a triangle is there at a point of it, of which each corner has a share.
    #[inline]
    pub fn is_solid(&self, triangle: u32, shares: [f64; 3]) -> bool {
        let mask = self.mask_of(triangle);
        mask.is_none_or(|mask| mask.is_solid(shares))
    }

    /// Unit normals by the right-hand rule, one for each triangle; zero where the area is zero.
    pub fn unit_normals(&self) -> &[Vec3] {
        let normals = || {
            let triangles = 0..self.triangles.len() as u32;
            let normal = |t| {
                let [a, b, c] = self.corners(t);
                unit_normal(a, b, c).as_vec3()
            };
            triangles.into_par_iter().map(normal).collect()
        };
        self.derived.unit_normals.get_or_init(normals)
    }

    /// Least and greatest corner of the box around all vertices that a triangle uses.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.derived.bounds
    }

    /// How many triangles have zero area in float64 and are ignored.
    pub fn degenerate_count(&self) -> usize {
        self.derived.degenerate_count
    }

    pub fn edge_directions(&self) -> &EdgeDirections {
        let found = || EdgeDirections::new(&self.vertices, &self.triangles);
        self.derived.edge_directions.get_or_init(found)
    }

    /// The planes of the triangles: unit normal, and its product with the points of the plane relative to the
    /// middle of the scene's box. Rounded: a light is looked for near to all of them in every frame.
    pub fn planes(&self) -> &[Vec4] {
        let find = || {
            let triangles = self.triangles.par_iter().zip(self.unit_normals());
            let plane = |(triangle, normal): (&[u32; 3], &Vec3)| {
                let corner = self.vertices[triangle[0] as usize] - self.centre();
                normal.extend(normal.as_dvec3().dot(corner) as f32)
            };
            triangles.map(plane).collect()
        };
        self.derived.planes.get_or_init(find)
    }

    /// The middle of the box around all vertices that a triangle uses.
    pub fn centre(&self) -> DVec3 {
        let (low, high) = self.bounds();
        low + 0.5 * (high - low)
    }

    /// The greatest distance of a point of the box around all vertices.
    pub fn farthest(&self, point: DVec3) -> f64 {
        farthest_in_box(self.bounds(), point)
    }

    /// Counts the calls of `update_vertices`.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The three corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        // Written out: it is asked for so often that an array's own `map`, which is not inlined, shows.
        let [a, b, c] = self.triangles[triangle as usize];
        let vertex = |i: u32| self.vertices[i as usize];
        [vertex(a), vertex(b), vertex(c)]
    }
}

impl Derived {
    fn new(vertices: &[DVec3], triangles: &[[u32; 3]], uses_all: bool) -> Result<Self> {
        if let Some(row) = vertices.par_iter().position_first(|v| !v.is_finite()) {
            ensure_value!(
                false,
                "vertices must be finite: row {row} is {:?}",
                vertices[row].to_array()
            );
        }
        // Squares of lengths must stay finite, or products of them turn into infinities.
        let largest = vertices
            .par_iter()
            .map(|v| v.abs().max_element())
            .reduce(|| 0.0, f64::max);
        ensure_value!(
            largest < 1e30,
            "vertices must be smaller than 1e30 in every coordinate, got {largest:e}"
        );
        let corners = |t: &[u32; 3]| t.map(|i| vertices[i as usize]);
        let none = || bounds_of(std::iter::empty());
        let both = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
        let bounds = match uses_all {
            true => vertices.par_iter().map(|&v| (v, v)).reduce(none, both),
            false => {
                let of_triangles = triangles
                    .par_iter()
                    .map(|t| bounds_of(corners(t).into_iter()));
                of_triangles.reduce(none, both)
            }
        };
        let degenerate = triangles.par_iter().filter(|t| !has_area(corners(t)));
        let degenerate_count = degenerate.count();
        Ok(Self {
            bounds,
            degenerate_count,
            unit_normals: OnceLock::new(),
            edge_directions: OnceLock::new(),
            planes: OnceLock::new(),
        })
    }
}

fn uses_all(vertices: usize, triangles: &[[u32; 3]]) -> bool {
    let mut is_used = vec![false; vertices];
    for &i in triangles.as_flattened() {
        is_used[i as usize] = true;
    }
    is_used.into_iter().all(|is_used| is_used)
}

/// Whether the unit normal is not zero.
fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let (v, w) = (b - a, c - a);
    // Far from what rounding may do, or what it decides.
    v.cross(w).length_squared() > 1e-20 * v.length_squared() * w.length_squared()
        || unit_normal(a, b, c) != DVec3::ZERO
}

/// Unit normal by the right-hand rule, zero where the area is zero.
pub fn unit_normal(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    // The two shortest edges give the least rounding.
    let edges = [b - a, c - b, a - c];
    let [ab, bc, ca] = edges.map(DVec3::length_squared);
    let (first, second) = if ca >= ab && ca >= bc {
        (edges[0], edges[1])
    } else if bc >= ab {
        (edges[2], edges[0])
    } else {
        (edges[1], edges[2])
    };
    let normal = of_size_one(first).cross(of_size_one(second));
    normal.normalize_or_zero()
}

/// The vector times a power of two that takes its largest part to between 1 and 2, so that no square underflows.
fn of_size_one(v: DVec3) -> DVec3 {
    const EXPONENT: u64 = 0x7ff << 52;
    // Biased: the product has the bias alone.
    let exponent = v.abs().max_element().to_bits() & EXPONENT;
    v * f64::from_bits((2046 << 52) - exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        (vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]])
    }

    #[test]
    fn normals_follow_the_right_hand_rule_at_any_scale() {
        for scale in [1e-200, 1.0, 1e25] {
            let n = unit_normal(DVec3::ZERO, DVec3::X * scale, DVec3::Y * scale);
            assert!((n - DVec3::Z).length() < 1e-15, "{scale}: {n}");
        }
    }

    #[test]
    fn bad_input_is_named() {
        let (mut vertices, triangles) = triangle();
        let message = |r: Result<Scene>| r.unwrap_err().to_string();
        assert!(message(Scene::new(vertices.clone(), vec![])).contains("at least one triangle"));
        assert!(message(Scene::new(vertices.clone(), vec![[0, 1, 7]])).contains("row 0"));
        vertices[2].y = f64::NAN;
        assert!(message(Scene::new(vertices, triangles)).contains("row 2"));
    }

    #[test]
    fn degenerate_triangles_are_counted() {
        let (vertices, _) = triangle();
        let scene = Scene::new(vertices, vec![[0, 1, 2], [0, 1, 1]]).unwrap();
        assert_eq!(scene.degenerate_count(), 1);
    }
}
