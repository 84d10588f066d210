//! A grid over what the light sees: for each cell the triangles that may touch it.
//!
//! The dual of an irregular z-buffer (Johnson et al., "The irregular Z-buffer", ACM TOG 24(4), 2005): there
//! receivers are listed in the light's texels, here triangles are, and receivers stay in the image's order.

use super::bins::{Bin, Bins, Cover, bins_among, eights, ids_at, triangles_of};
use super::crowds::{Crowds, MANY_SMALL, MOST_DEPTH};
use super::extents::Extent;
use super::lanes::{
    LANES, Simd, bits, dispatch, f32x8, greatest, greatest_of, indices, least, least_of, level,
    mask_bits, mask32x8, splat,
};
use super::shapes::{Corners, Shapes};
use super::tiles::{TILE, Tiling};
use super::view::{Place, View};
use crate::scene::Scene;
use fearless_simd::prelude::*;
use glam::{DVec2, DVec4};
use rayon::prelude::*;

/// Units along each side of the grid, and of a cell.
pub const GRID: usize = 1024;
pub const CELL: usize = 8;

/// Cells along each side of the grid, and of a tile.
pub const GRID_CELLS: usize = GRID / CELL;
const TILE_CELLS: usize = TILE / CELL;

/// How far from the border of the grid the samples lie, in units.
const ROOM: f64 = 64.0;

/// Tiles of a grid. A large triangle may be in each.
const TILES: usize = (GRID / TILE) * (GRID / TILE);

/// Entries of a tile, and entries for each of its triangles, from which on the tile is one cell: large triangles over
/// each other would fill the memory.
const MANY_ENTRIES: usize = 1 << 15;
const MANY_OF_TRIANGLE: usize = 4;

/// The same of a finer grid, of which there may be many.
const MANY_ENTRIES_OF_FINER: usize = 1 << 12;

/// The boxes of eight triangles, or of what eight groups hold.
#[derive(Debug, Clone, Copy)]
pub struct Group {
    pub low_u: [f32; LANES],
    pub high_u: [f32; LANES],
    pub low_v: [f32; LANES],
    pub high_v: [f32; LANES],
    pub nearest: [f32; LANES],
    /// Triangles, or numbers of groups.
    pub ids: [u32; LANES],
}

impl Group {
    const EMPTY: Self = Self {
        low_u: [f32::INFINITY; LANES],
        high_u: [f32::NEG_INFINITY; LANES],
        low_v: [f32::INFINITY; LANES],
        high_v: [f32::NEG_INFINITY; LANES],
        nearest: [f32::NEG_INFINITY; LANES],
        ids: [0; LANES],
    };

    /// So many. `vec!` would call for each a function that copies memory.
    #[inline(always)]
    fn empty(count: u32) -> Vec<Self> {
        let mut groups = Vec::with_capacity(count as usize);
        groups.extend((0..count).map(
            #[inline(always)]
            |_| Self::EMPTY,
        ));
        groups
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, bounds: &Bounds, id: u32) {
        [
            self.low_u[lane],
            self.high_u[lane],
            self.low_v[lane],
            self.high_v[lane],
        ] = bounds.sides;
        self.nearest[lane] = bounds.nearest;
        self.ids[lane] = id;
    }

    /// Triangles that are no larger than a cell.
    fn small(&self) -> usize {
        let is_small = |&lane: &usize| {
            let (u, v) = (
                self.high_u[lane] - self.low_u[lane],
                self.high_v[lane] - self.low_v[lane],
            );
            (0.0..=CELL as f32).contains(&u) && (0.0..=CELL as f32).contains(&v)
        };
        (0..LANES).filter(is_small).count()
    }

    /// Around all eight.
    fn bounds(&self) -> Bounds {
        Bounds {
            sides: [
                least_of(&self.low_u),
                greatest_of(&self.high_u),
                least_of(&self.low_v),
                greatest_of(&self.high_v),
            ],
            nearest: greatest_of(&self.nearest),
        }
    }

