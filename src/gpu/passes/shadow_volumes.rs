//! Pass "shadow volumes": the shadow of every pixel by counting faces of shadow volumes on the
//! rasterization hardware, `shaders/shadow_volumes.wgsl`.

use super::facts::{Describe, Fact, Facts, PendingFacts};
use super::inputs::Receivers;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::frame::{Dispatch, Draw, Frame, Groups, Source, Vertices, buffer, table};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::{EdgeTables, double_single};
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::{Shader, flag};
use crate::projection::Projection;
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

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen.
pub fn shadow_volumes(
    frame: &mut Frame,
    seen: Receivers,
    edges: &EdgeTables,
) -> Result<(PooledBuffer, PendingFacts)> {
    let (scene, camera) = (seen.scene, seen.camera);
    let gpu = frame.gpu.clone();
    let widest = gpu.limits.max_texture_dimension_2d;
    if camera.width.max(camera.height) > widest {
        return Err(Error::Device(format!(
            "shadow volumes draw at most {widest} pixels along each side on the device {}, got width {} \
             and height {}; take another method",
            gpu.adapter.name, camera.width, camera.height
        )));
    }
    let pixels = camera.pixel_count() as u64;
    let uniform = frame.uniform(LABEL, &ShadowVolumesUniform::new(seen, edges));
    let receivers = seen.uniform(&Projection::from_camera(camera));
    let receivers = frame.uniform("receivers", &receivers);
    let points = frame.storage("points", 8 * pixels)?;
    let counts = frame.storage("counts", 4 * pixels)?;
    let sides = frame.storage("sides", 4 * u64::from(scene.triangle_count))?;
    let silhouettes = SILHOUETTE_BYTES * u64::from(edges.edge_count.max(1));
    let silhouettes = frame.storage("silhouettes", silhouettes)?;
    let arguments = frame.storage("draw arguments", 16)?;
    let visibility = frame.storage("visibility image", 4 * pixels)?;
    frame.clear(&counts);

    let (vertices_per_side, describe): (_, Describe) = match seen.light.position() {
        Some(_) => (SIDE_OF_LOCAL, describe_local),
        None => (SIDE_OF_PARALLEL, describe_parallel),
    };
    let mut constants = vec![
        ("has_low_parts", flag(scene.has_low_parts)),
        ("vertices_per_side", f64::from(vertices_per_side)),
    ];
    constants.extend(seen.constants());
    let compute = |entry_point| gpu.pipeline(SHADER, entry_point, &constants);
    let draw = |vertex, fragment| gpu.render_pipeline(SHADER, [vertex, fragment], &constants);

    let volumes = (0, buffer(&uniform));
    let seen_by_camera = (20, buffer(&receivers));
    let visible = (21, buffer(seen.visibility_buffer));
    let normals = (10, table(&scene.unit_normals));
    let corners = [
        (1, table(&scene.vertex_indices)),
        (2, table(&scene.positions_high)),
        (3, table(&scene.positions_low)),
    ];
    let edge_table = (4, table(&edges.edges));
    let drawn = (13, buffer(&arguments));
    let asking = (15, buffer(&points));
    let counted = (16, buffer(&counts));
    let image = Groups::Grid(camera.width.div_ceil(8), camera.height.div_ceil(8));
    let groups_of = |count: u32| Groups::Linear(u64::from(count).div_ceil(GROUP));
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
                bindings: vec![
                    seen_by_camera.clone(),
                    visible.clone(),
                    normals.clone(),
                    (14, buffer(&points)),
                ],
                groups: image,
            },
            Dispatch {
                pipeline: &compute("find_sides"),
                bindings: [
                    &[volumes.clone(), seen_by_camera.clone(), normals.clone()],
                    corners.as_slice(),
                    &[(6, buffer(&sides))],
                ]
                .concat(),
                groups: groups_of(scene.triangle_count),
            },
            Dispatch {
                pipeline: &compute("find_silhouettes"),
                bindings: vec![
                    volumes.clone(),
                    edge_table.clone(),
                    (5, table(&edges.uses)),
                    (7, buffer(&sides)),
                    (8, buffer(&silhouettes)),
                    drawn,
                ],
                groups: groups_of(edges.edge_count),
            },
        ],
    );
    let shared = [
        volumes,
        seen_by_camera.clone(),
        asking.clone(),
        counted.clone(),
    ];
    let bindings_of_cap = [&shared, corners.as_slice(), &[(7, buffer(&sides))]].concat();
    let bindings_of_sides = [
        &shared,
        // Edges name their vertices.
        &corners[1..],
        &[edge_table, (9, buffer(&silhouettes))],
    ]
    .concat();
    let (light_cap, dark_cap) = (
        draw("light_cap", "count_light_cap"),
        draw("dark_cap", "count_dark_cap"),
    );
    let side = draw("side", "count_side");
    let mut draws = vec![
        Draw {
            pipeline: &light_cap,
            bindings: bindings_of_cap.clone(),
            vertices: Vertices::Number(3 * scene.triangle_count),
        },
        Draw {
            pipeline: &side,
            bindings: bindings_of_sides,
            vertices: Vertices::Indirect(&arguments),
        },
    ];
    if seen.light.position().is_some() {
        draws.push(Draw {
            pipeline: &dark_cap,
            bindings: bindings_of_cap,
            vertices: Vertices::Number(3 * scene.triangle_count),
        });
    }
    frame.draw(LABEL, (camera.width, camera.height), &draws);
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &compute("answer"),
            bindings: vec![
                seen_by_camera,
                visible,
                asking,
                counted,
                (17, buffer(&visibility)),
            ],
            groups: Groups::Grid(camera.width.div_ceil(8), camera.height.div_ceil(8)),
        }],
    );
    let facts = PendingFacts {
        label: LABEL,
        counters: frame.read(Source::Taken(arguments), 1)?,
        describe,
    };
    Ok((visibility, facts))
}
