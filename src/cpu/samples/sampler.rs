//! The samples of one tile: those of whole pixels together, the others one by one.

use super::super::caster_tests::{Known, Lit, Tests};
use super::super::extents::{Extent, add_extents};
use super::super::lanes::{LANES, Simd, bits, dispatch, level};
use super::super::light_grids::SeenGrid;
use super::super::rasterize::{NONE, Painter};
use super::super::receivers::{BlockPlaces, BlockReceivers, Receivers, ViewFromEye};
use super::super::tiles::{BLOCK, TILE};
use super::cover::TileCover;
use super::draw::{DrawnSamples, SampledTile};
use super::footprints::{BlockFootprints, BlockSquares};
use super::pattern::Pattern;
use super::receivers::{SampleRow, SampleRows};
use crate::occlusion::{RayOf, ReceiverRay};
use std::sync::OnceLock;

/// What was found of the pixels' samples, and how.
#[derive(Debug, Clone, Copy, Default)]
pub struct Effort {
    /// Pixels of which all samples see one triangle, and those of them whose samples were tested one by one.
    pub whole_pixels: u64,
    pub open_pixels: u64,
    /// Pixels whose samples were drawn one by one.
    pub mixed_pixels: u64,
    /// Samples that were tested one by one.
    pub tested_samples: u64,
}

impl Effort {
    pub fn and(self, other: Self) -> Self {
        Self {
            whole_pixels: self.whole_pixels + other.whole_pixels,
            open_pixels: self.open_pixels + other.open_pixels,
            mixed_pixels: self.mixed_pixels + other.mixed_pixels,
            tested_samples: self.tested_samples + other.tested_samples,
        }
    }
}

/// The rows of a tile: of each pixel how many samples are lit, and how many see a surface.
pub type TileRows<'a> = [Vec<&'a mut [u8]>; 2];

/// What samples are drawn and tested with.
pub struct Sampler<'a> {
    pub painter: &'a Painter<'a>,
    pub pattern: &'a Pattern,
    pub receivers: &'a Receivers<'a>,
    pub views: &'a [ViewFromEye],
    pub grids: &'a [Vec<SeenGrid>],
}

/// What a thread keeps from tile to tile.
#[derive(Default)]
pub struct Scratch {
    known: Known,
    drawn: DrawnSamples,
}

/// A tile that is being answered.
struct Testing<'t, 'r, S: Simd> {
    rows: &'t mut TileRows<'r>,
    /// The tile's first pixel.
    corner: (usize, usize),
    known: &'t mut Known,
    /// Samples on their way to the tests.
    samples: SampleRows,
    block: BlockReceivers<S>,
    places: BlockPlaces<S>,
    squares: BlockSquares<S>,
    footprints: BlockFootprints<S>,
    /// Of the receivers that fall in no grid.
    beside: [Extent; 6],
    /// Whether some are in a crowd whose grid is to be made.
    waits: bool,
    effort: Effort,
}

