//! Draws triangles into an image, tile by tile: which one is the nearest at the middle of each pixel.
//!
//! Corners go to the image in float64 and are rounded once; eight triangles are set up at once; a tile's pixels are
//! tested eight at once. Of an edge or a depth that float32 cannot tell, float64 decides at that pixel, so that the
//! image does not depend on the order of the triangles.

use super::bins::{Bin, Bins, Cover, DrawnTiles, TileBin, bins, eights, ids_at, triangles_of};
use super::holes::Holes;
use super::lanes::{
    EPSILON, LANES, Simd, bits, dispatch, f32x8, indices, least, level, mask_bits, mask32x8,
    numbers, splat, u32x8,
};
use super::receiver_tiles::ALL_BLOCKS;
use super::shapes::{Corners, Shapes};
use super::tile_rays::TileRays;
use super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS, Tiling};
use super::view::{Place, View};
use crate::camera::Camera;
use crate::lanes::Each;
use crate::scene::Scene;
use fearless_simd::prelude::*;
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;

/// No triangle.
pub const NONE: u32 = u32::MAX;

/// Of how near a triangle is: what rounding may do to it, as a share, where it is set up in float32.
const MAX_ROUNDING: f32 = 1.0 / 8192.0;

/// Columns and rows of a tile, as far as the middles of pixels go.
const SIDE: f32 = TILE as f32;

/// The nearest triangle of each pixel, in tiles.
#[derive(Debug, Clone)]
pub struct Image {
    pub tiling: Tiling,
    pub triangles: Vec<u32>,
}

impl Image {
    /// What a pixel shows, if anything.
    pub fn triangle_at(&self, x: usize, y: usize) -> Option<u32> {
        let triangle = self.triangles[self.tiling.index(x, y)];
        (triangle != NONE).then_some(triangle)
    }

    /// The image of a coarse camera, whose pixels are every so many of this one's.
    pub fn sampled(&self, coarse: &Camera, first: usize, stride: usize) -> Self {
        let (width, height) = (coarse.width as usize, coarse.height as usize);
        let tiling = Tiling::new(width, height);
        let mut triangles = vec![NONE; tiling.tiles() * TILE_PIXELS];
        for y in 0..height {
            for x in 0..width {
                let fine = self.tiling.index(x * stride + first, y * stride + first);
                triangles[tiling.index(x, y)] = self.triangles[fine];
            }
        }
        Self { tiling, triangles }
    }

    /// Pixels that show something.
    pub fn seen_count(&self) -> u32 {
        let seen = self.triangles.par_iter().filter(|&&id| id != NONE);
        seen.count() as u32
    }

    /// Writes the answers of a block, whose first pixel that is, into the rows of its tile; NaN where nothing is seen. `lit`
    /// is asked for each row of the block.
    #[inline(always)]
    pub fn write<S: Simd>(
        &self,
        simd: S,
        rows: &mut [&mut [f32]],
        (x, y): (usize, usize),
        mut lit: impl FnMut(usize) -> f32x8<S>,
    ) {
        let first = self.tiling.index(x, y);
        let (x, y) = (x % TILE, y % TILE);
        let (none, nothing) = (u32x8::simd_from(simd, NONE), splat(simd, f32::NAN));
        for (i, row) in rows[y..].iter_mut().take(BLOCK).enumerate() {
            let ids = &self.triangles[first + i * TILE..][..BLOCK];
            let is_none = u32x8::from_slice(simd, ids).simd_eq(none);
            let lit = is_none.select(nothing, lit(i)).to_array();
            let row = &mut row[x..];
            match row.first_chunk_mut() {
                Some(row) => *row = lit,
                None => write_end(row, &lit),
            }
        }
    }

    /// The same of a block whose lit pixels are the bits of a number a row.
    #[inline(always)]
    pub fn write_lit<S: Simd>(
        &self,
        simd: S,
        rows: &mut [&mut [f32]],
        pixel: (usize, usize),
        lit: [u32; BLOCK],
    ) {
        self.write(simd, rows, pixel, |i| {
            let lit = mask32x8::from_bitmask(simd, u64::from(lit[i]));
            lit.select(splat(simd, 1.0), splat(simd, 0.0))
        });
    }

    /// Of each pixel the triangle that it shows, row by row; -1 where there is none.
    pub fn triangle_ids(&self) -> Vec<i32> {
        let ids = self.tiling.row_by_row(&self.triangles).into_iter();
        ids.map(|id| id as i32).collect()
    }
}

