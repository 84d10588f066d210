//! Pass "caster tests": casters against the listed receivers, `shaders/caster_tests.wgsl`.

use super::facts::{Fact, Facts, PendingFacts};
use super::inputs::Receivers;
use super::light_grid::LightGrid;
use super::receiver_lists::ReceiverLists;
use super::warp_map::{self, WarpMap};
use super::work_items::{self, PendingWork, Stages};
use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::frame::{Frame, Source, buffer, table};
use crate::gpu::shaders::{Shader, flag};

pub const LABEL: &str = "caster tests";

fn describe(_gpu: &Gpu, counters: &[u32]) -> Result<Facts> {
    Ok(vec![Fact::sum("tests", counters[0])])
}

/// Writes 0 into the image where a caster is met. The triangles are taken in as many parts as their lists
/// need, each with its counters.
pub fn caster_tests(
    frame: &mut Frame,
    seen: Receivers,
    grid: &LightGrid,
    warp: Option<&WarpMap>,
    lists: &ReceiverLists,
    visibility: &wgpu::Buffer,
) -> Result<(PendingWork, PendingFacts)> {
    let scene = seen.scene;
    let tests = frame.storage("number of tests", 4)?;
    frame.clear(&tests);
    let receivers = seen.camera_uniform();
    let receivers = frame.uniform("receivers", &receivers);

    let shader = Shader {
        warp: warp_map::shader(warp),
        ..Shader::new("caster_tests")
    };
    let constants = [
        ("has_low_parts", flag(scene.has_low_parts)),
        ("is_local", flag(seen.light.position().is_some())),
    ];
    let mut counters = Vec::new();
    for triangles in work_items::parts(scene) {
        let grid = frame.uniform("light grid", &grid.of_triangles(&triangles));
        let mut bin = vec![(0, buffer(&grid)), (10, table(&scene.unit_normals))];
        bin.extend(scene.bindings());
        bin.extend(warp.map(WarpMap::bindings).unwrap_or_default());
        let mut walk = bin.clone();
        bin.push((5, buffer(&lists.tiles)));
        walk.extend([
            (9, buffer(&lists.starts)),
            (13, buffer(&lists.listed)),
            (14, buffer(&lists.details)),
            (15, buffer(visibility)),
            (16, buffer(&tests)),
        ]);
        walk.extend_from_slice(&seen.bindings(&receivers)[..2]);
        let stages = Stages {
            shader,
            constants: &constants,
            triangles: triangles.len() as u64,
            per_invocation: frame.gpu.work_per_invocation(1, 32),
            counters: work_items::counters(frame)?,
            prepare_bin: None,
            split: bin.clone(),
            bin,
            walk,
        };
        counters.push(work_items::record(frame, LABEL, scene, stages)?);
    }
    let facts = PendingFacts {
        label: LABEL,
        counters: frame.read(Source::Taken(tests), 1)?,
        describe,
    };
    let work = PendingWork {
        label: LABEL,
        counters,
        had_room: work_items::had_room_in_parts,
        describe: work_items::describe,
    };
    Ok((work, facts))
}
