//! Pass "caster tests": casters against the listed receivers, `shaders/caster_tests.wgsl`.

use super::light_grid::LightGrid;
use super::rasterize::{Counters, item_capacity, joined};
use super::receiver_lists::ReceiverLists;
use super::warp_map::{self, WarpMap};
use super::{Facts, PendingFacts, Receivers};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::frame::{Dispatch, Frame, Groups, Read, Source, buffer, table};
use crate::gpu::shaders::Shader;

pub const LABEL: &str = "caster tests";

/// Invocations of a workgroup, as in the shader.
const GROUP: u64 = 64;

const ITEM_BYTES: u64 = 8;

fn describe(_gpu: &Gpu, counters: &[u32]) -> Result<Facts> {
    Ok(vec![("tests", counters[0].into())])
}

/// Writes 0 into the image where a caster is met.
pub fn caster_tests(
    frame: &mut Frame,
    seen: Receivers,
    grid: &LightGrid,
    warp: Option<&WarpMap>,
    lists: &ReceiverLists,
    visibility: &wgpu::Buffer,
) -> Result<(Read<Counters>, PendingFacts)> {
    let scene = seen.scene;
    let grid = frame.uniform("light grid", grid);
    let capacity = item_capacity(&frame.gpu, scene);
    let items = frame.storage("items of work", capacity * ITEM_BYTES)?;
    let coarse_tiles = frame.storage("coarse tiles", capacity * ITEM_BYTES)?;
    let counters = frame.storage("counters", size_of::<Counters>() as u64)?;
    let tests = frame.storage("number of tests", 4)?;
    let split_groups = frame.storage("workgroups of split", 12)?;
    let walk_groups = frame.storage("workgroups of walk", 12)?;
    frame.clear(&counters);
    frame.clear(&tests);

    let shader = Shader {
        warp: warp_map::shader(warp),
        ..Shader::new("caster_tests")
    };
    let gpu = frame.gpu.clone();
    let per_invocation = gpu.work_per_invocation(1, 64);
    let flag = |value| f64::from(u8::from(value));
    let constants = [
        ("has_low_parts", flag(scene.has_low_parts)),
        ("is_local", flag(seen.light.position().is_some())),
        ("items_per_invocation", f64::from(per_invocation)),
    ];
    let bin = gpu.pipeline(shader, "bin", &constants);
    let prepare_split = gpu.pipeline(shader, "prepare_split", &[]);
    let split = gpu.pipeline(shader, "split", &constants);
    let prepare_walk = gpu.pipeline(shader, "prepare_walk", &constants[2..]);
    let walk = gpu.pipeline(shader, "walk", &constants);

    let counted = (4, buffer(&counters));
    let items = (5, buffer(&items));
    let coarse_tiles = (6, buffer(&coarse_tiles));
    let tiles = (8, buffer(&lists.tiles));
    let mut shared = vec![
        (0, buffer(&grid)),
        (1, table(&scene.vertex_indices)),
        (2, table(&scene.positions_high)),
        (3, table(&scene.positions_low)),
        (10, table(&scene.unit_normals)),
    ];
    shared.extend(warp.map(WarpMap::bindings).unwrap_or_default());
    let triangles = u64::from(scene.triangle_count);
    frame.pass(
        LABEL,
        &[
            Dispatch {
                pipeline: &bin,
                bindings: joined(&shared, &[&counted, &items, &coarse_tiles, &tiles]),
                groups: Groups::Linear(triangles.div_ceil(GROUP * u64::from(per_invocation))),
            },
            Dispatch {
                pipeline: &prepare_split,
                bindings: vec![
                    counted.clone(),
                    coarse_tiles.clone(),
                    (7, buffer(&split_groups)),
                ],
                groups: Groups::Linear(1),
            },
            Dispatch {
                pipeline: &split,
                bindings: joined(&shared, &[&counted, &items, &coarse_tiles, &tiles]),
                groups: Groups::Indirect(&split_groups),
            },
            Dispatch {
                pipeline: &prepare_walk,
                bindings: vec![counted.clone(), items.clone(), (7, buffer(&walk_groups))],
                groups: Groups::Linear(1),
            },
            Dispatch {
                pipeline: &walk,
                bindings: joined(
                    &shared,
                    &[
                        &counted,
                        &items,
                        &(9, buffer(&lists.starts)),
                        &(13, buffer(&lists.listed)),
                        &(14, buffer(&lists.details)),
                        &(15, buffer(visibility)),
                        &(16, buffer(&tests)),
                    ],
                ),
                groups: Groups::Indirect(&walk_groups),
            },
        ],
    );
    let counters = frame.read(Source::Taken(counters), 1)?;
    let facts = PendingFacts {
        label: LABEL,
        counters: frame.read(Source::Taken(tests), 1)?,
        describe,
    };
    Ok((counters, facts))
}