    /// Which of the boxes meet a box and have something nearer than `farthest`.
    #[inline(always)]
    pub fn meets<S: Simd>(
        &self,
        simd: S,
        [low_u, high_u, low_v, high_v]: [f32; 4],
        farthest: f32,
    ) -> u32 {
        let along_u = meets_range(simd, &self.low_u, &self.high_u, low_u, high_u);
        let along_v = meets_range(simd, &self.low_v, &self.high_v, low_v, high_v);
        let is_nearer = splat(simd, farthest).simd_lt(f32x8::simd_from(simd, self.nearest));
        mask_bits((along_u & along_v) & is_nearer)
    }
}

/// Which of eight ranges meet a range.
#[inline(always)]
pub fn meets_range<S: Simd>(
    simd: S,
    lows: &[f32; LANES],
    highs: &[f32; LANES],
    low: f32,
    high: f32,
) -> mask32x8<S> {
    let (lows, highs) = (
        f32x8::simd_from(simd, *lows),
        f32x8::simd_from(simd, *highs),
    );
    lows.simd_le(splat(simd, high)) & splat(simd, low).simd_le(highs)
}

/// The box of a triangle, and how near it comes.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    /// Least and greatest column, least and greatest row.
    sides: [f32; 4],
    nearest: f32,
}

/// The cells of a tile.
struct TileCells {
    /// Whether the first cell stands for all.
    is_one: bool,
    /// Where the groups of each cell begin, and where their heads do.
    groups_of: [u32; TILE_CELLS * TILE_CELLS + 1],
    heads_of: [u32; TILE_CELLS * TILE_CELLS + 1],
    groups: Vec<Group>,
    heads: Vec<Group>,
    /// A bit for each cell that has many small triangles, and so few others that a finer grid would not list these more often.
    crowded: u64,
}

/// What is in a cell: groups of triangles, and heads over eight groups each, which number the groups from the
/// cell's first one.
#[derive(Clone, Copy)]
pub struct Cell<'a> {
    pub heads: &'a [Group],
    pub groups: &'a [Group],
}

impl<'a> Cell<'a> {
    /// The triangles.
    pub fn ids(&self) -> impl Iterator<Item = u32> + use<'a> {
        // The lanes that hold none have no box.
        let held = |group: &'a Group| {
            (0..LANES)
                .filter(|&lane| group.low_u[lane] <= group.high_u[lane])
                .map(|lane| group.ids[lane])
        };
        self.groups.iter().flat_map(held)
    }
}

pub struct LightGrid {
    pub view: View,
    /// Of the vertices of its triangles.
    pub places: Vec<Place>,
    /// How many grids it is in.
    pub depth: usize,
    pub crowds: Crowds<Self>,
    tiling: Tiling,
    tiles: Vec<TileCells>,
}

impl LightGrid {
    /// Of a view of `GRID` x `GRID` units.
    pub fn new(view: View, scene: &Scene) -> Self {
        let places = view.places(scene);
        Self::among(view, (scene, None), places, 0)
    }

    /// The same of some triangles, or of all, in so many other grids.
    pub fn among(
        view: View,
        (scene, triangles): (&Scene, Option<&[u32]>),
        places: Vec<Place>,
        depth: usize,
    ) -> Self {
        let tiling = Tiling::new(view.width, view.height);
        let among = (scene, triangles);
        let bins: Bins = bins_among(&view, (tiling, &tiling), among, &places, Cover::Whole);
        let listing = Listing {
            view: &view,
            scene,
            places: &places,
            most_entries: match depth {
                0 => MANY_ENTRIES,
                _ => MANY_ENTRIES_OF_FINER,
            },
        };
        let tiles = (0..tiling.tiles()).into_par_iter().map(|tile| {
            let corner = tiling.corner(tile);
            let bins = bins.iter().map(|of_thread| &of_thread[tile]);
            dispatch!(level(), simd => listing.cells(simd, bins, corner))
        });
        let tiles: Vec<TileCells> = tiles.collect();
        let crowds = match depth < MOST_DEPTH && tiles.iter().any(|tile| tile.crowded != 0) {
            true => Crowds::new(GRID_CELLS, |column, row| {
                let (tile, cell) = tile_and_cell(tiling, column, row);
                tiles[tile].crowded >> cell & 1 != 0
            }),
            false => Crowds::none(),
        };
        Self {
            view,
            places,
            depth,
            crowds,
            tiling,
            tiles,
        }
    }

