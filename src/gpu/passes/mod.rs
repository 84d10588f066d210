//! The passes. Each is a function from handles to a handle; one pass is one file, one label and one
//! timer key, and passes belong to the house, not to a method.

pub mod blend_importance;
pub mod boundary;
pub mod caster_tests;
mod facts;
pub mod forward_importance;
pub mod image_tiles;
pub mod importance_map;
pub mod light_grid;
pub mod light_rays;
pub mod lookup;
pub mod outline;
pub mod rasterize;
pub mod ray_queries;
pub mod receiver_lists;
pub mod receiver_tiles;
pub mod receivers;
pub mod samples;
pub mod shadow_edge;
pub mod shadow_map;
pub mod shadow_rays;
pub mod shadow_volumes;
pub mod tessellate;
pub mod visibility;
pub mod warp_map;
pub mod work_items;

use crate::camera::Camera;
use crate::gpu::frame::{Binding, Groups, buffer, table};
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::{acceleration, flag};
use crate::light::Light;
use crate::projection::Projection;
use crate::region::{MAX_HALF_SPACES, Region};
use bytemuck::{Pod, Zeroable};
pub use facts::{Describe, Fact, Facts, FactsOfPasses, PendingFacts};
use glam::DVec3;
use image_tiles::{IMAGE_TILE, ImageTiles};

/// The keys of a frame's timers, of passes and of what the CPU does for them.
pub const LABELS: &[&str] = &[
    acceleration::LABEL,
    blend_importance::LABEL,
    boundary::LABEL,
    caster_tests::LABEL,
    forward_importance::LABEL,
    image_tiles::LABEL,
    importance_map::LABEL,
    lookup::LABEL,
    outline::LABEL,
    ray_queries::LABEL,
    receiver_lists::LABEL,
    receiver_tiles::LABEL,
    receivers::LABEL,
    samples::LABEL,
    shadow_edge::LABEL,
    shadow_map::LABEL,
    shadow_rays::HIERARCHY_LABEL,
    shadow_rays::LABEL,
    shadow_volumes::EDGES_LABEL,
    shadow_volumes::LABEL,
    visibility::LABEL,
    warp_map::LABEL,
];

/// As `Receivers` in `shaders/lib/receivers.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReceiversUniform {
    ray_x: [f32; 3],
    width: u32,
    ray_y: [f32; 3],
    height: u32,
    ray_z: [f32; 3],
    rounding: f32,
    centre: [f32; 2],
    constant_bias: f32,
    slope_bias: f32,
    from_light: [f32; 3],
    is_local: f32,
    cone_axis: [f32; 3],
    cone_cosine: f32,
    region: [[f32; 4]; MAX_HALF_SPACES],
    beam_bias: f32,
    receiver_plane: f32,
    filter_radius: f32,
    padding: f32,
    light_x: [f32; 4],
    light_y: [f32; 4],
    light_z: [f32; 4],
}

/// What every pass of a frame reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    pub scene: &'a SceneTables,
    pub camera: &'a Camera,
}

/// What the camera sees, before one light and for one layer: what the passes over receivers read.
#[derive(Clone, Copy)]
pub struct Receivers<'a> {
    pub scene: &'a SceneTables,
    pub camera: &'a Camera,
    pub visibility_buffer: &'a wgpu::Buffer,
    pub light: &'a Light,
    pub region: &'a Region,
    /// Those of the region, where they are known; the passes that look at tiles look at all of the image
    /// without them.
    pub tiles: Option<&'a ImageTiles>,
}

impl<'a> Receivers<'a> {
    pub fn within(self, tiles: Option<&'a ImageTiles>) -> Self {
        Self { tiles, ..self }
    }

