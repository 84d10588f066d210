//! Exact rasterization of the scene's triangles through a projection, `shaders/rasterize.wgsl`; through a
//! warp of many functions, `shaders/rasterize_bands.wgsl`.

use super::stored_pages::StoredPages;
use super::tessellate::{self, tessellate};
use super::warp_map::WarpMap;
use super::work_items::{self, Counters, Stages};
use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::kernel::Kernel;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::projection_uniform::ProjectionUniform;
use crate::gpu::recording::{Counted, Recording};
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::shader_struct::shader_struct;
use crate::map_settings::Rasterization;
use crate::projection::Projection;
use crate::stats::Fact;

/// What a texel keeps of the nearest triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// 32 bits: the depth.
    Depth,
    /// 64 bits: the depth and the triangle.
    DepthTriangle,
}

impl Target {
    pub fn texel_bytes(self) -> usize {
        match self {
            Self::Depth => 4,
            Self::DepthTriangle => 8,
        }
    }
}

shader_struct! {
    pub struct RasterizationUniform is Job in "lib/coverage" {
        projection: ProjectionUniform,
        triangle_count: u32,
        coarse_shift: u32,
        tile_bits: [u32; 2],
        band_bits: u32,
        has_bands: u32,
        steps_per_depth: f32,
        last_step: f32,
    }
}

/// Binary logarithm of the side of the tiles that are drawn: the same in `shaders/lib/fine_tiles.wgsl`.
pub const FINE_SHIFT: u32 = 3;

/// With more, what a triangle hides is not looked for: it takes a look at all bands of a tile in each of them, and
/// all loops of an invocation together must stay below 65,535 iterations.
const MAX_HIDING_BANDS: u32 = 64;

/// Columns and rows of them.
pub fn tiles_of_map(projection: &Projection) -> [u32; 2] {
    [projection.width, projection.height].map(|side| side.div_ceil(1 << FINE_SHIFT))
}

/// A map to draw.
#[derive(Clone, Copy)]
pub struct RasterJob<'a> {
    pub projection: &'a Projection,
    pub warp: Option<&'a WarpMap>,
    pub target: Target,
    pub rasterization: Rasterization,
    /// From `receiver_tiles`, of `FINE_SHIFT`: what the other tiles hold is undefined.
    pub receiver_tiles: Option<&'a wgpu::Buffer>,
    /// Those of the map that are stored, without a warp; `None`: all of it is.
    pub pages: Option<&'a StoredPages>,
}

impl<'a> RasterJob<'a> {
    /// An exact map of depths and triangles, not warped.
    pub fn plain(projection: &'a Projection) -> Self {
        Self {
            projection,
            warp: None,
            target: Target::DepthTriangle,
            rasterization: Rasterization::Exact,
            receiver_tiles: None,
            pages: None,
        }
    }

    pub fn texel_count(&self) -> usize {
        self.pages
            .map_or(self.projection.texel_count(), StoredPages::texel_count)
    }

    fn tile_count(&self) -> usize {
        let [columns, rows] = tiles_of_map(self.projection).map(|side| side as usize);
        let of_pages = |pages: &StoredPages| pages.texel_count() >> (2 * FINE_SHIFT);
        self.pages.map_or(columns * rows, of_pages)
    }
}

/// Binary logarithm of the side of the tiles that a large triangle is cut into first: coarser ones for larger maps, so
/// that none is cut into more than 64 x 64 of them.
pub fn coarse_shift(projection: &Projection) -> u32 {
    let side = projection.width.max(projection.height).div_ceil(64);
    side.next_power_of_two().max(128).trailing_zeros()
}

impl Kernel {
    /// Fills the slot that reads the texels of a map.
    pub fn stored(self, target: Target) -> Self {
        self.fill(match target {
            Target::Depth => "stored/depth",
            Target::DepthTriangle => "stored/depth_triangle",
        })
    }
}

/// A map's parts and who draws them.
struct Drawing<'a> {
    job: RasterJob<'a>,
    /// Triangles that were split; they are in the map, beyond projection and warp.
    pieces: Option<PooledBuffer>,
    /// Of the functions along x of a warp.
    bands: u32,
    /// Whether a part is of one band: of a warp of many functions a tile's bound says little.
    has_bands: bool,
}

impl<'a> Drawing<'a> {
    fn new(job: RasterJob<'a>, pieces: Option<PooledBuffer>) -> Self {
        let warp = job.warp.filter(|_| pieces.is_none());
        let bands = warp.map_or(1, |warp| warp.layout.functions[0]);
        Self {
            job: RasterJob { warp, ..job },
            pieces,
            bands,
            has_bands: bands > 1 && job.projection.kind.has_straight_edges(),
        }
    }

    /// The shader with its constants, and the casters and the warp that its entry points read.
    fn kernel(&self, frame: &Recording, scene: &SceneTables) -> Kernel {
        let file = match self.has_bands {
            true => "rasterize_bands",
            false => "rasterize",
        };
        let kernel = Kernel::new(file)
            .uniform(0, &self.uniform(scene))
            .constant("culls_by_depth", frame.culls)
            .warp(self.job.warp);
        let kernel = match self.job.pages {
            None => kernel.constant("has_receiver_tiles", self.job.receiver_tiles.is_some()),
            Some(pages) => kernel.stored_pages(pages),
        };
        let culls_hidden = frame.culls && self.bands <= MAX_HIDING_BANDS;
        match &self.pieces {
            None => kernel
                .projected(self.job.projection)
                .constant("culls_hidden", culls_hidden)
                .triangles(scene),
            Some(pieces) => kernel.fill("caster/pieces").bind(1, pieces),
        }
    }

