//! Rasterization of the scene's triangles through a projection, `shaders/rasterize.wgsl`.

use super::tessellate::{self, tessellate};
use super::warp_map::{self, WarpMap};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::frame::{Binding, Dispatch, Frame, Groups, Read, Source, buffer, table};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::shaders::Shader;
use crate::projection::{Projection, ProjectionUniform};
use bytemuck::{Pod, Zeroable};
use std::sync::atomic::Ordering;

/// What a texel keeps of the nearest triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// 32 bits: the depth.
    Depth,
    /// 64 bits: the depth and the triangle.
    DepthTriangle,
}

/// How triangles become texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rasterization {
    /// Each texel takes its own ray.
    Exact,
    /// As published: corners are projected and warped, edges between them are straight in the map.
    /// Triangles are split until no edge is longer than this share of the map's side.
    Linear { longest_edge: Option<f64> },
}

/// As `Counters` in the shaders.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    /// Items of work: small triangles, and tiles of large ones.
    pub items: u32,
    /// Coarse tiles of large triangles.
    pub coarse_tiles: u32,
    /// Triangles whose bound holds no texel centre, those of zero area among them.
    pub outside: u32,
    /// Triangles outside the range of depths.
    pub behind: u32,
    /// Pieces of triangles that a linear rasterization is of.
    pub pieces: u32,
    current_unfinished: u32,
    /// Pieces whose edges were too long when the splitting ended.
    pub next_unfinished: u32,
    /// In any round of splitting.
    pub most_unfinished: u32,
    /// Pieces that found no room.
    pub lost: u32,
    /// 1 where pieces, not triangles, are counted.
    pub is_linear: u32,
}

/// As `Job` in the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct JobUniform {
    projection: ProjectionUniform,
    triangle_count: u32,
    coarse_shift: u32,
    padding: [u32; 2],
}

/// A map with its texels and, after the next submission, its counters.
pub struct Rasterized {
    pub texels: PooledBuffer,
    pub counters: Read<Counters>,
}

const ITEM_BYTES: u64 = 8;

/// Items and coarse tiles that a frame makes room for: one for each triangle and some more, as long as
/// the device allows it. Grows when a frame of the scene needed more; such a frame is rendered again.
pub fn item_capacity(gpu: &Gpu, scene: &SceneTables) -> u64 {
    let spare = scene.spare_items.load(Ordering::Relaxed);
    (u64::from(scene.triangle_count) + spare).min(most_items(gpu))
}

fn most_items(gpu: &Gpu) -> u64 {
    gpu.largest_storage() / ITEM_BYTES
}