    /// The cell in that column and row.
    pub fn cell(&self, column: usize, row: usize) -> Cell<'_> {
        let (tile, cell) = tile_and_cell(self.tiling, column, row);
        let tile = &self.tiles[tile];
        let cell = if tile.is_one { 0 } else { cell };
        let range = |of: &[u32], i: usize| of[i] as usize..of[i + 1] as usize;
        Cell {
            heads: &tile.heads[range(&tile.heads_of, cell)],
            groups: &tile.groups[range(&tile.groups_of, cell)],
        }
    }
}

#[inline(always)]
fn tile_and_cell(tiling: Tiling, column: usize, row: usize) -> (usize, usize) {
    (
        row / TILE_CELLS * tiling.columns + column / TILE_CELLS,
        row % TILE_CELLS * TILE_CELLS + column % TILE_CELLS,
    )
}

struct Listing<'a> {
    view: &'a View,
    scene: &'a Scene,
    places: &'a [Place],
    /// Of a tile, before it is one cell.
    most_entries: usize,
}

/// Triangles and their bounds, and which cells each is in.
#[derive(Default)]
struct Listed {
    triangles: Vec<(u32, Bounds)>,
    is_one: bool,
    /// Cell, and place among the triangles.
    entries: Vec<(u8, u32)>,
}

impl Listed {
    fn has_too_many(&self, most: usize) -> bool {
        let entries = self.entries.len();
        entries > most && entries > MANY_OF_TRIANGLE * self.triangles.len()
    }

    /// Every triangle in the first cell.
    fn unite(&mut self) {
        self.is_one = true;
        self.entries.clear();
        self.entries
            .extend((0..self.triangles.len() as u32).map(|place| (0, place)));
    }

    /// Puts the triangles of the first cell, which stands for all, in an order that keeps neighbours together, so that
    /// groups are small (Morton 1966).
    fn sort(&mut self, corner: (usize, usize)) {
        let triangles = &self.triangles;
        let key = |&(_, place): &(u8, u32)| {
            let [low_u, high_u, low_v, high_v] = triangles[place as usize].1.sides;
            let middle = |low: f32, high: f32, from: usize| {
                // One that is set up in float64 may be anywhere: it is NaN, and first.
                (((low + high) * 0.5 - from as f32).clamp(0.0, TILE as f32) * STEPS_OF_UNIT) as u32
            };
            spread(middle(low_u, high_u, corner.0)) | spread(middle(low_v, high_v, corner.1)) << 1
        };
        self.entries.sort_by_cached_key(key);
    }
}

/// Of a place in a tile, where triangles are put in order.
const STEPS_OF_UNIT: f32 = 256.0;

