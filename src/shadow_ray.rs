//! A receiver's own light ray against a triangle: twin of `shaders/lib/shadow_ray.wgsl` and `receiver_ray.wgsl`, which
//! argue for it.

use crate::lanes::{Lane, V2, V3, axes_across};
use crate::rounding::ROUNDING;

const PRODUCT_ROUNDING: f64 = 0.5 * ROUNDING;

/// In axes relative to the receiver, the third of which goes towards the light.
#[derive(Debug, Clone, Copy)]
pub struct LightRay<L> {
    /// The ray is (shear, 1) per unit of depth.
    pub shear: V2<L>,
    /// Depth of the light; beyond every depth where it is at infinity.
    pub reach: L,
}

/// The ray against the edges of a triangle.
pub struct Edges<M> {
    pub may_be_inside: M,
    /// Whatever the room.
    pub is_inside: M,
}

/// The ray against a triangle.
pub struct Meeting<M> {
    pub is_possible: M,
    pub is_certain: M,
}

#[inline(always)]
fn absolute_sum<L: Lane>(v: V3<L>) -> L {
    v.x.abs() + v.y.abs() + v.z.abs()
}

#[inline(always)]
fn least<L: Lane>([a, b, c]: [L; 3]) -> L {
    a.min(b).min(c)
}

#[inline(always)]
fn greatest<L: Lane>([a, b, c]: [L; 3]) -> L {
    a.max(b).max(c)
}

/// How far rounding may move a point at a distance from the eye, seen along a ray that makes an angle with the
/// surface; `extent` is the triangle's longest edge.
#[inline(always)]
pub fn receiver_margin<L: Lane>(distance: L, cosine: L, extent: L) -> L {
    let margin = distance.constant(ROUNDING) * distance;
    margin + (margin / cosine.max(distance.constant(1e-30))).min(extent)
}

impl<L: Lane> LightRay<L> {
    /// `room` is how far each coordinate of the corners may be off.
    #[inline(always)]
    pub fn meet_edges(&self, corners: [V3<L>; 3], room: L) -> Edges<L::Mask> {
        let p = corners.map(|corner| corner.xy() - self.shear * corner.z);
        let total = p.map(|p| p.map(L::abs));
        let total = total[0] + total[1] + total[2];
        let off = room * (total.x + total.y + room);
        // The edge opposite to each corner: its function, and what that may be off.
        let edges = [[1, 2], [2, 0], [0, 1]].map(|[from, to]| {
            let (p, d) = (p[from], p[to] - p[from]);
            let [one, two] = [p.x * d.y, p.y * d.x];
            let rounding = room.constant(PRODUCT_ROUNDING) * (one.abs() + two.abs());
            (one - two, rounding + off)
        });
        let e = edges.map(|edge| edge.0);
        let all = |[a, b, c]: [L::Mask; 3]| a & b & c;
        let is_near = all(edges.map(|(e, slack)| (-slack).at_most(e)))
            | all(edges.map(|(e, slack)| e.at_most(slack)));
        // Edges that meet at no angle go on beyond the triangle.
        let around = room.constant(ROUNDING) * greatest(corners.map(absolute_sum)) + room;
        let is_around = |p: [L; 3]| least(p).at_most(around) & (-around).at_most(greatest(p));
        let is_around = is_around(p.map(|p| p.x)) & is_around(p.map(|p| p.y));
        let most = greatest(edges.map(|edge| edge.1));
        Edges {
            may_be_inside: is_near & is_around,
            is_inside: most.less(least(e)) | greatest(e).less(-most),
        }
    }

    /// What may be, and what is for sure.
    #[inline(always)]
    pub fn meeting(
        &self,
        edges: &Edges<L::Mask>,
        corners: [V3<L>; 3],
        normal: V3<L>,
        room: L,
    ) -> Meeting<L::Mask> {
        let (zero, one) = (room.constant(0.0), room.constant(1.0));
        // The nearest corner knows best how far the receiver is behind the triangle's plane.
        let mut distance = absolute_sum(corners[0]);
        let mut above = normal.dot(corners[0]);
        for corner in &corners[1..] {
            let is_nearer = absolute_sum(*corner).less(distance);
            above = L::select(is_nearer, normal.dot(*corner), above);
            distance = L::select(is_nearer, absolute_sum(*corner), distance);
        }
        let slope = normal.dot(self.shear.extend(one));
        let height = above * slope.sign();
        // Of a sum of three coordinates, and of the normal.
        let off = room.constant(4.0) * room + room.constant(ROUNDING) * distance;
        // Near to edge-on, the room hides which side the receiver is on.
        let steepness = one + self.shear.x.abs() + self.shear.y.abs();
        let is_edge_on = slope.abs().less(room.constant(1e-5) * steepness);
        let greatest_height = L::select(is_edge_on, height.abs(), height) + off;
        let to_light = slope.abs() * self.reach;
        let greatest_depth = greatest(corners.map(|corner| corner.z));
        let may_be_before_light =
            greatest_depth.less(self.reach + off) | height.less(to_light + off);
        let is_between = off.less(height) & height.less(to_light - off) & !is_edge_on;
        Meeting {
            is_possible: edges.may_be_inside & zero.less(greatest_height) & may_be_before_light,
            is_certain: edges.is_inside & is_between,
        }
    }
}

