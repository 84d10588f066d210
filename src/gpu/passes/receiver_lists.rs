//! Pass "receiver lists": receivers sorted into the texels of the light's grid, `shaders/receiver_lists.wgsl`.

use super::inputs::Receivers;
use super::light_grid::{GRID_TILE, LightGrid};
use super::warp_map::WarpMap;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::stats::Fact;

pub const LABEL: &str = "receiver lists";

/// Texels that an invocation adds up, as in the shader.
const SEGMENT: u64 = 256;

/// Tiles of a workgroup of `measure`, as in the shader.
const MEASURED_TILES: u32 = 4;

/// Bytes of a receiver in the longest list.
pub const RECEIVER_BYTES: u64 = 16;

/// Lists on the device; see the shader for what each holds.
pub struct ReceiverLists {
    pub starts: PooledBuffer,
    pub listed: PooledBuffer,
    pub details: PooledBuffer,
    pub tiles: PooledBuffer,
}

/// What the dispatches leave for each other, on the device.
struct Scratch {
    counts: PooledBuffer,
    places: PooledBuffer,
    sums: PooledBuffer,
    counters: PooledBuffer,
}

fn scratch(frame: &mut Recording, grid: &LightGrid, pixels: u64) -> Result<Scratch> {
    let segments = grid.texel_count().div_ceil(SEGMENT);
    let scratch = Scratch {
        counts: frame.storage("lengths of lists", 4 * grid.texel_count())?,
        places: frame.storage("places of receivers", 8 * pixels)?,
        sums: frame.storage("sums of lengths", 4 * segments)?,
        counters: frame.storage("counters", 8)?,
    };
    frame.clear(&scratch.counts);
    frame.clear(&scratch.counters);
    Ok(scratch)
}

fn new_lists(frame: &Recording, grid: &LightGrid, pixels: u64) -> Result<ReceiverLists> {
    Ok(ReceiverLists {
        starts: frame.storage("starts of lists", 4 * (grid.texel_count() + 1))?,
        listed: frame.storage(LABEL, RECEIVER_BYTES * pixels)?,
        details: frame.storage("details of receivers", 8 * pixels)?,
        tiles: frame.storage("tiles of receivers", 24 * grid.tile_count())?,
    })
}

/// Lists the receivers of the grid's rows that the shadow map does not settle, in an image that was begun.
/// Tiles are of all rows.
pub fn receiver_lists(
    frame: &mut Recording,
    seen: Receivers,
    grid: &LightGrid,
    warp: Option<&WarpMap>,
    shadow_map: &wgpu::Buffer,
    visibility: &wgpu::Buffer,
) -> Result<ReceiverLists> {
    let gpu = frame.gpu.clone();
    let pixels = u64::from(seen.camera.width) * u64::from(grid.uniform.row_count);
    let segments = grid.texel_count().div_ceil(SEGMENT);
    let Scratch {
        counts,
        places,
        sums,
        counters,
    } = scratch(frame, grid, pixels)?;
    let lists = new_lists(frame, grid, pixels)?;

    let rows = gpu.work_per_invocation(1, 32);
    let kernel = Kernel::new("receiver_lists").uniform(0, &grid.uniform);
    let of_light = grid.of_rays(kernel.clone());
    let of_image = of_light.clone();
    let of_image = of_image.receivers(seen, &seen.camera_uniform());
    let of_image = of_image.tiles(seen, rows).bind(4, &places);
    let summing = |entry_point| kernel.clone().entry(entry_point).bind(7, &sums);

    let count = of_image.clone().entry("count");
    let count = count
        .triangles(seen.scene)
        .masks(seen.scene.masks.as_ref())
        .warp(warp)
        .bind(15, &counts)
        .bind(16, visibility)
        .bind(17, shadow_map)
        .constant("settles", frame.culls);
    let sum = summing("sum").bind(13, &counts).bind(9, &counters);
    let scan = summing("scan").bind(14, &lists.starts).bind(9, &counters);
    let place = summing("place").bind(14, &lists.starts).bind(13, &counts);
    let listing = |kernel: Kernel| kernel.bind(14, &lists.starts).bind(5, &lists.listed);
    let scatter = listing(of_image.entry("scatter")).bind(6, &lists.details);
    let measure = listing(of_light.entry("measure")).bind(8, &lists.tiles);

    let image = seen.groups_of_rows(grid.uniform.row_count, rows);
    let by_segment = Groups::Grid(segments.div_ceil(64) as u32, 1);
    let tiles = grid.uniform.tiles;
    let by_tile = Groups::Grid(tiles.div_ceil(MEASURED_TILES), tiles);
    let dispatches = [
        count.dispatch(image.clone()),
        sum.dispatch(by_segment.clone()),
        scan.dispatch(Groups::ONE),
        place.dispatch(by_segment),
        scatter.dispatch(image),
        measure.dispatch(by_tile),
    ];
    frame.pass(LABEL, &dispatches);
    debug_assert_eq!(GRID_TILE, 16, "a row of a tile an invocation of `measure`");
    frame.count(LABEL, counters, 2, |_, counters| {
        let receivers = Fact::sum("receivers", counters[0]);
        Ok(vec![receivers, Fact::maximum("longest_list", counters[1])])
    })?;
    Ok(lists)
}
