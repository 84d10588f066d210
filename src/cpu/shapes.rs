//! Triangles as the lanes test them: eight are set up at once, or one in float64.

use super::lanes::{
    EPSILON, LANES, Simd, columns, f32x8, greatest, least, mask_bits, mask32x8, numbers, splat,
};
use super::tiles::BLOCK;
use super::view::{Place, Planes, View};
use crate::lanes::Each;
use crate::scene::Scene;
use fearless_simd::prelude::*;
use glam::{DVec2, Vec3Swizzles};

/// Eight triangles: functions of (column, row) relative to an origin.
#[derive(Clone, Copy)]
pub struct Shapes {
    /// a * column + b * row + c of each edge is above 1 inside, and below -1 outside, for sure.
    pub a: [[f32; LANES]; 3],
    pub b: [[f32; LANES]; 3],
    pub c: [[f32; LANES]; 3],
    /// The nearness: a step along columns, along rows, and its value at the origin.
    pub step_x: [f32; LANES],
    pub step_y: [f32; LANES],
    pub first: [f32; LANES],
    /// What rounding may do to it.
    pub rounding: [f32; LANES],
    /// Between which it is kept.
    pub low: [f32; LANES],
    pub high: [f32; LANES],
}

/// The corners of eight triangles: columns, rows, how near they are, and on which side of the origin.
#[derive(Clone, Copy)]
pub struct Corners<S: Simd> {
    pub x: [f32x8<S>; 3],
    pub y: [f32x8<S>; 3],
    pub nearness: [f32x8<S>; 3],
    pub side: [f32x8<S>; 3],
}

impl<S: Simd> Corners<S> {
    #[inline(always)]
    pub fn new(simd: S, places: &[Place], triangles: [[u32; 3]; LANES]) -> Self {
        let a = columns(simd, corner_of_eight(places, &triangles, 0));
        let b = columns(simd, corner_of_eight(places, &triangles, 1));
        let c = columns(simd, corner_of_eight(places, &triangles, 2));
        Self {
            x: [a[0], b[0], c[0]],
            y: [a[1], b[1], c[1]],
            nearness: [a[2], b[2], c[2]],
            side: [a[3], b[3], c[3]],
        }
    }

    /// Those that float32 does not know well: they pass the origin, reach far beside the view, or are thinner than
    /// rounding.
    #[inline(always)]
    pub fn wide(&self, simd: S, view: &View) -> u32 {
        let (x, y) = (self.x, self.y);
        let size = (greatest(x) - least(x)) + (greatest(y) - least(y));
        let area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
        let is_thin = area.abs().simd_lt(size * (8.0 * view.rounding()));
        self.out_of_reach(simd, view) | mask_bits(is_thin)
    }

    /// Those that pass the origin or reach far beside the view: of the others float32 knows the box.
    #[inline(always)]
    pub fn out_of_reach(&self, simd: S, view: &View) -> u32 {
        let (x, y, reach) = (self.x, self.y, splat(simd, view.reach()));
        let passes_origin = least(self.side).simd_lt(splat(simd, 0.0));
        let is_far = (least(x).simd_lt(-reach) | reach.simd_lt(greatest(x)))
            | (least(y).simd_lt(-reach) | reach.simd_lt(greatest(y)));
        mask_bits(passes_origin | is_far)
    }

    /// Least and greatest column, least and greatest row, wider by some room; those out of reach may be anywhere.
    #[inline(always)]
    pub fn boxes(&self, simd: S, out_of_reach: u32, room: f32) -> [f32x8<S>; 4] {
        let anywhere = mask32x8::from_bitmask(simd, u64::from(out_of_reach));
        let (low, high) = (splat(simd, f32::NEG_INFINITY), splat(simd, f32::INFINITY));
        [
            anywhere.select(low, least(self.x) - room),
            anywhere.select(high, greatest(self.x) + room),
            anywhere.select(low, least(self.y) - room),
            anywhere.select(high, greatest(self.y) + room),
        ]
    }

    #[inline(always)]
    pub fn relative_to(self, origin: [f32; 2]) -> Self {
        Self {
            x: self.x.each(|x| x - origin[0]),
            y: self.y.each(|y| y - origin[1]),
            ..self
        }
    }
}

