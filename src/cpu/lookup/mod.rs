//! The shadow test of every receiver: against what the texels around it hold, as `shaders/lookup.wgsl` does and says.
//!
//! Depths are compared eight receivers of a row at once. The triangles that the texels around the receivers of a block
//! hold are set up once for the block, as the triangles of a cell are in `caster_tests`, and what float32 leaves open is
//! decided in float64.

mod depths;
mod filter;
mod filtered;
mod looked_at;
mod own_blocks;
mod revectorized;
mod row;
mod seams;
mod triangles;
mod warped;

use super::filtered_texels::FilteredTexels;
use super::known::Known;
use super::lanes::{
    Bits, LANES, Simd, bits, dispatch, f32x8, level, mask_bits, mask32x8, splat, u32x8,
};
use super::light_space::LightSpace;
use super::map::Map;
use super::pages::table::Requests;
use super::rasterize::NONE;
use super::receiver_tiles::ReceiverTiles;
use super::receivers::{BlockPlaces, BlockReceivers, KnownPlanes, Receivers, ViewFromEye};
use super::tiles::{BLOCK, TILE, TILE_PIXELS, cut};
use super::warp_map::{CpuWarp, WarpMap};
use crate::bias::{Bias, Plane, Rule};
use crate::fits::layer::Layer;
use crate::lanes::{Lane, V2, V3};
use crate::map_settings::{Comparison, Filter, MapSettings, position_rounding};
use crate::map_size::MapSize;
use crate::projection::{Formulas, KindVisitor, LaneKind};
use crate::warp::Warping;
use fearless_simd::prelude::*;
use glam::DVec2;
use rayon::prelude::*;

/// Texels around a receiver, at most.
const MOST: usize = 25;

/// In place of a triangle: a texel beside the map. `NONE` comes after it.
const OFF_MAP: u32 = NONE - 1;

