//! Pass "shadow volumes": the shadow of every pixel by counting faces of shadow volumes on the
//! rasterization hardware, `shaders/shadow_volumes.wgsl`.

use super::inputs::Receivers;
use crate::camera::{Camera, Rays};
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::kernel::{Groups, Kernel, Vertices};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::EdgeTables;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::unsure::UnsureTests;
use crate::rounding::double_single;
use crate::stats::Fact;
use glam::{DVec3, DVec4};

pub const LABEL: &str = "shadow volumes";

/// The search for the scene's edges, where they are not known yet.
pub const EDGES_LABEL: &str = "edges (CPU)";

/// Invocations of a workgroup, as in the shader.
const GROUP: u64 = 64;

const SILHOUETTE_BYTES: u64 = 8;

shader_struct! {
    pub struct ShadowVolumesUniform is ShadowVolumes in "shadow_volumes" {
        eye_high: [f32; 3],
        triangle_count: u32,
        eye_low: [f32; 3],
        edge_count: u32,
        clip_x: [f32; 3],
        far: f32,
        clip_y: [f32; 3],
        count_at_infinity: i32,
        clip_w: [f32; 3],
        padding: u32,
        clip_offset: [f32; 3],
        more_padding: u32,
    }
}

impl ShadowVolumesUniform {
    fn new(seen: Receivers, edges: &EdgeTables, count_at_infinity: i32) -> Self {
        let (scene, camera) = (seen.scene, seen.camera);
        let (eye_high, eye_low) = double_single(camera.eye - scene.origin);
        let [_, _, clip_w] = camera.image_rows();
        let row = |axis: DVec3, focal: f64, centre: f64, size: u32| {
            let (focal, centre) = (2.0 * focal, 2.0 * centre - f64::from(size));
            ((axis * focal).extend(0.0) + clip_w * centre) / f64::from(size)
        };
        let (focal, centre) = (camera.focal, camera.centre);
        let clip_x = row(camera.right, focal.x, centre.x, camera.width);
        // Rows of the image go down.
        let from_below = f64::from(camera.height) - centre.y;
        let clip_y = row(camera.up, focal.y, from_below, camera.height);
        let vector = |row: DVec4| row.truncate().as_vec3().to_array();
        Self {
            eye_high: eye_high.to_array(),
            triangle_count: scene.triangle_count,
            eye_low: eye_low.to_array(),
            edge_count: edges.edge_count,
            clip_x: vector(clip_x),
            far: scene.farthest(camera.eye) as f32,
            clip_y: vector(clip_y),
            count_at_infinity,
            clip_w: vector(clip_w),
            padding: 0,
            clip_offset: DVec3::new(clip_x.w, clip_y.w, clip_w.w)
                .as_vec3()
                .to_array(),
            more_padding: 0,
        }
    }
}

/// What the dispatches and draws of a frame share, on the device.
struct Volumes<'a> {
    seen: Receivers<'a>,
    edges: &'a EdgeTables,
    uniform: ShadowVolumesUniform,
    kernel: Kernel,
    /// The same for entry points that read the scene relative to the eye and the light.
    of_scene: Kernel,
    /// The pixels that face the light, and by how many volumes each is counted to be shaded.
    points: PooledBuffer,
    counts: PooledBuffer,
    /// Which side of each triangle the light is on.
    sides: PooledBuffer,
    silhouettes: PooledBuffer,
    /// Of the draw of the silhouettes' sides.
    arguments: PooledBuffer,
}

impl<'a> Volumes<'a> {
    fn new(
        frame: &mut Recording,
        seen: Receivers<'a>,
        edges: &'a EdgeTables,
        count_at_infinity: i32,
    ) -> Result<Self> {
        let (scene, pixels) = (seen.scene, seen.camera.pixel_count() as u64);
        let uniform = ShadowVolumesUniform::new(seen, edges, count_at_infinity);
        let kernel = Kernel::new("shadow_volumes");
        let kernel = kernel.constant("vertices_per_side", vertices_per_side(seen));
        let of_scene = kernel.clone().uniform(0, &uniform);
        let of_scene = of_scene.receivers_uniform(seen, &seen.camera_uniform());
        let silhouettes = SILHOUETTE_BYTES * u64::from(edges.edge_count.max(1));
        let volumes = Self {
            seen,
            edges,
            uniform,
            kernel,
            of_scene,
            points: frame.storage("points", 8 * pixels)?,
            counts: frame.storage("counts", 4 * pixels)?,
            sides: frame.storage("sides", 4 * u64::from(scene.triangle_count))?,
            silhouettes: frame.storage("silhouettes", silhouettes)?,
            arguments: frame.storage("draw arguments", 16)?,
        };
        frame.clear(&volumes.counts);
        Ok(volumes)
    }

