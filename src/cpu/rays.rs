//! Where the rays of a map's texels lie. Every map is a table of rays: of a light matrix they are a regular grid; a warp
//! moves each to a place of its own, and a paraboloid looks to all sides, so that its rays lie in the planes of up to six
//! faces of a cube around the light. Triangles are drawn at the rays as at the middles of pixels, and nothing is
//! clipped.

use super::bins::{eights, ids_at};
use super::lanes::{LANES, Simd, bits, f32x8, f64x8, mask_bits, numbers, splat};
use super::rasterize::{Painter, Tile};
use super::ray_bins::RayBins;
use super::shapes::Shapes;
use super::tile_rays::{Places, Taken, TileRays};
use super::tiles::{BLOCKS, TILE, TILE_PIXELS, Tiling};
use super::view::{Nearness, View, cube_views};
use super::warp_map::{CpuWarp, WarpMap};
use crate::lanes::{Each, V2, V3};
use crate::map_size::MapSize;
use crate::projection::Projection;
use crate::sides::Source;
use crate::warp::Warping;
use fearless_simd::prelude::*;
use glam::{DVec2, DVec3};

/// Blocks in a row, and rows of them, that the box of a triangle meets, together, at most: of more those are left out that
/// the triangle does not touch.
const MAX_BLOCKS_UNTESTED: u32 = 3;

impl Painter<'_> {
    /// Draws the triangles of bins at rays into the texels that are open: what is held there is `-INFINITY`, elsewhere
    /// `INFINITY`. `has_closed`: whether some are not.
    #[inline(always)]
    pub fn draw_at_rays<S: Simd>(
        &self,
        simd: S,
        bins: &RayBins,
        rays: &TileRays,
        (ids, nearness): (&mut [u32], &mut [f32; TILE_PIXELS]),
        has_closed: bool,
    ) {
        let mut tile = Tile::new(self.view, self.scene, (0, 0), (ids, nearness));
        tile.rays = Some(rays);
        if has_closed {
            tile.find_farthest(simd);
        }
        let (near, wide) = self.near_rays(simd, bins, rays);
        let rounding = 2.0 * self.view.rounding();
        for (list, is_wide) in [(&near, false), (&wide, true)] {
            for (places, count) in eights(0..list.len()) {
                let ids = ids_at(list, places);
                let place = (rays.origin, rays.side);
                let eight = self.set_up(simd, ids, is_wide, place, rounding);
                let boxes = eight.boxes.each(|side| side.to_array());
                for lane in 0..count {
                    let sides = boxes.each(|side| side[lane]);
                    let shape = (&eight.shapes, lane, sides);
                    match eight.wide >> lane & 1 {
                        0 => tile.draw_at_rays::<S, false>(simd, shape, ids[lane], rays),
                        _ => tile.draw_wide_at_rays(simd, ids[lane], sides, rays),
                    }
                }
            }
        }
    }
}

