//! Pass "ray queries": the shadow of every pixel by a ray query of the device, `shaders/ray_queries.wgsl`.

use super::inputs::Receivers;
use super::light_rays::{MAX_STEPS, Search, light_rays};
use crate::error::Result;
use crate::gpu::acceleration::AccelerationStructure;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::unsure::UnsureTests;

pub const LABEL: &str = "ray queries";

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen; what float32 leaves open is lit,
/// and in the list.
pub fn ray_queries(
    frame: &mut Recording,
    seen: Receivers,
    structure: &AccelerationStructure,
    unsure: &UnsureTests,
) -> Result<PooledBuffer> {
    let search = Search {
        label: LABEL,
        file: "ray_queries",
        space: structure.space,
        box_margin: structure.margin,
        node_count: 0,
        structure: structure.boxes(),
        triangles: structure.triangles(),
        too_much: format!(
            "a ray query meets the boxes of {MAX_STEPS} triangles or more, more than one invocation \
             may test"
        ),
    };
    light_rays(frame, seen, search, unsure)
}
