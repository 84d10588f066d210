//! What the receivers make of each cell of the light's map, as `shaders/importance_map.wgsl`, which argues for it.

use super::cells::{filled, filled_beside};
use super::lanes::{
    LANES, Simd, bits, dispatch, f32x8, indices, level, mask_bits, mask32x8, narrow, splat, u32x8,
};
use super::light_space::LightSpace;
use super::receivers::{BlockReceivers, KnownPlanes, Receivers, function_of};
use super::tiles::TILE_PIXELS;
use crate::fits::layer::Layer;
use crate::importance::{BOUNDARY_BLOCK, Factors, Grid, Importance, ImportanceMap};
use crate::lanes::{Each, Lane, V2};
use crate::projection::{Formulas, KindVisitor, LaneKind};
use crate::warp::{Axis, Warp};
use fearless_simd::prelude::*;
use glam::DVec3;

/// Words of 32 bits: a float32 number's, or a count.
pub type Words = Vec<u32>;

/// How far from the middle of the map, in maps, receivers have cells: a light matrix may leave some off the map, which
/// need no texels; rounding leaves none.
const ON_THE_MAP: f32 = 0.501;

/// The cell of a grid over the map's side that holds a place; the first or the last for what is beyond.
#[inline(always)]
pub fn cell_at<L: Lane>(place: L, cells: u32) -> L {
    let (zero, one) = (place.constant(0.0), place.constant(1.0));
    let count = place.constant(cells.into());
    (place.clamp(zero, one) * count).floor().min(count - one)
}

#[inline(always)]
fn weight_at(weights: &Grid<Words>, x: usize, y: usize) -> f32 {
    f32::from_bits(weights.values[y * weights.columns as usize + x])
}

/// The weight of the cell that holds a place in the map.
#[inline(always)]
pub fn weight_of_place(weights: Option<&Grid<Words>>, [u, v]: [f32; 2]) -> f32 {
    weights.map_or(1.0, |weights| {
        let (x, y) = (cell_at(u, weights.columns), cell_at(v, weights.rows));
        weight_at(weights, x as usize, y as usize)
    })
}

/// By the cosine between a surface's normal and the ray from the eye.
#[inline(always)]
pub fn factor_of_normal(bonus: f64, normal: DVec3, sight: DVec3) -> f32 {
    (1.0 + bonus * (normal.dot(sight) / sight.length()).abs()) as f32
}

/// Eight receivers in the map, both sides of which are 1, and which of them are on it and the layer's.
pub struct Places {
    u: [f32; LANES],
    v: [f32; LANES],
    mask: u32,
}

/// Where the receivers of a layer lie: counts along y, which come after those along x, begin there.
pub struct PlacedReceivers {
    layer: Layer,
    tiles: Vec<Vec<Places>>,
}

/// The importance of a layer's cells from the receivers. Counts along y are of where the warp's functions along x put
/// them. Where they lie is given back by counts along x of receivers that are worth the same, for those along y.
pub fn importance_map(
    receivers: &Receivers,
    layer: &Layer,
    cells: u32,
    importance: Importance,
    factors: Factors<Words>,
    (warp, placed): (Option<&Warp>, Option<PlacedReceivers>),
) -> (ImportanceMap<Words>, Option<PlacedReceivers>) {
    let (along, count_unit) = match importance {
        Importance::Count { along, unit } => (along, Some(unit)),
        Importance::Maximum => (Axis::X, None),
    };
    let projection = &layer.projection;
    let (centre, size) = (projection.centre, [projection.width, projection.height]);
    let is_even = !factors.distance && !factors.has_more_than_distance();
    let pass = Pass {
        receivers,
        space: LightSpace::new(layer, receivers),
        centre: [centre.x as f32, centre.y as f32],
        side: size.map(|texels| 1.0 / texels as f32),
        cells,
        count_unit: count_unit.map(|unit| unit as f32),
        even_count: count_unit.filter(|_| is_even).map(even_count),
        keeps_places: count_unit.is_some() && is_even && along == Axis::X,
        factors,
        warp: warp.filter(|_| along == Axis::Y),
    };
    let both: fn(u32, u32) -> u32 = match count_unit {
        Some(_) => u32::wrapping_add,
        None => u32::max,
    };
    let count = (cells as usize).pow(2);
    let placed = placed.filter(|placed| is_even && along == Axis::Y && placed.layer == *layer);
    let (values, tiles) = match placed {
        Some(PlacedReceivers { tiles, .. }) => {
            let values = filled(count, tiles.len(), both, |map, tile| {
                dispatch!(level(), simd => pass.count_again(simd, &tiles[tile], map));
            });
            (values, vec![])
        }
        None => {
            let (tiles, known) = (receivers.image.tiling.tiles(), KnownPlanes::default);
            filled_beside(count, tiles, both, known, |map, known, tile| {
                let pass = &pass;
                dispatch!(level(), simd => {
                    pass.space.kind.visit(TileReceivers { simd, pass, tile, known, map })
                })
            })
        }
    };
    let placed = pass.keeps_places.then(|| PlacedReceivers {
        layer: layer.clone(),
        tiles,
    });
    let map = ImportanceMap {
        values,
        cells,
        count_unit,
    };
    (map, placed)
}

