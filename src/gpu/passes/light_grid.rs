//! The light's grid of `shaders/lib/light_grid.wgsl`: what the lists of receivers and the casters share.

use crate::camera::Camera;
use crate::gpu::kernel::Kernel;
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;
use crate::rounding::{RECEIVER_ROUNDING, double_single};
use glam::{DMat3, DVec2};
use std::ops::Range;

/// Texels along the side of a tile, as in the shader.
pub const GRID_TILE: u32 = 16;

/// Tiles are counted in 8 bits.
pub const LARGEST_RESOLUTION: u32 = 256 * GRID_TILE;

/// Of the farthest depth: where casters that reach behind a local light are cut. Nearer, rounding would
/// make the bounds of what is left as wide as the grid.
const NEAR_SHARE: f64 = 1.0 / (1 << 14) as f64;

shader_struct! {
    pub struct LightGridUniform is LightGrid in "lib/light_grid" {
        x_axis: [f32; 3],
        rounding: f32,
        y_axis: [f32; 3],
        z_near: f32,
        z_axis: [f32; 3],
        size: u32,
        light: [f32; 3],
        pub tiles: u32,
        scale: [f32; 2],
        offset: [f32; 2],
        eye_high: [f32; 3],
        end_triangle: u32,
        eye_low: [f32; 3],
        coarse_shift: u32,
        first_row: u32,
        pub row_count: u32,
        map_size: u32,
        first_triangle: u32,
    }
}

/// The grid, and which rays it is of.
#[derive(Clone)]
pub struct LightGrid {
    pub uniform: LightGridUniform,
    is_local: bool,
    is_far_away: bool,
}

impl LightGrid {
    /// The texels of a square map through a projection with straight edges. A shadow map through the same projection
    /// has `map_size` texels along each side.
    pub fn new(
        scene: &SceneTables,
        camera: &Camera,
        projection: &Projection,
        map_size: u32,
    ) -> Self {
        let eye = camera.eye;
        let convergence = projection.kind.convergence();
        let is_local = projection.kind.is_central();
        let is_far_away = convergence > 0.0;
        let depth_axis = projection.z_axis.normalize();
        // Where rays meet, the map's axes lean along the ray through its origin.
        let [x, y] = [projection.x_axis, projection.y_axis].map(|axis| match is_far_away {
            true => axis.reject_from_normalized(depth_axis),
            false => axis,
        });
        let axes = DMat3::from_cols(x.normalize(), y.normalize(), -depth_axis).transpose();
        let texels_per_unit = DVec2::new(x.length(), y.length());
        let (eye_high, eye_low) = double_single(eye - scene.origin);
        let to_origin = axes * (projection.origin - eye);
        // Of a sum of three products, of positions relative to the eye, and of the light's or the map's.
        let rounding = RECEIVER_ROUNDING * (scene.farthest(eye) + to_origin.length());
        let (light, scale, offset) = if is_far_away {
            let [texels, _] = projection.kind.matrices().expect("a homography");
            let stretched = DVec2::new(texels.x_axis.x, texels.y_axis.y);
            let from_eye = convergence / (1.0 + convergence * to_origin.z);
            // The ray through the map's origin leads to the light.
            let slope = axes * projection.steps().z_axis * (1.0 / convergence);
            let light = (to_origin.truncate() - slope.truncate()) * from_eye;
            let scale = texels_per_unit * stretched * (from_eye / convergence);
            let at_eye = projection.texel_from_point(eye).truncate();
            (light.extend(from_eye), scale, at_eye)
        } else {
            let shift = match is_local {
                false => -to_origin.truncate() * texels_per_unit,
                true => DVec2::ZERO,
            };
            (to_origin, texels_per_unit, projection.centre + shift)
        };
        let size = projection.width;
        // No triangle is cut into more than 64 x 64 coarse tiles.
        let coarse = (size.div_ceil(64)).next_power_of_two().max(8 * GRID_TILE);
        let uniform = LightGridUniform {
            x_axis: axes.row(0).as_vec3().to_array(),
            rounding: rounding as f32,
            y_axis: axes.row(1).as_vec3().to_array(),
            z_near: (NEAR_SHARE * projection.far) as f32,
            z_axis: axes.row(2).as_vec3().to_array(),
            size,
            light: light.as_vec3().to_array(),
            tiles: size.div_ceil(GRID_TILE),
            scale: scale.as_vec2().to_array(),
            offset: offset.as_vec2().to_array(),
            eye_high: eye_high.to_array(),
            end_triangle: scene.triangle_count,
            eye_low: eye_low.to_array(),
            coarse_shift: coarse.trailing_zeros(),
            first_row: 0,
            row_count: camera.height,
            map_size,
            first_triangle: 0,
        };
        Self {
            uniform,
            is_local,
            is_far_away,
        }
    }

    /// The same grid for some rows of the image.
    pub fn of_rows(&self, rows: Range<u32>) -> Self {
        let uniform = LightGridUniform {
            first_row: rows.start,
            row_count: rows.end - rows.start,
            ..self.uniform
        };
        Self {
            uniform,
            ..self.clone()
        }
    }

    /// A kernel for such rays.
    pub fn of_rays(&self, kernel: Kernel) -> Kernel {
        kernel
            .constant("is_local", self.is_local)
            .constant("is_far_away", self.is_far_away)
    }

    /// The same grid for some of the triangles.
    pub fn of_triangles(&self, triangles: &Range<u32>) -> LightGridUniform {
        LightGridUniform {
            first_triangle: triangles.start,
            end_triangle: triangles.end,
            ..self.uniform
        }
    }

    pub fn texel_count(&self) -> u64 {
        u64::from(self.uniform.size) * u64::from(self.uniform.size)
    }

    pub fn tile_count(&self) -> u64 {
        u64::from(self.uniform.tiles) * u64::from(self.uniform.tiles)
    }
}
