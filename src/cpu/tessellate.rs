//! Triangles to pieces with straight edges in the map, as `shaders/tessellate.wgsl`: what comes before a linear
//! rasterization.
//!
//! Corners go through projection and warp. A triangle whose edges are too long in the map is split at their middles, and so
//! are its parts. An edge alone tells whether and where it is split, so that neighbours fit without cracks.

use super::warp_map::WarpMap;
use crate::error::{Error, Result};
use crate::geometry::is_before;
use crate::lanes::V2;
use crate::projection::Projection;
use crate::rounding::FUNCTION_ROUNDING;
use crate::scene::Scene;
use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Maps from the middle to the sides of the band that far triangles are cut to.
const BAND: f64 = 16.0;

/// Sides that triangles are cut at: the end of the projection, and those of the band. Of a paraboloid, whose places are all
/// near the map, only the rim.
const CUTS: usize = 5;

/// Halvings of an edge. Its parts are far within their rounding then.
const MAX_ROUNDS: u32 = 48;

/// Pieces of a map: there are some 300 bytes of each in memory.
const MAX_PIECES: usize = 1 << 21;

/// Triangles that are split in one job.
const CHUNK: usize = 256;

/// A corner in the map.
struct Corner {
    /// Column, row and depth, and what depths are divided by before they are interpolated.
    place: DVec4,
    /// Before the warp, from 0 to 1 on the map.
    linear: DVec2,
    /// Of the map that it is beyond, a bit each.
    sides: u32,
}

/// A piece of a triangle.
pub struct Piece {
    /// Column, row, depth, and what depths are divided by before they are interpolated.
    pub corners: [DVec4; 3],
    pub triangle: u32,
}

struct Tessellation<'a> {
    projection: &'a Projection,
    warp: Option<&'a WarpMap>,
    /// As a share of the map; infinite where nothing is split.
    longest_edge: f64,
    /// How wide a function of the warp is: between two of them the map is torn. 0 where there is one.
    seam_width: f64,
    /// In the linear map a triangle of less than this area, doubled, is not split.
    thin: f64,
}

/// The pieces of all triangles, in their order.
pub fn tessellate(
    projection: &Projection,
    warp: Option<&WarpMap>,
    scene: &Scene,
    longest_edge: Option<f64>,
) -> Result<Vec<Piece>> {
    let tessellation = Tessellation::new(projection, warp, longest_edge);
    let count = AtomicUsize::new(0);
    let chunks = scene.triangles().par_chunks(CHUNK).enumerate();
    let pieces = chunks.map(|(chunk, triangles)| {
        let mut pieces = Vec::new();
        for i in 0..triangles.len() {
            let known = pieces.len();
            tessellation.split((chunk * CHUNK + i) as u32, scene, &mut pieces);
            let made = pieces.len() - known;
            if count.fetch_add(made, Ordering::Relaxed) + made > MAX_PIECES {
                return Err(Error::Device(format!(
                    "tessellation makes more than {MAX_PIECES} pieces of triangles, which is as many as the CPU \
                     engine keeps; a larger share of the map makes fewer"
                )));
            }
        }
        Ok(pieces)
    });
    let pieces: Vec<Vec<Piece>> = pieces.collect::<Result<_>>()?;
    Ok(pieces.into_iter().flatten().collect())
}

impl<'a> Tessellation<'a> {
    fn new(
        projection: &'a Projection,
        warp: Option<&'a WarpMap>,
        longest_edge: Option<f64>,
    ) -> Self {
        let side = f64::from(projection.width.min(projection.height));
        // As the shader knows places, so that both engines split alike.
        let rounding = FUNCTION_ROUNDING * (1.0 + projection.centre.abs().max_element() / side);
        let functions = warp.map_or(1, |warp| warp.warp.functions);
        let seam_width = match functions {
            1 => 0.0,
            functions => 1.0 / functions as f64,
        };
        let longest_edge = longest_edge.map_or(f64::INFINITY, |share| share.max(rounding));
        Self {
            projection,
            warp,
            longest_edge,
            seam_width,
            thin: (seam_width * seam_width / 16.0).max(rounding * longest_edge),
        }
    }

    fn size(&self) -> DVec2 {
        DVec2::new(self.projection.width.into(), self.projection.height.into())
    }

    fn homogeneous_texel(&self, q: DVec3) -> DVec3 {
        self.projection.kind.homogeneous_texel(q.into()).into()
    }

    fn corner(&self, q: DVec3) -> Corner {
        let kind = &self.projection.kind;
        let centred = DVec2::from(kind.centred_texel_from_projected(q.into()));
        let linear = (centred + self.projection.centre) / self.size();
        let mut place = linear;
        if let Some(WarpMap { warp, .. }) = self.warp {
            // Beyond its ends a warp moves nothing.
            let inside = linear.clamp(DVec2::ZERO, DVec2::ONE);
            let (warped, _) = warp.warped_from_linear::<f64>(V2::from(inside));
            place = DVec2::from(warped) + (linear - inside);
        }
        let sides = [
            linear.x < 0.0,
            linear.y < 0.0,
            linear.x > 1.0,
            linear.y > 1.0,
        ];
        let bits = sides.iter().enumerate();
        let DVec2 { x, y } = place * self.size();
        let depth = kind.depth_from_projected(q.into());
        Corner {
            place: DVec4::new(x, y, depth, self.homogeneous_texel(q).z),
            linear,
            sides: bits.fold(0, |bits, (i, &is_beyond)| bits | u32::from(is_beyond) << i),
        }
    }

