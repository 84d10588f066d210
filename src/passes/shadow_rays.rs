//! Pass "shadow rays": the shadow of every pixel by a ray, `shaders/shadow_rays.wgsl`.

use super::{Facts, PendingFacts, Receivers};
use crate::bvh::WALK_MARGIN;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::frame::{Dispatch, Frame, Groups, Source, buffer, table};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::{HierarchyTables, double_single};
use crate::gpu::shaders::Shader;
use crate::projection::Projection;
use bytemuck::{Pod, Zeroable};

pub const LABEL: &str = "shadow rays";

const SHADER: Shader = Shader::new("shadow_rays");

/// Boxes and triangles of a ray at most: below the iterations after which some drivers end a loop.
const MOST_STEPS: u32 = 65_000;

/// Fails where a ray was not walked to its end. `counters` are the shader's `Counters`.
fn describe(gpu: &Gpu, counters: &[u32]) -> Result<Facts> {
    let [longest_walk, rays] = [counters[0], counters[1]];
    if longest_walk >= MOST_STEPS {
        return Err(Error::Device(format!(
            "a shadow ray meets {MOST_STEPS} boxes and triangles or more, more than one invocation may \
             walk on the device {}; take another method",
            gpu.adapter.name
        )));
    }
    Ok(vec![
        ("rays", rays.into()),
        ("longest_walk", longest_walk.into()),
    ])
}

/// As `ShadowRays` in the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ShadowRaysUniform {
    eye_high: [f32; 3],
    node_count: u32,
    eye_low: [f32; 3],
    box_scale: f32,
    eye_in_boxes: [f32; 3],
    box_margin: f32,
}

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen.
pub fn shadow_rays(
    frame: &mut Frame,
    seen: Receivers,
    hierarchy: &HierarchyTables,
) -> Result<(PooledBuffer, PendingFacts)> {
    let (scene, camera) = (seen.scene, seen.camera);
    let (eye_high, eye_low) = double_single(camera.eye - scene.origin);
    let eye_in_boxes = (camera.eye - hierarchy.centre) / hierarchy.half_size;
    // The walk's own roundings, and those of a point relative to the eye.
    let distance = eye_in_boxes.length() + 2.0;
    let uniform = ShadowRaysUniform {
        eye_high: eye_high.to_array(),
        node_count: hierarchy.node_count,
        eye_low: eye_low.to_array(),
        box_scale: hierarchy.half_size.recip() as f32,
        eye_in_boxes: eye_in_boxes.as_vec3().to_array(),
        box_margin: (distance * f64::from(WALK_MARGIN)) as f32,
    };
    let uniform = frame.uniform(LABEL, &uniform);
    let receivers = seen.uniform(&Projection::from_camera(camera));
    let receivers = frame.uniform("receivers", &receivers);
    let visibility = frame.storage("visibility image", 4 * camera.pixel_count() as u64)?;
    let counters = frame.storage("counters", 8)?;
    frame.clear(&counters);
    let mut constants = vec![
        ("has_low_parts", f64::from(u8::from(scene.has_low_parts))),
        ("most_steps", f64::from(MOST_STEPS)),
    ];
    constants.extend(seen.constants());
    let pipeline = frame.gpu.clone().pipeline(SHADER, "main", &constants);
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &pipeline,
            bindings: [
                &seen.bindings(&receivers)[..],
                &[
                    (0, buffer(&uniform)),
                    (2, table(&scene.positions_high)),
                    (3, table(&scene.positions_low)),
                    (4, table(&hierarchy.nodes)),
                    (5, table(&hierarchy.leaf_triangles)),
                    (6, buffer(&visibility)),
                    (7, buffer(&counters)),
                ],
            ]
            .concat(),
            groups: Groups::Grid(camera.width.div_ceil(8), camera.height.div_ceil(8)),
        }],
    );
    let facts = PendingFacts {
        label: LABEL,
        counters: frame.read(Source::Taken(counters), 2)?,
        describe,
    };
    Ok((visibility, facts))
}