impl Tile<'_> {
    #[inline(never)]
    fn draw_wide_at_rays<S: Simd>(&mut self, simd: S, id: u32, sides: [f32; 4], rays: &TileRays) {
        let (seen, side) = ((self.view, self.scene), f64::from(rays.side));
        let rounding = self.view.rounding();
        if let Some(shapes) = Shapes::wide(seen, id, rays.origin(), side, rounding) {
            simd.vectorize(
                #[inline(always)]
                || self.draw_at_rays::<S, true>(simd, (&shapes, 0, sides), id, rays),
            );
        }
    }

    #[inline(always)]
    fn draw_at_rays<S: Simd, const IS_WIDE: bool>(
        &mut self,
        simd: S,
        (shapes, lane, sides): (&Shapes, usize, [f32; 4]),
        id: u32,
        rays: &TileRays,
    ) {
        self.find_holes(id);
        let block_rows = rays.rows_of_box(simd, sides);
        for by in bits(block_rows) {
            let farthest = f32x8::from_slice(simd, &self.farthest[by * BLOCKS..][..LANES]);
            let room = self.room_of(simd, shapes, lane, by);
            let near = farthest.simd_le(room + shapes.high[lane]);
            let met = mask_bits(near) & rays.blocks_of_box(simd, by, sides);
            if met == 0 {
                continue;
            }
            let (mut blocks, mut covered) = (met, 0);
            // In few blocks it is sooner drawn than tested against them.
            if met.count_ones() + block_rows.count_ones() > MAX_BLOCKS_UNTESTED {
                let found = rays.blocks(simd, (shapes, lane), by);
                let (touched, nearest) = (found.0, found.2);
                blocks &= touched & mask_bits(farthest.simd_le(nearest + room));
                covered = found.1;
            }
            for bx in bits(blocks) {
                let shape = (shapes, lane, covered >> bx & 1 != 0);
                let rows = rays.rows_of_block(simd, (bx, by), sides);
                if self.draw_in_block::<S, IS_WIDE, true>(simd, shape, id, bx, rows) {
                    self.farthest[by * BLOCKS + bx] = self.farthest_of_block(simd, bx, by);
                }
            }
        }
    }
}

/// How the texels of a map take their rays, where that is not by a regular grid.
pub struct RayTable<'a> {
    projection: &'a Projection,
    warp: Option<&'a CpuWarp>,
    /// What sees the rays, where edges are not straight in the map itself.
    straightened: Option<Projection>,
    /// The faces of a cube around the light, where rays go to all sides.
    pub faces: Option<Vec<View>>,
}

impl<'a> RayTable<'a> {
    /// `None` where rays are a regular grid.
    pub fn new(
        projection: &'a Projection,
        warp: Option<&'a CpuWarp>,
        light: Source,
    ) -> Option<Self> {
        let straightened = projection.kind.straightened(projection);
        let seen = straightened.as_ref().unwrap_or(projection);
        let faces = seen.homogeneous_rows().is_none().then(|| {
            let side = projection.size().longer() as usize;
            cube_views(projection.origin, light, side)
                .map(|view| scaled(view, side))
                .collect()
        });
        (warp.is_some() || faces.is_some() || straightened.is_some()).then_some(Self {
            projection,
            warp,
            straightened,
            faces,
        })
    }

    /// Of the map.
    pub fn tiling(&self) -> Tiling {
        let MapSize { width, height } = self.projection.size();
        Tiling::new(width as usize, height as usize)
    }

    /// Where the ray of a place in the map is in the view that sees it.
    fn seen_place(&self, place: DVec2) -> DVec2 {
        let Some(straightened) = &self.straightened else {
            return place;
        };
        let ray = self
            .projection
            .kind
            .ray_from_texel((place - self.projection.centre).into());
        // Where it crosses the plane of places.
        let point = V3::new(ray.x, ray.y, 0.0);
        let texel = straightened.kind.centred_texel_from_projected(point);
        DVec2::from(texel) + straightened.centre
    }

