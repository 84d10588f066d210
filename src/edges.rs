//! The edges of the scene's triangles, and which triangles have each: what silhouettes are found on.

use crate::scene::Scene;
use glam::Vec3;
use rayon::prelude::*;

/// Uses of one edge at most: more are listed as several edges in one place, whose crossings add up.
const MAX_USES: usize = 1024;

/// An edge between two places, whatever vertices lie there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// From the vertex with the lower index to the other.
    pub vertices: [u32; 2],
    /// Of its part of `Edges::uses`.
    pub first_use: u32,
    pub use_count: u32,
}

/// Every edge of a triangle with an area. An edge may have any number of triangles.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Edges {
    pub edges: Vec<Edge>,
    /// A triangle times two, and one more where it goes along the edge backwards.
    pub uses: Vec<u32>,
}

impl Edges {
    pub fn new(scene: &Scene) -> Self {
        let welded = welded_vertices(scene);
        let normals = scene.unit_normals();
        let mut sides: Vec<([u32; 2], u32)> = scene
            .triangles()
            .par_iter()
            .enumerate()
            .filter(|(t, _)| normals[*t] != Vec3::ZERO)
            .flat_map_iter(|(t, triangle)| {
                let corners = triangle.map(|vertex| welded[vertex as usize]);
                (0..3).map(move |i| {
                    let (from, to) = (corners[i], corners[(i + 1) % 3]);
                    let is_backward = u32::from(to < from);
                    ([from.min(to), from.max(to)], 2 * t as u32 + is_backward)
                })
            })
            .collect();
        sides.par_sort_unstable();
        let mut edges = Vec::new();
        let mut first_use = 0;
        for of_edge in sides.chunk_by(|a, b| a.0 == b.0) {
            for part in of_edge.chunks(MAX_USES) {
                edges.push(Edge {
                    vertices: part[0].0,
                    first_use,
                    use_count: part.len() as u32,
                });
                first_use += part.len() as u32;
            }
        }
        Self {
            edges,
            uses: sides.into_iter().map(|(_, side)| side).collect(),
        }
    }
}

/// For each vertex one that stands for all those in its place: files split meshes where materials meet.
fn welded_vertices(scene: &Scene) -> Vec<u32> {
    let vertices = scene.vertices();
    let place = |vertex: &u32| {
        // Both zeros are one place.
        (vertices[*vertex as usize] + 0.0)
            .to_array()
            .map(f64::to_bits)
    };
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.par_sort_unstable_by_key(|vertex| (place(vertex), *vertex));
    let mut welded = vec![0; vertices.len()];
    for together in order.chunk_by(|a, b| place(a) == place(b)) {
        for &vertex in together {
            welded[vertex as usize] = together[0];
        }
    }
    welded
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn edges(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Edges {
        let vertices = vertices.iter().copied().map(DVec3::from).collect();
        Edges::new(&Scene::new(vertices, triangles.to_vec()).unwrap())
    }

    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    /// The sum over an edge's triangles, all turned the same way.
    fn crossings(edges: &Edges, edge: &Edge) -> i32 {
        let first = edge.first_use as usize;
        let uses = &edges.uses[first..first + edge.use_count as usize];
        uses.iter()
            .map(|side| if side & 1 == 1 { -1 } else { 1 })
            .sum()
    }

    #[test]
    fn neighbours_cancel_and_rims_stay() {
        let edges = edges(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(edges.edges.len(), 5);
        for edge in &edges.edges {
            let expected = if edge.vertices == [0, 2] { 0 } else { 1 };
            assert_eq!(crossings(&edges, edge).abs(), expected, "{edge:?}");
        }
    }

    #[test]
    fn vertices_in_one_place_are_one() {
        let mut vertices = SQUARE.to_vec();
        vertices.extend([[-0.0, 0.0, 0.0], [1.0, 1.0, -0.0]]);
        let edges = edges(&vertices, &[[0, 1, 2], [4, 5, 3]]);
        assert_eq!(edges.edges.len(), 5);
        assert_eq!(edges.uses.len(), 6);
    }

    #[test]
    fn an_edge_may_have_any_number_of_triangles() {
        let mut vertices = vec![[0., 0., 0.], [0., 0., 1.]];
        let mut triangles = Vec::new();
        for i in 0..MAX_USES as u32 + 7 {
            let angle = 0.001 * f64::from(i);
            vertices.push([angle.cos(), angle.sin(), 0.5]);
            triangles.push([0, 1, i + 2]);
        }
        let edges = edges(&vertices, &triangles);
        let spine = edges.edges.iter().filter(|edge| edge.vertices == [0, 1]);
        let sum: i32 = spine.map(|edge| crossings(&edges, edge)).sum();
        assert_eq!(sum, MAX_USES as i32 + 7);
    }

    #[test]
    fn triangles_without_an_area_have_no_edges() {
        let edges = edges(&SQUARE, &[[0, 1, 2], [0, 1, 1]]);
        assert_eq!(edges.uses.len(), 3);
    }
}
