//! A projection as the shaders get it.

use super::shader_struct::shader_struct;
use crate::projection::Projection;
use crate::rounding::double_single;
use glam::{DMat3, DVec3};

shader_struct! {
    pub struct ProjectionUniform is Projection in "lib/projection" {
        origin_high: [f32; 3],
        depth_offset: f32,
        origin_low: [f32; 3],
        depth_scale: f32,
        x_axis: [f32; 3],
        pub z_min: f32,
        y_axis: [f32; 3],
        pub z_max: f32,
        z_axis: [f32; 3],
        pub least_w: f32,
        centre: [f32; 2],
        size: [u32; 2],
        pub scale: [f32; 2],
        pub convergence: f32,
        z_floor: f32,
        step_x: [f32; 4],
        step_y: [f32; 4],
        step_z: [f32; 4],
        pub texel_from_place: [[f32; 4]; 3],
        pub place_from_texel: [[f32; 4]; 3],
    }
}

impl ProjectionUniform {
    /// Positions in the shaders are relative to `scene_origin`.
    pub fn new(projection: &Projection, scene_origin: DVec3) -> Self {
        let (origin_high, origin_low) = double_single(projection.origin - scene_origin);
        let (depth_offset, depth_scale) = projection.depth_from_z();
        let kind = &projection.kind;
        let unit = projection.unit();
        let to_world = unit.recip();
        let steps = projection.steps() * to_world;
        let scaled = |k: f64| DMat3::from_diagonal(DVec3::new(k, k, 1.0));
        let [texel_from_place, place_from_texel] = kind.matrices().unwrap_or_default();
        let padded = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        let rows = |matrix: DMat3| [0, 1, 2].map(|i| padded(matrix.row(i)));
        Self {
            origin_high: origin_high.to_array(),
            depth_offset: (depth_offset * unit) as f32,
            origin_low: origin_low.to_array(),
            depth_scale: (depth_scale / unit) as f32,
            x_axis: (projection.x_axis * unit).as_vec3().to_array(),
            z_min: (projection.near * unit) as f32,
            y_axis: (projection.y_axis * unit).as_vec3().to_array(),
            z_max: (projection.far * unit).min(f64::from(f32::MAX)) as f32,
            z_axis: (projection.z_axis * unit).as_vec3().to_array(),
            least_w: kind.least_w(projection) as f32,
            centre: projection.centre.as_vec2().to_array(),
            size: [projection.width, projection.height],
            scale: kind.plane_scale().as_vec2().to_array(),
            convergence: (kind.convergence() * to_world) as f32,
            z_floor: match projection.normalizes_depth {
                true => (projection.near * unit) as f32,
                // An image shows nothing that is too near.
                false => f32::MIN,
            },
            step_x: padded(steps.x_axis),
            step_y: padded(steps.y_axis),
            step_z: padded(steps.z_axis),
            texel_from_place: rows(texel_from_place * scaled(to_world)),
            place_from_texel: rows(scaled(unit) * place_from_texel),
        }
    }
}
