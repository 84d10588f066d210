//! The search: which triangles may a ray meet?
//!
//! A binary bounding volume hierarchy, built by `obvhs` (parallel locally ordered clustering,
//! Meister and Bittner 2018, with reinsertion) and walked by the short loop below. It never decides
//! whether a triangle is hit: it hands every triangle near the ray to the caller, who tests in
//! float64. So the boxes may be float32, as long as no triangle is missed.
//!
//! They are kept relative to the centre of the scene and scaled to [-1, 1], which makes all float32
//! errors of the walk one constant, whatever the scene's size and place; each box is grown by it and
//! by the caller's margin (after Ize, "Robust BVH ray traversal", 2013).

use crate::scene::Scene;
use glam::{DVec3, Vec3, Vec3A};
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::builder::build_bvh2, bvh2::node::Bvh2Node};
use rayon::prelude::*;
use std::{ops::ControlFlow, time::Duration};

/// A piece of a ray, thick by a margin: all triangles within the margin of it are asked for.
#[derive(Debug, Clone, Copy)]
pub struct ThickRay {
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    /// Distances from the origin between which triangles count; the end may be infinite.
    pub start: f64,
    pub end: f64,
    pub margin: f64,
    /// Of a packet, how far its rays begin from this one at most, along each axis.
    pub spread: DVec3,
}

/// Something that finds the triangles near a ray.
pub trait Search: Sync {
    /// At least the distance from the point to the farthest corner of any triangle.
    fn farthest(&self, point: DVec3) -> f64;

    /// Calls `visit` with every triangle of non-zero area near the ray, and perhaps with others,
    /// each once. `visit` returns the distance beyond which it needs no more, or breaks.
    fn visit(&self, ray: ThickRay, visit: impl FnMut(u32) -> ControlFlow<(), f64>);
}

/// The hierarchy over the triangles of one scene, at one time.
pub struct Bvh {
    nodes: Vec<Bvh2Node>,
    /// Triangle indices; a leaf holds a range of them.
    triangles: Vec<u32>,
    pub space: BoxSpace,
}

/// The space of boxes, in which the scene reaches from -1 to 1.
#[derive(Debug, Clone, Copy)]
pub struct BoxSpace {
    pub centre: DVec3,
    /// Half the longest side of the scene's box.
    pub half_size: f64,
}

impl BoxSpace {
    pub fn place_of(self, point: DVec3) -> DVec3 {
        (point - self.centre) / self.half_size
    }
}

/// A node of a hierarchy that is walked without a stack, as in `shaders/shadow_rays.wgsl`.
#[derive(Debug, Clone, Copy)]
pub struct ThreadedNode {
    pub least: Vec3,
    pub next: u32,
    pub greatest: Vec3,
    /// Index of the first triangle times 16 plus their number; 0 for an inner node.
    pub leaf: u32,
}

const LEAF_SHIFT: u32 = 4;

/// Covers the float32 errors of the walk: all numbers that matter are below 4 and go through a
/// handful of roundings of 2^-24 each.
pub const WALK_MARGIN: f32 = 1.0 / (1 << 18) as f32;

/// A box around each triangle of non-zero area, rounded outwards.
pub struct TriangleBoxes {
    pub triangles: Vec<u32>,
    boxes: Vec<Aabb>,
    pub space: BoxSpace,
}

impl TriangleBoxes {
    pub fn new(scene: &Scene) -> Self {
        let (low, high) = scene.bounds();
        let space = BoxSpace {
            centre: low + 0.5 * (high - low),
            half_size: (0.5 * (high - low).max_element()).max(f64::MIN_POSITIVE),
        };
        let triangles: Vec<u32> = (0..scene.triangles().len() as u32)
            .filter(|&t| scene.unit_normals()[t as usize] != Vec3::ZERO)
            .collect();
        let boxes = triangles
            .par_iter()
            .map(|&t| {
                let [a, b, c] = scene.corners(t).map(|v| space.place_of(v));
                // The conversion rounds by at most half a step.
                let down = |v: DVec3| v.as_vec3().to_array().map(f32::next_down);
                let up = |v: DVec3| v.as_vec3().to_array().map(f32::next_up);
                Aabb::new(
                    Vec3A::from(down(a.min(b).min(c))),
                    Vec3A::from(up(a.max(b).max(c))),
                )
            })
            .collect();
        Self {
            triangles,
            boxes,
            space,
        }
    }

    /// Least and greatest corners, the boxes grown by at least the margin.
    pub fn grown(&self, margin: f32) -> Vec<[[f32; 3]; 2]> {
        let grow = |aabb: &Aabb| {
            let least = (aabb.min - margin).to_array().map(f32::next_down);
            let greatest = (aabb.max + margin).to_array().map(f32::next_up);
            [least, greatest]
        };
        self.boxes.par_iter().map(grow).collect()
    }
}