/// What a receiver of weight one counts.
fn even_count(unit: f64) -> u32 {
    dispatch!(level(), simd => counts(splat(simd, 1.0), unit as f32)[0])
}

#[inline(always)]
fn counts<S: Simd>(weights: f32x8<S>, unit: f32) -> [u32; LANES] {
    let simd = weights.simd;
    simd.cvt_u32_f32x8(rounded(weights * unit)).into()
}

struct Pass<'a> {
    receivers: &'a Receivers<'a>,
    space: LightSpace,
    /// Texels from the map's corner to the projection's axis.
    centre: [f32; 2],
    /// Maps per texel.
    side: [f32; 2],
    cells: u32,
    count_unit: Option<f32>,
    /// What a receiver counts where all count the same.
    even_count: Option<u32>,
    keeps_places: bool,
    factors: Factors<'a, Words>,
    /// The one that counts along y go through.
    warp: Option<&'a Warp>,
}

/// A tile of the image, and the map that its receivers are added to.
struct TileReceivers<'a, S: Simd> {
    simd: S,
    pass: &'a Pass<'a>,
    tile: usize,
    known: &'a mut KnownPlanes,
    map: &'a mut [u32],
}

impl<S: Simd> KindVisitor for TileReceivers<'_, S> {
    type Output = Vec<Places>;

    #[inline(always)]
    fn visit<K: LaneKind>(self, kind: &K) -> Vec<Places> {
        let Self {
            simd,
            pass,
            tile,
            known,
            map,
        } = self;
        let kind = kind.in_lanes(pass.space.unit, splat(simd, 0.0));
        let mut kept = Vec::new();
        if pass.keeps_places {
            kept.reserve_exact(TILE_PIXELS / LANES);
        }
        pass.receivers.each_block_of_tile(
            simd,
            tile,
            known,
            #[inline(always)]
            |(x, y), block| {
                let masks = pass.space.masks(simd, block);
                for (i, &mask) in masks.iter().enumerate() {
                    if mask == 0 {
                        continue;
                    }
                    let row = pass.placed(simd, &kind, block, i, mask);
                    match pass.even_count {
                        Some(count) => add_count(simd, row.cells, row.mask, count, map),
                        None => pass.add(simd, &row, block, (x, y, i), map),
                    }
                    if pass.keeps_places {
                        kept.push(Places {
                            u: row.u.into(),
                            v: row.v.into(),
                            mask: row.mask,
                        });
                    }
                }
            },
        );
        kept
    }
}

/// Eight receivers in the map.
struct Placed<S: Simd> {
    u: f32x8<S>,
    v: f32x8<S>,
    /// The cell that each falls in.
    cells: u32x8<S>,
    weights: f32x8<S>,
    /// Which are on the map.
    mask: u32,
}

/// Adds a number to the cell of each of eight receivers, once for neighbours in the same.
#[inline(always)]
fn add_count<S: Simd>(simd: S, cells: u32x8<S>, mask: u32, count: u32, map: &mut [u32]) {
    let next = cells.slide::<1>(u32x8::simd_from(simd, u32::MAX));
    let is_last = mask_bits(!next.simd_eq(cells));
    let cells: [u32; LANES] = cells.into();
    let mut left = mask;
    for last in bits(is_last) {
        let run = left & ((2 << last) - 1);
        left &= !run;
        if run != 0 {
            map[cells[last] as usize] += run.count_ones() * count;
        }
    }
}

