//! Lists of work between the dispatches of a pass, `shaders/lib/work_items.wgsl`.

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{Read, Recording, Source};
use crate::gpu::scene_tables::Room;
use crate::gpu::shader_struct::shader_struct;
use crate::stats::{Fact, Facts};
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
fn capacity(gpu: &Gpu, room: &Room) -> u64 {
    let spare = room.spare_items.load(Ordering::Relaxed);
    (u64::from(room.triangle_count) + spare).min(most_items(gpu))
}

fn most_items(gpu: &Gpu) -> u64 {
    gpu.largest_storage() / ITEM_BYTES
}

/// The triangles in parts whose lists have room, one after the other.
pub fn parts(room: &Room) -> impl Iterator<Item = Range<u32>> + use<> {
    let count = room.triangle_count;
    let size = count
        .div_ceil(room.caster_parts.load(Ordering::Relaxed))
        .max(1);
    (0..count)
        .step_by(size as usize)
        .map(move |first| first..count.min(first + size))
}

impl Counters {
    /// Those of a pass in parts, whose lists follow one another.
    pub fn joined(parts: &[Vec<u32>]) -> Self {
        let mut parts = parts.iter().map(|part| bytemuck::cast_slice(part)[0]);
        let mut joined: Self = parts.next().expect("a pass has a part");
        for part in parts {
            joined.items = joined.items.max(part.items);
            joined.coarse_items = joined.coarse_items.max(part.coarse_items);
            joined.outside += part.outside;
            joined.behind += part.behind;
        }
        joined
    }
}

/// What is counted whichever pass has the lists.
pub fn describe(room: &Room, counters: &Counters) -> Facts {
    let all = match counters.is_linear {
        0 => room.triangle_count,
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
pub fn had_room(gpu: &Gpu, room: &Room, counters: &Counters) -> Result<bool> {
    let wanted = u64::from(counters.items.max(counters.coarse_items));
    if wanted <= capacity(gpu, room) {
        return Ok(true);
    }
    let most = most_items(gpu);
    if wanted > most {
        return Err(Error::Device(format!(
            "the triangles make {wanted} items of work, the device {} allows {most}",
            gpu.adapter.name
        )));
    }
    let spare = wanted - u64::from(room.triangle_count).min(wanted);
    // Splitting goes on where coarse items had no room, so the next try may need more again.
    let more = (2 * spare).next_power_of_two();
    room.spare_items.fetch_max(more, Ordering::Relaxed);
    Ok(false)
}

/// The same of a pass that takes the triangles in parts: more parts have more room.
pub fn had_room_in_parts(gpu: &Gpu, room: &Room, counters: &Counters) -> Result<bool> {
    let wanted = u64::from(counters.items.max(counters.coarse_items));
    let most = most_items(gpu);
    let parts = room.caster_parts.load(Ordering::Relaxed);
    if wanted <= most || parts >= MAX_PARTS {
        return had_room(gpu, room, counters);
    }
    let more = (2 * wanted).div_ceil(most).min(u64::from(MAX_PARTS)) as u32;
    let parts = parts.saturating_mul(more).min(MAX_PARTS);
    room.caster_parts.store(parts, Ordering::Relaxed);
    Ok(false)
}

/// The entry points of a shader that imports the lists, without the bindings of the lists.
pub struct Stages {
    /// How many `bin` takes.
    pub triangles: u64,
    /// Triangles or items that an invocation takes one after the other.
    pub per_invocation: u32,
    /// From `counters`; what came before the pass may have counted in it.
    pub counters: PooledBuffer,
    /// Finds how many casters there are, where only the device knows.
    pub prepare_bin: Option<Kernel>,
    pub bin: Kernel,
    pub split: Kernel,
    /// One after the other over the same items.
    pub walks: Vec<Kernel>,
}

/// New counters, all zero.
pub fn counters(frame: &mut Recording) -> Result<PooledBuffer> {
    let counters = frame.storage("counters", size_of::<Counters>() as u64)?;
    frame.clear(&counters);
    Ok(counters)
}

/// Records the dispatches under the label.
pub fn record(
    frame: &mut Recording,
    label: &'static str,
    room: &Room,
    stages: Stages,
) -> Result<Read<u32>> {
    let per_invocation = stages.per_invocation;
    let counters = stages.counters;
    let size = capacity(&frame.gpu, room) * ITEM_BYTES;
    let items = frame.storage("items of work", size)?;
    let coarse_items = frame.storage("coarse items of work", size)?;
    let of_stage = |kernel: Kernel, entry_point| {
        let kernel = kernel.entry(entry_point).bind(4, &counters);
        kernel.constant("items_per_invocation", per_invocation)
    };
    let bare = stages.bin.bare();
    // Each time as many workgroups as one invocation finds.
    let groups = frame.storage("workgroups", 12)?;
    let counted = |prepare: Kernel, stages: Vec<Kernel>| {
        let mut dispatches = vec![prepare.bind(8, &groups).dispatch(Groups::ONE)];
        for stage in stages {
            dispatches.push(stage.dispatch(Groups::Indirect((*groups).clone(), 0)));
        }
        dispatches
    };
    let bin = of_stage(stages.bin, "bin");
    let bin = bin.bind(6, &items).bind(7, &coarse_items);
    let size = GROUP * u64::from(per_invocation);
    let mut dispatches = match stages.prepare_bin {
        Some(prepare) => counted(of_stage(prepare, "prepare_bin"), vec![bin]),
        None => vec![bin.dispatch(Groups::Linear(stages.triangles.div_ceil(size)))],
    };
    let prepare_split = of_stage(bare.clone(), "prepare_split").bind(7, &coarse_items);
    let split = of_stage(stages.split, "split").bind(6, &items);
    dispatches.extend(counted(prepare_split, vec![split.bind(7, &coarse_items)]));
    let prepare_walk = of_stage(bare, "prepare_walk").bind(6, &items);
    let walks = stages.walks.into_iter();
    let walks = walks.map(|walk| of_stage(walk, "walk").bind(6, &items));
    dispatches.extend(counted(prepare_walk, walks.collect()));
    frame.pass(label, &dispatches);
    frame.read(Source::Taken(counters), size_of::<Counters>() / 4)
}