impl Sampler<'_> {
    /// Counts the samples of a tile. Where some fall in no grid or in a crowd without one, it is for nothing, and the
    /// extents of those in none come with it.
    pub fn answer_tile(
        &self,
        tile: usize,
        cover: &TileCover,
        rows: &mut TileRows,
        scratch: &mut Scratch,
    ) -> (Effort, Option<[Extent; 6]>) {
        dispatch!(level(), simd => self.answer_in_lanes(simd, tile, cover, rows, scratch))
    }

    #[inline(always)]
    fn answer_in_lanes<S: Simd>(
        &self,
        simd: S,
        tile: usize,
        cover: &TileCover,
        rows: &mut TileRows,
        Scratch { known, drawn }: &mut Scratch,
    ) -> (Effort, Option<[Extent; 6]>) {
        let tiling = self.painter.tiling;
        let corner = tiling.corner(tile);
        let (painter, pattern) = (self.painter, self.pattern);
        drawn.draw(
            simd,
            SampledTile {
                painter,
                pattern,
                cover,
                corner,
            },
        );
        for row in rows.iter_mut().flatten() {
            row.fill(0);
        }
        let mut testing = Testing {
            rows,
            corner,
            known,
            samples: SampleRows::NONE,
            block: BlockReceivers::none(simd),
            places: BlockPlaces::none(simd),
            squares: BlockSquares::none(simd),
            footprints: BlockFootprints::none(simd),
            beside: [Extent::EMPTY; 6],
            waits: false,
            effort: Effort::default(),
        };
        for pixel in tiling.blocks(tile) {
            let (x, y) = (pixel.0 - corner.0, pixel.1 - corner.1);
            let in_block =
                |of: &[u64; TILE]| std::array::from_fn(|i| (of[y + i] >> x) as u32 & 0xff);
            let [whole, mixed]: [[u32; BLOCK]; 2] =
                [in_block(&cover.whole), in_block(&cover.mixed)];
            let mut open = [0; BLOCK];
            if whole != [0; BLOCK] {
                open = self.answer_whole(simd, pixel, (cover, &whole), &mut testing);
            }
            for i in 0..BLOCK {
                for column in bits(open[i]) {
                    let at = (pixel.0 + column, pixel.1 + i);
                    let id = cover.ids[(y + i) * TILE + x + column];
                    self.push_pixel(simd, at, |_| [id; LANES], &mut testing);
                }
                for column in bits(mixed[i]) {
                    let at = (pixel.0 + column, pixel.1 + i);
                    let ids = drawn.of_pixel((y + i) * TILE + x + column, pattern.eights());
                    let seen = ids.iter().filter(|&&id| id != NONE).count();
                    testing.rows[1][y + i][x + column] = seen as u8;
                    let of = |eight: usize| {
                        let ids = ids[eight * LANES..].first_chunk();
                        *ids.expect("eight by eight")
                    };
                    self.push_pixel(simd, at, of, &mut testing);
                }
                let effort = &mut testing.effort;
                effort.whole_pixels += u64::from(whole[i].count_ones());
                effort.open_pixels += u64::from(open[i].count_ones());
                effort.mixed_pixels += u64::from(mixed[i].count_ones());
            }
        }
        self.test_samples(simd, &mut testing);
        let Testing { beside, waits, .. } = testing;
        let is_open = waits || beside.iter().any(|extent| !extent.is_empty());
        (testing.effort, is_open.then_some(beside))
    }

    /// Writes the answers of the whole pixels of a block, and gives those whose samples are to be tested.
    #[inline(always)]
    fn answer_whole<S: Simd>(
        &self,
        simd: S,
        pixel: (usize, usize),
        (cover, whole): (&TileCover, &[u32; BLOCK]),
        testing: &mut Testing<S>,
    ) -> [u32; BLOCK] {
        let Testing {
            rows,
            corner,
            known,
            block,
            squares,
            footprints,
            ..
        } = testing;
        let (x, y) = (pixel.0 - corner.0, pixel.1 - corner.1);
        let count = self.pattern.count as u8;
        for (i, &whole) in whole.iter().enumerate() {
            // Of the others any will do that is looked up anyway.
            let of_row = &cover.ids[(y + i) * TILE + x..][..LANES];
            let first = match whole {
                0 => NONE,
                _ => of_row[whole.trailing_zeros() as usize],
            };
            for (lane, id) in block.ids[i].iter_mut().enumerate() {
                let is_whole = whole >> lane & 1 != 0;
                *id = if is_whole { of_row[lane] } else { first };
            }
            block.is_one[i] = block.ids[i].iter().all(|id| *id == first);
            for column in bits(whole) {
                rows[1][y + i][x + column] = count;
            }
        }
        let planes = &mut known.planes;
        if !self
            .receivers
            .squares(simd, pixel, whole, planes, block, squares)
        {
            return [0; BLOCK];
        }
        let ray = |_: (usize, usize), _: u32| unreachable!("footprints leave samples open");
        let tests = self.tests(&ray);
        let decided = tests.footprints(simd, block, squares, footprints, known);
        for (i, &lit) in decided.lit.iter().enumerate() {
            for column in bits(lit) {
                rows[0][y + i][x + column] = count;
            }
        }
        decided.open
    }

    /// Hands the samples of a pixel to the tests, by the triangles that they see, in eights.
    #[inline(always)]
    fn push_pixel<S: Simd>(
        &self,
        simd: S,
        pixel: (usize, usize),
        ids: impl Fn(usize) -> [u32; LANES],
        testing: &mut Testing<S>,
    ) {
        for eight in 0..self.pattern.eights() {
            let (mut ids, lanes) = (ids(eight), self.pattern.lanes(eight));
            for id in &mut ids[lanes.count_ones() as usize..] {
                *id = NONE;
            }
            let samples = &mut testing.samples;
            samples.rows[samples.count] = SampleRow { pixel, eight };
            samples.ids[samples.count] = ids;
            samples.count += 1;
            if samples.count == BLOCK {
                self.test_samples(simd, testing);
            }
        }
    }

    /// Tests the samples that were handed over.
    #[inline(never)]
    fn test_samples<S: Simd>(&self, simd: S, testing: &mut Testing<S>) {
        simd.vectorize(
            #[inline(always)]
            || self.test_in_lanes(simd, testing),
        );
    }

    #[inline(always)]
    fn test_in_lanes<S: Simd>(&self, simd: S, testing: &mut Testing<S>) {
        let Testing {
            rows,
            corner,
            known,
            samples,
            block,
            places,
            beside,
            waits,
            effort,
            ..
        } = testing;
        let (pattern, receivers) = (self.pattern, self.receivers);
        if receivers.samples(simd, pattern, samples, &mut known.planes, block) {
            let width = receivers.camera.width as usize;
            // Many samples are on one triangle: its normal is found once, as a ray of its own would.
            let normals = [const { OnceLock::new() }; BLOCK * LANES];
            let ids = samples.ids.as_flattened();
            let ray = |(lane, row): (usize, usize), triangle: u32| {
                let SampleRow { pixel, eight } = samples.rows[row];
                let camera = &pattern.cameras[eight * LANES + lane];
                let pixel = (pixel.1 * width + pixel.0) as u32;
                let first = ids.iter().position(|&id| id == triangle);
                let normal = normals[first.expect("a sample that is tested")]
                    .get_or_init(|| ReceiverRay::normal(receivers.scene, camera.eye, triangle));
                let seen = (receivers.scene, camera);
                ReceiverRay::along(seen, receivers.light, pixel, triangle, *normal)
            };
            let tests = self.tests(&ray);
            let found = tests.lit(simd, (0, 0), block, places, known);
            let Lit { lit, left, .. } = found;
            *waits |= found.waits;
            add_extents(simd, self.views, block, &left, places, beside);
            for (row, lit) in samples.rows[..samples.count].iter().zip(lit) {
                let (x, y) = (row.pixel.0 - corner.0, row.pixel.1 - corner.1);
                rows[0][y][x] += lit.count_ones() as u8;
            }
            let facing: u32 = block.facing.iter().map(|facing| facing.count_ones()).sum();
            effort.tested_samples += u64::from(facing);
        }
        samples.count = 0;
    }

    fn tests<'t>(&'t self, ray: &'t RayOf<'t>) -> Tests<'t> {
        Tests {
            scene: self.painter.scene,
            light_at: self.receivers.light_at,
            views: self.views,
            grids: self.grids,
            ray,
            trusts_hits: true,
        }
    }
}
