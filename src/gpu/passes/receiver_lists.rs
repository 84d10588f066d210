//! Pass "receiver lists": receivers sorted into the texels of the light's grid, `shaders/receiver_lists.wgsl`.

use super::facts::{Fact, Facts, PendingFacts};
use super::inputs::Receivers;
use super::light_grid::{LightGrid, TILE};
use super::warp_map::{self, WarpMap};
use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::frame::{Dispatch, Frame, Groups, Source, buffer, joined};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shaders::{Shader, flag};

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

fn describe(_gpu: &Gpu, counters: &[u32]) -> Result<Facts> {
    Ok(vec![
        Fact::sum("receivers", counters[0]),
        Fact::maximum("longest_list", counters[1]),
    ])
}

/// What the dispatches leave for each other, on the device.
struct Scratch {
    counts: PooledBuffer,
    places: PooledBuffer,
    sums: PooledBuffer,
    counters: PooledBuffer,
}

fn scratch(frame: &mut Frame, grid: &LightGrid, pixels: u64) -> Result<Scratch> {
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

fn new_lists(frame: &Frame, grid: &LightGrid, pixels: u64) -> Result<ReceiverLists> {
    Ok(ReceiverLists {
        starts: frame.storage("starts of lists", 4 * (grid.texel_count() + 1))?,
        listed: frame.storage(LABEL, RECEIVER_BYTES * pixels)?,
        details: frame.storage("details of receivers", 8 * pixels)?,
        tiles: frame.storage("tiles of receivers", 24 * grid.tile_count())?,
    })
}

fn shader(warp: Option<&WarpMap>) -> Shader {
    Shader {
        warp: warp_map::shader(warp),
        ..Shader::new("receiver_lists")
    }
}

/// Lists the receivers of the grid's rows that the shadow map does not settle, in an image that was begun.
/// Tiles are of all rows.
pub fn receiver_lists(
    frame: &mut Frame,
    seen: Receivers,
    grid: &LightGrid,
    warp: Option<&WarpMap>,
    shadow_map: &wgpu::Buffer,
    visibility: &wgpu::Buffer,
) -> Result<(ReceiverLists, PendingFacts)> {
    let scene = seen.scene;
    let receivers = seen.camera_uniform();
    let receivers = frame.uniform("receivers", &receivers);
    let grid_uniform = frame.uniform("light grid", grid);
    let pixels = u64::from(seen.camera.width) * u64::from(grid.row_count);
    let segments = grid.texel_count().div_ceil(SEGMENT);
    let Scratch {
        counts,
        places,
        sums,
        counters,
    } = scratch(frame, grid, pixels)?;
    let lists = new_lists(frame, grid, pixels)?;

    let gpu = frame.gpu.clone();
    let rows = gpu.work_per_invocation(1, 32);
    let is_local = ("is_local", flag(seen.light.position().is_some()));
    let mut constants = vec![is_local];
    constants.extend(seen.constants());
    constants.extend(seen.tiles_constants(rows));
    let scatter = gpu.pipeline(shader(None), "scatter", &constants);
    constants.push(("settles", flag(frame.culls)));
    constants.push(("has_low_parts", flag(scene.has_low_parts)));
    let count = gpu.pipeline(shader(warp), "count", &constants);
    let sum = gpu.pipeline(shader(None), "sum", &[]);
    let scan = gpu.pipeline(shader(None), "scan", &[]);
    let place = gpu.pipeline(shader(None), "place", &[]);
    let measure = gpu.pipeline(shader(None), "measure", &[is_local]);

    let grid_binding = (0, buffer(&grid_uniform));
    let starts = (14, buffer(&lists.starts));
    let lengths = (13, buffer(&counts));
    let places = (4, buffer(&places));
    let listed = (5, buffer(&lists.listed));
    let sums = (7, buffer(&sums));
    let counted_facts = (9, buffer(&counters));
    let image = || seen.groups_of_rows(grid.row_count, rows);
    let mut receivers = seen.bindings(&receivers).to_vec();
    receivers.push(seen.tiles_binding());
    let mut count_bindings = receivers.clone();
    count_bindings.extend([
        grid_binding.clone(),
        (16, buffer(visibility)),
        (15, buffer(&counts)),
        (17, buffer(shadow_map)),
        places.clone(),
    ]);
    count_bindings.extend(scene.bindings());
    count_bindings.extend(warp.map(WarpMap::bindings).unwrap_or_default());
    let mut scatter_bindings = receivers;
    scatter_bindings.extend([
        grid_binding.clone(),
        starts.clone(),
        places,
        listed.clone(),
        (6, buffer(&lists.details)),
    ]);
    let segment_groups = || Groups::Grid(segments.div_ceil(64) as u32, 1);
    let shared = [grid_binding];
    frame.pass(
        LABEL,
        &[
            Dispatch {
                pipeline: &count,
                bindings: count_bindings,
                groups: image(),
            },
            Dispatch {
                pipeline: &sum,
                bindings: joined(&shared, &[&lengths, &sums, &counted_facts]),
                groups: segment_groups(),
            },
            Dispatch {
                pipeline: &scan,
                bindings: joined(&shared, &[&starts, &sums, &counted_facts]),
                groups: Groups::Linear(1),
            },
            Dispatch {
                pipeline: &place,
                bindings: joined(&shared, &[&starts, &lengths, &sums]),
                groups: segment_groups(),
            },
            Dispatch {
                pipeline: &scatter,
                bindings: scatter_bindings,
                groups: image(),
            },
            Dispatch {
                pipeline: &measure,
                bindings: joined(&shared, &[&starts, &listed, &(8, buffer(&lists.tiles))]),
                groups: Groups::Grid(grid.tiles.div_ceil(MEASURED_TILES), grid.tiles),
            },
        ],
    );
    debug_assert_eq!(TILE, 16, "a row of a tile an invocation of `measure`");
    let facts = PendingFacts {
        label: LABEL,
        counters: frame.read(Source::Taken(counters), 2)?,
        describe,
    };
    Ok((lists, facts))
}
