//! The light's grid of `shaders/lib/light_grid.wgsl`: what the lists of receivers and the casters share.

use crate::camera::Camera;
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
    pub struct LightGrid is LightGrid in "lib/light_grid" {
        x_axis: [f32; 3],
        rounding: f32,
        y_axis: [f32; 3],
        z_near: f32,
        z_axis: [f32; 3],
        pub size: u32,
        light: [f32; 3],
        pub tiles: u32,
        scale: [f32; 2],
        offset: [f32; 2],
        eye_high: [f32; 3],
        end_triangle: u32,
        eye_low: [f32; 3],
        coarse_shift: u32,
        pub first_row: u32,
        pub row_count: u32,
        map_size: u32,
        first_triangle: u32,
    }
}

impl LightGrid {
    /// The texels of a square map through a parallel or perspective projection whose axes are orthogonal.
    /// A shadow map through the same projection has `map_size` texels along each side.
    pub fn new(
        scene: &SceneTables,
        camera: &Camera,
        projection: &Projection,
        map_size: u32,
    ) -> Self {
        let (x, y) = (projection.x_axis, projection.y_axis);
        let texels_per_unit = DVec2::new(x.length(), y.length());
        let z_axis = -projection.z_axis.normalize();
        let axes = DMat3::from_cols(x.normalize(), y.normalize(), z_axis).transpose();
        let (eye_high, eye_low) = double_single(camera.eye - scene.origin);
        let light = axes * (projection.origin - camera.eye);
        let shift = match projection.kind.is_central() {
            false => -light.truncate() * texels_per_unit,
            true => DVec2::ZERO,
        };
        // Of a sum of three products, of positions relative to the eye, and of the light's.
        let rounding = RECEIVER_ROUNDING * (scene.farthest(camera.eye) + light.length());
        let size = projection.width;
        // No triangle is cut into more than 64 x 64 coarse tiles.
        let coarse = (size.div_ceil(64)).next_power_of_two().max(8 * GRID_TILE);
        Self {
            x_axis: axes.row(0).as_vec3().to_array(),
            rounding: rounding as f32,
            y_axis: axes.row(1).as_vec3().to_array(),
            z_near: (NEAR_SHARE * projection.far) as f32,
            z_axis: axes.row(2).as_vec3().to_array(),
            size,
            light: light.as_vec3().to_array(),
            tiles: size.div_ceil(GRID_TILE),
            scale: texels_per_unit.as_vec2().to_array(),
            offset: (projection.centre + shift).as_vec2().to_array(),
            eye_high: eye_high.to_array(),
            end_triangle: scene.triangle_count,
            eye_low: eye_low.to_array(),
            coarse_shift: coarse.trailing_zeros(),
            first_row: 0,
            row_count: camera.height,
            map_size,
            first_triangle: 0,
        }
    }

    /// The same grid for some of the triangles.
    pub fn of_triangles(&self, triangles: &Range<u32>) -> Self {
        Self {
            first_triangle: triangles.start,
            end_triangle: triangles.end,
            ..*self
        }
    }

    pub fn texel_count(&self) -> u64 {
        u64::from(self.size) * u64::from(self.size)
    }

    pub fn tile_count(&self) -> u64 {
        u64::from(self.tiles) * u64::from(self.tiles)
    }
}
