//! The rays of the receivers towards the light, whichever pass searches for what they meet:
//! `shaders/lib/light_rays.wgsl`.

use super::inputs::Receivers;
use crate::bvh::BoxSpace;
use crate::error::{Error, Result};
use crate::gpu::kernel::{Groups, Kernel, Resource};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::unsure::UnsureTests;
use crate::rounding::double_single;
use crate::stats::Fact;

/// Boxes and triangles of a ray at most: below the iterations after which some drivers end a loop.
pub const MAX_STEPS: u32 = 65_000;

/// A pass that searches.
pub struct Search<'a> {
    pub label: &'static str,
    /// Its file of `shaders/`.
    pub file: &'static str,
    pub space: BoxSpace,
    /// For all roundings, in the boxes' space.
    pub box_margin: f32,
    /// Of a hierarchy that compute walks.
    pub node_count: u32,
    /// What is searched.
    pub structure: Resource,
    /// (vertex, vertex, vertex, triangle) in the structure's order.
    pub triangles: &'a wgpu::TextureView,
    /// Words for a ray of `MAX_STEPS` steps, which does not end.
    pub too_much: String,
}

shader_struct! {
    pub struct LightRaysUniform is LightRays in "lib/light_rays" {
        eye_high: [f32; 3],
        box_scale: f32,
        eye_low: [f32; 3],
        box_margin: f32,
        eye_in_boxes: [f32; 3],
        node_count: u32,
    }
}

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen; what float32 leaves open is lit,
/// and in the list.
pub fn light_rays(
    frame: &mut Recording,
    seen: Receivers,
    search: Search,
    unsure: &UnsureTests,
) -> Result<PooledBuffer> {
    let (scene, camera) = (seen.scene, seen.camera);
    let (eye_high, eye_low) = double_single(camera.eye - scene.origin);
    let eye_in_boxes = search.space.place_of(camera.eye);
    let uniform = LightRaysUniform {
        eye_high: eye_high.to_array(),
        box_scale: search.space.half_size.recip() as f32,
        eye_low: eye_low.to_array(),
        box_margin: search.box_margin,
        eye_in_boxes: eye_in_boxes.as_vec3().to_array(),
        node_count: search.node_count,
    };
    let visibility = frame.storage("visibility image", 4 * camera.pixel_count() as u64)?;
    let counters = frame.storage("counters", 8)?;
    frame.clear(&counters);
    let kernel = Kernel::new(search.file)
        .uniform(0, &uniform)
        .receivers(seen, &seen.camera_uniform())
        .vertices(scene)
        .masks(scene.masks.as_ref())
        .bind(4, search.structure)
        .bind(5, search.triangles)
        .bind(6, &visibility)
        .bind(7, &counters)
        .bind(19, &unsure.list)
        .constant("most_steps", MAX_STEPS);
    let groups = Groups::Grid(camera.width.div_ceil(8), camera.height.div_ceil(8));
    frame.pass(search.label, &[kernel.dispatch(groups)]);
    let too_much = search.too_much;
    frame.count(search.label, counters, 2, move |gpu, counters| {
        // As the shader's `RayCounters`.
        let [longest_walk, rays] = [counters[0], counters[1]];
        if longest_walk >= MAX_STEPS {
            return Err(Error::Device(format!(
                "{too_much} on the device {}; take another method",
                gpu.adapter.name
            )));
        }
        Ok(vec![
            Fact::sum("rays", rays),
            Fact::maximum("longest_walk", longest_walk),
        ])
    })?;
    Ok(visibility)
}