    /// Finds the pixels that ask, the sides of triangles that the light is on, and the silhouettes.
    fn find(&self, frame: &mut Recording, unsure: &UnsureTests) {
        let (seen, scene) = (self.seen, self.seen.scene);
        let of_entry = |entry_point| self.kernel.clone().entry(entry_point);
        let by_item = |count: u32| Groups::Linear(u64::from(count).div_ceil(GROUP));
        let begin = of_entry("begin").bind(13, &self.arguments);
        let find_points = of_entry("find_points")
            .receivers(seen, &seen.camera_uniform())
            .bind(14, &self.points)
            .bind(19, &unsure.list);
        let find_sides = self.of_scene.clone().entry("find_sides");
        let find_sides = find_sides
            .triangles(scene)
            .bind(10, &scene.unit_normals)
            .light_sides(seen.scene, seen.light_sides)
            .bind(6, &self.sides);
        let find_silhouettes = of_entry("find_silhouettes")
            .uniform(0, &self.uniform)
            .bind(4, &self.edges.edges)
            .bind(5, &self.edges.uses)
            .bind(7, &self.sides)
            .bind(8, &self.silhouettes)
            .bind(13, &self.arguments);
        let dispatches = [
            begin.dispatch(Groups::ONE),
            find_points.dispatch(image(seen)),
            find_sides.dispatch(by_item(scene.triangle_count)),
            find_silhouettes.dispatch(by_item(self.edges.edge_count)),
        ];
        frame.pass(LABEL, &dispatches);
    }

    /// Draws the faces of the volumes and counts those beyond each point.
    fn count(&self, frame: &mut Recording) {
        let seen = self.seen;
        let kernel = self.of_scene.clone();
        let kernel = kernel.bind(15, &self.points).bind(16, &self.counts);
        let caps = kernel.clone().triangles(seen.scene).bind(7, &self.sides);
        let corners = || Vertices::Number(3 * seen.scene.triangle_count);
        // Edges name their vertices.
        let sides = kernel
            .vertices(seen.scene)
            .bind(4, &self.edges.edges)
            .bind(9, &self.silhouettes);
        let arguments = Vertices::Indirect((*self.arguments).clone());
        let mut draws = vec![
            caps.clone().draw("light_cap", "count_light_cap", corners()),
            sides.draw("side", "count_side", arguments),
        ];
        // At infinity parallel lines of sight are at one place.
        if seen.light.position().is_some() && seen.camera.rays == Rays::Perspective {
            draws.push(caps.draw("dark_cap", "count_dark_cap", corners()));
        }
        frame.draw(LABEL, (seen.camera.width, seen.camera.height), &draws);
    }

    /// The visibility image from the counts.
    fn answer(&self, frame: &mut Recording) -> Result<PooledBuffer> {
        let pixels = self.seen.camera.pixel_count() as u64;
        let visibility = frame.storage("visibility image", 4 * pixels)?;
        let kernel = self.kernel.clone().entry("answer");
        let kernel = kernel
            .receivers_uniform(self.seen, &self.seen.camera_uniform())
            .bind(21, self.seen.visibility_buffer)
            .bind(15, &self.points)
            .bind(16, &self.counts)
            .bind(17, &visibility)
            .uniform(0, &self.uniform);
        frame.pass(LABEL, &[kernel.dispatch(image(self.seen))]);
        Ok(visibility)
    }
}

/// Of a side: two triangles, or one where the light is at infinity.
fn vertices_per_side(seen: Receivers) -> u32 {
    match seen.light.position() {
        Some(_) => 6,
        None => 3,
    }
}

fn image(seen: Receivers) -> Groups {
    Groups::Grid(
        seen.camera.width.div_ceil(8),
        seen.camera.height.div_ceil(8),
    )
}

fn check_image(gpu: &Gpu, camera: &Camera) -> Result<()> {
    let widest = gpu.limits.max_texture_dimension_2d;
    if camera.width.max(camera.height) > widest {
        return Err(Error::Device(format!(
            "shadow volumes draw at most {widest} pixels along each side on the device {}, got width {} \
             and height {}; take another method",
            gpu.adapter.name, camera.width, camera.height
        )));
    }
    Ok(())
}

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen. An orthographic camera's lines of sight
/// are at last in so many volumes.
pub fn shadow_volumes(
    frame: &mut Recording,
    seen: Receivers,
    edges: &EdgeTables,
    count_at_infinity: i32,
    unsure: &UnsureTests,
) -> Result<PooledBuffer> {
    check_image(&frame.gpu, seen.camera)?;
    let volumes = Volumes::new(frame, seen, edges, count_at_infinity)?;
    volumes.find(frame, unsure);
    volumes.count(frame);
    let visibility = volumes.answer(frame)?;
    let per_side = vertices_per_side(seen);
    frame.count(LABEL, volumes.arguments, 1, move |_, arguments| {
        Ok(vec![Fact::sum("sides", arguments[0] / per_side)])
    })?;
    Ok(visibility)
}