/// At least the length, and at most 1.09 times as much: the two are the same where one of the axes has nothing or
/// both have the same, and between those the length is below the chord.
#[inline(always)]
fn length<S: Simd>(x: f32x8<S>, y: f32x8<S>) -> f32x8<S> {
    let (x, y) = (x.abs(), y.abs());
    let longer = x.max(y).max(1e-20);
    longer + x.min(y) * 0.414_214
}

#[inline(always)]
fn corner_of_eight<'a>(
    places: &'a [Place],
    triangles: &[[u32; 3]; LANES],
    k: usize,
) -> [&'a Place; LANES] {
    let mut corners = [&places[triangles[0][k] as usize]; LANES];
    for lane in 1..LANES {
        corners[lane] = &places[triangles[lane][k] as usize];
    }
    corners
}

impl Shapes {
    pub const NONE: Self = Self {
        a: [[0.0; LANES]; 3],
        b: [[0.0; LANES]; 3],
        c: [[0.0; LANES]; 3],
        step_x: [0.0; LANES],
        step_y: [0.0; LANES],
        first: [0.0; LANES],
        rounding: [0.0; LANES],
        low: [0.0; LANES],
        high: [0.0; LANES],
    };

    /// One in float64, in the first lane; see `set_wide`.
    pub fn wide(
        view_and_scene: (&View, &Scene),
        id: u32,
        origin: DVec2,
        side: f64,
        rounding: f32,
    ) -> Option<Self> {
        let mut shapes = Self::NONE;
        let is_seen = shapes.set_wide(0, view_and_scene, id, origin, side, rounding);
        is_seen.then_some(shapes)
    }

    /// Corners within reach, relative to the origin. `rounding`: what it may have moved them by. Columns and rows
    /// that are asked for are less than `side` from the origin.
    #[inline(always)]
    pub fn new<S: Simd>(simd: S, corners: &Corners<S>, rounding: f32, side: f32) -> Self {
        let Corners {
            x, y, nearness: d, ..
        } = *corners;
        let (ux, uy) = (x[1] - x[0], y[1] - y[0]);
        let (vx, vy) = (x[2] - x[0], y[2] - y[0]);
        let area = ux * vy - vx * uy;
        let inverse_area = splat(simd, 1.0) / area;
        let sign = splat(simd, 1.0).copysign(area);
        let lengths = [
            length(x[2] - x[1], y[2] - y[1]),
            length(x[0] - x[2], y[0] - y[2]),
            length(x[1] - x[0], y[1] - y[0]),
        ];
        let longest = greatest(lengths);
        let mut edges = [[splat(simd, 0.0); 3]; 3];
        for (i, edge) in edges.iter_mut().enumerate() {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (a, b) = ((y[j] - y[k]) * sign, (x[k] - x[j]) * sign);
            // By the corner that is nearer to the origin: there is less to round.
            let (of_j, of_k) = (x[j].abs() + y[j].abs(), x[k].abs() + y[k].abs());
            let is_first = of_j.simd_lt(of_k);
            let (px, py) = (is_first.select(x[j], x[k]), is_first.select(y[j], y[k]));
            let c = -(a * px + b * py);
            // A corner that moves turns the edge, which matters the more the shorter the edge is.
            let turned = (longest + lengths[i]) * (2.0 * rounding);
            let off = (of_j.min(of_k) + 2.0 * side) * (4.0 * EPSILON);
            let scale = splat(simd, 1.0) / off.mul_add(lengths[i], turned);
            *edge = [a * scale, b * scale, c * scale];
        }
        let (ud, vd) = (d[1] - d[0], d[2] - d[0]);
        let step_x = (ud * vy - vd * uy) * inverse_area;
        let step_y = (vd * ux - ud * vx) * inverse_area;
        let first = d[0] - step_x * x[0] - step_y * y[0];
        let steps = step_x.abs() + step_y.abs();
        let moved = steps * (rounding * 2.0);
        // What rounding turns the plane by, over the triangle's extent.
        let turned =
            (ud.abs() + vd.abs()) * (longest * longest * (8.0 * EPSILON) * inverse_area.abs());
        let far_off = steps * ((x[0].abs() + y[0].abs() + 2.0 * side) * (2.0 * EPSILON));
        let (low, high) = (least(d), greatest(d));
        let size = low.abs().max(high.abs());
        let off = moved + turned + far_off + size * (4.0 * EPSILON);
        // It is kept between its corners'.
        let off = off.min((high - low) + size * (4.0 * EPSILON));
        let [p, q, r] = edges;
        Self {
            a: [p[0].to_array(), q[0].to_array(), r[0].to_array()],
            b: [p[1].to_array(), q[1].to_array(), r[1].to_array()],
            c: [p[2].to_array(), q[2].to_array(), r[2].to_array()],
            step_x: step_x.to_array(),
            step_y: step_y.to_array(),
            first: first.to_array(),
            rounding: off.to_array(),
            low: low.to_array(),
            high: high.to_array(),
        }
    }