/// The end of a row that is no whole block. Were it inlined, all blocks would be copied by a call.
#[cold]
#[inline(never)]
fn write_end(row: &mut [f32], lit: &[f32; BLOCK]) {
    row.copy_from_slice(&lit[..row.len()]);
}

/// The nearest triangles of an image.
pub fn rasterize(view: &View, scene: &Scene) -> Image {
    let places = view.places(scene);
    let (painter, bins) = Painter::new(view, scene, &places, Cover::Middles);
    let mut triangles = vec![0; painter.tiling.tiles() * TILE_PIXELS];
    let tiles = triangles.par_chunks_mut(TILE_PIXELS).enumerate();
    tiles.for_each_init(
        || [0.0; TILE_PIXELS],
        |nearness, (tile, ids)| {
            let bins = bins.iter().map(|of_thread| &of_thread[tile]);
            dispatch!(level(), simd => painter.draw_tile(simd, bins, (tile, ALL_BLOCKS), ids, nearness));
        },
    );
    Image {
        tiling: painter.tiling,
        triangles,
    }
}

/// A view whose tiles are drawn.
pub struct Painter<'a> {
    pub view: &'a View,
    pub tiling: Tiling,
    pub scene: &'a Scene,
    pub places: &'a [Place],
}

/// A tile that is being drawn.
pub struct Tile<'a> {
    pub view: &'a View,
    pub scene: &'a Scene,
    /// Its first pixel.
    corner: (usize, usize),
    /// How near what is seen is, and which triangle it is.
    nearness: &'a mut [f32; TILE_PIXELS],
    ids: &'a mut [u32],
    /// No nearer than anything in each block.
    pub farthest: [f32; BLOCKS * BLOCKS],
    /// What rounding may have done to the nearness in each block.
    pub room: [f32; BLOCKS * BLOCKS],
    /// The rays of its texels, where they are no middles of pixels.
    pub rays: Option<&'a TileRays>,
    /// Of the triangle that is being drawn, if it is masked.
    holes: Option<Holes<'a>>,
}

impl<'p> Painter<'p> {
    pub fn new<B: TileBin>(
        view: &'p View,
        scene: &'p Scene,
        places: &'p [Place],
        cover: Cover,
    ) -> (Self, Bins<B>) {
        let tiling = Tiling::new(view.width, view.height);
        Self::of_tiles(view, scene, places, cover, &tiling)
    }

    /// Of those tiles alone that are drawn.
    pub fn of_tiles<B: TileBin>(
        view: &'p View,
        scene: &'p Scene,
        places: &'p [Place],
        cover: Cover,
        drawn: &impl DrawnTiles,
    ) -> (Self, Bins<B>) {
        let tiling = Tiling::new(view.width, view.height);
        let painter = Self {
            view,
            tiling,
            scene,
            places,
        };
        (painter, bins(view, (tiling, drawn), scene, places, cover))
    }

    /// Draws those blocks of a tile, by its number, whose bits are set.
    #[inline(always)]
    pub fn draw_tile<'a, S: Simd>(
        &self,
        simd: S,
        bins: impl Iterator<Item = &'a Bin>,
        (index, blocks): (usize, u64),
        ids: &mut [u32],
        nearness: &mut [f32; TILE_PIXELS],
    ) {
        let corner = self.tiling.corner(index);
        ids.fill(NONE);
        nearness.fill(f32::NEG_INFINITY);
        // What lies beside the image is never seen.
        let width = (self.tiling.width - corner.0).min(TILE);
        let height = (self.tiling.height - corner.1).min(TILE);
        for row in nearness.chunks_exact_mut(TILE).take(height) {
            row[width..].fill(f32::INFINITY);
        }
        nearness[height * TILE..].fill(f32::INFINITY);
        let mut tile = Tile::new(self.view, self.scene, corner, (ids, nearness));
        tile.close(!blocks);
        let origin = [corner.0 as f32 + 0.5, corner.1 as f32 + 0.5];
        let rounding = self.view.rounding();
        for bin in bins {
            for (list, is_wide) in [(&bin.near, false), (&bin.wide, true)] {
                for (places, count) in eights(0..list.len()) {
                    let ids = ids_at(list, places);
                    let eight = self.set_up(simd, ids, is_wide, (origin, SIDE), rounding);
                    let pixels = pixel_boxes(simd, eight.boxes);
                    for lane in 0..count {
                        let pixels = pixels.each(|side| side[lane] as usize);
                        match eight.wide >> lane & 1 {
                            0 => {
                                tile.draw::<S, false>(simd, &eight.shapes, lane, ids[lane], pixels)
                            }
                            _ => tile.draw_wide(simd, ids[lane], pixels),
                        }
                    }
                }
            }
        }
    }

    /// Sets eight triangles up relative to a place, for what is less than `side` from it.
    #[inline(always)]
    pub fn set_up<S: Simd>(
        &self,
        simd: S,
        ids: [u32; LANES],
        is_wide: bool,
        (origin, side): ([f32; 2], f32),
        rounding: f32,
    ) -> EightTriangles<S> {
        let corners = Corners::new(simd, self.places, triangles_of(self.scene, ids));
        let out_of_reach = corners.out_of_reach(simd, self.view);
        let corners = corners.relative_to(origin);
        let (mut shapes, mut wide) = (Shapes::NONE, 0xff);
        if !is_wide {
            shapes = Shapes::new(simd, &corners, rounding, side);
            wide = !shapes.well_known(simd);
        }
        EightTriangles {
            boxes: corners.boxes(simd, out_of_reach, rounding),
            shapes,
            wide,
        }
    }
}

