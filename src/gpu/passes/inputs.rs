//! What the passes read: the scene, and the receivers of a layer.

use crate::camera::{Camera, Rays};
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::{LightSides, SceneTables};
use crate::gpu::shader_struct::shader_struct;
use crate::light::Light;
use crate::projection::Projection;
use crate::region::{MAX_HALF_SPACES, Region};
use crate::rounding::RECEIVER_ROUNDING;
use glam::DVec3;

/// Columns and rows of a tile, as in `shaders/lib/image_tiles.wgsl`.
pub const IMAGE_TILE: [u32; 2] = [64, 32];

/// Workgroups for invocations of 1, 2, 4, ... rows up to all of a tile.
pub const CHOICES: u64 = IMAGE_TILE[1].ilog2() as u64 + 1;
pub const BYTES_OF_CHOICE: u64 = 12;

shader_struct! {
    pub struct ReceiversUniform is Receivers in "lib/receivers" {
        ray_x: [f32; 3],
        width: u32,
        ray_y: [f32; 3],
        height: u32,
        ray_z: [f32; 3],
        pub rounding: f32,
        centre: [f32; 2],
        pub constant_bias: f32,
        pub slope_bias: f32,
        from_light: [f32; 3],
        is_local: f32,
        cone_axis: [f32; 3],
        cone_cosine: f32,
        region: [[f32; 4]; MAX_HALF_SPACES],
        pub beam_bias: f32,
        pub receiver_plane: f32,
        pub filter_radius: f32,
        cone_at_eye: f32,
        eye_from_axis: [f32; 3],
        cone_sine: f32,
        pub margin: f32,
        padding: f32,
        more_padding: [f32; 2],
        light_x: [f32; 4],
        light_y: [f32; 4],
        light_z: [f32; 4],
    }
}

/// Tiles of one layer, on the device.
pub struct ImageTiles {
    pub listed: PooledBuffer,
    pub groups: PooledBuffer,
}

impl ImageTiles {
    fn groups(&self, rows_per_invocation: u32) -> Groups {
        debug_assert!(rows_per_invocation.is_power_of_two());
        let choice = u64::from(rows_per_invocation.ilog2());
        debug_assert!(choice < CHOICES);
        Groups::Indirect((*self.groups).clone(), BYTES_OF_CHOICE * choice)
    }
}

/// What the camera sees, before one light and for one layer: what the passes over receivers read.
#[derive(Clone, Copy)]
pub struct Receivers<'a> {
    pub scene: &'a SceneTables,
    pub camera: &'a Camera,
    pub visibility_buffer: &'a wgpu::Buffer,
    pub light: &'a Light,
    pub light_sides: &'a LightSides,
    pub region: &'a Region,
    /// Those of the region, where they are known; the passes that look at tiles look at all of the image
    /// without them.
    pub tiles: Option<&'a ImageTiles>,
}

impl<'a> Receivers<'a> {
    /// Those of a region, and its tiles.
    pub fn within<'b>(self, region: &'b Region, tiles: Option<&'b ImageTiles>) -> Receivers<'b>
    where
        'a: 'b,
    {
        Receivers {
            region,
            tiles,
            ..self
        }
    }

    /// The camera's pixels seen in the projection space of a light.
    pub fn uniform(&self, projection: &Projection) -> ReceiversUniform {
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
        let eye_from_axis = cone.map_or(DVec3::ZERO, |cone| cone.aside(from_light));
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
            cone_at_eye: cone.map_or(1.0, |cone| cone.depth_of(from_light) as f32),
            eye_from_axis: eye_from_axis.as_vec3().to_array(),
            cone_sine: cone.map_or(0.0, |cone| cone.sine as f32),
            margin: 0.0,
            padding: 0.0,
            more_padding: [0.0; 2],
            light_x: row(projection.x_axis),
            light_y: row(projection.y_axis),
            light_z: row(projection.z_axis),
        }
    }

    /// The same for passes that need no projection of the light.
    pub fn camera_uniform(&self) -> ReceiversUniform {
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

    /// What float32 may round of a receiver's side of the region's planes.
    pub fn slack(&self) -> f64 {
        let eye = self.camera.eye;
        // A light far away is no part of them.
        let to_planes = self.region.farthest_origin(eye);
        let to_planes = to_planes.min(self.eye_from_light().length());
        RECEIVER_ROUNDING * (self.scene.farthest(eye) + to_planes)
    }

    /// Workgroups of the layer's tiles, or of all of the image, each invocation with so many rows: a power of
    /// two that divides a tile's.
    pub fn groups(&self, rows_per_invocation: u32) -> Groups {
        self.groups_of_rows(self.camera.height, rows_per_invocation)
    }

    /// The same, but of so many rows of the image where tiles are not known.
    pub fn groups_of_rows(&self, rows: u32, rows_per_invocation: u32) -> Groups {
        match self.tiles {
            Some(tiles) => tiles.groups(rows_per_invocation),
            None => Groups::Grid(
                self.camera.width.div_ceil(IMAGE_TILE[0]),
                rows.div_ceil(rows_per_invocation),
            ),
        }
    }
}

impl Kernel {
    /// What `shaders/lib/receivers.wgsl` reads.
    pub fn receivers(self, seen: Receivers, uniform: &ReceiversUniform) -> Self {
        self.receivers_uniform(seen, uniform)
            .bind(21, seen.visibility_buffer)
            .bind(10, &seen.scene.unit_normals)
            .light_sides(seen.scene, seen.light_sides)
            .constant("has_cone", seen.light.cone().is_some())
            .constant("has_region", !seen.region.is_everywhere())
    }

    /// Of these the uniform alone, and which rays its camera has.
    pub fn receivers_uniform(self, seen: Receivers, uniform: &ReceiversUniform) -> Self {
        let is_orthographic = seen.camera.rays == Rays::Orthographic;
        self.uniform(20, uniform)
            .constant("is_orthographic", is_orthographic)
    }

    /// What `shaders/lib/image_tiles.wgsl` reads.
    pub fn tiles(self, seen: Receivers, rows_per_invocation: u32) -> Self {
        let unused = seen.visibility_buffer;
        self.bind(22, seen.tiles.map_or(unused, |tiles| &tiles.listed))
            .constant("has_tiles", seen.tiles.is_some())
            .constant("rows_per_invocation", rows_per_invocation)
    }
}