    fn is_too_long(&self, a: &Corner, b: &Corner) -> bool {
        let in_map = (a.place - b.place).xy() / self.size();
        let step = (a.linear - b.linear).abs().max_element();
        // What lies beyond one side of the map needs no better edge.
        in_map.length() > self.longest_edge && a.sides & b.sides == 0 && step > self.seam_width
    }

    /// Of an edge in the linear map; from the same end for both triangles at it.
    fn middle(&self, a: DVec3, b: DVec3) -> DVec3 {
        let (from, to) = if is_before(b, a) { (b, a) } else { (a, b) };
        let [w, to_w] = [from, to].map(|end| self.homogeneous_texel(end).z);
        from.lerp(to, w / (w + to_w))
    }

    /// Positive on the side of a cut that is kept: before the end of the projection, or within the band. Linear in `q`.
    fn side_of_cut(&self, q: DVec3, cut: usize) -> f64 {
        let texel = self.homogeneous_texel(q);
        let reach = self.size() * (BAND * texel.z);
        match cut {
            0 => self
                .projection
                .kind
                .side_from_projected(self.projection, q.into()),
            1 => reach.x + texel.x,
            2 => reach.y + texel.y,
            3 => reach.x - texel.x,
            _ => reach.y - texel.y,
        }
    }

    fn crossing(&self, a: DVec3, b: DVec3, cut: usize) -> DVec3 {
        let (from, to) = if is_before(b, a) { (b, a) } else { (a, b) };
        let [side, to_side] = [from, to].map(|end| self.side_of_cut(end, cut));
        from.lerp(to, side / (side - to_side))
    }

    /// Cuts a triangle where its projection ends or far off the map (Sutherland and Hodgman, "Reentrant polygon clipping",
    /// 1974), and splits what is left.
    fn split(&self, triangle: u32, scene: &Scene, pieces: &mut Vec<Piece>) {
        let corners = scene.corners(triangle);
        let mut polygon =
            Vec::from(corners.map(|corner| self.projection.projected_from_point(corner)));
        let cuts = match self.projection.kind.has_straight_edges() {
            true => CUTS,
            false => 1,
        };
        for cut in 0..cuts {
            let is_kept = |q: DVec3| self.side_of_cut(q, cut) > 0.0;
            if polygon.iter().all(|&q| is_kept(q)) {
                continue;
            }
            let mut kept = Vec::new();
            for (i, &a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                if is_kept(a) {
                    kept.push(a);
                }
                if is_kept(a) != is_kept(b) {
                    kept.push(self.crossing(a, b, cut));
                }
            }
            polygon = kept;
        }
        for i in 2..polygon.len() {
            let mut open = vec![([polygon[0], polygon[i - 1], polygon[i]], 0)];
            while let Some((corners, round)) = open.pop() {
                self.settle(triangle, corners, round, &mut open, pieces);
                if pieces.len() > MAX_PIECES {
                    return;
                }
            }
        }
    }

    /// Keeps a piece, or splits it at the middles of its long edges.
    fn settle(
        &self,
        triangle: u32,
        q: [DVec3; 3],
        round: u32,
        open: &mut Vec<([DVec3; 3], u32)>,
        pieces: &mut Vec<Piece>,
    ) {
        let corners = q.map(|q| self.corner(q));
        let [a, b, c] = &corners;
        // A corner in the light has no place: not a number.
        let has_places = corners.iter().all(|corner| corner.place.is_finite());
        if a.sides & b.sides & c.sides != 0 || !has_places {
            return;
        }
        let is_long = [(a, b), (b, c), (c, a)].map(|(a, b)| self.is_too_long(a, b));
        let long = is_long.iter().filter(|&&is_long| is_long).count();
        // And what is thinner than its rounding has no end either.
        let area = (b.linear - a.linear).perp_dot(c.linear - a.linear).abs();
        if long == 0 || area < self.thin || round == MAX_ROUNDS {
            let corners = corners.map(|corner| corner.place);
            pieces.push(Piece { corners, triangle });
            return;
        }
        // Turned so that the first edge is long, and the last one is not if another is not.
        let first = match (long, is_long) {
            (1, [_, true, _]) | (2, [false, ..]) => 1,
            (1, [.., true]) | (2, [_, false, _]) => 2,
            _ => 0,
        };
        let [a, b, c] = [0, 1, 2].map(|i| q[(first + i) % 3]);
        let (ab, bc, ca) = (self.middle(a, b), self.middle(b, c), self.middle(c, a));
        let parts: &[[DVec3; 3]] = match long {
            1 => &[[a, ab, c], [ab, b, c]],
            2 => &[[ab, b, bc], [a, ab, bc], [a, bc, c]],
            _ => &[[ab, b, bc], [a, ab, ca], [ca, bc, c], [ab, bc, ca]],
        };
        open.extend(parts.iter().map(|&part| (part, round + 1)));
    }
}
