//! The scene on the device.

use super::acceleration::AccelerationStructure;
use super::device::Gpu;
use super::kernel::Kernel;
use super::mask_tables::MaskTables;
use super::recording::Recording;
use super::tables::{filled_table, new_table, triangle_items, write_items, write_table};
use crate::bvh::{BoxSpace, Bvh};
use crate::edges::Edges;
use crate::error::Result;
use crate::geometry::farthest_in_box;
use crate::light::Light;
use crate::lock::Kept;
use crate::rounding::double_single;
use crate::scene::Scene;
use crate::sides::{sides_for_float32, triangles_at_light};
use bytemuck::Zeroable;
use glam::{DVec3, UVec3, UVec4, Vec3, Vec4};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64};
use wgpu::TextureFormat::{R32Uint, Rgba32Float, Rgba32Uint};

/// Triangles as the shaders read them, see `shaders/lib/triangles.wgsl`.
pub struct SceneTables {
    pub vertex_indices: wgpu::TextureView,
    pub positions_high: wgpu::TextureView,
    /// One zero where `has_low_parts` is false.
    pub positions_low: wgpu::TextureView,
    pub has_low_parts: bool,
    /// With the triangle's longest edge as the fourth component.
    pub unit_normals: wgpu::TextureView,
    /// Of the triangles with holes, if there are any.
    pub masks: Option<MaskTables>,
    /// Positions are relative to this point.
    pub origin: DVec3,
    /// Least and greatest corner of the scene.
    pub bounds: (DVec3, DVec3),
    pub triangle_count: u32,
    pub generation: u64,
    pub room: Arc<Room>,
    hierarchy: Kept<HierarchyTables>,
    /// The same for ray queries; it knows itself when it is out of date.
    pub acceleration: Kept<AccelerationStructure>,
    edges: Kept<EdgeTables>,
}

/// What the lists of a frame of the scene have room for. Grows where one had too little; such a frame is
/// rendered again.
pub struct Room {
    pub triangle_count: u32,
    /// Items of work beyond one for each triangle.
    pub spare_items: AtomicU64,
    /// Parts that the triangles are taken in where one list of their work would be too long.
    pub caster_parts: AtomicU32,
    /// Pieces of tessellated triangles beyond one for each triangle, and as many that are not done yet.
    pub spare_pieces: AtomicU64,
    /// Tests that float32 leaves open.
    pub unsure_tests: AtomicU64,
    /// Rounds of tessellation: each halves the edges that are too long.
    pub split_rounds: AtomicU32,
}

impl Room {
    fn new(triangle_count: u32) -> Self {
        Self {
            triangle_count,
            spare_items: AtomicU64::new(1 << 16),
            caster_parts: AtomicU32::new(1),
            spare_pieces: AtomicU64::new(1 << 16),
            unsure_tests: AtomicU64::new(1 << 14),
            split_rounds: AtomicU32::new(12),
        }
    }
}

/// The search structure of the scene's triangles as `shaders/shadow_rays.wgsl` walks it.
pub struct HierarchyTables {
    pub nodes: wgpu::TextureView,
    pub leaf_triangles: wgpu::TextureView,
    pub node_count: u32,
    pub space: BoxSpace,
}

impl HierarchyTables {
    fn new(gpu: &Arc<Gpu>, scene: &Scene) -> Result<Self> {
        let bvh = Bvh::new(scene);
        let (nodes, order) = bvh.threaded();
        let bits = |corner: Vec3, last| {
            UVec3::from_array(corner.to_array().map(f32::to_bits)).extend(last)
        };
        let halves = nodes
            .iter()
            .flat_map(|node| [bits(node.least, node.next), bits(node.greatest, node.leaf)]);
        let leaf_triangles = triangle_items(gpu, order.len())?;
        write_items(gpu, &leaf_triangles, scene, order);
        Ok(Self {
            nodes: filled_table(gpu, "boxes", Rgba32Uint, halves.collect())?,
            leaf_triangles,
            node_count: nodes.len() as u32,
            space: bvh.space,
        })
    }
}