/// What texels are found for.
#[derive(Clone, Copy)]
enum Purpose<'a> {
    /// To look at what they hold.
    Look,
    /// To know which pages they lie in.
    AskForPages(&'a Requests),
    /// To know which of them are looked at.
    Mark(&'a ReceiverTiles),
}

/// A layer to look up.
pub struct LookedUp<'a> {
    space: LightSpace,
    map: &'a Map,
    purpose: Purpose<'a>,
    /// Of each pixel the number of its layer, and that of this one, where receivers are chosen pixel by pixel.
    chosen: Option<(&'a [u8], u8)>,
    warp: Option<&'a CpuWarp>,
    /// Its moments, where they are compared in place of depths.
    moments: Option<&'a FilteredTexels>,
    /// Where the map's views see points from the eye.
    seen: Vec<ViewFromEye>,
    comparison: Comparison,
    rule: Rule<f64>,
    /// Whether a texel that holds a receiver's own triangle is never before the receiver's plane.
    knows_own: bool,
    /// What rounding may move a position across its surface, world units.
    margin: f32,
    texels: MapSize,
    /// The same for arithmetic.
    size: DVec2,
    centre: DVec2,
}

impl<'a> LookedUp<'a> {
    pub fn new(
        receivers: &Receivers,
        layer: &Layer,
        (map, warp): (&'a Map, Option<&'a CpuWarp>),
        moments: Option<&'a FilteredTexels>,
        settings: MapSettings,
    ) -> Self {
        let projection = &layer.projection;
        let space = LightSpace::new(layer, receivers);
        let rounding = position_rounding(projection, receivers.eye);
        let rule = settings
            .bias
            .depth_bias(projection, rounding)
            .rule(space.unit);
        Self {
            space,
            map,
            purpose: Purpose::Look,
            chosen: None,
            warp,
            moments,
            seen: map
                .views
                .iter()
                .map(|seen| ViewFromEye::new(&seen.view, receivers.eye))
                .collect(),
            comparison: settings.lookup,
            knows_own: settings.knows_own_triangle(),
            rule,
            margin: rounding as f32,
            texels: projection.size(),
            size: projection.size().texels(),
            centre: projection.centre,
        }
    }

    /// For those pixels alone, in tiles, that have the number.
    pub fn of_pixels(self, numbers: &'a [u8], number: u8) -> Self {
        Self {
            chosen: Some((numbers, number)),
            ..self
        }
    }

    /// Asks for the pages of texels in place of looking at them.
    pub fn asking(self, requests: &'a Requests) -> Self {
        Self {
            purpose: Purpose::AskForPages(requests),
            ..self
        }
    }

    /// Marks texels in place of looking at them, where there is no warp.
    pub fn marking(self, tiles: &'a ReceiverTiles) -> Self {
        Self {
            purpose: Purpose::Mark(tiles),
            ..self
        }
    }

    /// The receivers of a block that the layer is for; the pixel's place is that of the first.
    #[inline(always)]
    fn masks<S: Simd>(&self, simd: S, block: &BlockReceivers<S>, first: usize) -> [u32; BLOCK] {
        let Some((numbers, own)) = self.chosen else {
            return self.space.masks(simd, block);
        };
        std::array::from_fn(|i| {
            let numbers = &numbers[first + i * TILE..][..LANES];
            let pairs = numbers.iter().enumerate();
            let own = pairs.fold(0, |mask, (lane, &number)| {
                mask | u32::from(number == own) << lane
            });
            own & block.facing[i]
        })
    }
}

/// 1 lit, 0 in shadow, in between with a filter, NaN where nothing is seen, row by row. What no layer says anything of is
/// lit.
pub fn lookup(receivers: &Receivers, layers: &[LookedUp]) -> Vec<f32> {
    let tiling = receivers.image.tiling;
    let mut visibility = vec![0.0; tiling.width * tiling.height];
    let tiles = cut(&mut visibility, tiling).into_par_iter().enumerate();
    tiles.for_each_init(
        || KnownParts::new(layers),
        |known, (tile, mut rows)| {
            let seen = (receivers, layers, tile);
            dispatch!(level(), simd => answer_tile(simd, seen, Some(&mut rows), known));
        },
    );
    visibility
}

/// Asks for the pages of layers, or marks their tiles, without an answer.
pub fn ask(receivers: &Receivers, layers: &[LookedUp]) {
    let tiles = (0..receivers.image.tiling.tiles()).into_par_iter();
    tiles.for_each_init(
        || KnownParts::new(layers),
        |known, tile| {
            let seen = (receivers, layers, tile);
            dispatch!(level(), simd => answer_tile(simd, seen, None, known));
        },
    );
}

/// What was found of triangles that were asked for before: planes, and for each layer normals.
struct KnownParts {
    planes: KnownPlanes,
    normals: Vec<KnownNormals>,
}

impl KnownParts {
    fn new(layers: &[LookedUp]) -> Self {
        Self {
            planes: KnownPlanes::default(),
            normals: layers.iter().map(|_| KnownNormals::default()).collect(),
        }
    }
}

/// Looks the receivers of a tile up, and writes the answers, if they are asked for.
#[inline(always)]
fn answer_tile<S: Simd>(
    simd: S,
    (receivers, layers, tile): (&Receivers, &[LookedUp], usize),
    mut rows: Option<&mut [&mut [f32]]>,
    KnownParts { planes, normals }: &mut KnownParts,
) {
    let mut block = BlockReceivers::none(simd);
    let mut work = Work::new(simd);
    for pixel in receivers.image.tiling.blocks(tile) {
        let mut lit = [[0.0; LANES]; BLOCK];
        if receivers.block(simd, pixel, 0..BLOCK, planes, &mut block) {
            for (lit, &facing) in lit.iter_mut().zip(&block.facing) {
                let facing = mask32x8::from_bitmask(simd, u64::from(facing));
                *lit = facing.select(splat(simd, 1.0), splat(simd, 0.0)).into();
            }
            let first = receivers.image.tiling.index(pixel.0, pixel.1);
            for (layer, normals) in layers.iter().zip(&mut *normals) {
                let masks = layer.masks(simd, &block, first);
                if masks != [0; BLOCK] {
                    layer.space.kind.visit(BlockLookup {
                        simd,
                        receivers,
                        layer,
                        block: &block,
                        masks: &masks,
                        pixel,
                        normals,
                        work: &mut work,
                        patch: None,
                        lit: &mut lit,
                    });
                }
            }
        }
        if let Some(rows) = &mut rows {
            receivers
                .image
                .write(simd, rows, pixel, |i| f32x8::simd_from(simd, lit[i]));
        }
    }
}

/// Of triangles that were asked for before, the plane's unit normal to the side of the light, in the world and as a covector
/// of projection space.
type KnownNormals = Known<[f32; 6], 256>;

/// Room for what is found in a block.
struct Work<S: Simd> {
    /// The triangles around the receivers of each row.
    ids: [[[u32; LANES]; MOST]; BLOCK],
    candidates: Vec<u32>,
    places: BlockPlaces<S>,
}

impl<S: Simd> Work<S> {
    fn new(simd: S) -> Self {
        Self {
            ids: [[[NONE; LANES]; MOST]; BLOCK],
            candidates: Vec::new(),
            places: BlockPlaces::none(simd),
        }
    }
}

struct BlockLookup<'a, S: Simd> {
    simd: S,
    receivers: &'a Receivers<'a>,
    layer: &'a LookedUp<'a>,
    block: &'a BlockReceivers<S>,
    /// The receivers that the layer is for.
    masks: &'a [u32; BLOCK],
    /// The block's first one.
    pixel: (usize, usize),
    normals: &'a mut KnownNormals,
    work: &'a mut Work<S>,
    /// The patches of the receivers of the last row, and the functions that are theirs.
    patch: Option<Patch<S>>,
    lit: &'a mut [[f32; LANES]; BLOCK],
}