/// Triangles that are set up relative to a place.
pub struct EightTriangles<S: Simd> {
    pub boxes: [f32x8<S>; 4],
    pub shapes: Shapes,
    /// Those that are set up in float64, not here.
    pub wide: u32,
}

/// First and last column and row of the pixels of a tile whose middles eight boxes may hold.
#[inline(always)]
fn pixel_boxes<S: Simd>(simd: S, [x0, x1, y0, y1]: [f32x8<S>; 4]) -> [[u32; LANES]; 4] {
    let (zero, end) = (splat(simd, 0.0), splat(simd, SIDE - 1.0));
    let pixel = |number: f32x8<S>| indices(simd, number.max(zero).min(end));
    [
        pixel(x0.ceil()),
        pixel(x1.floor()),
        pixel(y0.ceil()),
        pixel(y1.floor()),
    ]
}

impl Shapes {
    /// Of which float32 knows well how near they are: one of which it does not would make the others' uncertain.
    #[inline(always)]
    fn well_known<S: Simd>(&self, simd: S) -> u32 {
        let [low, high] = [self.low, self.high].each(|v| f32x8::simd_from(simd, v).abs());
        let rounding = f32x8::simd_from(simd, self.rounding);
        mask_bits(rounding.simd_lt(low.max(high) * MAX_ROUNDING))
    }
}

impl<'a> Tile<'a> {
    pub fn new(
        view: &'a View,
        scene: &'a Scene,
        corner: (usize, usize),
        (ids, nearness): (&'a mut [u32], &'a mut [f32; TILE_PIXELS]),
    ) -> Self {
        Self {
            view,
            scene,
            corner,
            nearness,
            ids,
            farthest: [f32::NEG_INFINITY; BLOCKS * BLOCKS],
            room: [0.0; BLOCKS * BLOCKS],
            rays: None,
            holes: None,
        }
    }

    /// Closes blocks, a bit each: nothing is drawn there.
    #[inline(always)]
    fn close(&mut self, blocks: u64) {
        for block in (0..BLOCKS * BLOCKS).filter(|block| blocks >> block & 1 != 0) {
            let (bx, by) = (block % BLOCKS, block / BLOCKS);
            for row in by * BLOCK..(by + 1) * BLOCK {
                self.nearness[row * TILE + bx * BLOCK..][..BLOCK].fill(f32::INFINITY);
            }
            self.farthest[block] = f32::INFINITY;
        }
    }

    /// Finds what each block holds.
    #[inline(always)]
    pub fn find_farthest<S: Simd>(&mut self, simd: S) {
        for block in 0..BLOCKS * BLOCKS {
            self.farthest[block] = self.farthest_of_block(simd, block % BLOCKS, block / BLOCKS);
        }
    }

    #[inline(never)]
    fn draw_wide<S: Simd>(&mut self, simd: S, id: u32, pixels: [usize; 4]) {
        let seen = (self.view, self.scene);
        if let Some(shapes) = Shapes::wide(seen, id, self.origin(), f64::from(SIDE), 0.0) {
            simd.vectorize(
                #[inline(always)]
                || self.draw::<S, true>(simd, &shapes, 0, id, pixels),
            );
        }
    }

