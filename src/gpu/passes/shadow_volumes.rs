//! Pass "shadow volumes": the shadow of every pixel by counting faces of shadow volumes on the
//! rasterization hardware, `shaders/shadow_volumes.wgsl`.

use super::facts::{Fact, Facts, PendingFacts};
use super::inputs::Receivers;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::frame::{Dispatch, Draw, Frame, Groups, Source, Vertices, buffer, table};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::EdgeTables;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::{Shader, flag};
use crate::projection::Projection;
use crate::rounding::double_single;
use glam::DVec3;

pub const LABEL: &str = "shadow volumes";

/// The search for the scene's edges, where they are not known yet.
pub const EDGES_LABEL: &str = "edges (CPU)";

const SHADER: Shader = Shader::new("shadow_volumes");

/// Invocations of a workgroup, as in the shader.
const GROUP: u64 = 64;

const SILHOUETTE_BYTES: u64 = 8;

/// Vertices of a side: two triangles, or one where the light is at infinity.
const SIDE_OF_LOCAL: u32 = 6;
const SIDE_OF_PARALLEL: u32 = 3;

fn describe_local(_gpu: &Gpu, arguments: &[u32]) -> Result<Facts> {
    Ok(vec![Fact::sum("sides", arguments[0] / SIDE_OF_LOCAL)])
}

fn describe_parallel(_gpu: &Gpu, arguments: &[u32]) -> Result<Facts> {
    Ok(vec![Fact::sum("sides", arguments[0] / SIDE_OF_PARALLEL)])
}

shader_struct! {
    pub struct ShadowVolumesUniform is ShadowVolumes in "shadow_volumes" {
        eye_high: [f32; 3],
        triangle_count: u32,
        eye_low: [f32; 3],
        edge_count: u32,
        clip_x: [f32; 3],
        far: f32,
        clip_y: [f32; 3],
        padding0: u32,
        clip_w: [f32; 3],
        padding1: u32,
    }
}

impl ShadowVolumesUniform {
    fn new(seen: Receivers, edges: &EdgeTables) -> Self {
        let (scene, camera) = (seen.scene, seen.camera);
        let (eye_high, eye_low) = double_single(camera.eye - scene.origin);
        let row = |axis: DVec3, focal: f64, centre: f64, size: u32| {
            let (focal, centre) = (2.0 * focal, 2.0 * centre - f64::from(size));
            let row = (axis * focal + camera.forward * centre) / f64::from(size);
            row.as_vec3().to_array()
        };
        let (focal, centre) = (camera.focal, camera.centre);
        Self {
            eye_high: eye_high.to_array(),
            triangle_count: scene.triangle_count,
            eye_low: eye_low.to_array(),
            edge_count: edges.edge_count,
            clip_x: row(camera.right, focal.x, centre.x, camera.width),
            far: scene.farthest(camera.eye) as f32,
            // Rows of the image go down.
            clip_y: row(
                camera.up,
                focal.y,
                f64::from(camera.height) - centre.y,
                camera.height,
            ),
            padding0: 0,
            clip_w: camera.forward.as_vec3().to_array(),
            padding1: 0,
        }
    }
}

/// What the dispatches and draws of a frame share, on the device.
struct Volumes {
    uniform: wgpu::Buffer,
    receivers: wgpu::Buffer,
    /// The pixels that face the light, and by how many volumes each is counted to be shaded.
    points: PooledBuffer,
    counts: PooledBuffer,
    /// Which side of each triangle the light is on.
    sides: PooledBuffer,
    silhouettes: PooledBuffer,
    /// Of the draw of the silhouettes' sides.
    arguments: PooledBuffer,
    constants: Vec<(&'static str, f64)>,
}

impl Volumes {
    fn new(frame: &mut Frame, seen: Receivers, edges: &EdgeTables) -> Result<Self> {
        let (scene, pixels) = (seen.scene, seen.camera.pixel_count() as u64);
        let receivers = seen.uniform(&Projection::from_camera(seen.camera));
        let vertices_per_side = vertices_per_side(seen);
        let mut constants = vec![
            ("has_low_parts", flag(scene.has_low_parts)),
            ("vertices_per_side", f64::from(vertices_per_side)),
        ];
        constants.extend(seen.constants());
        let silhouettes = SILHOUETTE_BYTES * u64::from(edges.edge_count.max(1));
        let volumes = Self {
            uniform: frame.uniform(LABEL, &ShadowVolumesUniform::new(seen, edges)),
            receivers: frame.uniform("receivers", &receivers),
            points: frame.storage("points", 8 * pixels)?,
            counts: frame.storage("counts", 4 * pixels)?,
            sides: frame.storage("sides", 4 * u64::from(scene.triangle_count))?,
            silhouettes: frame.storage("silhouettes", silhouettes)?,
            arguments: frame.storage("draw arguments", 16)?,
            constants,
        };
        frame.clear(&volumes.counts);
        Ok(volumes)
    }

