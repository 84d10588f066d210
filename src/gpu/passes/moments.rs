//! Pass "moments": of the depths in a map's texels, blurred and halved, `shaders/moments.wgsl`.

use super::rasterize::Target;
use super::warp_map::WarpMap;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::shader_struct::shader_struct;
use crate::moments::{FilteredMap, Moments};
use crate::projection::Projection;

pub const LABEL: &str = "moments";

shader_struct! {
    pub struct LevelUniform is MomentLevel in "moments" {
        size: [u32; 2],
        first: u32,
        next: u32,
    }
}

/// Moments of a map, and of coarser ones behind them.
pub struct MomentMap {
    pub values: PooledBuffer,
    pub levels: u32,
    pub filter: FilteredMap,
}

impl Kernel {
    /// What `shaders/lib/moments.wgsl` asks for.
    pub fn moments(self, filter: FilteredMap) -> Self {
        let plain = (0u32, [1.0; 2], 0.0, 0.0);
        let (kind, exponents, least, bias) = match filter.moments {
            Moments::Variance { least } => (0, plain.1, least, 0.0),
            Moments::Exponential {
                exponent,
                negative,
                least,
            } => {
                let kind = if negative.is_some() { 2 } else { 1 };
                (kind, [exponent, negative.unwrap_or(1.0)], least, 0.0)
            }
            Moments::Four { bias } => (3, plain.1, 0.0, bias),
        };
        self.constant("moment_kind", kind)
            .constant("exponent", exponents[0])
            .constant("negative_exponent", exponents[1])
            // Depths run over 2, not 1.
            .constant("least_deviation", 2.0 * f64::sqrt(least))
            .constant("moment_bias", bias)
            .constant("bleeding_reduction", filter.bleeding_reduction)
    }
}

/// Those of the texels of a map of depths.
pub fn moments(
    frame: &mut Recording,
    scene: &SceneTables,
    projection: &Projection,
    warp: Option<&WarpMap>,
    texels: &wgpu::Buffer,
    filter: FilteredMap,
) -> Result<MomentMap> {
    filter.check_warp(warp.map_or(1, |warp| warp.layout.functions[0] as usize))?;
    let sizes = sizes_of_levels([projection.width, projection.height], filter.mips);
    let count = filter.moments.count() as u64;
    let numbers = |[width, height]: [u32; 2]| count * u64::from(width) * u64::from(height);
    let all: u64 = sizes.iter().map(|&size| numbers(size)).sum();
    let values = frame.storage(LABEL, 4 * all)?;
    let groups = |[width, height]: [u32; 2]| Groups::Grid(width.div_ceil(64), height);
    let kernel = |entry| {
        Kernel::new("moments")
            .entry(entry)
            .moments(filter)
            .projected(projection)
    };
    let fill = kernel("fill")
        .projection(0, projection, scene.origin)
        .stored(Target::Depth)
        .bind(5, texels)
        .bind(3, &values);
    let mut dispatches = vec![fill.dispatch(groups(sizes[0]))];
    let weights = filter.kernel.weights(filter.blur);
    // Along rows into another buffer, and along columns back.
    let (table, between);
    if weights.len() > 1 {
        table = frame.constants("weights of the blur", &weights)?;
        between = frame.storage("moments between", 4 * numbers(sizes[0]))?;
        for (is_along_y, before, after) in [(false, &values, &between), (true, &between, &values)] {
            let blur = kernel("blur")
                .projection(0, projection, scene.origin)
                .warp(warp)
                .constant("is_along_y", is_along_y)
                .constant("reach", weights.len() as u32 - 1)
                .bind(2, before)
                .bind(3, after)
                .bind(4, &table);
            dispatches.push(blur.dispatch(groups(sizes[0])));
        }
    }
    let mut first = 0;
    for pair in sizes.windows(2) {
        let next = first + numbers(pair[0]);
        let level = LevelUniform {
            size: pair[0],
            first: first as u32,
            next: next as u32,
        };
        let halve = kernel("halve").uniform(1, &level).bind(3, &values);
        dispatches.push(halve.dispatch(groups(pair[1])));
        first = next;
    }
    frame.pass(LABEL, &dispatches);
    Ok(MomentMap {
        values,
        levels: sizes.len() as u32,
        filter,
    })
}

/// Texels along each side of a map and, with mips, of those of half as many, down to one.
fn sizes_of_levels(size: [u32; 2], has_mips: bool) -> Vec<[u32; 2]> {
    let next =
        |size: &[u32; 2]| (has_mips && *size != [1, 1]).then(|| size.map(|side| side.div_ceil(2)));
    std::iter::successors(Some(size), next).collect()
}
