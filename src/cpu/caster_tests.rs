//! Every receiver against the triangles in its cell of the light's grid.
//!
//! Eight receivers of a row are tested at once. Three answers: certainly hit, certainly missed, maybe; a maybe is
//! decided in float64, in the receiver's own ray. A receiver in shadow leaves its block.

use super::bins::triangles_of;
use super::extents::{Extent, add_extents};
use super::holes::Holes;
use super::lanes::{EPSILON, LANES, Simd, bits, f32x16, mask_bits, mask32x8, splat, u32x16};
use super::light_grid::{CELL, Cell, GRID, GRID_CELLS, Group, LightGrid, cells_of_places};
use super::light_grids::{Crowded, SeenGrid};
use super::receivers::{
    BlockPlaces, BlockReceivers, KnownPlanes, Receivers, ViewFromEye, masks_of_views,
};
use super::row_boxes::{RowBoxes, least_within};
use super::shapes::{Corners, Shapes};
use super::tiles::BLOCK;
use crate::lanes::Each;
use crate::occlusion::RayOf;
use crate::scene::Scene;
use fearless_simd::prelude::*;
use glam::{DVec2, DVec3};

/// What receivers are tested against: grids of each view.
pub struct Tests<'a> {
    pub scene: &'a Scene,
    /// The light's position relative to the eye, or the way to it.
    pub light_at: DVec3,
    pub views: &'a [ViewFromEye],
    pub grids: &'a [Vec<SeenGrid>],
    pub ray: &'a RayOf<'a>,
    /// Whether a certain hit is one. It is not where receivers are less well known than float32 rounds.
    pub trusts_hits: bool,
}

/// The receivers of a block, and where a grid sees them.
#[derive(Clone, Copy)]
struct InGrid<'a, S: Simd> {
    grid: &'a LightGrid,
    block: &'a BlockReceivers<S>,
    places: &'a BlockPlaces<S>,
    /// The block's first pixel, or point.
    pixel: (usize, usize),
}

/// The receivers of a block that fall in one cell.
struct InCell<S: Simd> {
    /// Which of each row are still unanswered.
    left: [u32; BLOCK],
    boxes: RowBoxes<4>,
    /// The middle of the cell: relative to it the shapes are set up.
    origin: [f32; 2],
    /// Of two rows each.
    u: [f32x16<S>; BLOCK / 2],
    v: [f32x16<S>; BLOCK / 2],
    nearness: [f32x16<S>; BLOCK / 2],
}

impl<S: Simd> InGrid<'_, S> {
    /// The holes of a triangle relative to a place of the grid, if it has any.
    #[inline(always)]
    fn holes<'s>(&self, scene: &'s Scene, id: u32, origin: [f32; 2]) -> Option<Holes<'s>> {
        let origin = DVec2::from(origin.map(f64::from));
        Holes::new(&self.grid.view, scene, id, origin)
    }
}

/// What is known of the receivers of a block.
pub struct Lit {
    /// Those of each row that the light reaches.
    pub lit: [u32; BLOCK],
    /// Of each view, those that fall in no grid.
    pub left: [[u32; BLOCK]; 6],
    /// Whether some are in a crowd whose grid is to be made.
    pub waits: bool,
}