    /// Puts one of the eight in float64; `false` where it is seen edge-on. `rounding`: what it may have moved the places
    /// that are asked for by.
    pub fn set_wide(
        &mut self,
        lane: usize,
        (view, scene): (&View, &Scene),
        id: u32,
        origin: DVec2,
        side: f64,
        rounding: f32,
    ) -> bool {
        let rounding = f64::from(rounding);
        let Some(planes) = Planes::new(view, scene, id, origin) else {
            return false;
        };
        let epsilon = f64::from(EPSILON);
        for (i, edge) in planes.edges.iter().enumerate() {
            let length = edge.xy().length();
            let band = 4.0 * epsilon * (edge.z.abs() + side * length) + 2.0 * rounding * length;
            // An edge that is a point, or none at all, is sure of nothing.
            let edge = if band > 0.0 {
                *edge / band
            } else {
                *edge * 0.0
            };
            [self.a[i][lane], self.b[i][lane], self.c[i][lane]] = edge.as_vec3().to_array();
        }
        let d = planes.nearness;
        let steps = d.xy().abs().element_sum();
        [self.step_x[lane], self.step_y[lane], self.first[lane]] = d.as_vec3().to_array();
        let off = 4.0 * epsilon * (d.z.abs() + side * steps) + 2.0 * rounding * steps;
        self.rounding[lane] = off as f32;
        self.low[lane] = f32::NEG_INFINITY;
        self.high[lane] = (d.z + side * steps) as f32;
        true
    }

    /// Which of the eight may hide something in a box of columns and rows that is no nearer than `farthest`.
    #[inline(always)]
    pub fn may_hide<S: Simd>(&self, simd: S, sides: [f32; 4], farthest: f32) -> u32 {
        let inside = greatest_in_box(simd, sides, [&self.a[0], &self.b[0], &self.c[0]])
            .min(greatest_in_box(
                simd,
                sides,
                [&self.a[1], &self.b[1], &self.c[1]],
            ))
            .min(greatest_in_box(
                simd,
                sides,
                [&self.a[2], &self.b[2], &self.c[2]],
            ));
        let nearest = greatest_in_box(simd, sides, [&self.step_x, &self.step_y, &self.first])
            .min(f32x8::simd_from(simd, self.high));
        let rounding = f32x8::simd_from(simd, self.rounding) * 2.0;
        // Half a unit of what is sure, and once more the rounding, are for the rounding here.
        mask_bits(
            splat(simd, -1.5).simd_le(inside) & splat(simd, farthest).simd_le(nearest + rounding),
        )
    }

