//! Pass "forward importance": what a light's depth image makes of each cell of its map.

use super::importance_map::{Factors, ImportanceMap};
use super::inputs::Receivers;
use super::rasterize::Target;
use crate::camera::Rays;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;
use glam::DVec3;

pub const LABEL: &str = "forward importance";

shader_struct! {
    pub struct ForwardUniform is Forward in "forward_importance" {
        camera_x: [f32; 4],
        camera_y: [f32; 4],
        camera_z: [f32; 4],
        eye: [f32; 4],
        centre: [f32; 2],
        image: [f32; 2],
        near: f32,
        far: f32,
        cells: u32,
        normal_bonus: f32,
        map_weights: [u32; 2],
        padding: [u32; 2],
    }
}

/// The greatest importance in each cell of the texels of an image of depths and triangles.
pub fn forward_importance(
    frame: &mut Recording,
    seen: Receivers,
    projection: &Projection,
    texels: &wgpu::Buffer,
    cells: u32,
    factors: Factors,
) -> Result<ImportanceMap> {
    let map = frame.storage(LABEL, 4 * u64::from(cells) * u64::from(cells))?;
    frame.clear(&map);
    let camera = Projection::from_camera(seen.camera);
    let steps = projection.steps() * projection.unit().recip();
    // Products of float64 matrices, rounded once.
    let row = |axis: DVec3| {
        let offset = axis.dot(projection.origin - camera.origin);
        [
            axis.dot(steps.x_axis),
            axis.dot(steps.y_axis),
            axis.dot(steps.z_axis),
            offset,
        ]
        .map(|v| v as f32)
    };
    let origin = projection.projected_from_point(camera.origin);
    let eye = match seen.camera.rays {
        Rays::Perspective => (origin * projection.unit()).extend(1.0),
        Rays::Orthographic => {
            let ahead = projection.projected_from_point(camera.origin + seen.camera.forward);
            ((ahead - origin) * projection.unit()).extend(0.0)
        }
    };
    let uniform = ForwardUniform {
        camera_x: row(camera.x_axis),
        camera_y: row(camera.y_axis),
        camera_z: row(camera.z_axis),
        eye: eye.as_vec4().to_array(),
        centre: camera.centre.as_vec2().to_array(),
        image: [camera.width as f32, camera.height as f32],
        near: camera.near as f32,
        far: camera.far.min(f64::from(f32::MAX)) as f32,
        cells,
        normal_bonus: factors.normal.unwrap_or(0.0) as f32,
        map_weights: factors
            .map_weights
            .map_or([1; 2], |grid| [grid.columns, grid.rows]),
        padding: [0; 2],
    };
    let unused = frame.storage("unused weights", 4)?;
    let kernel = Kernel::new("forward_importance")
        .projection(0, projection, seen.scene.origin)
        .uniform(1, &uniform)
        .bind(2, &map)
        .stored(Target::DepthTriangle)
        .bind(5, texels)
        .bind(10, &seen.scene.unit_normals)
        .factors(factors, &unused);
    let groups = Groups::Grid(projection.width.div_ceil(64), projection.height);
    frame.pass(LABEL, &[kernel.dispatch(groups)]);
    Ok(ImportanceMap {
        values: map,
        cells,
        count_unit: None,
    })
}
