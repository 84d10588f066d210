//! Draws the samples of those pixels of a tile that may see several triangles: a triangle is set up once for all of them.

use super::super::holes::Holes;
use super::super::lanes::{
    EPSILON, LANES, Simd, bits, f32x8, least, mask_bits, mask32x8, splat, u32x8,
};
use super::super::rasterize::{NONE, Painter};
use super::super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS};
use super::cover::TileCover;
use super::pattern::{MAX_EIGHTS, Pattern};
use super::squares::{InSquares, SetUp, Squares, each_triangle};
use crate::lanes::Each;
use fearless_simd::prelude::*;
use glam::DVec2;

/// What is surely inside or outside, with room for the rounding of a sample's place.
const SURE: f32 = 1.25;

/// The samples of the mixed pixels of a tile; kept for the next one, since they are many.
#[derive(Default)]
pub struct DrawnSamples {
    /// Of each pixel of the tile its number among the mixed ones.
    slots: Vec<u16>,
    /// Of each mixed pixel and sample, in eights: how near what it sees is, and which triangle that is.
    nearness: Vec<f32>,
    ids: Vec<u32>,
    /// What rounding may have done to the nearness.
    room: f32,
}

/// A triangle at the samples of any pixel, relative to the pixel's centre.
struct AtSamples<S: Simd> {
    edges: [[f32x8<S>; 3]; MAX_EIGHTS],
    plane: [f32x8<S>; MAX_EIGHTS],
}

impl<S: Simd> AtSamples<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        Self {
            edges: [[zero; 3]; MAX_EIGHTS],
            plane: [zero; MAX_EIGHTS],
        }
    }

    #[inline(always)]
    fn set(&mut self, simd: S, squares: &Squares<S>, pattern: &Pattern) {
        for eight in 0..pattern.eights() {
            let [x, y] = pattern.places(simd, eight);
            self.edges[eight] = [0, 1, 2].each(
                #[inline(always)]
                |i| x.mul_add(squares.a[i], y * squares.b[i]),
            );
            self.plane[eight] = x.mul_add(squares.step_x, y * squares.step_y);
        }
    }
}

/// What is drawn, and where.
#[derive(Clone, Copy)]
pub struct SampledTile<'a> {
    pub painter: &'a Painter<'a>,
    pub pattern: &'a Pattern,
    pub cover: &'a TileCover,
    /// The tile's first pixel.
    pub corner: (usize, usize),
}

impl DrawnSamples {
    /// The triangles that the samples of a mixed pixel see, in eights.
    pub fn of_pixel(&self, place: usize, eights: usize) -> &[u32] {
        let count = eights * LANES;
        &self.ids[usize::from(self.slots[place]) * count..][..count]
    }

    #[inline(always)]
    pub fn draw<S: Simd>(&mut self, simd: S, tile: SampledTile) {
        let SampledTile {
            painter,
            pattern,
            cover,
            corner,
        } = tile;
        let eights = pattern.eights();
        self.slots.resize(TILE_PIXELS, 0);
        let mut count = 0;
        for (row, &mixed) in cover.mixed.iter().enumerate() {
            for column in ones(mixed) {
                self.slots[row * TILE + column] = count;
                count += 1;
            }
        }
        self.room = 0.0;
        self.ids.clear();
        self.ids.resize(usize::from(count) * eights * LANES, NONE);
        self.nearness.clear();
        // What stands for no sample is never seen.
        let last = pattern.lanes(eights - 1);
        for _ in 0..count {
            let new = self.nearness.len() + (eights - 1) * LANES;
            self.nearness.resize(new, f32::NEG_INFINITY);
            let is_sample = |lane| last >> lane & 1 != 0;
            let of = |lane| [f32::INFINITY, f32::NEG_INFINITY][usize::from(is_sample(lane))];
            self.nearness.extend((0..LANES).map(of));
        }
        if count == 0 {
            return;
        }
        let mut at_samples = AtSamples::none(simd);
        each_triangle(
            simd,
            painter,
            corner,
            &cover.drawn(),
            #[inline(always)]
            |set_up| self.draw_triangle(simd, tile, &set_up, &mut at_samples),
        );
    }

    #[inline(always)]
    fn draw_triangle<S: Simd>(
        &mut self,
        simd: S,
        tile: SampledTile,
        set_up: &SetUp,
        at_samples: &mut AtSamples<S>,
    ) {
        let SampledTile { pattern, cover, .. } = tile;
        let [x0, x1, y0, y1] = set_up.pixels;
        let (bx0, bx1, by0, by1) = (x0 / BLOCK, x1 / BLOCK, y0 / BLOCK, y1 / BLOCK);
        let is_small = bx1 - bx0 + by1 - by0 <= 1;
        let squares = Squares::new(simd, set_up, tile.painter.view.seen);
        let mut is_met = false;
        let mut holes = Vec::new();
        for by in by0..=by1 {
            let mut blocks = (0xff << bx0) & (0xff >> (BLOCKS - 1 - bx1));
            if !is_small {
                let row = (by * BLOCK) as f32;
                let found = set_up.shapes.blocks(simd, set_up.lane, row, BLOCK as f32);
                blocks &= found.touched;
            }
            for row in y0.max(by * BLOCK)..y1.min(by * BLOCK + BLOCK - 1) + 1 {
                if cover.mixed[row] == 0 {
                    continue;
                }
                for bx in bits(blocks) {
                    let mixed = (cover.mixed[row] >> (bx * BLOCK)) as u32 & 0xff;
                    if mixed == 0 {
                        continue;
                    }
                    let found = squares.at(simd, bx, row);
                    let first = row * TILE + bx * BLOCK;
                    let low = f32x8::from_slice(simd, &cover.low[first..first + LANES]);
                    let met = mixed & found.touched & mask_bits(low.simd_le(found.high));
                    if met == 0 {
                        continue;
                    }
                    if !is_met {
                        at_samples.set(simd, &squares, pattern);
                        holes = holes_of_samples(tile, set_up.id);
                        is_met = true;
                    }
                    let triangle = (&squares, &*at_samples, set_up.id, &holes[..]);
                    self.draw_in_pixels(simd, tile, triangle, (&found, met), first);
                }
            }
        }
    }