    /// Of the eight blocks of a tile that begin in a row, those that a triangle may touch and those that it covers,
    /// for sure, and how near it comes in each. A block reaches `side` from its first column and row.
    #[inline(always)]
    pub fn blocks<S: Simd>(&self, simd: S, lane: usize, row: f32, side: f32) -> Blocks<S> {
        let column = numbers(simd) * BLOCK as f32;
        let mut least_of_all = splat(simd, f32::INFINITY);
        let mut greatest_of_all = splat(simd, f32::INFINITY);
        for i in 0..3 {
            let (a, b) = (self.a[i][lane], self.b[i][lane]);
            let e = column.mul_add(splat(simd, a), splat(simd, b * row + self.c[i][lane]));
            greatest_of_all = greatest_of_all.min(e + side * (a.max(0.0) + b.max(0.0)));
            least_of_all = least_of_all.min(e + side * (a.min(0.0) + b.min(0.0)));
        }
        let (x, y) = (self.step_x[lane], self.step_y[lane]);
        let plane = column.mul_add(splat(simd, x), splat(simd, y * row + self.first[lane]));
        let nearest = plane + side * (x.max(0.0) + y.max(0.0));
        // Half a unit of what is sure is for the rounding here.
        Blocks {
            touched: mask_bits(splat(simd, -1.5).simd_le(greatest_of_all)),
            covered: mask_bits(splat(simd, 1.5).simd_lt(least_of_all)),
            nearest: nearest.min(splat(simd, self.high[lane])),
        }
    }
}

/// What a triangle does in eight blocks.
pub struct Blocks<S: Simd> {
    pub touched: u32,
    pub covered: u32,
    pub nearest: f32x8<S>,
}