    /// The camera's pixels seen in the projection space of a light.
    fn uniform(&self, projection: &Projection) -> ReceiversUniform {
        let (camera, eye) = (self.camera, self.camera.eye);
        let ray_x = camera.right / camera.focal.x;
        let ray_y = -camera.up / camera.focal.y;
        let ray_z = camera.forward;
        // Products of float64 matrices, rounded once.
        let unit = projection.unit();
        let row = |axis: DVec3| {
            [
                axis.dot(ray_x),
                axis.dot(ray_y),
                axis.dot(ray_z),
                axis.dot(eye - projection.origin),
            ]
            .map(|v| (v * unit) as f32)
        };
        let from_light = self.eye_from_light();
        let cone = self.light.cone();
        ReceiversUniform {
            ray_x: ray_x.as_vec3().to_array(),
            width: camera.width,
            ray_y: ray_y.as_vec3().to_array(),
            height: camera.height,
            ray_z: ray_z.as_vec3().to_array(),
            rounding: 0.0,
            centre: camera.centre.as_vec2().to_array(),
            constant_bias: 0.0,
            slope_bias: 0.0,
            from_light: from_light.as_vec3().to_array(),
            is_local: f32::from(u8::from(self.light.position().is_some())),
            cone_axis: cone.map_or([0.0; 3], |cone| cone.axis.as_vec3().to_array()),
            cone_cosine: cone.map_or(-1.0, |cone| cone.cosine as f32),
            region: self.region.planes(eye, self.slack()),
            beam_bias: 0.0,
            receiver_plane: 0.0,
            filter_radius: 0.0,
            padding: 0.0,
            light_x: row(projection.x_axis),
            light_y: row(projection.y_axis),
            light_z: row(projection.z_axis),
        }
    }

    /// The same for passes that need no projection of the light.
    fn camera_uniform(&self) -> ReceiversUniform {
        self.uniform(&Projection::from_camera(self.camera))
    }

    /// From the light to the eye; of a light at infinity a unit vector.
    fn eye_from_light(&self) -> DVec3 {
        let eye = self.camera.eye;
        match self.light.position() {
            Some(position) => eye - position,
            None => -self.light.vector_from_point(eye),
        }
    }

    /// What float32 may round of a receiver's position.
    fn slack(&self) -> f64 {
        let distances = self.scene.farthest(self.camera.eye) + self.eye_from_light().length();
        8.0 * f64::from(f32::EPSILON) * distances
    }

    /// Bindings of `shaders/lib/receivers.wgsl`, with a buffer of `uniform`.
    fn bindings<'b>(&'b self, uniform: &'b wgpu::Buffer) -> [Binding<'b>; 3] {
        [
            (20, buffer(uniform)),
            (21, buffer(self.visibility_buffer)),
            (10, table(&self.scene.unit_normals)),
        ]
    }

    /// The binding of `shaders/lib/image_tiles.wgsl`.
    fn tiles_binding(&self) -> Binding<'_> {
        let unused = self.visibility_buffer;
        (22, buffer(self.tiles.map_or(unused, |tiles| &tiles.listed)))
    }

    /// Workgroups of the layer's tiles, or of all of the image, each invocation with so many rows: a power of
    /// two that divides a tile's.
    fn groups(&self, rows_per_invocation: u32) -> Groups<'_> {
        self.groups_of_rows(self.camera.height, rows_per_invocation)
    }

    /// The same, but of so many rows of the image where tiles are not known.
    fn groups_of_rows(&self, rows: u32, rows_per_invocation: u32) -> Groups<'_> {
        match self.tiles {
            Some(tiles) => tiles.groups(rows_per_invocation),
            None => Groups::Grid(
                self.camera.width.div_ceil(IMAGE_TILE[0]),
                rows.div_ceil(rows_per_invocation),
            ),
        }
    }

    /// Constants of `shaders/lib/image_tiles.wgsl`.
    fn tiles_constants(&self, rows_per_invocation: u32) -> [(&'static str, f64); 2] {
        [
            ("has_tiles", flag(self.tiles.is_some())),
            ("rows_per_invocation", f64::from(rows_per_invocation)),
        ]
    }

    /// Constants of `shaders/lib/receivers.wgsl`.
    fn constants(&self) -> [(&'static str, f64); 2] {
        [
            ("has_cone", flag(self.light.cone().is_some())),
            ("has_region", flag(!self.region.is_everywhere())),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::LABELS;
    use std::path::Path;

    #[test]
    fn every_label_is_listed_once() {
        let gpu = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/gpu");
        let mut found = Vec::new();
        for folder in [gpu.join("passes"), gpu] {
            for entry in std::fs::read_dir(folder).unwrap() {
                let Ok(text) = std::fs::read_to_string(entry.unwrap().path()) else {
                    continue;
                };
                let constants = text.lines().filter(|line| line.starts_with("pub const "));
                let labels = constants.filter_map(|line| line.split_once("LABEL: &str = \""));
                found.extend(labels.map(|(_, value)| value.trim_end_matches("\";").to_string()));
            }
        }
        found.sort();
        let mut listed = LABELS.to_vec();
        listed.sort();
        assert_eq!(found, listed);
    }
}