    /// Draws the samples of some of eight pixels.
    #[inline(always)]
    fn draw_in_pixels<S: Simd>(
        &mut self,
        simd: S,
        tile: SampledTile,
        (squares, at_samples, id, holes): (&Squares<S>, &AtSamples<S>, u32, &[Option<Holes>]),
        (found, met): (&InSquares<S>, u32),
        first: usize,
    ) {
        let eights = tile.pattern.eights();
        let rounding = squares.rounding;
        self.room = self.room.max(rounding.to_array()[0]);
        let room = rounding + self.room;
        let edges = found.edges.each(
            #[inline(always)]
            |e| e.to_array(),
        );
        let plane = found.plane.to_array();
        for lane in bits(met) {
            let slot = usize::from(self.slots[first + lane]) * eights * LANES;
            let is_covered = found.covered >> lane & 1 != 0;
            for eight in 0..eights {
                let place = slot + eight * LANES;
                let old = f32x8::from_slice(simd, &self.nearness[place..place + LANES]);
                let new = at_samples.plane[eight] + plane[lane];
                let new = new.max(squares.low).min(squares.high);
                let mut may_win = old.simd_le(new + room);
                let mut wins = old.simd_lt(new - room);
                if !is_covered {
                    let e = least([0, 1, 2].each(
                        #[inline(always)]
                        |i| at_samples.edges[eight][i] + edges[i][lane],
                    ));
                    may_win &= splat(simd, -SURE).simd_le(e);
                    wins &= splat(simd, SURE).simd_lt(e);
                }
                if let Some((far, near)) = squares.seen() {
                    may_win &= far.simd_le(new + rounding) & (new - rounding).simd_le(near);
                    wins &= far.simd_lt(new - rounding) & (new + rounding).simd_lt(near);
                }
                let (may_win, won) = (mask_bits(may_win), mask_bits(wins));
                if may_win == 0 {
                    continue;
                }
                if !holes.is_empty() {
                    let pixel = DVec2::new(
                        ((first + lane) % TILE) as f64,
                        ((first + lane) / TILE) as f64,
                    );
                    wins = mask32x8::from_bitmask(
                        simd,
                        u64::from(solid(&holes[eight * LANES..], pixel, won)),
                    );
                }
                wins.select(new, old)
                    .store_slice(&mut self.nearness[place..place + LANES]);
                let known = u32x8::from_slice(simd, &self.ids[place..place + LANES]);
                wins.select(u32x8::simd_from(simd, id), known)
                    .store_slice(&mut self.ids[place..place + LANES]);
                for i in bits(may_win & !won) {
                    self.decide(tile, first + lane, (place + i, eight * LANES + i), id);
                }
            }
        }
    }

    /// A sample that float32 leaves open, as the camera of the sample's own decides it.
    #[inline(never)]
    fn decide(
        &mut self,
        tile: SampledTile,
        pixel: usize,
        (place, sample): (usize, usize),
        id: u32,
    ) {
        let SampledTile {
            painter, pattern, ..
        } = tile;
        // Those that stand for no sample are infinitely near.
        if self.nearness[place] == f32::INFINITY {
            return;
        }
        let (x, y) = tile.corner;
        let middle = DVec2::new((x + pixel % TILE) as f64, (y + pixel / TILE) as f64) + 0.5;
        let (view, scene) = (&pattern.views[sample], painter.scene);
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
            self.room = self.room.max(new.abs() as f32 * EPSILON);
        }
    }
}

/// Of each sample the holes of a triangle as it sees them, relative to the middle of the tile's first pixel; none where
/// the triangle has none.
fn holes_of_samples<'a>(tile: SampledTile<'a>, id: u32) -> Vec<Option<Holes<'a>>> {
    let SampledTile {
        painter, pattern, ..
    } = tile;
    if painter.scene.mask_of(id).is_none() {
        return Vec::new();
    }
    let origin = DVec2::new(tile.corner.0 as f64, tile.corner.1 as f64) + 0.5;
    let views = pattern.views.iter();
    let holes = views.map(|view| Holes::new(view, painter.scene, id, origin));
    holes.collect()
}

/// Those of eight samples of a pixel that do not fall in a hole.
#[inline(never)]
fn solid(holes: &[Option<Holes>], pixel: DVec2, samples: u32) -> u32 {
    let is_solid = |sample: &usize| holes[*sample].is_none_or(|holes| !holes.has_at(pixel));
    let solid = bits(samples).filter(is_solid);
    solid.fold(0, |solid, i| solid | 1 << i)
}

/// The numbers of the bits that are set.
#[inline(always)]
fn ones(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros() as usize;
        let has_more = mask != 0;
        mask &= mask.wrapping_sub(1);
        has_more.then_some(bit)
    })
}