/// Functions of rows and of columns; first and last texel of their patches.
type Patch<S> = (V2<f32x8<S>>, [V2<f32x8<S>>; 2]);

/// Eight receivers in a layer.
struct RowReceivers<S: Simd> {
    plane: Plane<f32x8<S>>,
    bias: Bias<f32x8<S>>,
    from_light: V3<f32x8<S>>,
    /// Their own place in the map, in centred texels.
    own: V2<f32x8<S>>,
    /// Where their lookup begins, and the texel that holds it.
    place: V2<f32x8<S>>,
    middle: V2<f32x8<S>>,
    /// The same before the warp, from 0 to 1 along each side, and the functions that warp it.
    linear: V2<f32x8<S>>,
    functions: V2<f32x8<S>>,
    /// First and last texel that they take places to side by side: all of the map, if it is not torn.
    patch: [V2<f32x8<S>>; 2],
    /// Those on the map.
    on_map: mask32x8<S>,
}

/// How places become texels, and what is taken off depths.
type Formula<'a, S, F> = (&'a F, &'a Rule<f32x8<S>>);

impl<S: Simd> KindVisitor for BlockLookup<'_, S> {
    type Output = ();

    #[inline(always)]
    fn visit<K: LaneKind>(mut self, kind: &K) {
        let simd = self.simd;
        let zero = splat(simd, 0.0);
        let kind = kind.in_lanes(self.layer.space.unit, zero);
        let rule = self.layer.rule.map(|v| zero.constant(v));
        let formula = (&kind, &rule);
        if let Purpose::Mark(tiles) = self.layer.purpose {
            return apart(
                simd,
                #[inline(always)]
                || self.mark_block(formula, tiles),
            );
        }
        match (self.layer.comparison.filter, self.layer.moments) {
            (Some(filter), _) => apart(
                simd,
                #[inline(always)]
                || self.filter_block(formula, filter),
            ),
            (_, Some(moments)) => apart(
                simd,
                #[inline(always)]
                || self.look_at_moments_of_block(formula, moments),
            ),
            _ if self.layer.comparison.is_revectorized => apart(
                simd,
                #[inline(always)]
                || self.revectorize_block(formula),
            ),
            _ => apart(
                simd,
                #[inline(always)]
                || self.compare_block(formula),
            ),
        }
    }
}

/// Works with lanes in a function of its own. What a projection and a lookup have in common is inlined into each of their
/// functions: all of them in one would take minutes to compile.
#[inline(never)]
fn apart<S: Simd>(simd: S, work: impl FnOnce()) {
    simd.vectorize(work);
}