/// The bits of a number below 2^16, each followed by a zero.
fn spread(number: u32) -> u32 {
    let steps = [
        (8, 0x00ff_00ff),
        (4, 0x0f0f_0f0f),
        (2, 0x3333_3333),
        (1, 0x5555_5555),
    ];
    steps
        .iter()
        .fold(number, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

impl Listing<'_> {
    #[inline(always)]
    fn cells<'a, S: Simd>(
        &self,
        simd: S,
        bins: impl Iterator<Item = &'a Bin>,
        corner: (usize, usize),
    ) -> TileCells {
        let mut listed = Listed::default();
        for bin in bins {
            for (places, count) in eights(0..bin.near.len()) {
                let ids = ids_at(&bin.near, places);
                self.list_near::<_, false>(simd, ids, count, corner, &mut listed);
            }
            for (places, count) in eights(0..bin.wide.len()) {
                let ids = ids_at(&bin.wide, places);
                self.list_near::<_, true>(simd, ids, count, corner, &mut listed);
            }
        }
        if listed.is_one {
            listed.sort(corner);
        }
        TileCells::new(&listed)
    }

    /// Those whose corners float32 knows well, or those of the others of which it knows the box, in one cell or two.
    #[inline(always)]
    fn list_near<S: Simd, const IS_WIDE: bool>(
        &self,
        simd: S,
        ids: [u32; LANES],
        count: usize,
        corner: (usize, usize),
        listed: &mut Listed,
    ) {
        let triangles = triangles_of(self.scene, ids);
        let corners = Corners::new(simd, self.places, triangles);
        let Corners { x, y, nearness, .. } = corners;
        let rounding = self.view.rounding() * 2.0;
        let (low_u, high_u) = (least(x) - rounding, greatest(x) + rounding);
        let (low_v, high_v) = (least(y) - rounding, greatest(y) + rounding);
        let (u0, u1) = (
            cell_of(simd, low_u, corner.0),
            cell_of(simd, high_u, corner.0),
        );
        let (v0, v1) = (
            cell_of(simd, low_v, corner.1),
            cell_of(simd, high_v, corner.1),
        );
        let sides = [
            low_u.to_array(),
            high_u.to_array(),
            low_v.to_array(),
            high_v.to_array(),
        ];
        let nearest = greatest(nearness);
        let nearest = (nearest + nearest.abs() * 1e-6).to_array();
        let origin = [corner.0 as f32, corner.1 as f32];
        // A triangle in one cell or two touches them.
        let has_many = mask_bits(splat(simd, 1.0).simd_lt((u1 - u0) + (v1 - v0)));
        let unknown = match IS_WIDE {
            true => has_many | corners.out_of_reach(simd, self.view),
            false => 0,
        };
        let shapes = match has_many & !unknown & ((1 << count) - 1) {
            0 => Shapes::NONE,
            _ => Shapes::new(
                simd,
                &corners.relative_to(origin),
                self.view.rounding(),
                TILE as f32,
            ),
        };
        let (u0, u1) = (indices(simd, u0), indices(simd, u1));
        let (v0, v1) = (indices(simd, v0), indices(simd, v1));
        for lane in 0..count {
            if unknown >> lane & 1 != 0 {
                self.list_wide(simd, ids[lane], corner, listed);
                continue;
            }
            let bounds = Bounds {
                sides: [
                    sides[0][lane],
                    sides[1][lane],
                    sides[2][lane],
                    sides[3][lane],
                ],
                nearest: nearest[lane],
            };
            let cells = [u0[lane], u1[lane], v0[lane], v1[lane]].map(|cell| cell as usize);
            self.list(simd, ids[lane], bounds, cells, (&shapes, lane), listed);
        }
    }

    /// One that is set up in float64.
    #[inline(always)]
    fn list_wide<S: Simd>(&self, simd: S, id: u32, corner: (usize, usize), listed: &mut Listed) {
        let origin = DVec2::new(corner.0 as f64, corner.1 as f64);
        let (seen, rounding) = ((self.view, self.scene), self.view.rounding());
        if let Some(shapes) = Shapes::wide(seen, id, origin, TILE as f64, rounding) {
            let bounds = Bounds {
                sides: [
                    f32::NEG_INFINITY,
                    f32::INFINITY,
                    f32::NEG_INFINITY,
                    f32::INFINITY,
                ],
                nearest: shapes.high[0] + shapes.rounding[0],
            };
            let last = TILE_CELLS - 1;
            self.list(simd, id, bounds, [0, last, 0, last], (&shapes, 0), listed);
        }
    }

    /// Adds a triangle to the cells of a box that it may touch.
    #[inline(always)]
    fn list<S: Simd>(
        &self,
        simd: S,
        id: u32,
        bounds: Bounds,
        [u0, u1, v0, v1]: [usize; 4],
        (shapes, lane): (&Shapes, usize),
        listed: &mut Listed,
    ) {
        let is_small = u1 - u0 + v1 - v0 <= 1;
        let columns = (0xff << u0) & (0xff >> (TILE_CELLS - 1 - u1));
        let place = listed.triangles.len() as u32;
        listed.triangles.push((id, bounds));
        if listed.is_one {
            listed.entries.push((0, place));
            return;
        }
        for row in v0..v1 + 1 {
            let mut cells = columns;
            if !is_small {
                cells &= shapes
                    .blocks(simd, lane, (row * CELL) as f32, CELL as f32)
                    .touched;
            }
            for column in bits(cells) {
                listed
                    .entries
                    .push(((row * TILE_CELLS + column) as u8, place));
            }
        }
        if listed.has_too_many(self.most_entries) {
            listed.unite();
        }
    }
}

