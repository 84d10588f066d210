//! Pass "caster tests": casters against the listed receivers, `shaders/caster_tests.wgsl`.

use super::inputs::Receivers;
use super::light_grid::LightGrid;
use super::receiver_lists::ReceiverLists;
use super::warp_map::WarpMap;
use super::work_items::{self, Counters, Stages};
use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::recording::{Counted, Recording};
use crate::gpu::unsure::UnsureTests;
use crate::stats::Fact;

pub const LABEL: &str = "caster tests";

/// Writes 0 into the image where a caster is met for sure, and lists what float32 leaves open. The triangles are taken in as many parts as their lists
/// need, each with its counters.
pub fn caster_tests(
    frame: &mut Recording,
    seen: Receivers,
    grid: &LightGrid,
    warp: Option<&WarpMap>,
    lists: &ReceiverLists,
    visibility: &wgpu::Buffer,
    unsure: &UnsureTests,
) -> Result<()> {
    let scene = seen.scene;
    let tests = frame.storage("number of tests", 4)?;
    frame.clear(&tests);
    let gpu = frame.gpu.clone();
    let kernel = grid
        .of_rays(Kernel::new("caster_tests"))
        .triangles(scene)
        .bind(10, &scene.unit_normals)
        .warp(warp);
    let mut counters = Vec::new();
    for triangles in work_items::parts(&scene.room) {
        let kernel = kernel.clone();
        let kernel = kernel.uniform(0, &grid.of_triangles(&triangles));
        let bin = kernel.clone().bind(5, &lists.tiles);
        let walk = kernel
            .bind(9, &lists.starts)
            .bind(13, &lists.listed)
            .bind(14, &lists.details)
            .bind(15, visibility)
            .bind(16, &tests)
            .bind(19, &unsure.list)
            .receivers_uniform(seen, &seen.camera_uniform())
            .bind(21, seen.visibility_buffer)
            .light_sides(scene, seen.light_sides)
            .masks(scene.masks.as_ref());
        let stages = Stages {
            triangles: triangles.len() as u64,
            per_invocation: gpu.work_per_invocation(1, 32),
            counters: work_items::counters(frame)?,
            prepare_bin: None,
            split: bin.clone(),
            bin,
            walks: vec![walk],
        };
        counters.push(work_items::record(frame, LABEL, &scene.room, stages)?);
    }
    let room = scene.room.clone();
    frame.count_parts(LABEL, counters, move |gpu, parts| {
        let counters = Counters::joined(parts);
        let facts = work_items::describe(&room, &counters);
        let had_room = work_items::had_room_in_parts(gpu, &room, &counters)?;
        Ok(Counted { facts, had_room })
    });
    frame.count(LABEL, tests, 1, |_, tests| {
        Ok(vec![Fact::sum("tests", tests[0])])
    })
}