    /// Finds the pixels that ask, the sides of triangles that the light is on, and the silhouettes.
    fn find(&self, frame: &mut Frame, seen: Receivers, edges: &EdgeTables) {
        let scene = seen.scene;
        let gpu = frame.gpu.clone();
        let compute = |entry_point| gpu.pipeline(SHADER, entry_point, &self.constants);
        let groups_of = |count: u32| Groups::Linear(u64::from(count).div_ceil(GROUP));
        let drawn = (13, buffer(&self.arguments));
        let mut bindings_of_sides = scene.bindings().to_vec();
        bindings_of_sides.extend([
            (0, buffer(&self.uniform)),
            (20, buffer(&self.receivers)),
            (10, table(&scene.unit_normals)),
            (6, buffer(&self.sides)),
        ]);
        frame.pass(
            LABEL,
            &[
                Dispatch {
                    pipeline: &compute("begin"),
                    bindings: vec![drawn.clone()],
                    groups: Groups::Linear(1),
                },
                Dispatch {
                    pipeline: &compute("find_points"),
                    bindings: [
                        &seen.bindings(&self.receivers)[..],
                        &[(14, buffer(&self.points))],
                    ]
                    .concat(),
                    groups: image(seen),
                },
                Dispatch {
                    pipeline: &compute("find_sides"),
                    bindings: bindings_of_sides,
                    groups: groups_of(scene.triangle_count),
                },
                Dispatch {
                    pipeline: &compute("find_silhouettes"),
                    bindings: vec![
                        (0, buffer(&self.uniform)),
                        (4, table(&edges.edges)),
                        (5, table(&edges.uses)),
                        (7, buffer(&self.sides)),
                        (8, buffer(&self.silhouettes)),
                        drawn,
                    ],
                    groups: groups_of(edges.edge_count),
                },
            ],
        );
    }

    /// Draws the faces of the volumes and counts those beyond each point.
    fn count(&self, frame: &mut Frame, seen: Receivers, edges: &EdgeTables) {
        let gpu = frame.gpu.clone();
        let pipeline =
            |vertex, fragment| gpu.render_pipeline(SHADER, [vertex, fragment], &self.constants);
        let light_cap = pipeline("light_cap", "count_light_cap");
        let dark_cap = pipeline("dark_cap", "count_dark_cap");
        let side = pipeline("side", "count_side");
        let shared = [
            (0, buffer(&self.uniform)),
            (20, buffer(&self.receivers)),
            (15, buffer(&self.points)),
            (16, buffer(&self.counts)),
        ];
        let corners = seen.scene.bindings();
        let cap = |pipeline| Draw {
            pipeline,
            bindings: [&shared[..], &corners, &[(7, buffer(&self.sides))]].concat(),
            vertices: Vertices::Number(3 * seen.scene.triangle_count),
        };
        // Edges name their vertices.
        let of_edges = [(4, table(&edges.edges)), (9, buffer(&self.silhouettes))];
        let sides = Draw {
            pipeline: &side,
            bindings: [&shared[..], &corners[1..], &of_edges].concat(),
            vertices: Vertices::Indirect(&self.arguments),
        };
        let mut draws = vec![cap(&light_cap), sides];
        if seen.light.position().is_some() {
            draws.push(cap(&dark_cap));
        }
        frame.draw(LABEL, (seen.camera.width, seen.camera.height), &draws);
    }

    /// The visibility image from the counts.
    fn answer(&self, frame: &mut Frame, seen: Receivers) -> Result<PooledBuffer> {
        let pixels = seen.camera.pixel_count() as u64;
        let visibility = frame.storage("visibility image", 4 * pixels)?;
        let pipeline = frame
            .gpu
            .clone()
            .pipeline(SHADER, "answer", &self.constants);
        frame.pass(
            LABEL,
            &[Dispatch {
                pipeline: &pipeline,
                bindings: vec![
                    (20, buffer(&self.receivers)),
                    (21, buffer(seen.visibility_buffer)),
                    (15, buffer(&self.points)),
                    (16, buffer(&self.counts)),
                    (17, buffer(&visibility)),
                ],
                groups: image(seen),
            }],
        );
        Ok(visibility)
    }
}

fn vertices_per_side(seen: Receivers) -> u32 {
    match seen.light.position() {
        Some(_) => SIDE_OF_LOCAL,
        None => SIDE_OF_PARALLEL,
    }
}

fn image(seen: Receivers) -> Groups<'static> {
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

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen.
pub fn shadow_volumes(
    frame: &mut Frame,
    seen: Receivers,
    edges: &EdgeTables,
) -> Result<(PooledBuffer, PendingFacts)> {
    check_image(&frame.gpu, seen.camera)?;
    let volumes = Volumes::new(frame, seen, edges)?;
    volumes.find(frame, seen, edges);
    volumes.count(frame, seen, edges);
    let visibility = volumes.answer(frame, seen)?;
    let facts = PendingFacts {
        label: LABEL,
        counters: frame.read(Source::Taken(volumes.arguments), 1)?,
        describe: match seen.light.position() {
            Some(_) => describe_local,
            None => describe_parallel,
        },
    };
    Ok((visibility, facts))
}
