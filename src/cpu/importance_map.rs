//! What the receivers make of each cell of the light's map, as `shaders/importance_map.wgsl`, which argues for it.

use super::cells::filled;
use super::lanes::{
    LANES, Simd, bits, dispatch, f32x8, indices, level, mask_bits, narrow, splat, u32x8,
};
use super::light_space::LightSpace;
use super::receivers::{BlockReceivers, Receivers, function_of};
use super::tiles::BLOCK;
use crate::fits::layer::Layer;
use crate::importance::{BOUNDARY_BLOCK, Factors, Grid, Importance, ImportanceMap};
use crate::lanes::{Each, Lane, V2};
use crate::projection::{Formulas, KindVisitor, LaneKind};
use crate::warp::{Axis, Warp};
use fearless_simd::SimdFrom;
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

/// The importance of a layer's cells from the receivers. Counts along y are of where the warp's functions along x put
/// them.
pub fn importance_map(
    receivers: &Receivers,
    layer: &Layer,
    cells: u32,
    importance: Importance,
    factors: Factors<Words>,
    warp: Option<&Warp>,
) -> ImportanceMap<Words> {
    let (along, count_unit) = match importance {
        Importance::Count { along, unit } => (along, Some(unit)),
        Importance::Maximum => (Axis::X, None),
    };
    let projection = &layer.projection;
    let (centre, size) = (projection.centre, [projection.width, projection.height]);
    let pass = Pass {
        receivers,
        space: LightSpace::new(layer, receivers),
        centre: [centre.x as f32, centre.y as f32],
        side: size.map(|texels| 1.0 / texels as f32),
        cells,
        count_unit: count_unit.map(|unit| unit as f32),
        factors,
        warp: warp.filter(|_| along == Axis::Y),
    };
    let both: fn(u32, u32) -> u32 = match count_unit {
        Some(_) => u32::wrapping_add,
        None => u32::max,
    };
    let rows = receivers.image.tiling.height.div_ceil(BLOCK);
    let values = filled((cells as usize).pow(2), rows, both, |map, row| {
        let (pass, y) = (&pass, row * BLOCK);
        dispatch!(level(), simd => pass.space.kind.visit(Rows { simd, pass, y, map }));
    });
    ImportanceMap {
        values,
        cells,
        count_unit,
    }
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
    factors: Factors<'a, Words>,
    /// The one that counts along y go through.
    warp: Option<&'a Warp>,
}

/// Eight rows of the image from `y` on, and the map that they are added to.
struct Rows<'a, S: Simd> {
    simd: S,
    pass: &'a Pass<'a>,
    y: usize,
    map: &'a mut [u32],
}

impl<S: Simd> KindVisitor for Rows<'_, S> {
    type Output = ();

    #[inline(always)]
    fn visit<K: LaneKind>(self, kind: &K) {
        let Self { simd, pass, y, map } = self;
        let kind = kind.in_lanes(pass.space.unit, splat(simd, 0.0));
        pass.receivers.each_block(
            simd,
            y,
            #[inline(always)]
            |x, block| {
                let masks = pass.space.masks(simd, block);
                for (i, &mask) in masks.iter().enumerate() {
                    if mask != 0 {
                        let row = pass.placed(simd, &kind, block, i);
                        pass.add(simd, &row, mask, block, (x, y, i), map);
                    }
                }
            },
        );
    }
}

/// Eight receivers in the map.
struct Placed {
    u: [f32; LANES],
    v: [f32; LANES],
    /// The cell that each falls in.
    cells: [u32; LANES],
    weights: [f32; LANES],
    /// Which are on the map.
    mask: u32,
}

impl Pass<'_> {
    #[inline(always)]
    fn placed<S: Simd>(
        &self,
        simd: S,
        kind: &impl Formulas<f32x8<S>>,
        block: &BlockReceivers<S>,
        i: usize,
    ) -> Placed {
        let point = &block.points[i];
        let q = self.space.projected(simd, point);
        let texel = kind.centred_texel_from_projected(q);
        let u = (texel.x + splat(simd, self.centre[0])) * splat(simd, self.side[0]);
        let v = (texel.y + splat(simd, self.centre[1])) * splat(simd, self.side[1]);
        let reach = splat(simd, ON_THE_MAP);
        let [on_u, on_v] = [u, v].each(|place| (place - splat(simd, 0.5)).abs().at_most(reach));
        let [line, place] = match self.warp {
            None => [v, u],
            Some(warp) => [warp.warped_x(V2::new(u, v)), v],
        };
        let [line, place] = [line, place].each(|place| cell_at(place, self.cells));
        let mut weights = splat(simd, 1.0);
        if self.factors.distance {
            let [_, _, width] = self.receivers.camera.image_rows();
            weights = kind.texel_width(q) / narrow(function_of(simd, width, point));
        }
        let [line, place] =
            [line, place].each(|number| u32x8::simd_from(simd, indices(simd, number)));
        Placed {
            u: u.into(),
            v: v.into(),
            cells: (line * self.cells + place).into(),
            weights: weights.into(),
            mask: mask_bits(on_u) & mask_bits(on_v),
        }
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        row: &Placed,
        mask: u32,
        block: &BlockReceivers<S>,
        (x, y, i): (usize, usize, usize),
        map: &mut [u32],
    ) {
        let has_factors = self.factors.has_more_than_distance();
        let points = has_factors.then(|| block.points[i].map(<[f64; LANES]>::from));
        let mut weights = row.weights;
        if let Some([a, b, c]) = points {
            for lane in bits(mask & row.mask) {
                weights[lane] *= self.weight(&Receiver {
                    pixel: (x + lane, y + i),
                    triangle: block.ids[i][lane],
                    point: DVec3::new(a[lane], b[lane], c[lane]),
                    place: [row.u[lane], row.v[lane]],
                });
            }
        }
        let Some(unit) = self.count_unit else {
            for lane in bits(mask & row.mask) {
                let cell = &mut map[row.cells[lane] as usize];
                // Positive floats are ordered as their bits are.
                *cell = weights[lane].to_bits().max(*cell);
            }
            return;
        };
        let weights = f32x8::simd_from(simd, weights);
        let counts: [u32; LANES] = simd.cvt_u32_f32x8(rounded(weights * unit)).into();
        for lane in bits(mask & row.mask) {
            map[row.cells[lane] as usize] += counts[lane];
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
    (numbers + 0.5f32.next_down()).floor()
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

    #[test]
    fn counts_are_the_nearest_whole_numbers() {
        let below = |number: f32| number.next_down();
        let numbers = [0.0, below(0.5), 0.75, below(1.5), 1.75, 6.25, 7.75, 1e6];
        let found: [f32; LANES] =
            dispatch!(level(), simd => rounded(f32x8::simd_from(simd, numbers)).into());
        assert_eq!(found, numbers.map(f32::round));
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