impl TileCells {
    #[inline(always)]
    fn new(listed: &Listed) -> Self {
        const CELLS: usize = TILE_CELLS * TILE_CELLS;
        let mut counts = [0u32; CELLS];
        for &(cell, _) in &listed.entries {
            counts[cell as usize] += 1;
        }
        let starts = |per: u32| {
            let mut starts = [0; CELLS + 1];
            for cell in 0..CELLS {
                starts[cell + 1] = starts[cell] + counts[cell].div_ceil(per);
            }
            starts
        };
        let (groups_of, heads_of) = (starts(LANES as u32), starts((LANES * LANES) as u32));
        let mut groups = Group::empty(groups_of[CELLS]);
        let mut next: [u32; CELLS] = std::array::from_fn(|cell| groups_of[cell] * LANES as u32);
        for &(cell, place) in &listed.entries {
            let at = &mut next[cell as usize];
            let (id, bounds) = &listed.triangles[place as usize];
            groups[*at as usize / LANES].set(*at as usize % LANES, bounds, *id);
            *at += 1;
        }
        let mut heads = Group::empty(heads_of[CELLS]);
        for cell in 0..CELLS {
            let first = groups_of[cell];
            for group in first..groups_of[cell + 1] {
                let place = (group - first) as usize;
                let head = &mut heads[heads_of[cell] as usize + place / LANES];
                head.set(
                    place % LANES,
                    &groups[group as usize].bounds(),
                    place as u32,
                );
            }
        }
        let mut crowded = 0;
        for cell in (0..CELLS).filter(|&cell| counts[cell] as usize > MANY_SMALL) {
            let range = groups_of[cell] as usize..groups_of[cell + 1] as usize;
            let small: usize = groups[range].iter().map(Group::small).sum();
            let large = counts[cell] as usize - small;
            if small > MANY_SMALL && large * TILES <= small * MANY_OF_TRIANGLE {
                crowded |= if listed.is_one { u64::MAX } else { 1 << cell };
            }
        }
        Self {
            is_one: listed.is_one,
            groups_of,
            heads_of,
            groups,
            heads,
            crowded,
        }
    }
}

/// The cell of a tile, along one axis, that is nearest to eight places.
#[inline(always)]
fn cell_of<S: Simd>(simd: S, place: f32x8<S>, from: usize) -> f32x8<S> {
    let cell = ((place - from as f32) * (1.0 / CELL as f32)).floor();
    cell.max(splat(simd, 0.0))
        .min(splat(simd, TILE_CELLS as f32 - 1.0))
}

/// The numbers of the cells that places fall in.
#[inline(always)]
pub fn cells_of_places<S: Simd>(simd: S, u: f32x8<S>, v: f32x8<S>) -> f32x8<S> {
    let (zero, last) = (splat(simd, 0.0), splat(simd, GRID_CELLS as f32 - 1.0));
    let column = (u * (1.0 / CELL as f32)).floor().max(zero).min(last);
    let row = (v * (1.0 / CELL as f32)).floor().max(zero).min(last);
    row * GRID_CELLS as f32 + column
}

/// Moves and scales a view, so that an extent fills it but for some room on each side.
pub fn fitted(view: &View, extent: &Extent) -> View {
    let [x, y, w] = view.rows;
    let fit = |row: DVec4, k: usize| {
        let (low, high) = (f64::from(extent.low[k]), f64::from(extent.high[k]));
        // No narrower than float32 can tell from its place.
        let size = (high - low)
            .max(1e-5 * low.abs().max(high.abs()))
            .max(f64::MIN_POSITIVE);
        (row - w * low) * ((GRID as f64 - 2.0 * ROOM) / size) + w * ROOM
    };
    View {
        rows: [fit(x, 0), fit(y, 1), w],
        ..view.clone()
    }
}
