//! Lists of work between the dispatches of a pass, `shaders/lib/work_items.wgsl`.

use super::facts::{Fact, Facts};
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::frame::{Binding, Dispatch, Frame, Groups, Read, Source, buffer};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::Shader;
use std::ops::Range;
use std::sync::atomic::Ordering;

shader_struct! {
    pub struct Counters is Counters in "lib/counters" {
        /// Small triangles, and parts of large ones.
        pub items: u32,
        /// Coarse parts of large triangles.
        pub coarse_items: u32,
        /// Triangles that touch nothing of the map, those of zero area among them.
        pub outside: u32,
        /// Triangles outside the range of depths.
        pub behind: u32,
        /// Items that lie behind others.
        pub hidden: u32,
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
}

const ITEM_BYTES: u64 = 8;

/// Invocations of a workgroup, as in the shader.
pub const GROUP: u64 = 64;

/// Parts that casters are taken in at most: each has a pass of its own.
const MAX_PARTS: u32 = 16;

/// Items, and coarse ones, that a frame makes room for: one for each triangle and some more, as long as the
/// device allows it. Grows when a frame of the scene needed more; such a frame is rendered again.
fn capacity(gpu: &Gpu, scene: &SceneTables) -> u64 {
    let spare = scene.room.spare_items.load(Ordering::Relaxed);
    (u64::from(scene.triangle_count) + spare).min(most_items(gpu))
}

fn most_items(gpu: &Gpu) -> u64 {
    gpu.largest_storage() / ITEM_BYTES
}

/// The triangles in parts whose lists have room, one after the other.
pub fn parts(scene: &SceneTables) -> impl Iterator<Item = Range<u32>> {
    let count = scene.triangle_count;
    let size = count
        .div_ceil(scene.room.caster_parts.load(Ordering::Relaxed))
        .max(1);
    (0..count)
        .step_by(size as usize)
        .map(move |first| first..count.min(first + size))
}

impl Counters {
    /// Those of a pass in parts, whose lists follow one another.
    pub fn joined(parts: &[Self]) -> Self {
        let mut joined = parts[0];
        for part in &parts[1..] {
            joined.items = joined.items.max(part.items);
            joined.coarse_items = joined.coarse_items.max(part.coarse_items);
            joined.outside += part.outside;
            joined.behind += part.behind;
        }
        joined
    }
}

/// What the counters of a pass say of its lists.
pub type HadRoom = fn(&Gpu, &SceneTables, &Counters) -> Result<bool>;

/// Counters of a pass that the next submission brings.
pub struct PendingWork {
    pub label: &'static str,
    /// Of each part.
    pub counters: Vec<Read<Counters>>,
    pub had_room: HadRoom,
    pub describe: fn(&SceneTables, &Counters) -> Facts,
}

/// What is counted whichever pass has the lists.
pub fn describe(scene: &SceneTables, counters: &Counters) -> Facts {
    let all = match counters.is_linear {
        0 => scene.triangle_count,
        _ => counters.pieces,
    };
    vec![
        Fact::sum("rasterized", all - counters.outside - counters.behind),
        Fact::sum("culled_outside", counters.outside),
        Fact::sum("culled_by_depth", counters.behind),
        Fact::sum("work_items", counters.items),
        Fact::sum("coarse_items", counters.coarse_items),
    ]
}

/// Whether every item of a pass had room in its list. If not, room is made for the next try.
pub fn had_room(gpu: &Gpu, scene: &SceneTables, counters: &Counters) -> Result<bool> {
    let wanted = u64::from(counters.items.max(counters.coarse_items));
    if wanted <= capacity(gpu, scene) {
        return Ok(true);
    }
    let most = most_items(gpu);
    if wanted > most {
        return Err(Error::Device(format!(
            "the triangles make {wanted} items of work, the device {} allows {most}",
            gpu.adapter.name
        )));
    }
    let spare = wanted - u64::from(scene.triangle_count).min(wanted);
    // Splitting goes on where coarse items had no room, so the next try may need more again.
    let room = (2 * spare).next_power_of_two();
    scene.room.spare_items.fetch_max(room, Ordering::Relaxed);
    Ok(false)
}

/// The same of a pass that takes the triangles in parts: more parts have more room.
pub fn had_room_in_parts(gpu: &Gpu, scene: &SceneTables, counters: &Counters) -> Result<bool> {
    let wanted = u64::from(counters.items.max(counters.coarse_items));
    let most = most_items(gpu);
    let parts = scene.room.caster_parts.load(Ordering::Relaxed);
    if wanted <= most || parts >= MAX_PARTS {
        return had_room(gpu, scene, counters);
    }
    let more = (2 * wanted).div_ceil(most).min(u64::from(MAX_PARTS)) as u32;
    let parts = parts.saturating_mul(more).min(MAX_PARTS);
    scene.room.caster_parts.store(parts, Ordering::Relaxed);
    Ok(false)
}

/// Bindings of the three entry points of a shader that imports the lists, without those of the lists.
pub struct Stages<'a> {
    pub shader: Shader,
    pub constants: &'a [(&'static str, f64)],
    /// How many `bin` takes.
    pub triangles: u64,
    /// Triangles or items that an invocation takes one after the other.
    pub per_invocation: u32,
    /// From `counters`; what came before the pass may have counted in it.
    pub counters: PooledBuffer,
    /// Of an entry point that finds how many casters there are, where only the device knows.
    pub prepare_bin: Option<Vec<Binding<'a>>>,
    pub bin: Vec<Binding<'a>>,
    pub split: Vec<Binding<'a>>,
    pub walk: Vec<Binding<'a>>,
}

