//! Pass "shadow rays": the shadow of every pixel by a ray through a hierarchy that compute walks,
//! `shaders/shadow_rays.wgsl`.

use super::inputs::Receivers;
use super::light_rays::{MAX_STEPS, Search, light_rays};
use crate::bvh::WALK_MARGIN;
use crate::error::Result;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::HierarchyTables;
use crate::gpu::unsure::UnsureTests;

pub const LABEL: &str = "shadow rays";

/// The hierarchy's build, where it is not there yet.
pub const HIERARCHY_LABEL: &str = "hierarchy (CPU)";

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen; what float32 leaves open is lit,
/// and in the list.
pub fn shadow_rays(
    frame: &mut Recording,
    seen: Receivers,
    hierarchy: &HierarchyTables,
    unsure: &UnsureTests,
) -> Result<PooledBuffer> {
    let eye_in_boxes = hierarchy.space.place_of(seen.camera.eye);
    // The walk's own roundings, and those of a point relative to the eye.
    let distance = eye_in_boxes.length() + 2.0;
    let search = Search {
        label: LABEL,
        file: "shadow_rays",
        space: hierarchy.space,
        box_margin: (distance * f64::from(WALK_MARGIN)) as f32,
        node_count: hierarchy.node_count,
        structure: (&hierarchy.nodes).into(),
        triangles: &hierarchy.leaf_triangles,
        too_much: format!(
            "a shadow ray meets {MAX_STEPS} boxes and triangles or more, more than one invocation \
             may walk"
        ),
    };
    light_rays(frame, seen, search, unsure)
}