impl Bvh {
    pub fn new(scene: &Scene) -> Self {
        let TriangleBoxes {
            triangles,
            boxes,
            space,
        } = TriangleBoxes::new(scene);
        if boxes.is_empty() {
            return Self {
                nodes: vec![],
                triangles,
                space,
            };
        }
        let parameters = BvhBuildParams::medium_build();
        let built = build_bvh2(&boxes, parameters, &mut Duration::default());
        let order = built.primitive_indices.iter();
        Self {
            nodes: built.nodes,
            triangles: order.map(|&i| triangles[i as usize]).collect(),
            space,
        }
    }

    /// Nodes in depth-first order, each with the index of the one to go on with where its box is missed,
    /// and the triangles in the order of the leaves.
    pub fn threaded(&self) -> (Vec<ThreadedNode>, &[u32]) {
        let mut threaded: Vec<ThreadedNode> = Vec::with_capacity(self.nodes.len());
        // Nodes to come, and the inner nodes whose last child they are.
        enum Step {
            Enter(u32),
            Close(usize),
        }
        let mut stack = Vec::new();
        if !self.nodes.is_empty() {
            stack.push(Step::Enter(0));
        }
        while let Some(step) = stack.pop() {
            match step {
                Step::Close(index) => threaded[index].next = threaded.len() as u32,
                Step::Enter(index) => {
                    let node = &self.nodes[index as usize];
                    stack.push(Step::Close(threaded.len()));
                    threaded.push(ThreadedNode {
                        least: node.aabb.min.into(),
                        next: 0,
                        greatest: node.aabb.max.into(),
                        leaf: (node.first_index << LEAF_SHIFT) * node.prim_count.min(1)
                            + node.prim_count,
                    });
                    if node.prim_count == 0 {
                        stack.push(Step::Enter(node.first_index + 1));
                        stack.push(Step::Enter(node.first_index));
                    }
                }
            }
        }
        (threaded, &self.triangles)
    }
}

impl Search for Bvh {
    fn farthest(&self, point: DVec3) -> f64 {
        point.distance(self.space.centre) + 3_f64.sqrt() * self.space.half_size
    }

    fn visit(&self, ray: ThickRay, mut visit: impl FnMut(u32) -> ControlFlow<(), f64>) {
        if self.nodes.is_empty() {
            return;
        }
        // Start where the ray enters the sphere of radius 2 around the scene's box or nearer, so
        // that an eye far away costs no precision.
        let origin = self.space.place_of(ray.origin);
        let half_size = self.space.half_size;
        let margin = ray.margin / half_size;
        let spread = ray.spread / half_size;
        let width = margin + spread.length();
        let skipped = (-origin.dot(ray.direction) - 2.0 - width).max(ray.start / half_size);
        let start = (origin + skipped * ray.direction).as_vec3a();
        let reach = |end: f64| {
            let reach = end / half_size - skipped + width;
            reach as f32 * (1.0 + WALK_MARGIN) + WALK_MARGIN
        };
        let mut end = reach(ray.end);
        if end < 0.0 {
            return;
        }

        // A component that is zero would give 0 * infinity on the side of a box. One this small
        // gives finite numbers and moves the ray by nothing.
        let component = |d: f64| {
            if d.abs() < 1e-20 {
                1e20_f32
            } else {
                1.0 / d as f32
            }
        };
        let inverse = Vec3A::from(ray.direction.to_array().map(component));
        let grown = (spread + margin).as_vec3a() * (1.0 + WALK_MARGIN) + WALK_MARGIN;
        let (from_min, from_max) = (start + grown, start - grown);
        let entry = |node: &Bvh2Node, end: f32| {
            let a = (node.aabb.min - from_min) * inverse;
            let b = (node.aabb.max - from_max) * inverse;
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(end);
            if enter <= leave { enter } else { f32::INFINITY }
        };

        let mut stack: Vec<(u32, f32)> = Vec::with_capacity(64);
        let enter = entry(&self.nodes[0], end);
        if enter == f32::INFINITY {
            return;
        }
        stack.push((0, enter));
        while let Some((index, enter)) = stack.pop() {
            if enter > end {
                continue;
            }
            let node = &self.nodes[index as usize];
            let first = node.first_index as usize;
            if node.prim_count > 0 {
                for &triangle in &self.triangles[first..first + node.prim_count as usize] {
                    match visit(triangle) {
                        ControlFlow::Continue(needed) => end = end.min(reach(needed)),
                        ControlFlow::Break(()) => return,
                    }
                }
                continue;
            }
            // The nearer child first: it goes on the stack last.
            let mut children =
                [first, first + 1].map(|child| (child as u32, entry(&self.nodes[child], end)));
            if children[0].1 < children[1].1 {
                children.swap(0, 1);
            }
            stack.extend(children.iter().filter(|child| child.1 < f32::INFINITY));
        }
    }
}