/// New counters, all zero.
pub fn counters(frame: &mut Frame) -> Result<PooledBuffer> {
    let counters = frame.storage("counters", size_of::<Counters>() as u64)?;
    frame.clear(&counters);
    Ok(counters)
}

/// Records the dispatches under the label.
pub fn record(
    frame: &mut Frame,
    label: &'static str,
    scene: &SceneTables,
    stages: Stages,
) -> Result<Read<Counters>> {
    let Stages {
        shader,
        constants,
        triangles,
        per_invocation,
        counters,
        prepare_bin,
        bin,
        split,
        walk,
    } = stages;
    let gpu = frame.gpu.clone();
    let size = capacity(&gpu, scene) * ITEM_BYTES;
    let items = frame.storage("items of work", size)?;
    let coarse_items = frame.storage("coarse items of work", size)?;
    let new_groups = |frame: &Frame| -> Result<PooledBuffer> { frame.storage("workgroups", 12) };
    let (split_groups, walk_groups) = (new_groups(frame)?, new_groups(frame)?);
    let bin_groups = new_groups(frame)?;

    let mut constants = constants.to_vec();
    constants.push(("items_per_invocation", f64::from(per_invocation)));
    let pipeline = |entry_point| gpu.pipeline(shader, entry_point, &constants);
    let pipelines = ["bin", "prepare_split", "split", "prepare_walk", "walk"].map(pipeline);
    let counted = (4, buffer(&counters));
    let listed = (6, buffer(&items));
    let coarse = (7, buffer(&coarse_items));
    let lists = [counted.clone(), listed.clone(), coarse.clone()];
    let bindings = [
        [&lists[..], &bin].concat(),
        vec![counted.clone(), coarse, (8, buffer(&split_groups))],
        [&lists[..], &split].concat(),
        vec![counted.clone(), listed, (8, buffer(&walk_groups))],
        [&lists[..2], &walk].concat(),
    ];
    let of_bin = match &prepare_bin {
        None => Groups::Linear(triangles.div_ceil(GROUP * u64::from(per_invocation))),
        Some(_) => Groups::Indirect(&bin_groups, 0),
    };
    let groups = [
        of_bin,
        Groups::Linear(1),
        Groups::Indirect(&split_groups, 0),
        Groups::Linear(1),
        Groups::Indirect(&walk_groups, 0),
    ];
    let stages: Vec<_> = pipelines
        .iter()
        .zip(bindings)
        .zip(groups)
        .map(|((pipeline, bindings), groups)| Dispatch {
            pipeline,
            bindings,
            groups,
        })
        .collect();
    let mut dispatches = Vec::new();
    let prepare = prepare_bin.map(|own| (pipeline("prepare_bin"), own));
    if let Some((pipeline, own)) = &prepare {
        dispatches.push(Dispatch {
            pipeline,
            bindings: [&[counted, (8, buffer(&bin_groups))], &own[..]].concat(),
            groups: Groups::Linear(1),
        });
    }
    dispatches.extend(stages);
    frame.pass(label, &dispatches);
    frame.read(Source::Taken(counters), 1)
}