/// The scene's edges as `shaders/shadow_volumes.wgsl` reads them.
pub struct EdgeTables {
    /// (vertex, vertex, first use, uses).
    pub edges: wgpu::TextureView,
    pub uses: wgpu::TextureView,
    pub edge_count: u32,
}

impl EdgeTables {
    fn new(gpu: &Arc<Gpu>, scene: &Scene) -> Result<Self> {
        let Edges { edges, uses } = Edges::new(scene);
        let edge_count = edges.len() as u32;
        let edges = edges.par_iter().map(|edge| {
            let [a, b] = edge.vertices;
            UVec4::new(a, b, edge.first_use, edge.use_count)
        });
        Ok(Self {
            edges: filled_table(gpu, "edges", Rgba32Uint, edges.collect())?,
            uses: filled_table(gpu, "uses of edges", R32Uint, uses)?,
            edge_count,
        })
    }
}

impl SceneTables {
    pub fn new(gpu: &Arc<Gpu>, scene: &Scene) -> Result<Self> {
        let (origin, has_low_parts) = choose_origin(scene);
        let (high, low) = split_positions(scene, origin, has_low_parts);
        let table = |what, format, count| new_table(gpu, what, format, count);
        let tables = Self {
            vertex_indices: table("faces", Rgba32Uint, scene.triangles().len())?,
            positions_high: table("vertices", Rgba32Float, high.len())?,
            positions_low: table("vertices, low parts", Rgba32Float, low.len())?,
            has_low_parts,
            unit_normals: table("normals", Rgba32Float, scene.triangles().len())?,
            masks: match scene.masks() {
                Some(masks) => Some(MaskTables::new(gpu, masks)?),
                None => None,
            },
            origin,
            bounds: scene.bounds(),
            triangle_count: scene.triangles().len() as u32,
            generation: scene.generation(),
            room: Arc::new(Room::new(scene.triangles().len() as u32)),
            hierarchy: Kept::default(),
            acceleration: Kept::default(),
            edges: Kept::default(),
        };
        tables.write(gpu, scene, high, low);
        Ok(tables)
    }

    /// Brings the tables up to date after `Scene::update_vertices`; the memory stays where it can.
    pub fn update(&mut self, gpu: &Arc<Gpu>, scene: &Scene) -> Result<()> {
        let (origin, has_low_parts) = choose_origin(scene);
        if has_low_parts != self.has_low_parts {
            *self = Self::new(gpu, scene)?;
            return Ok(());
        }
        let (high, low) = split_positions(scene, origin, has_low_parts);
        self.write(gpu, scene, high, low);
        self.origin = origin;
        self.bounds = scene.bounds();
        self.generation = scene.generation();
        self.hierarchy.forget();
        // Vertices that lay in one place may have parted.
        self.edges.forget();
        Ok(())
    }

    /// Built at first use and after the vertices moved; also says whether it was built now.
    pub fn hierarchy(
        &self,
        frame: &Recording,
        scene: &Scene,
    ) -> Result<(Arc<HierarchyTables>, bool)> {
        let build = |_| HierarchyTables::new(&frame.gpu, scene);
        self.hierarchy.get(|_| frame.culls, build)
    }

    /// Likewise.
    pub fn edges(&self, frame: &Recording, scene: &Scene) -> Result<(Arc<EdgeTables>, bool)> {
        let build = |_| EdgeTables::new(&frame.gpu, scene);
        self.edges.get(|_| frame.culls, build)
    }

    /// The greatest distance of a point of the scene's box.
    pub fn farthest(&self, point: DVec3) -> f64 {
        farthest_in_box(self.bounds, point)
    }