/// Records the pass under the label.
pub fn rasterize(
    frame: &mut Frame,
    label: &'static str,
    scene: &SceneTables,
    projection: &Projection,
    warp: Option<&WarpMap>,
    target: Target,
    rasterization: Rasterization,
) -> Result<Rasterized> {
    let texel_bytes = match target {
        Target::Depth => 4,
        Target::DepthTriangle => 8,
    };
    let texels = frame.storage(label, projection.texel_count() as u64 * texel_bytes)?;
    let capacity = item_capacity(&frame.gpu, scene);
    let items = frame.storage("items of work", capacity * ITEM_BYTES)?;
    let coarse_tiles = frame.storage("coarse tiles", capacity * ITEM_BYTES)?;
    let counters = frame.storage("counters", size_of::<Counters>() as u64)?;
    let split_groups = frame.storage("workgroups of split", 12)?;
    let walk_groups = frame.storage("workgroups of walk", 12)?;
    frame.clear(&texels);
    frame.clear(&counters);

    let pieces = match rasterization {
        Rasterization::Exact => None,
        Rasterization::Linear { longest_edge } => {
            let pieces = tessellate(
                frame,
                label,
                scene,
                projection,
                warp,
                longest_edge,
                &counters,
            )?;
            Some((pieces, frame.storage("workgroups of bin", 12)?))
        }
    };
    // Pieces are in the map, beyond projection and warp.
    let warp = warp.filter(|_| pieces.is_none());
    let shader = Shader {
        projection: match pieces {
            None => projection.shader(),
            Some(_) => "projection/parallel",
        },
        warp: warp_map::shader(warp),
        caster: match pieces {
            None => "caster/scene",
            Some(_) => "caster/pieces",
        },
        target: match target {
            Target::Depth => "target/depth",
            Target::DepthTriangle => "target/depth_triangle",
        },
        ..Shader::new("rasterize")
    };
    let has_straight_rows = pieces.is_some() || (warp.is_none() && projection.has_straight_edges());
    let warp = warp.map(WarpMap::bindings).unwrap_or_default();
    let gpu = frame.gpu.clone();
    let per_invocation = gpu.work_per_invocation(1, 64);
    let has_low_parts = f64::from(u8::from(scene.has_low_parts));
    // Of the scene's vertices, which pieces do not ask for.
    let of_casters = |mut constants: Vec<(&'static str, f64)>| {
        constants.extend(pieces.is_none().then_some(("has_low_parts", has_low_parts)));
        constants
    };
    let items_per_invocation = ("items_per_invocation", f64::from(per_invocation));
    // Where edges are no lines, rows are walked from side to side of a tile: smaller ones waste less.
    let fine_shift = match has_straight_rows {
        true => 4_u32,
        false => 3,
    };
    let small_area = ("small_area", f64::from(1 << (2 * fine_shift)));
    let fine_shift = ("fine_shift", f64::from(fine_shift));
    let bin = gpu.pipeline(
        shader,
        "bin",
        &of_casters(vec![items_per_invocation, small_area]),
    );
    let prepare_bin = gpu.pipeline(shader, "prepare_bin", &[items_per_invocation]);
    let prepare_split = gpu.pipeline(shader, "prepare_split", &[]);
    let split = gpu.pipeline(shader, "split", &of_casters(vec![fine_shift]));
    let prepare_walk = gpu.pipeline(shader, "prepare_walk", &[items_per_invocation]);
    let walk = gpu.pipeline(
        shader,
        "walk",
        &of_casters(vec![items_per_invocation, fine_shift]),
    );

    // Coarser tiles for larger maps: no triangle is cut into more than 64 x 64 of them.
    let coarse_side = projection.width.max(projection.height).div_ceil(64);
    let job = JobUniform {
        projection: projection.uniform(scene.origin),
        triangle_count: scene.triangle_count,
        coarse_shift: coarse_side.next_power_of_two().max(128).trailing_zeros(),
        padding: [0; 2],
    };
    let job = frame.uniform("job", &job);
    let job = (0, buffer(&job));
    let counted = (4, buffer(&counters));
    let drawn = (5, buffer(&texels));
    let items = (6, buffer(&items));
    let coarse_tiles = (7, buffer(&coarse_tiles));
    // Bindings of the casters and the warp, and those of the casters' planes.
    let mut casters = vec![job];
    let mut planes = Vec::new();
    let mut dispatches = Vec::new();
    let bin_groups = match &pieces {
        None => {
            casters.extend([
                (1, table(&scene.vertex_indices)),
                (2, table(&scene.positions_high)),
                (3, table(&scene.positions_low)),
            ]);
            planes.push((10, table(&scene.unit_normals)));
            let triangles = u64::from(scene.triangle_count);
            Groups::Linear(triangles.div_ceil(GROUP * u64::from(per_invocation)))
        }
        Some((pieces, bin_groups)) => {
            casters.push((1, buffer(pieces)));
            let counts_and_groups = [&counted, &(2, buffer(bin_groups))];
            dispatches.push(Dispatch {
                pipeline: &prepare_bin,
                bindings: joined(&casters[1..], &counts_and_groups),
                groups: Groups::Linear(1),
            });
            Groups::Indirect(bin_groups)
        }
    };
    casters.extend(warp);
    let planed = joined(&casters, &planes.iter().collect::<Vec<_>>());
    dispatches.extend([
        Dispatch {
            pipeline: &bin,
            bindings: joined(&casters, &[&counted, &items, &coarse_tiles]),
            groups: bin_groups,
        },
        Dispatch {
            pipeline: &prepare_split,
            bindings: joined(&[], &[&counted, &coarse_tiles, &(8, buffer(&split_groups))]),
            groups: Groups::Linear(1),
        },
        Dispatch {
            pipeline: &split,
            bindings: joined(&planed, &[&counted, &items, &coarse_tiles]),
            groups: Groups::Indirect(&split_groups),
        },
        Dispatch {
            pipeline: &prepare_walk,
            bindings: joined(&[], &[&counted, &items, &(9, buffer(&walk_groups))]),
            groups: Groups::Linear(1),
        },
        Dispatch {
            pipeline: &walk,
            bindings: joined(&planed, &[&counted, &drawn, &items]),
            groups: Groups::Indirect(&walk_groups),
        },
    ]);
    frame.pass(label, &dispatches);
    let counters = frame.read(Source::Taken(counters), 1)?;
    Ok(Rasterized { texels, counters })
}

/// Bindings that several dispatches share, and some more.
pub fn joined<'a>(shared: &[Binding<'a>], own: &[&Binding<'a>]) -> Vec<Binding<'a>> {
    let own = own.iter().copied().cloned();
    shared.iter().cloned().chain(own).collect()
}

/// Invocations of a workgroup.
pub const GROUP: u64 = 64;

/// Whether every item had room in its list. If not, room is made for the next try.
pub fn had_room(gpu: &Gpu, scene: &SceneTables, counters: &Counters) -> Result<bool> {
    if !tessellate::had_room(gpu, counters)? {
        return Ok(false);
    }
    let wanted = u64::from(counters.items.max(counters.coarse_tiles));
    if wanted <= item_capacity(gpu, scene) {
        return Ok(true);
    }
    let most = most_items(gpu);
    if wanted > most {
        return Err(Error::Device(format!(
            "the triangles cover {wanted} tiles of the map, the device {} allows {most}",
            gpu.adapter.name
        )));
    }
    let spare = wanted - u64::from(scene.triangle_count).min(wanted);
    // Splitting goes on where coarse tiles had no room, so the next try may need more again.
    scene
        .spare_items
        .fetch_max((2 * spare).next_power_of_two(), Ordering::Relaxed);
    Ok(false)
}
