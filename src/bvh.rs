//! The search: which triangles may a ray meet?
//!
//! A binary bounding volume hierarchy, built by `obvhs` (parallel locally ordered clustering,
//! Meister and Bittner 2018, with reinsertion) and walked by the short loop below. It never decides
//! whether a triangle is hit: it hands every triangle near the ray to the caller, who tests in
//! float64. So the boxes may be float32, as long as no triangle is missed.
//!
//! They are kept relative to the centre of the scene and scaled to [-1, 1]. Each box is grown by the
//! caller's margin and by what float32 rounds of where the ray starts, and distances along the ray are
//! compared with their relative rounding (after Ize, "Robust BVH ray traversal", JCGT 2(2), 2013). So
//! near the middle of a wide scene the walk is no coarser than what is there.

use crate::scene::Scene;
use glam::{DVec3, Vec3, Vec3A};
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::{BvhBuildParams, aabb::Aabb, ploc::PlocBuilder};
use rayon::prelude::*;
use std::ops::ControlFlow;

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
    /// How much more that is for a triangle, as a share of how far its corners are from the origin at most.
    pub growth: f64,
    /// Of a packet, how far its rays begin from this one at most, along each axis.
    pub spread: DVec3,
}

/// Something that finds the triangles near a ray.
pub trait Search: Sync {
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

/// Boxes to either side on the curve among which the nearest is looked for: that of a medium build.
const SEARCHED: usize = 14;

/// Covers the float32 errors of a walk in shaders: all numbers that matter are below 4 and go through
/// a handful of roundings of 2^-24 each.
pub const WALK_MARGIN: f32 = 1.0 / (1 << 18) as f32;

/// What float32 rounds of a number that goes through a handful of roundings of 2^-24 each, as a share
/// of it: a place of the walk here, or a distance along the ray.
const WALK_ROUNDING: f32 = 1.0 / (1 << 20) as f32;

/// What float64 rounds of a ray's origin that was put together, as a share of it.
const ORIGIN_ROUNDING: f64 = 1.0 / (1_u64 << 50) as f64;

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

/// The hierarchy of boxes from -1 to 1, as `obvhs` builds one of medium quality, but that the curve which puts the boxes in
/// order has steps of the same size along each axis. By a box of its own shape a wide scene would first be cut into
/// slices of its height, and neighbours would be far from each other.
fn built(boxes: &[Aabb]) -> Bvh2 {
    let parameters = BvhBuildParams::medium_build();
    let mut bvh = Bvh2::zeroed(boxes.len());
    bvh.primitive_indices = (0..boxes.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(boxes.len());
    for (i, (node, aabb)) in builder.current_nodes.iter_mut().zip(boxes).enumerate() {
        *node = Bvh2Node::new(*aabb, 1, i as u32);
    }
    // A little wider than what it holds, so that no place is beyond its last step.
    let side = Vec3A::splat(1.0 + WALK_MARGIN);
    builder.build_ploc_from_leaves::<SEARCHED, false>(
        &mut bvh,
        Aabb::new(-side, side),
        parameters.sort_precision,
        parameters.search_depth_threshold,
    );
    let mut reinsertion = ReinsertionOptimizer::default();
    let share = parameters.reinsertion_batch_ratio;
    reinsertion.run(&mut bvh, share, None);
    collapse(
        &mut bvh,
        parameters.max_prims_per_leaf,
        parameters.collapse_traversal_cost,
    );
    let more = parameters.post_collapse_reinsertion_batch_ratio_multiplier;
    reinsertion.run(&mut bvh, share * more, None);
    bvh
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
        let built = built(&boxes);
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

impl Bvh {
    /// At least the distance from the point to the farthest corner of any triangle.
    pub fn farthest(&self, point: DVec3) -> f64 {
        point.distance(self.space.centre) + 3_f64.sqrt() * self.space.half_size
    }
}

/// A ray in the space of boxes.
struct Walk {
    start: Vec3A,
    inverse: Vec3A,
    /// How much each box is grown, and more as a share of its distance.
    grown: Vec3A,
    growth: f32,
}

impl Walk {
    /// Where the ray enters a box before a distance, infinite if it does not.
    #[inline(always)]
    fn entry(&self, aabb: &Aabb, end: f32) -> f32 {
        let mut grown = self.grown;
        if self.growth > 0.0 {
            let farthest = (aabb.min - self.start)
                .abs()
                .max((aabb.max - self.start).abs());
            grown += self.growth * farthest.element_sum();
        }
        let a = (aabb.min - (self.start + grown)) * self.inverse;
        let b = (aabb.max - (self.start - grown)) * self.inverse;
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element() * (1.0 + WALK_ROUNDING);
        if enter <= leave.min(end) {
            enter
        } else {
            f32::INFINITY
        }
    }
}

impl Search for Bvh {
    fn visit(&self, ray: ThickRay, mut visit: impl FnMut(u32) -> ControlFlow<(), f64>) {
        if self.nodes.is_empty() {
            return;
        }
        // Start where the ray enters the sphere of radius 2 around the scene's box or nearer, so
        // that an eye far away costs no precision.
        let origin = self.space.place_of(ray.origin);
        let half_size = self.space.half_size;
        let spread = ray.spread / half_size;
        let rounding = ORIGIN_ROUNDING * ray.origin.abs().max_element();
        let mut margin = (ray.margin + rounding) / half_size;
        // Beyond a corner of the scene's box there is no triangle.
        let width = margin + spread.length() + ray.growth * 2.0 * (origin.length() + 2.0);
        let skipped = (-origin.dot(ray.direction) - 2.0 - width).max(ray.start / half_size);
        margin += ray.growth * 2.0 * skipped;
        let start = (origin + skipped * ray.direction).as_vec3a();
        let grown = (spread + margin).as_vec3a();
        let grown = grown + WALK_ROUNDING * (start.abs().max_element() + grown.max_element());
        let reach = |end: f64| {
            let reach = end / half_size - skipped + width;
            reach as f32 * (1.0 + WALK_ROUNDING) + grown.max_element()
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
        let walk = Walk {
            start,
            inverse: Vec3A::from(ray.direction.to_array().map(component)),
            grown,
            growth: ray.growth as f32 * (1.0 + WALK_ROUNDING),
        };

        let mut stack: Vec<(u32, f32)> = Vec::with_capacity(64);
        let enter = walk.entry(&self.nodes[0].aabb, end);
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
            let mut children = [first, first + 1]
                .map(|child| (child as u32, walk.entry(&self.nodes[child].aabb, end)));
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
    fn visit(&self, _ray: ThickRay, mut visit: impl FnMut(u32) -> ControlFlow<(), f64>) {
        for (triangle, normal) in self.0.unit_normals().iter().enumerate() {
            if *normal != Vec3::ZERO && visit(triangle as u32).is_break() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests;