impl Tests<'_> {
    /// Answers a tile. Where some receivers fall in no grid or in a crowd without one, it is for nothing, and what comes
    /// is the extents of those in none.
    #[inline(always)]
    pub fn answer_tile<S: Simd>(
        &self,
        simd: S,
        receivers: &Receivers,
        tile: usize,
        rows: &mut [&mut [f32]],
        known: &mut Known,
    ) -> Option<[Extent; 6]> {
        let mut block = BlockReceivers::none(simd);
        let mut places = BlockPlaces::none(simd);
        let mut beside = [Extent::EMPTY; 6];
        let mut waits = false;
        for pixel in receivers.image.tiling.blocks(tile) {
            let mut lit = [0; BLOCK];
            if receivers.block(simd, pixel, 0..BLOCK, &mut known.planes, &mut block) {
                let found = self.lit(simd, pixel, &block, &mut places, known);
                lit = found.lit;
                waits |= found.waits;
                let left = found.left;
                add_extents(simd, self.views, &block, &left, &mut places, &mut beside);
            }
            receivers.image.write_lit(simd, rows, pixel, lit);
        }
        let is_open = waits || beside.iter().any(|extent| !extent.is_empty());
        is_open.then_some(beside)
    }

    /// Which receivers of a block are lit, as far as they fall in a grid.
    #[inline(always)]
    pub fn lit<S: Simd>(
        &self,
        simd: S,
        pixel: (usize, usize),
        block: &BlockReceivers<S>,
        places: &mut BlockPlaces<S>,
        known: &mut Known,
    ) -> Lit {
        let mut found = Lit {
            lit: [0; BLOCK],
            left: masks_of_views(simd, self.light_at, block, self.views.len()),
            waits: false,
        };
        let mut crowded = Crowded::default();
        for (face, grids) in self.grids.iter().enumerate() {
            for seen in grids {
                let mut masks = found.left[face];
                if masks == [0; BLOCK] {
                    break;
                }
                let mut next = seen;
                loop {
                    next.view.places(simd, block, &masks, places);
                    // A finer grid has room around the cells that it stands for.
                    if next.grid.depth == 0 {
                        masks = within_grid(simd, places, &masks);
                        for (left, within) in found.left[face].iter_mut().zip(masks) {
                            *left &= !within;
                        }
                    }
                    let in_grid = InGrid {
                        grid: &next.grid,
                        block,
                        places,
                        pixel,
                    };
                    let lit = self.lit_in_grid(simd, (&in_grid, next), &masks, known, &mut crowded);
                    for (all, lit) in found.lit.iter_mut().zip(lit) {
                        *all |= lit;
                    }
                    match crowded.finer.pop() {
                        Some(finer) => (next, masks) = finer,
                        None => break,
                    }
                }
            }
        }
        found.waits = crowded.waits;
        found
    }

    /// Which of the receivers are lit, but for those in crowds, which are put aside.
    #[inline(always)]
    fn lit_in_grid<'a, S: Simd>(
        &self,
        simd: S,
        (seen, grids): (&InGrid<S>, &'a SeenGrid),
        masks: &[u32; BLOCK],
        known: &mut Known,
        crowded: &mut Crowded<'a>,
    ) -> [u32; BLOCK] {
        let InGrid { grid, places, .. } = *seen;
        let mut unseen = *masks;
        let mut lit = [0; BLOCK];
        let mut cells = [splat(simd, 0.0); BLOCK];
        for (i, cells) in cells.iter_mut().enumerate() {
            *cells = cells_of_places(simd, places.u[i], places.v[i]);
        }
        while let Some(row) = (0..BLOCK).find(|&i| unseen[i] != 0) {
            let lane = unseen[row].trailing_zeros() as usize;
            let cell = cells[row][lane];
            let mut within = [0; BLOCK];
            for i in row..BLOCK {
                within[i] = unseen[i] & mask_bits(cells[i].simd_eq(splat(simd, cell)));
                unseen[i] &= !within[i];
            }
            let number = cell as usize;
            if let Some(crowd) = grid.crowds.of_cell(number) {
                crowded.add(grids, crowd, &within);
                continue;
            }
            let (column, row_of_cells) = (number % GRID_CELLS, number / GRID_CELLS);
            let held = grid.cell(column, row_of_cells);
            let middle = [column, row_of_cells].map(|i| (i * CELL + CELL / 2) as f32);
            let one = [places.u[row][lane], places.v[row][lane]];
            let mut in_cell = InCell::new(simd, places, within, (one, middle));
            self.test_cell(simd, seen, held, &mut in_cell, &mut known.shapes);
            for i in row..BLOCK {
                lit[i] |= within[i] & in_cell.left[i];
            }
        }
        lit
    }

    #[inline(always)]
    fn test_cell<S: Simd>(
        &self,
        simd: S,
        seen: &InGrid<S>,
        cell: Cell,
        in_cell: &mut InCell<S>,
        known: &mut KnownShapes,
    ) {
        for head in cell.heads {
            for place in bits(head.meets(simd, in_cell.boxes.sides, in_cell.boxes.limit)) {
                let group = &cell.groups[head.ids[place] as usize];
                let met = group.meets(simd, in_cell.boxes.sides, in_cell.boxes.limit);
                if met != 0 {
                    let known = known.get(simd, self.scene, seen.grid, group, in_cell.origin);
                    self.test_group(simd, seen, (group, known), met, in_cell);
                    if in_cell.boxes.limit == f32::INFINITY {
                        return;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn test_group<S: Simd>(
        &self,
        simd: S,
        seen: &InGrid<S>,
        (group, known): (&Group, &mut KnownGroup),
        met: u32,
        in_cell: &mut InCell<S>,
    ) {
        let (grid, scene) = (seen.grid, self.scene);
        for lane in bits(met & known.unset) {
            known.set_wide(lane, scene, grid, group.ids[lane], in_cell.origin);
        }
        let met = met & !known.unseen;
        let met = met
            & known.shapes.may_hide(
                simd,
                in_cell.boxes.sides_from(in_cell.origin),
                in_cell.boxes.limit,
            );
        for lane in bits(met) {
            let rows = in_cell.boxes.rows(simd, group, lane);
            let shape = (&known.shapes, lane);
            if self.test_triangle(simd, seen, shape, group.ids[lane], rows, in_cell) {
                in_cell.boxes.set_limit();
                if in_cell.boxes.limit == f32::INFINITY {
                    return;
                }
            }
        }
    }

    /// Tests rows of receivers against one triangle; whether some went into shadow.
    #[inline(always)]
    fn test_triangle<S: Simd>(
        &self,
        simd: S,
        seen: &InGrid<S>,
        (shapes, lane): (&Shapes, usize),
        id: u32,
        rows: u32,
        in_cell: &mut InCell<S>,
    ) -> bool {
        let mut has_changed = false;
        let holes = seen.holes(self.scene, id, in_cell.origin);
        // Two rows at once; what is asked of one is true of the other.
        for row in bits((rows | rows >> 1) & 0x55) {
            let pair = row / 2;
            let left = in_cell.left[row] | in_cell.left[row + 1] << LANES;
            if left == 0 {
                continue;
            }
            let z = in_cell.nearness[pair];
            let (hit, maybe) = shapes.test(simd, lane, in_cell.u[pair], in_cell.v[pair], z);
            let candidates = (hit | maybe) & left;
            if candidates == 0 {
                continue;
            }
            let (hit, maybe) = match &holes {
                None => (hit, maybe),
                Some(holes) => {
                    let (u, v) = (in_cell.u[pair].to_array(), in_cell.v[pair].to_array());
                    let rounding = seen.grid.view.rounding();
                    holes.sort((hit & left, maybe & left), (&u, &v), rounding)
                }
            };
            let ids = &seen.block.ids.as_flattened()[row * LANES..][..2 * LANES];
            let others = left & !own_lanes(simd, ids, id);
            let mut shadowed = if self.trusts_hits { hit & others } else { 0 };
            for i in bits((hit | maybe) & others & !shadowed) {
                let at = (seen.pixel.0 + i % LANES, seen.pixel.1 + row + i / LANES);
                if (self.ray)(at, ids[i]).is_shadowed_by(id) {
                    shadowed |= 1 << i;
                }
            }
            if shadowed != 0 {
                in_cell.leave(simd, row, shadowed, seen.places);
                has_changed = true;
            }
        }
        has_changed
    }
}

/// What a thread keeps from block to block.
#[derive(Default)]
pub struct Known {
    pub planes: KnownPlanes,
    pub shapes: KnownShapes,
}

/// How far from the middle of a cell shapes are asked for: footprints of pixels reach beyond the cell.
const SHAPES_REACH: f32 = 1.5 * CELL as f32;

/// Groups whose shapes are kept at hand.
const KNOWN_GROUPS: usize = 128;

/// Shapes of groups that were asked for before: blocks beside each other look at the same ones.
pub struct KnownShapes(Vec<KnownGroup>);

/// The shapes of a group's triangles, relative to the middle of a cell.
#[derive(Clone)]
struct KnownGroup {
    /// Where the group lies in memory.
    address: usize,
    /// The middle: cells may share a group.
    origin: [f32; 2],
    shapes: Shapes,
    /// Lanes that are for float64 and not set up yet, and those that are seen edge-on.
    unset: u32,
    unseen: u32,
}

impl Default for KnownShapes {
    fn default() -> Self {
        let none = KnownGroup {
            address: 0,
            origin: [0.0; 2],
            shapes: Shapes::NONE,
            unset: 0,
            unseen: 0,
        };
        Self(vec![none; KNOWN_GROUPS])
    }
}

impl KnownShapes {
    /// Those of a group that a cell around an origin holds, and which of `met` are seen at all.
    #[inline(always)]
    pub fn of_group<S: Simd>(
        &mut self,
        simd: S,
        (scene, grid): (&Scene, &LightGrid),
        (group, met): (&Group, u32),
        origin: [f32; 2],
    ) -> (&Shapes, u32) {
        let known = self.get(simd, scene, grid, group, origin);
        for lane in bits(met & known.unset) {
            known.set_wide(lane, scene, grid, group.ids[lane], origin);
        }
        (&known.shapes, met & !known.unseen)
    }

    #[inline(always)]
    fn get<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene,
        grid: &LightGrid,
        group: &Group,
        origin: [f32; 2],
    ) -> &mut KnownGroup {
        let address = std::ptr::from_ref(group).addr();
        let known = &mut self.0[address / size_of::<Group>() % KNOWN_GROUPS];
        if known.address != address || known.origin != origin {
            let triangles = triangles_of(scene, group.ids);
            let corners = Corners::new(simd, &grid.places, triangles);
            (known.address, known.origin) = (address, origin);
            known.unset = corners.wide(simd, &grid.view);
            known.unseen = 0;
            let corners = corners.relative_to(origin);
            known.shapes = Shapes::new(simd, &corners, grid.view.rounding(), SHAPES_REACH);
        }
        known
    }
}

impl KnownGroup {
    /// Sets one of the triangles up in float64.
    #[inline(never)]
    fn set_wide(
        &mut self,
        lane: usize,
        scene: &Scene,
        grid: &LightGrid,
        id: u32,
        [u, v]: [f32; 2],
    ) {
        let origin = DVec2::new(f64::from(u), f64::from(v));
        let (side, rounding) = (f64::from(SHAPES_REACH), grid.view.rounding());
        let (shapes, seen) = (&mut self.shapes, (&grid.view, scene));
        self.unset &= !(1 << lane);
        if !shapes.set_wide(lane, seen, id, origin, side, rounding) {
            self.unseen |= 1 << lane;
        }
    }
}

/// The receivers that do not fall beside the grid.
#[inline(always)]
fn within_grid<S: Simd>(simd: S, places: &BlockPlaces<S>, masks: &[u32; BLOCK]) -> [u32; BLOCK] {
    let (low, high) = (splat(simd, 0.0), splat(simd, GRID as f32));
    let mut within = *masks;
    for (i, within) in within.iter_mut().enumerate() {
        let (u, v) = (places.u[i], places.v[i]);
        *within &= mask_bits(low.simd_le(u.min(v)) & u.max(v).simd_le(high));
    }
    within
}

/// Which of sixteen pixels show a triangle.
#[inline(always)]
pub fn own_lanes<S: Simd>(simd: S, ids: &[u32], id: u32) -> u32 {
    let ids = u32x16::from_slice(simd, ids);
    ids.simd_eq(u32x16::simd_from(simd, id)).to_bitmask() as u32
}

impl<S: Simd> InCell<S> {
    #[inline(always)]
    fn new(
        simd: S,
        places: &BlockPlaces<S>,
        left: [u32; BLOCK],
        (one, origin): ([f32; 2], [f32; 2]),
    ) -> Self {
        let mut in_cell = Self {
            left,
            boxes: RowBoxes::EMPTY,
            origin,
            u: [f32x16::splat(simd, 0.0); BLOCK / 2],
            v: [f32x16::splat(simd, 0.0); BLOCK / 2],
            nearness: [f32x16::splat(simd, 0.0); BLOCK / 2],
        };
        for (i, &left) in left.iter().enumerate() {
            if left == 0 {
                continue;
            }
            let mask = mask32x8::from_bitmask(simd, u64::from(left));
            let u = mask.select(places.u[i], splat(simd, one[0]));
            let v = mask.select(places.v[i], splat(simd, one[1]));
            let sides = [
                u.reduce_min(),
                u.reduce_max(),
                v.reduce_min(),
                v.reduce_max(),
            ];
            let farthest = least_within(simd, places.nearness[i], left);
            in_cell.boxes.set(i, sides, farthest);
        }
        for pair in 0..BLOCK / 2 {
            let (i, j) = (2 * pair, 2 * pair + 1);
            in_cell.u[pair] = places.u[i].combine(places.u[j]) - origin[0];
            in_cell.v[pair] = places.v[i].combine(places.v[j]) - origin[1];
            in_cell.nearness[pair] = places.nearness[i].combine(places.nearness[j]);
        }
        in_cell.boxes.set_sides(simd);
        in_cell.boxes.set_limit();
        in_cell
    }

    /// Takes receivers of two rows out.
    #[inline(always)]
    fn leave(&mut self, simd: S, row: usize, shadowed: u32, places: &BlockPlaces<S>) {
        for (row, shadowed) in [(row, shadowed & 0xff), (row + 1, shadowed >> LANES)] {
            self.left[row] &= !shadowed;
            let farthest = least_within(simd, places.nearness[row], self.left[row]);
            self.boxes.set_farthest(row, farthest);
        }
    }
}

#[inline(always)]
fn linear<S: Simd>(simd: S, u: f32x16<S>, v: f32x16<S>, a: f32, b: f32, c: f32) -> f32x16<S> {
    u.mul_add(
        f32x16::splat(simd, a),
        v.mul_add(f32x16::splat(simd, b), f32x16::splat(simd, c)),
    )
}

impl Shapes {
    /// Which of sixteen receivers are certainly behind a triangle, and which may be.
    #[inline(always)]
    pub fn test<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        u: f32x16<S>,
        v: f32x16<S>,
        nearness: f32x16<S>,
    ) -> (u32, u32) {
        let [p, q, r] = [0, 1, 2].each(|i| {
            linear(
                simd,
                u,
                v,
                self.a[i][lane],
                self.b[i][lane],
                self.c[i][lane],
            )
        });
        let e = p.min(q).min(r);
        let plane = linear(
            simd,
            u,
            v,
            self.step_x[lane],
            self.step_y[lane],
            self.first[lane],
        );
        let low = f32x16::splat(simd, self.low[lane]);
        let high = f32x16::splat(simd, self.high[lane]);
        let before = plane.max(low).min(high) - nearness;
        let rounding = nearness.abs() * (2.0 * EPSILON) + self.rounding[lane];
        let hit = f32x16::splat(simd, 1.0).simd_lt(e) & rounding.simd_lt(before);
        let maybe = f32x16::splat(simd, -1.0).simd_le(e) & (-rounding).simd_le(before);
        (hit.to_bitmask() as u32, maybe.to_bitmask() as u32)
    }
}