    /// The places of a tile's texels before the projection's own rays, in texels.
    #[inline(always)]
    fn linear_places<S: Simd>(&self, simd: S, (x, y): (usize, usize)) -> Places {
        let size = self.projection.size();
        let last = [size.width, size.height].map(|texels| splat(simd, texels as f32 - 1.0));
        let mut places = [[0.0; TILE_PIXELS]; 2];
        let scales = match self.warp {
            None => DVec2::ONE,
            Some(_) => size.texels(),
        };
        // Most eights are of one function along y.
        let functions = self.warp.and_then(Warping::functions);
        let shared: [_; BLOCKS] = std::array::from_fn(|i| {
            let map = functions?;
            let columns = x + i * LANES..x + (i + 1) * LANES;
            let function = map.warp.function_of_columns(&map.inverses, columns)?;
            Some((map, function))
        });
        for first in (0..TILE_PIXELS).step_by(LANES) {
            let (column, row) = (x + first % TILE, y + first / TILE);
            let texel = V2::new(numbers(simd) + column as f32, splat(simd, row as f32));
            let texel = V2::new(texel.x.min(last[0]), texel.y.min(last[1]));
            let of_one = shared[first % TILE / LANES].filter(|_| row < size.height as usize);
            let linear = match (of_one, self.warp) {
                (Some((WarpMap { warp, inverses }, function)), _) => {
                    let (x, y) = warp.linear_from_row(inverses, function, [column, row]);
                    V2::new(f32x8::simd_from(simd, *x), splat(simd, y))
                }
                (None, None) => texel.map(|texel| texel + 0.5),
                (None, Some(warp)) => warp.linear_from_texel(texel),
            };
            let along_axes = [(linear.x, scales.x), (linear.y, scales.y)];
            for (places, (linear, scale)) in places.iter_mut().zip(along_axes) {
                let linear: [f32; LANES] = linear.into();
                let place = f64x8::simd_from(simd, linear.map(f64::from)) * scale;
                place.store_slice(&mut places[first..first + LANES]);
            }
        }
        places
    }

    /// Gives the rays of a tile's blocks in the plane of each view that some of them fall in: the view's number, the rays
    /// and the texels that have them.
    #[inline(always)]
    pub fn for_each_view<S: Simd>(
        &self,
        simd: S,
        (corner, blocks): ((usize, usize), u64),
        rays: &mut TileRays,
        mut draw: impl FnMut(usize, &TileRays, &Taken),
    ) {
        let tiling = self.tiling();
        let inside = Taken::inside(corner, (tiling.width, tiling.height)).of_blocks(blocks);
        let mut places = self.linear_places(simd, corner);
        let Some(faces) = &self.faces else {
            if self.straightened.is_some() {
                self.straighten(&mut places);
            }
            if rays.set(simd, &places, &inside) {
                draw(0, rays, &inside);
            }
            return;
        };
        let steps = self.projection.steps();
        let directions: [DVec3; TILE_PIXELS] = std::array::from_fn(|i| {
            let centred = DVec2::new(places[0][i], places[1][i]) - self.projection.centre;
            let kind = &self.projection.kind;
            steps * DVec3::from(kind.direction_from_texel(centred.into()))
        });
        let face_of = directions.map(face_of);
        for (face, view) in faces.iter().enumerate() {
            let mut taken = Taken::NONE;
            for i in (0..TILE_PIXELS).filter(|&i| face_of[i] == face && inside.has(i)) {
                taken.add(i);
                let row = |k: usize| view.rows[k].truncate().dot(directions[i]);
                (places[0][i], places[1][i]) = (row(0) / row(2), row(1) / row(2));
            }
            if rays.set(simd, &places, &taken) {
                draw(face, rays, &taken);
            }
        }
    }

    /// Takes places to where the view sees their rays.
    #[inline(never)]
    fn straighten(&self, places: &mut Places) {
        let [x, y] = places;
        for (x, y) in x.iter_mut().zip(y) {
            [*x, *y] = self.seen_place(DVec2::new(*x, *y)).to_array();
        }
    }
}

/// The face of a cube that a direction falls in, as `faces_around` counts them.
fn face_of(direction: DVec3) -> usize {
    let [x, y, z] = direction.abs().to_array();
    let axis = match (y <= x && z <= x, z <= y) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    };
    2 * axis + usize::from(direction[axis] < 0.0)
}

/// A face of a cube, from -1 to 1 along its sides, with so many columns and rows.
fn scaled(view: View, side: usize) -> View {
    let [x, y, ahead] = view.rows;
    let half = 0.5 * side as f64;
    debug_assert_eq!(view.nearness, Nearness::Inverse);
    View {
        rows: [(x + ahead) * half, (y + ahead) * half, ahead],
        ..view
    }
}