    #[inline(always)]
    fn draw<S: Simd, const IS_WIDE: bool>(
        &mut self,
        simd: S,
        shapes: &Shapes,
        lane: usize,
        id: u32,
        [x0, x1, y0, y1]: [usize; 4],
    ) {
        self.find_holes(id);
        let (bx0, bx1, by0, by1) = (x0 / BLOCK, x1 / BLOCK, y0 / BLOCK, y1 / BLOCK);
        let columns = (0xff << bx0) & (0xff >> (BLOCKS - 1 - bx1));
        let is_small = bx1 - bx0 + by1 - by0 <= 1;
        for by in by0..=by1 {
            let rows = y0.max(by * BLOCK)..y1.min(by * BLOCK + BLOCK - 1) + 1;
            let farthest = &self.farthest[by * BLOCKS..(by + 1) * BLOCKS];
            let farthest = f32x8::from_slice(simd, farthest);
            let (mut blocks, mut covered) = (columns, 0);
            let mut nearest = splat(simd, shapes.high[lane]);
            if !is_small {
                let found = shapes.blocks(simd, lane, (by * BLOCK) as f32, BLOCK as f32 - 1.0);
                (blocks, covered, nearest) = (blocks & found.touched, found.covered, found.nearest);
            }
            blocks &= mask_bits(farthest.simd_le(nearest + self.room_of(simd, shapes, lane, by)));
            for bx in bits(blocks) {
                let (is_covered, rows) = (covered >> bx & 1 != 0, rows.clone());
                let finds_farthest = is_covered || rows.len() == BLOCK;
                let shape = (shapes, lane, is_covered);
                if self.draw_in_block::<S, IS_WIDE, false>(simd, shape, id, bx, rows)
                    && finds_farthest
                {
                    self.farthest[by * BLOCKS + bx] = self.farthest_of_block(simd, bx, by);
                }
            }
        }
    }

    /// How much farther than a triangle what blocks of a row hold may be, and yet be behind it.
    #[inline(always)]
    pub fn room_of<S: Simd>(&self, simd: S, shapes: &Shapes, lane: usize, by: usize) -> f32x8<S> {
        let known = f32x8::from_slice(simd, &self.room[by * BLOCKS..(by + 1) * BLOCKS]);
        let own = splat(simd, shapes.rounding[lane]);
        known.max(own) + own
    }

    /// Draws into some rows of a block, which is covered or not, and tells whether it may have won a pixel.
    #[inline(always)]
    pub fn draw_in_block<S: Simd, const IS_WIDE: bool, const HAS_RAYS: bool>(
        &mut self,
        simd: S,
        (shapes, lane, is_covered): (&Shapes, usize, bool),
        id: u32,
        bx: usize,
        rows: Range<usize>,
    ) -> bool {
        match is_covered {
            true => self.draw_block::<S, IS_WIDE, true, HAS_RAYS>(simd, shapes, lane, id, bx, rows),
            false => {
                self.draw_block::<S, IS_WIDE, false, HAS_RAYS>(simd, shapes, lane, id, bx, rows)
            }
        }
    }

