//! Triangles to pieces with straight edges in the map, `shaders/tessellate.wgsl`: what comes before a
//! linear rasterization.

use super::warp_map::WarpMap;
use super::work_items::{Counters, GROUP};
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::projection_uniform::ProjectionUniform;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::{Room, SceneTables};
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;
use crate::rounding::FUNCTION_ROUNDING;
use std::iter;
use std::sync::atomic::Ordering;

shader_struct! {
    pub struct TessellationUniform is Tessellation in "tessellate" {
        projection: ProjectionUniform,
        triangle_count: u32,
        longest_edge: f32,
        rounding: f32,
        padding: u32,
    }
}

/// As `Piece` in the shaders.
const PIECE_BYTES: u64 = 64;

/// Halvings of an edge. Its parts are far within their rounding then, and what is left is kept as it is.
const MAX_ROUNDS: u32 = 48;

fn most_pieces(gpu: &Gpu) -> u64 {
    gpu.largest_storage() / PIECE_BYTES
}

/// Records the pass under the label; it counts in `counters`, which are zero.
pub fn tessellate(
    frame: &mut Recording,
    label: &'static str,
    scene: &SceneTables,
    projection: &Projection,
    warp: Option<&WarpMap>,
    longest_edge: Option<f64>,
    counters: &wgpu::Buffer,
) -> Result<PooledBuffer> {
    let most = most_pieces(&frame.gpu);
    let spare = scene.room.spare_pieces.load(Ordering::Relaxed).min(most);
    let capacity = (u64::from(scene.triangle_count) + spare).min(most);
    let pieces = frame.storage("pieces", capacity * PIECE_BYTES)?;
    let lists = [
        frame.storage("pieces to split", spare * PIECE_BYTES)?,
        frame.storage("split pieces", spare * PIECE_BYTES)?,
    ];
    let groups = frame.storage("workgroups of refine", 12)?;
    // Of places in the map, as a share of it: the smaller the map is and the farther off its axis, the more.
    let side = f64::from(projection.width.min(projection.height));
    let rounding = FUNCTION_ROUNDING * (1.0 + projection.centre.abs().max_element() / side);
    let job = TessellationUniform {
        projection: ProjectionUniform::new(projection, scene.origin),
        triangle_count: scene.triangle_count,
        longest_edge: longest_edge.map_or(f32::MAX, |share| share.max(rounding) as f32),
        rounding: rounding as f32,
        padding: 0,
    };
    let kernel = Kernel::new("tessellate");
    let of_triangles = kernel
        .projected(projection)
        .warp(warp)
        .uniform(0, &job)
        .bind(4, counters);
    let of_list = of_triangles.bare().bind(4, counters);
    let of_triangles = of_triangles.bind(5, &pieces);
    let begin = of_triangles.clone().entry("begin");
    let begin = begin.triangles(scene).bind(7, &lists[0]);
    let by_triangle = Groups::Linear(u64::from(scene.triangle_count).div_ceil(GROUP));
    let mut dispatches = vec![begin.dispatch(by_triangle)];
    // Without a longest edge nothing is split.
    let rounds = longest_edge.map_or(0, |_| scene.room.split_rounds.load(Ordering::Relaxed));
    let last = (rounds == MAX_ROUNDS).then_some("finish");
    let kernels = iter::repeat_n("refine", rounds as usize).chain(last);
    for (round, entry_point) in kernels.enumerate() {
        let (from, to) = (&lists[round % 2], &lists[(round + 1) % 2]);
        let prepare = of_list.clone().entry("prepare_refine");
        dispatches.push(prepare.bind(6, from).bind(8, &groups).dispatch(Groups::ONE));
        let settle = of_triangles.clone().entry(entry_point);
        let by_piece = Groups::Indirect((*groups).clone(), 0);
        dispatches.push(settle.bind(6, from).bind(7, to).dispatch(by_piece));
    }
    frame.pass(label, &dispatches);
    Ok(pieces)
}

/// Whether every piece had room and was done. If not, there is more of either in the next try.
pub fn had_room(gpu: &Gpu, room: &Room, counters: &Counters) -> Result<bool> {
    if counters.lost > 0 {
        let wanted = u64::from(counters.pieces.max(counters.most_unfinished));
        let (most, spare) = (most_pieces(gpu), room.spare_pieces.load(Ordering::Relaxed));
        if wanted > most || spare >= most {
            return Err(Error::Device(format!(
                "tessellation makes more than {} pieces of triangles, the device {} allows {most}; a \
                 larger share of the map makes fewer",
                wanted.min(most),
                gpu.adapter.name
            )));
        }
        // What was lost would have been split further.
        let more = (2 * wanted).next_power_of_two().max(16 * spare);
        room.spare_pieces
            .fetch_max(more.min(most), Ordering::Relaxed);
        return Ok(false);
    }
    if counters.next_unfinished > 0 {
        room.split_rounds.fetch_max(MAX_ROUNDS, Ordering::Relaxed);
        return Ok(false);
    }
    Ok(true)
}