/// Of eight linear functions of (column, row, 1), the greatest values in a box.
#[inline(always)]
fn greatest_in_box<S: Simd>(
    simd: S,
    [low_u, high_u, low_v, high_v]: [f32; 4],
    [a, b, c]: [&[f32; LANES]; 3],
) -> f32x8<S> {
    let (a, b) = (f32x8::simd_from(simd, *a), f32x8::simd_from(simd, *b));
    let along_u = (a * low_u).max(a * high_u);
    let along_v = (b * low_v).max(b * high_v);
    along_u + along_v + f32x8::simd_from(simd, *c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::lanes::{dispatch, level};
    use crate::cpu::light_grid::{CELL, GRID};
    use crate::cpu::tests::{flat_view, prepared};
    use crate::cpu::tiles::TILE;
    use crate::twin::Random;
    use glam::DVec3;

    /// A triangle around a place, from a thousandth of a unit to thousands of them, often a sliver.
    fn triangle(random: &mut Random, around: DVec2) -> Scene {
        let size = 10f64.powf(7.0 * random.share() - 3.0);
        let mut corner = || {
            let mut signed = || 2.0 * random.share() - 1.0;
            around.extend(0.0) + size * DVec3::new(signed(), signed(), 100.0 * signed() / size)
        };
        let [a, b, mut c] = [corner(), corner(), corner()];
        if random.below(3) == 0 {
            c = a.lerp(b, random.share()) + (c - a) * 10f64.powf(-5.0 * random.share());
        }
        Scene::new(vec![a, b, c], vec![[0, 1, 2]]).unwrap()
    }

    /// A place near an edge of the triangle, or anywhere in the cell around the origin.
    fn place(random: &mut Random, scene: &Scene, origin: DVec2) -> DVec2 {
        let corners = scene.corners(0);
        let i = random.below(3);
        let edge = corners[i].lerp(corners[(i + 1) % 3], random.share()).xy();
        let angle = std::f64::consts::TAU * random.share();
        let near = edge + DVec2::from_angle(angle) * 10f64.powf(5.0 * random.share() - 6.0);
        let half = CELL as f64;
        match (near - origin).abs().max_element() < half {
            true => near,
            false => {
                origin + half * DVec2::new(2.0 * random.share() - 1.0, 2.0 * random.share() - 1.0)
            }
        }
    }

    /// What float64 says: whether a place is inside, and how near the plane is there.
    fn truth(view: &View, scene: &Scene, place: DVec2) -> (bool, f64) {
        let inside = view.nearness_at(scene, place, 0).is_some();
        (inside, view.nearness_of_plane(scene, place, 0))
    }

    #[test]
    fn what_lanes_are_sure_of_is_so_in_float64() {
        let view = flat_view();
        let mut random = Random(1);
        let mut sure = [0; 2];
        for round in 0..200_000 {
            let origin = DVec2::new(random.share(), random.share()) * GRID as f64;
            let scene = triangle(&mut random, origin);
            let places = view.places(&scene);
            let side = 2.0 * CELL as f32;
            let near = origin.as_vec2().to_array();
            let (mut shapes, wide) =
                dispatch!(level(), simd => prepared(simd, &places, &view, near, side));
            let origin = DVec2::new(f64::from(near[0]), f64::from(near[1]));
            if wide
                && !shapes.set_wide(
                    0,
                    (&view, &scene),
                    0,
                    origin,
                    f64::from(side),
                    view.rounding(),
                )
            {
                continue;
            }
            let at = place(&mut random, &scene, origin);
            // Receivers are rounded once, too.
            let step = at.as_vec2() - origin.as_vec2();
            let edges = [0, 1, 2]
                .map(|i| shapes.a[i][0] * step.x + shapes.b[i][0] * step.y + shapes.c[i][0]);
            let least = edges.into_iter().fold(f32::INFINITY, f32::min);
            let (is_inside, nearness) = truth(&view, &scene, at);
            let case = format!("round {round}: {edges:?} at {at}, {:?}", scene.corners(0));
            if least > 1.0 {
                assert!(is_inside, "{case}");
                let plane = shapes.step_x[0] * step.x + shapes.step_y[0] * step.y + shapes.first[0];
                let found = f64::from(plane.max(shapes.low[0]).min(shapes.high[0]));
                let off = (found - nearness).abs();
                assert!(
                    off <= f64::from(shapes.rounding[0]),
                    "{case}: {off} {}",
                    shapes.rounding[0]
                );
                sure[0] += 1;
            } else if least < -1.0 {
                assert!(!is_inside, "{case}");
                sure[1] += 1;
            }
        }
        assert!(sure[0] > 20_000 && sure[1] > 50_000, "{sure:?}");
    }

    #[test]
    fn blocks_that_are_left_out_hold_nothing_of_a_triangle() {
        let view = flat_view();
        let mut random = Random(2);
        let mut counts = [0; 3];
        for round in 0..40_000 {
            let origin = DVec2::new(random.share(), random.share()) * GRID as f64;
            let scene = triangle(&mut random, origin);
            let places = view.places(&scene);
            let column = random.below(TILE / BLOCK);
            let row = random.below(TILE / BLOCK) * BLOCK;
            let first = DVec2::new((column * BLOCK) as f64, row as f64);
            // A corner of a block, which an edge of the triangle nearly passes, or anywhere in it.
            let (corner, within) = match random.below(2) {
                0 => {
                    let within = DVec2::new(random.below(2) as f64, random.below(2) as f64);
                    let within = within * BLOCK as f64;
                    (place(&mut random, &scene, origin) - first - within, within)
                }
                _ => {
                    let share = DVec2::new(random.share(), random.share());
                    let within = DVec2::new(random.share(), random.share());
                    (origin - share * TILE as f64, within * BLOCK as f64)
                }
            };
            let corner = corner.as_vec2();
            let near = corner.to_array();
            let found =
                dispatch!(level(), simd => found_blocks(simd, &places, &view, near, row as f32));
            let Some((touched, covered)) = found else {
                continue;
            };
            let at = corner.as_dvec2() + first + within;
            let (is_inside, _) = truth(&view, &scene, at);
            let case = format!("round {round}: {at}, {:?}", scene.corners(0));
            assert!(!is_inside || touched >> column & 1 != 0, "{case}");
            assert!(is_inside || covered >> column & 1 == 0, "{case}");
            counts[0] += usize::from(touched >> column & 1 == 0);
            counts[1] += usize::from(covered >> column & 1 != 0);
            counts[2] += usize::from(is_inside);
        }
        assert!(counts.iter().all(|&count| count > 500), "{counts:?}");
    }

    #[inline(always)]
    fn found_blocks<S: Simd>(
        simd: S,
        places: &[Place],
        view: &View,
        corner: [f32; 2],
        row: f32,
    ) -> Option<(u32, u32)> {
        let (shapes, wide) = prepared(simd, places, view, corner, TILE as f32);
        let blocks = shapes.blocks(simd, 0, row, BLOCK as f32);
        (!wide).then_some((blocks.touched, blocks.covered))
    }
}