    /// The same where what is covered is known when it is compiled. With `HAS_RAYS` columns and rows are those
    /// of the rays.
    #[inline(always)]
    fn draw_block<S: Simd, const IS_WIDE: bool, const IS_COVERED: bool, const HAS_RAYS: bool>(
        &mut self,
        simd: S,
        shapes: &Shapes,
        lane: usize,
        id: u32,
        bx: usize,
        rows: Range<usize>,
    ) -> bool {
        let x = numbers(simd) + (bx * BLOCK) as f32;
        let Shapes { a, b, c, .. } = shapes;
        let edges = [0, 1, 2].each(|i| x.mul_add(splat(simd, a[i][lane]), splat(simd, c[i][lane])));
        let b = [b[0][lane], b[1][lane], b[2][lane]];
        let along = x.mul_add(
            splat(simd, shapes.step_x[lane]),
            splat(simd, shapes.first[lane]),
        );
        let step_y = shapes.step_y[lane];
        let (low, high) = (
            splat(simd, shapes.low[lane]),
            splat(simd, shapes.high[lane]),
        );
        let rounding = splat(simd, shapes.rounding[lane]);
        let block = rows.start / BLOCK * BLOCKS + bx;
        self.room[block] = self.room[block].max(shapes.rounding[lane]);
        let room = rounding + self.room[block];
        let (far, near) = self.view.seen;
        let (far, near) = (splat(simd, far as f32), splat(simd, near as f32));
        let id_of_all = u32x8::simd_from(simd, id);
        let mut may_win_any = false;
        for row in rows {
            let y = row as f32;
            let place = row * TILE + bx * BLOCK;
            let old = f32x8::from_slice(simd, &self.nearness[place..place + LANES]);
            let at_rays = match self.rays {
                Some(rays) if HAS_RAYS => Some(rays.eight(simd, place)),
                _ => None,
            };
            let plane = match at_rays {
                Some((x, y)) => {
                    let (step_x, first) = (shapes.step_x[lane], shapes.first[lane]);
                    let at_row = y.mul_add(splat(simd, step_y), splat(simd, first));
                    x.mul_add(splat(simd, step_x), at_row)
                }
                None => along + step_y * y,
            };
            let new = plane.max(low).min(high);
            let mut may_win = old.simd_le(new + room);
            let mut wins = old.simd_lt(new - room);
            if !IS_COVERED {
                let e = match at_rays {
                    Some((x, y)) => least([0, 1, 2].each(|i| {
                        let rest = y.mul_add(splat(simd, b[i]), splat(simd, c[i][lane]));
                        x.mul_add(splat(simd, a[i][lane]), rest)
                    })),
                    None => least([
                        edges[0] + b[0] * y,
                        edges[1] + b[1] * y,
                        edges[2] + b[2] * y,
                    ]),
                };
                may_win &= splat(simd, -1.0).simd_le(e);
                wins &= splat(simd, 1.0).simd_lt(e);
            }
            if IS_WIDE {
                may_win &= far.simd_le(new + rounding) & (new - rounding).simd_le(near);
                wins &= far.simd_lt(new - rounding) & (new + rounding).simd_lt(near);
            }
            let (may_win, won) = (mask_bits(may_win), mask_bits(wins));
            if may_win == 0 {
                continue;
            }
            may_win_any = true;
            if self.holes.is_some() {
                wins = mask32x8::from_bitmask(simd, u64::from(self.solid(place, won)));
            }
            let held = &mut self.nearness[place..place + LANES];
            wins.select(new, old).store_slice(held);
            let ids = &mut self.ids[place..place + LANES];
            let known = u32x8::from_slice(simd, ids);
            wins.select(id_of_all, known).store_slice(ids);
            for i in bits(may_win & !won) {
                self.decide(place + i, id);
            }
        }
        may_win_any
    }

    /// Sets up what masks the triangle that is drawn next.
    #[inline(always)]
    pub fn find_holes(&mut self, id: u32) {
        if self.scene.masks().is_some() {
            self.holes = Holes::new(self.view, self.scene, id, self.origin());
        }
    }

    /// What places are relative to: that of the rays, or the middle of the first pixel.
    pub fn origin(&self) -> DVec2 {
        match self.rays {
            Some(rays) => rays.origin(),
            None => DVec2::new(self.corner.0 as f64, self.corner.1 as f64) + 0.5,
        }
    }

    /// The place of a pixel relative to the origin.
    fn offset(&self, place: usize) -> DVec2 {
        match self.rays {
            Some(rays) => rays.offset(place),
            None => DVec2::new((place % TILE) as f64, (place / TILE) as f64),
        }
    }

    /// Those of eight pixels that do not fall in a hole of the triangle.
    #[inline(never)]
    fn solid(&self, first: usize, pixels: u32) -> u32 {
        let Some(holes) = &self.holes else {
            return pixels;
        };
        let is_solid = |place: usize| !holes.has_at(self.offset(place));
        let solid = bits(pixels).filter(|i| is_solid(first + i));
        solid.fold(0, |solid, i| solid | 1 << i)
    }

    /// A pixel that float32 leaves open.
    #[inline(never)]
    fn decide(&mut self, place: usize, id: u32) {
        let middle = self.origin() + self.offset(place);
        let (view, scene) = (self.view, self.scene);
        let Some(new) = view.nearness_even_edge_on(scene, middle, id) else {
            return;
        };
        let known = self.ids[place];
        let is_nearest = known == NONE || {
            let old = view.nearness_of_plane(scene, middle, known);
            new > old || new == old && id < known
        };
        if is_nearest && !view.is_edge_on(scene, id) {
            self.ids[place] = id;
            self.nearness[place] = new as f32;
            let block = place / TILE / BLOCK * BLOCKS + place % TILE / BLOCK;
            self.room[block] = self.room[block].max(new.abs() as f32 * EPSILON);
        }
    }

    #[inline(always)]
    pub fn farthest_of_block<S: Simd>(&self, simd: S, bx: usize, by: usize) -> f32 {
        let mut least = splat(simd, f32::INFINITY);
        for row in by * BLOCK..(by + 1) * BLOCK {
            let place = row * TILE + bx * BLOCK;
            least = least.min(f32x8::from_slice(
                simd,
                &self.nearness[place..place + LANES],
            ));
        }
        least.reduce_min()
    }
}