    fn write(&self, gpu: &Gpu, scene: &Scene, high: Vec<Vec4>, low: Vec<Vec4>) {
        write_table(gpu, &self.positions_high, high);
        write_table(gpu, &self.positions_low, low);
        let normals = scene.unit_normals().par_iter().enumerate();
        let with_extent = normals.map(|(t, n)| {
            let [a, b, c] = scene.corners(t as u32);
            let extent = (b - a).length().max((c - b).length()).max((a - c).length());
            n.extend(extent as f32)
        });
        write_table(gpu, &self.unit_normals, with_extent.collect());
        // Which triangles have no area may have changed.
        write_table(gpu, &self.vertex_indices, vertex_indices(scene));
    }
}

/// The sides of triangles that a light is on, where float32 may be wrong: `shaders/lib/light_sides.wgsl`.
pub struct LightSides {
    table: Option<wgpu::TextureView>,
    /// The triangles that the light is at: see `triangles_at_light`.
    pub at_light: Vec<u32>,
}

impl LightSides {
    pub fn new(gpu: &Gpu, scene: &Scene, light: &Light, eye: DVec3) -> Result<Self> {
        let Some(words) = sides_for_float32(scene, light, eye) else {
            return Ok(Self {
                table: None,
                at_light: Vec::new(),
            });
        };
        Ok(Self {
            at_light: triangles_at_light(scene, light, eye, &words),
            table: Some(filled_table(gpu, "sides of the light", R32Uint, words)?),
        })
    }
}

impl Kernel {
    /// Binds the sides of a light, or any table where float32 finds them.
    pub fn light_sides(self, scene: &SceneTables, sides: &LightSides) -> Self {
        let table = &sides.table;
        self.bind(18, table.as_ref().unwrap_or(&scene.vertex_indices))
            .constant("has_light_sides", table.is_some())
    }

    /// Binds the positions of `shaders/lib/triangles.wgsl`, and fills the slot of masks.
    pub fn vertices(self, scene: &SceneTables) -> Self {
        self.bind(2, &scene.positions_high)
            .bind(3, &scene.positions_low)
            .constant("has_low_parts", scene.has_low_parts)
            .fill(match scene.masks {
                Some(_) => "mask/alpha",
                None => "mask/none",
            })
    }

    /// Binds the triangles, too.
    pub fn triangles(self, scene: &SceneTables) -> Self {
        self.bind(1, &scene.vertex_indices).vertices(scene)
    }
}

/// Triangles of zero area shrink to one vertex, which the rasterizer leaves out whatever it rounds.
fn vertex_indices(scene: &Scene) -> Vec<UVec4> {
    scene
        .triangles()
        .par_iter()
        .zip(scene.unit_normals())
        .map(|(triangle, normal)| {
            let [a, b, c] = *triangle;
            if *normal == Vec3::ZERO {
                UVec4::splat(a)
            } else {
                UVec4::new(a, b, c, 0)
            }
        })
        .collect()
}

/// Coordinates that float32 holds (all that most files have) need no low parts and keep the world's
/// origin; others are taken relative to the middle of the scene.
fn choose_origin(scene: &Scene) -> (DVec3, bool) {
    let is_single = scene
        .vertices()
        .par_iter()
        .all(|v| v.as_vec3().as_dvec3() == *v);
    if is_single {
        (DVec3::ZERO, false)
    } else {
        let (low, high) = scene.bounds();
        (low + 0.5 * (high - low), true)
    }
}

fn split_positions(scene: &Scene, origin: DVec3, has_low_parts: bool) -> (Vec<Vec4>, Vec<Vec4>) {
    let vertices = scene.vertices().par_iter();
    if has_low_parts {
        vertices
            .map(|v| {
                let (high, low) = double_single(*v - origin);
                (high.extend(0.0), low.extend(0.0))
            })
            .unzip()
    } else {
        let high = vertices.map(|v| v.as_vec3().extend(0.0)).collect();
        (high, vec![Vec4::zeroed()])
    }
}