impl<S: Simd> BlockLookup<'_, S> {
    #[inline(always)]
    fn filter_block<F: Formulas<f32x8<S>>>(
        &mut self,
        (kind, rule): Formula<'_, S, F>,
        filter: Filter,
    ) {
        for i in self.rows() {
            let row = self.row(kind, rule, i);
            self.filter(kind, rule, &row, i, filter);
        }
    }

    #[inline(always)]
    fn look_at_moments_of_block<F: Formulas<f32x8<S>>>(
        &mut self,
        (kind, rule): Formula<'_, S, F>,
        moments: &FilteredTexels,
    ) {
        for i in self.rows() {
            let row = self.row(kind, rule, i);
            self.look_at_moments(kind, rule, &row, i, moments);
        }
    }

    #[inline(always)]
    fn revectorize_block<F: Formulas<f32x8<S>>>(&mut self, (kind, rule): Formula<'_, S, F>) {
        for i in self.rows() {
            let row = self.row(kind, rule, i);
            self.revectorize(kind, rule, &row, i);
        }
    }

    #[inline(always)]
    fn compare_block<F: Formulas<f32x8<S>>>(&mut self, (kind, rule): Formula<'_, S, F>) {
        if self.is_of_own(kind) {
            return;
        }
        let mut left = [0; BLOCK];
        for i in self.rows() {
            let row = self.row(kind, rule, i);
            left[i] = self.compare(kind, rule, &row, i);
        }
        if left != [0; BLOCK] {
            self.test_triangles(&left);
        }
    }

    /// Those in which the layer has receivers.
    #[inline(always)]
    fn rows(&self) -> Bits {
        let rows = self.masks.iter().enumerate();
        bits(rows.fold(0, |rows, (i, &mask)| rows | u32::from(mask != 0) << i))
    }

    #[inline(always)]
    fn v2(&self, v: DVec2) -> V2<f32x8<S>> {
        V2::new(splat(self.simd, v.x as f32), splat(self.simd, v.y as f32))
    }

    /// The warp, where it tears the map between its functions.
    #[inline(always)]
    fn tearing_warp(&self) -> Option<&WarpMap> {
        let functions = self.layer.warp.and_then(Warping::functions);
        functions.filter(|map| map.warp.functions > 1)
    }

    /// The middle of a texel before the warp, in texels.
    #[inline(always)]
    fn linear_middle(&self, texel: V2<f32x8<S>>) -> V2<f32x8<S>> {
        match self.layer.warp {
            None => texel + V2::splat(splat(self.simd, 0.5)),
            Some(warp) => {
                let linear = warp.linear_from_texel(texel);
                linear.zip(self.v2(self.layer.size), |v, size| v * size)
            }
        }
    }

    /// From the receivers to a place before the warp, in texels.
    #[inline(always)]
    fn step_to(&self, row: &RowReceivers<S>, place: V2<f32x8<S>>) -> V2<f32x8<S>> {
        place - self.v2(self.layer.centre) - row.own
    }

    /// Which places are on the map. Rounding may move a receiver at the border.
    #[inline(always)]
    fn is_on_map(&self, place: V2<f32x8<S>>) -> mask32x8<S> {
        let half = splat(self.simd, 0.5);
        let off = place.zip(self.v2(self.layer.size), |place, size| {
            Lane::abs(place - size * half) - size * half
        });
        Lane::at_most(Lane::max(off.x, off.y), half)
    }

    /// Depths that texels hold.
    #[inline(always)]
    fn stored(&self, index: [u32; LANES]) -> f32x8<S> {
        let mut stored = [0.0; LANES];
        for (stored, index) in stored.iter_mut().zip(index) {
            *stored = self.layer.map.depths[index as usize];
        }
        f32x8::simd_from(self.simd, stored)
    }

    /// Triangles that texels hold.
    #[inline(always)]
    fn triangles(&self, index: [u32; LANES]) -> [u32; LANES] {
        let mut ids = [NONE; LANES];
        for (id, index) in ids.iter_mut().zip(index) {
            *id = self.layer.map.image.triangles[index as usize];
        }
        ids
    }

    /// Where the texels of some receivers are in the map's memory; those of the others are any.
    #[inline(always)]
    fn index(&self, asking: mask32x8<S>, texel: V2<f32x8<S>>) -> [u32; LANES] {
        let (x, y): (u32x8<S>, u32x8<S>) = (texel.x.to_int(), texel.y.to_int());
        if let Purpose::AskForPages(requests) = self.layer.purpose {
            requests.ask(mask_bits(asking), x.into(), y.into());
            return [0; LANES];
        }
        if let Some(pages) = &self.layer.map.pages {
            return pages.indices(mask_bits(asking), x.into(), y.into());
        }
        let columns = self.layer.map.image.tiling.columns as u32;
        let shift = TILE.ilog2();
        let tile = (y >> shift) * columns + (x >> shift);
        let last = TILE as u32 - 1;
        let index = tile * TILE_PIXELS as u32 + ((y & last) << shift) + (x & last);
        index.into()
    }
}