/// No search at all: every triangle, for settling disputes.
pub struct Everything<'a>(pub &'a Scene);

impl Search for Everything<'_> {
    fn farthest(&self, _point: DVec3) -> f64 {
        0.0
    }

    fn visit(&self, _ray: ThickRay, mut visit: impl FnMut(u32) -> ControlFlow<(), f64>) {
        for (triangle, normal) in self.0.unit_normals().iter().enumerate() {
            if *normal != Vec3::ZERO && visit(triangle as u32).is_break() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::Random;

    /// The triangles near a ray.
    fn met(bvh: &Bvh, ray: ThickRay) -> Vec<u32> {
        let mut met = Vec::new();
        bvh.visit(ray, |triangle| {
            met.push(triangle);
            ControlFlow::Continue(f64::INFINITY)
        });
        met
    }

    #[test]
    fn grown_boxes_hold_their_triangles_and_the_margin() {
        let vertices = vec![
            DVec3::ZERO,
            DVec3::X / 3.0,
            DVec3::new(0.1, 0.7, 0.0),
            -DVec3::Z,
        ];
        let scene = Scene::new(vertices, vec![[0, 1, 2], [0, 0, 3], [1, 2, 3]]).unwrap();
        let boxes = TriangleBoxes::new(&scene);
        assert_eq!(boxes.triangles, [0, 2]);
        for margin in [0.0, WALK_MARGIN, 0.25] {
            for (triangle, [least, greatest]) in boxes.triangles.iter().zip(boxes.grown(margin)) {
                let slack = f64::from(margin);
                for corner in scene.corners(*triangle) {
                    let corner = boxes.space.place_of(corner);
                    let least = Vec3::from(least).as_dvec3();
                    let greatest = Vec3::from(greatest).as_dvec3();
                    assert!((corner - slack).cmpgt(least).all());
                    assert!((corner + slack).cmplt(greatest).all());
                }
            }
        }
    }

    #[test]
    fn a_packet_meets_what_each_of_its_rays_meets() {
        let mut random = Random(7);
        let mut vector = || DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0));
        let mut vertices = Vec::new();
        for _ in 0..400 {
            let middle = 10.0 * vector();
            vertices.extend([0; 3].map(|_| middle + 0.4 * vector()));
        }
        let triangles = (0..400).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let bvh = Bvh::new(&Scene::new(vertices, triangles).unwrap());
        let met = |ray| met(&bvh, ray);
        let mut count = 0;
        for i in 0..500 {
            // From within the scene, and wide from far outside of it.
            let scale = if i % 4 < 2 { 1.0 } else { 8.0 };
            let (middle, spread) = (scale * 8.0 * vector(), scale * vector().abs());
            let light = 12.0 * vector();
            // Rays that all go one way, and rays that end in one point.
            let has_end = i % 2 == 0;
            let ray_from = |origin: DVec3, spread: DVec3| {
                let to_light = if has_end { light - origin } else { light };
                ThickRay {
                    origin,
                    direction: to_light.normalize(),
                    start: 0.0,
                    end: if has_end {
                        to_light.length()
                    } else {
                        f64::INFINITY
                    },
                    margin: 1e-6,
                    spread,
                }
            };
            let of_packet = met(ray_from(middle, spread));
            for _ in 0..20 {
                let of_one = met(ray_from(middle + spread * vector(), DVec3::ZERO));
                count += of_one.len();
                assert!(of_one.iter().all(|triangle| of_packet.contains(triangle)));
            }
        }
        assert!(count > 1000);
    }

    #[test]
    fn a_wide_packet_begins_before_any_of_its_rays_enters_the_scene() {
        let corner = DVec3::splat(-10.0);
        let small = |at: DVec3, size: f64| [at, at + size * DVec3::X, at + size * DVec3::Y];
        let vertices = [small(corner, 0.1), small(-corner, -0.1)].concat();
        let bvh = Bvh::new(&Scene::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap());
        let direction = DVec3::new(0.95, 0.3, 0.1).normalize();
        let origin = corner + DVec3::new(0.03, 0.03, 0.0) - 40.0 * direction;
        // The ray in the middle passes the corner before it comes near the scene.
        let spread = DVec3::new(20.0, 20.0, 0.0);
        let middle = origin - 0.999 * DVec3::new(20.0, -20.0, 0.0);
        for (origin, spread) in [(origin, DVec3::ZERO), (middle, spread)] {
            let ray = ThickRay {
                origin,
                direction,
                start: 0.0,
                end: f64::INFINITY,
                margin: 1e-6,
                spread,
            };
            let met = met(&bvh, ray);
            assert!(met.contains(&0), "{spread}: {met:?}");
        }
    }
}