/// A receiver and its light ray, in world axes.
#[derive(Debug, Clone, Copy)]
pub struct ReceiverRay<L> {
    /// How far rounding may have moved the receiver.
    pub margin: L,
    /// Axes of the test; the third one is the ray's direction.
    pub axes: [V3<L>; 3],
    pub light_ray: LightRay<L>,
}

impl<L: Lane> ReceiverRay<L> {
    /// Corners relative to the receiver; not of its own triangle.
    #[inline(always)]
    pub fn meets(&self, corners: [V3<L>; 3], normal: V3<L>) -> Meeting<L::Mask> {
        let [x, y, z] = self.axes;
        let turned = |v: V3<L>| V3::new(x.dot(v), y.dot(v), z.dot(v));
        let room =
            self.margin.constant(ROUNDING) * greatest(corners.map(absolute_sum)) + self.margin;
        let corners = corners.map(turned);
        let edges = self.light_ray.meet_edges(corners, room);
        self.light_ray
            .meeting(&edges, corners, turned(normal), room)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::Shader;
    use crate::twin::{Random, Twin, assert_twins};

    const WGSL: &str = "
fn row(i: u32) -> vec3<f32> {
    return vec3<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u]);
}

fn twin(i: u32) -> array<f32, 13> {
    let a = row(i);
    let b = row(i + 3u);
    let c = row(i + 6u);
    let normal = row(i + 9u);
    let axes = axes_across(row(i + 12u));
    let light_ray = LightRay(row(i + 15u).xy, inputs[i + 17u]);
    let room = inputs[i + 19u];
    let edges = meet_edges(light_ray.shear, a, b, c, room);
    let both = meeting(light_ray, edges, a, b, c, normal, room);
    var ray: ReceiverRay;
    ray.margin = inputs[i + 18u];
    ray.x = axes.x;
    ray.y = axes.y;
    ray.z = row(i + 12u);
    ray.light_ray = light_ray;
    let met = meets_corners(ray, a, b, c, normal);
    return array<f32, 13>(
        receiver_margin(abs(a.x), abs(a.y), abs(a.z)),
        axes.x.x, axes.x.y, axes.x.z, axes.y.x, axes.y.y, axes.y.z,
        f32(edges.may_be_inside), f32(edges.is_inside),
        f32(both.is_possible), f32(both.is_certain),
        f32(met.is_possible), f32(met.is_certain),
    );
}
";

    const INPUTS: usize = 20;

    struct ShadowRay;

    impl Twin for ShadowRay {
        fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
            let row = |i: usize| V3::new(inputs[i], inputs[i + 1], inputs[i + 2]);
            let corners = [row(0), row(3), row(6)];
            let [a, _, _] = corners;
            let (normal, z) = (row(9), row(12));
            let [x, y] = axes_across(z);
            let light_ray = LightRay {
                shear: row(15).xy(),
                reach: inputs[17],
            };
            let room = inputs[19];
            let edges = light_ray.meet_edges(corners, room);
            let both = light_ray.meeting(&edges, corners, normal, room);
            let ray = ReceiverRay {
                margin: inputs[18],
                axes: [x, y, z],
                light_ray,
            };
            let met = ray.meets(corners, normal);
            let masks = [
                edges.may_be_inside,
                edges.is_inside,
                both.is_possible,
                both.is_certain,
                met.is_possible,
                met.is_certain,
            ];
            let masks = masks.map(|mask| L::select(mask, a.x.constant(1.0), a.x.constant(0.0)));
            let mut outputs = vec![receiver_margin(a.x.abs(), a.y.abs(), a.z.abs())];
            outputs.extend([x.x, x.y, x.z, y.x, y.y, y.z]);
            outputs.extend(masks);
            outputs
        }
    }

    /// Triangles around the ray and beside it, large, thin and without an area, before and behind the light, and
    /// planes edge-on to the ray.
    fn case(random: &mut Random) -> [f32; INPUTS] {
        let mut case = [0.0; INPUTS].map(|_: f32| random.number());
        let mut unit = || (2.0 * random.share() - 1.0) as f32;
        for coordinate in &mut case[..20] {
            if unit() > -0.8 {
                *coordinate = unit();
            }
        }
        let scale = 10f64.powi(random.below(7) as i32 - 3) as f32;
        for coordinate in &mut case[..9] {
            *coordinate *= scale;
        }
        match random.below(8) {
            0 => case.copy_within(0..3, 6),
            1 => (case[0], case[1], case[3], case[4]) = (0.0, 0.0, 0.0, 0.0),
            2 => case[11] = 0.0,
            3 => case[9..12].fill(0.0),
            4 => (case[3], case[4], case[5]) = (-case[0], -case[1], case[2]),
            _ => {}
        }
        (case[15], case[16]) = [(0.0, 0.0), (case[15], case[16])][random.below(2)];
        case[17] = [3e38, case[17].abs()][random.below(2)];
        case[18] = 1e-6 * case[18].abs();
        case[19] = [0.0, 1e-3 * case[19].abs()][random.below(2)];
        case
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn shaders_of_shadow_rays_compute_what_rust_does() {
        let mut random = Random(1);
        let cases: Vec<_> = (0..20_000).map(|_| case(&mut random)).collect();
        let source = Shader::new("lib/receiver_ray").compose() + WGSL;
        assert_twins(&source, &ShadowRay, &cases, &[]);
    }
}