    /// The walks that draw the texels: two where the device cannot find the nearest depth and its triangle at once.
    fn walks(&self, gpu: &Gpu, walk: &Kernel) -> Vec<Kernel> {
        let walk = |target| walk.clone().fill(target);
        match self.job.target {
            Target::Depth => vec![walk("target/depth")],
            Target::DepthTriangle if gpu.has_64_bit_atomics() => {
                vec![walk("target/depth_triangle")]
            }
            Target::DepthTriangle => {
                let walk = |before: u32| {
                    let walk = walk("target/depth_then_triangle");
                    walk.uniform(15, &before)
                };
                vec![walk(0), walk(1)]
            }
        }
    }

    fn uniform(&self, scene: &SceneTables) -> RasterizationUniform {
        let projection = self.job.projection;
        let tile_bits = tile_bits(projection.width, projection.height);
        // A band that there is not stands for a whole triangle.
        let band_bits = match self.has_bands {
            true => u32::BITS - self.bands.leading_zeros(),
            false => 1,
        };
        let depth_bits = u32::BITS - tile_bits[0] - tile_bits[1] - band_bits;
        // Steps are told apart in float32 with room for rounding.
        let last_step = f64::from((1u32 << depth_bits.min(16)) - 1);
        RasterizationUniform {
            projection: ProjectionUniform::new(projection, scene.origin),
            triangle_count: scene.triangle_count,
            coarse_shift: coarse_shift(projection),
            tile_bits,
            band_bits,
            has_bands: u32::from(self.has_bands),
            steps_per_depth: (last_step / projection.greatest_stored_depth()).max(0.0) as f32,
            last_step: last_step as f32,
        }
    }

    /// Triangles or items that an invocation takes one after the other: all of its loops together must stay below
    /// 65,535 iterations.
    fn per_invocation(&self, gpu: &Gpu) -> u32 {
        let Projection { width, height, .. } = *self.job.projection;
        let coarse = coarse_shift(self.job.projection);
        let [columns, rows] = [width, height].map(|side| side.div_ceil(1 << coarse));
        // So many coarse tiles a triangle may be cut into.
        let most = gpu
            .work_per_invocation(1, 64)
            .min(60_000 / (columns * rows));
        if self.has_bands {
            assert!(self.bands <= max_bands(width, height));
        }
        // A lane takes several bands and columns of functions of an item.
        match self.bands {
            1 => most,
            _ => most.min(32),
        }
    }
}

/// Records the pass under the label.
pub fn rasterize(
    frame: &mut Recording,
    label: &'static str,
    scene: &SceneTables,
    job: RasterJob,
) -> Result<PooledBuffer> {
    let projection = job.projection;
    let texel_bytes = job.target.texel_bytes();
    let texels = frame.storage(label, (job.texel_count() * texel_bytes) as u64)?;
    frame.clear(&texels);
    let counters = work_items::counters(frame)?;
    let pieces = match job.rasterization {
        Rasterization::Exact => None,
        Rasterization::Linear { longest_edge } => Some(tessellate(
            frame,
            label,
            scene,
            projection,
            job.warp,
            longest_edge,
            &counters,
        )?),
    };
    let drawing = Drawing::new(job, pieces);
    let depths_of_tiles = frame.storage("depths of tiles", 4 * job.tile_count() as u64)?;
    frame.clear(&depths_of_tiles);
    let unused = frame.storage("unused tiles", 4)?;

    let bin = drawing.kernel(frame, scene);
    let prepare_bin = drawing.pieces.as_ref();
    let prepare_bin = prepare_bin.map(|pieces| bin.bare().bind(1, pieces));
    let drawn = match drawing.pieces {
        None => bin.clone().bind(10, &scene.unit_normals),
        Some(_) => bin.clone(),
    };
    let drawn = drawn.bind(13, &depths_of_tiles);
    let tiles = job.receiver_tiles.unwrap_or(&unused);
    // Of a map in pages their table says what is looked at.
    let looked_at = |kernel: Kernel| match job.pages {
        None => kernel.bind(9, tiles),
        Some(_) => kernel,
    };
    let masks = scene.masks.as_ref();
    let stages = Stages {
        triangles: u64::from(scene.triangle_count),
        per_invocation: drawing.per_invocation(&frame.gpu),
        counters,
        prepare_bin,
        bin: looked_at(bin),
        split: looked_at(drawn.clone()).mask_numbers(masks),
        walks: drawing.walks(&frame.gpu, &drawn.bind(5, &texels).masks(masks)),
    };
    let room = scene.room.clone();
    let parts = vec![work_items::record(frame, label, &room, stages)?];
    frame.count_parts(label, parts, move |gpu, parts| {
        let counters = Counters::joined(parts);
        let mut facts = work_items::describe(&room, &counters);
        facts.push(Fact::sum("hidden_items", counters.hidden));
        let had_room = tessellate::had_room(gpu, &room, &counters)?
            && work_items::had_room(gpu, &room, &counters)?;
        Ok(Counted { facts, had_room })
    });
    Ok(texels)
}

/// Bits that count the tiles along each side of a map.
fn tile_bits(width: u32, height: u32) -> [u32; 2] {
    [width, height].map(|side| u32::BITS - ((side - 1) >> FINE_SHIFT | 1).leading_zeros())
}

/// Functions along an axis of a warp that an item of work can tell apart, in a map of so many texels.
pub fn max_bands(width: u32, height: u32) -> u32 {
    let [x, y] = tile_bits(width, height);
    ((1u64 << (u32::BITS - x - y)) - 1) as u32
}