/// Raises the cell of each of eight receivers to its weight, once for neighbours in the same.
#[inline(always)]
fn raise<S: Simd>(simd: S, cells: u32x8<S>, mask: u32, weights: [f32; LANES], map: &mut [u32]) {
    let zero = u32x8::simd_from(simd, 0);
    let nowhere = u32x8::simd_from(simd, u32::MAX);
    let mask = mask32x8::from_bitmask(simd, u64::from(mask));
    // Positive floats are ordered as their bits are.
    let mut most = mask.select(u32x8::simd_from(simd, weights.map(f32::to_bits)), zero);
    // From those one, two and four before, where they are in the same cell.
    let before = (nowhere.slide::<7>(cells), zero.slide::<7>(most));
    most = most.max(before.0.simd_eq(cells).select(before.1, zero));
    let before = (nowhere.slide::<6>(cells), zero.slide::<6>(most));
    most = most.max(before.0.simd_eq(cells).select(before.1, zero));
    let before = (nowhere.slide::<4>(cells), zero.slide::<4>(most));
    most = most.max(before.0.simd_eq(cells).select(before.1, zero));
    let is_last = mask_bits(!cells.slide::<1>(nowhere).simd_eq(cells));
    let has_any = mask_bits(!most.simd_eq(zero));
    let (cells, most): ([u32; LANES], [u32; LANES]) = (cells.into(), most.into());
    for last in bits(is_last & has_any) {
        let cell = &mut map[cells[last] as usize];
        *cell = most[last].max(*cell);
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn placed<S: Simd>(
        &self,
        simd: S,
        kind: &impl Formulas<f32x8<S>>,
        block: &BlockReceivers<S>,
        i: usize,
        mask: u32,
    ) -> Placed<S> {
        let point = &block.points[i];
        let q = self.space.projected(simd, point);
        let texel = kind.centred_texel_from_projected(q);
        let u = (texel.x + splat(simd, self.centre[0])) * splat(simd, self.side[0]);
        let v = (texel.y + splat(simd, self.centre[1])) * splat(simd, self.side[1]);
        let reach = splat(simd, ON_THE_MAP);
        let [on_u, on_v] = [u, v].each(|place| Lane::abs(place - splat(simd, 0.5)).at_most(reach));
        let mut weights = splat(simd, 1.0);
        if self.factors.distance {
            let [_, _, width] = self.receivers.camera.image_rows();
            weights = kind.texel_width(q) / narrow(function_of(simd, width, point));
        }
        Placed {
            u,
            v,
            cells: self.cells_of(simd, u, v),
            weights,
            mask: mask & mask_bits(on_u & on_v),
        }
    }

    /// The cells that places in the map fall in.
    #[inline(always)]
    fn cells_of<S: Simd>(&self, simd: S, u: f32x8<S>, v: f32x8<S>) -> u32x8<S> {
        let [line, place] = match self.warp {
            None => [v, u],
            Some(warp) => [warp.warped_x(V2::new(u, v)), v],
        };
        let [line, place] = [line, place].each(|place| {
            let cell = cell_at(place, self.cells);
            u32x8::simd_from(simd, indices(simd, cell))
        });
        line * self.cells + place
    }

    /// Counts receivers where they are known to be.
    #[inline(always)]
    fn count_again<S: Simd>(&self, simd: S, receivers: &[Places], map: &mut [u32]) {
        let count = self.even_count.expect("all count the same");
        for Places { u, v, mask } in receivers {
            let [u, v] = [u, v].each(|place| f32x8::simd_from(simd, *place));
            add_count(simd, self.cells_of(simd, u, v), *mask, count, map);
        }
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        row: &Placed<S>,
        block: &BlockReceivers<S>,
        (x, y, i): (usize, usize, usize),
        map: &mut [u32],
    ) {
        let cells: [u32; LANES] = row.cells.into();
        let mut weights: [f32; LANES] = row.weights.into();
        let [u, v] = [row.u, row.v].each(<[f32; LANES]>::from);
        if self.factors.has_more_than_distance() {
            let [a, b, c] = block.points[i].map(<[f64; LANES]>::from);
            for lane in bits(row.mask) {
                weights[lane] *= self.weight(&Receiver {
                    pixel: (x + lane, y + i),
                    triangle: block.ids[i][lane],
                    point: DVec3::new(a[lane], b[lane], c[lane]),
                    place: [u[lane], v[lane]],
                });
            }
        }
        let Some(unit) = self.count_unit else {
            raise(simd, row.cells, row.mask, weights, map);
            return;
        };
        let counts = counts(f32x8::simd_from(simd, weights), unit);
        for lane in bits(row.mask) {
            map[cells[lane] as usize] += counts[lane];
        }
    }

    /// The product of all factors but the distance's.
    #[inline(always)]
    fn weight(&self, receiver: &Receiver) -> f32 {
        let factors = &self.factors;
        let mut weight = 1.0;
        if let Some(bonus) = factors.normal {
            let normal = self.receivers.scene.unit_normals()[receiver.triangle as usize];
            let sight = self.receivers.camera.sight_of(receiver.point);
            weight = factor_of_normal(bonus, normal.as_dvec3(), sight);
        }
        let (x, y) = receiver.pixel;
        if let Some(boundary) = factors.boundary {
            let block = BOUNDARY_BLOCK as usize;
            weight *= weight_at(boundary, x / block, y / block);
        }
        if let Some(pixels) = factors.pixel_weights {
            weight *= weight_at(pixels, x, y);
        }
        weight
            * weight_of_place(factors.shadow_edge, receiver.place)
            * weight_of_place(factors.map_weights, receiver.place)
    }
}

/// The nearest whole numbers of positive ones.
#[inline(always)]
fn rounded<S: Simd>(numbers: f32x8<S>) -> f32x8<S> {
    // Just below a half: 0.5 is added without a sum that is rounded up.
    Lane::floor(numbers + 0.5f32.next_down())
}

struct Receiver {
    pixel: (usize, usize),
    triangle: u32,
    /// Relative to the eye.
    point: DVec3,
    /// In the map, both sides of which are 1.
    place: [f32; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::Random;

    #[test]
    fn counts_are_the_nearest_whole_numbers() {
        let below = |number: f32| number.next_down();
        let numbers = [0.0, below(0.5), 0.75, below(1.5), 1.75, 6.25, 7.75, 1e6];
        let found: [f32; LANES] =
            dispatch!(level(), simd => rounded(f32x8::simd_from(simd, numbers)).into());
        assert_eq!(found, numbers.map(f32::round));
    }

    #[test]
    fn each_of_eight_receivers_counts_in_its_own_cell_and_raises_it() {
        let mut random = Random(1);
        for _ in 0..500 {
            let cells: [u32; LANES] = std::array::from_fn(|_| random.below(3) as u32);
            let (mask, count) = (random.below(256) as u32, 1 + random.below(4) as u32);
            let mut right = [0; 3];
            for lane in bits(mask) {
                right[cells[lane] as usize] += count;
            }
            let mut found = [0; 3];
            dispatch!(level(), simd => {
                add_count(simd, u32x8::simd_from(simd, cells), mask, count, &mut found)
            });
            assert_eq!(found, right, "{cells:?} {mask:#b}");
            let weights: [f32; LANES] = std::array::from_fn(|_| random.share() as f32);
            let mut right = [0; 3];
            for lane in bits(mask) {
                let cell = &mut right[cells[lane] as usize];
                *cell = weights[lane].to_bits().max(*cell);
            }
            let mut found = [0; 3];
            dispatch!(level(), simd => {
                raise(simd, u32x8::simd_from(simd, cells), mask, weights, &mut found)
            });
            assert_eq!(found, right, "{cells:?} {mask:#b} {weights:?}");
        }
    }

    #[test]
    fn the_ends_of_a_map_are_in_its_first_and_last_cell() {
        for (place, cell) in [(-0.001, 0.0), (0.0, 0.0), (0.499, 3.0), (0.5, 4.0)] {
            assert_eq!(cell_at(place, 8), cell);
            assert_eq!(
                cell_at(1.0 - place, 8),
                if place == 0.5 { 4.0 } else { 7.0 - cell }
            );
        }
    }
}
