//! The scene for ray queries: an acceleration structure that the device builds over boxes of triangles.
//!
//! The device may round as it likes: it finds boxes that a ray meets, and a shader decides about the
//! triangles in them. No triangle is missed, because the boxes are grown by all roundings, in the space of
//! `src/bvh.rs`, where they are one constant for an eye within reach.

use super::bind_groups::Bound;
use super::device::Gpu;
use super::kernel::Resource;
use super::recording::Recording;
use super::tables::{triangle_items, write_items};
use crate::bvh::{BoxSpace, TriangleBoxes, WALK_MARGIN};
use crate::error::{Error, Result};
use crate::lock::Kept;
use crate::scene::Scene;
use glam::DVec3;
use std::sync::Arc;
use wgpu::{
    AccelerationStructureFlags, AccelerationStructureGeometryFlags,
    AccelerationStructureUpdateMode, BufferUsages,
};

pub const LABEL: &str = "acceleration structure";

/// What `shaders/ray_queries.wgsl` searches, at one time.
pub struct AccelerationStructure {
    memory: Arc<Memory>,
    pub space: BoxSpace,
    /// By which the boxes are grown, in their space.
    pub margin: f32,
    /// Distance of the eye for which that is enough, in the boxes' space.
    reach: f64,
    generation: u64,
}

/// What stays where the vertices move.
struct Memory {
    structure: wgpu::Tlas,
    of_boxes: wgpu::Blas,
    boxes: wgpu::Buffer,
    triangles: wgpu::TextureView,
}

/// Nearly all eyes are within it, so that the structure need not be built anew for them.
const LEAST_REACH: f64 = 8.0;

/// From here on float32 tells no two vertices of the scene apart.
const MAX_REACH: f64 = (1u32 << 30) as f64;

/// A distance with room for the receivers' own, rounded up.
fn reach_of_eye(eye_in_boxes: DVec3) -> f64 {
    let distance = (eye_in_boxes.length() + 2.0).clamp(LEAST_REACH, MAX_REACH);
    2_f64.powf(distance.log2().ceil())
}

/// Three rows of four.
const IN_PLACE: [f32; 12] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.];

const BOX_BYTES: u64 = size_of::<[[f32; 3]; 2]>() as u64;

/// Refuses more boxes than one structure may hold.
fn check_count(count: u64, device: &str, limits: &wgpu::Limits) -> Result<()> {
    let most = u64::from(limits.max_blas_primitive_count).min(limits.max_buffer_size / BOX_BYTES);
    if count > most {
        return Err(Error::Device(format!(
            "the scene has {count} triangles, the device {device} allows {most} in one acceleration \
             structure"
        )));
    }
    Ok(())
}

fn boxes_of(count: u32) -> wgpu::BlasAABBGeometrySizeDescriptor {
    wgpu::BlasAABBGeometrySizeDescriptor {
        primitive_count: count,
        // Not opaque: the shader is asked about each.
        flags: AccelerationStructureGeometryFlags::empty(),
    }
}

impl Memory {
    fn new(gpu: &Gpu, count: u32) -> Result<Self> {
        check_count(u64::from(count), &gpu.adapter.name, &gpu.limits)?;
        let label = Some(LABEL);
        let flags = AccelerationStructureFlags::PREFER_FAST_TRACE;
        let update_mode = AccelerationStructureUpdateMode::Build;
        let of_boxes = gpu.device.create_blas(
            &wgpu::CreateBlasDescriptor {
                label,
                flags,
                update_mode,
            },
            wgpu::BlasGeometrySizeDescriptors::AABBs {
                descriptors: vec![boxes_of(count)],
            },
        );
        let mut structure = gpu.device.create_tlas(&wgpu::CreateTlasDescriptor {
            label,
            max_instances: 1,
            flags,
            update_mode,
        });
        structure[0] = Some(wgpu::TlasInstance::new(&of_boxes, IN_PLACE, 0, 0xff));
        Ok(Self {
            structure,
            of_boxes,
            boxes: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("boxes"),
                size: BOX_BYTES * u64::from(count),
                usage: BufferUsages::BLAS_INPUT | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            triangles: triangle_items(gpu, count as usize)?,
        })
    }

    /// Has the device build the structure, and waits for it.
    fn build(&self, gpu: &Gpu, boxes: &[[[f32; 3]; 2]]) {
        gpu.queue
            .write_buffer(&self.boxes, 0, bytemuck::cast_slice(boxes));
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(LABEL) });
        let size = boxes_of(boxes.len() as u32);
        let geometry = wgpu::BlasAabbGeometry {
            size: &size,
            stride: BOX_BYTES,
            aabb_buffer: &self.boxes,
            primitive_offset: 0,
        };
        let entry = wgpu::BlasBuildEntry {
            blas: &self.of_boxes,
            geometry: wgpu::BlasGeometries::AabbGeometries(vec![geometry]),
        };
        encoder.build_acceleration_structures([&entry], [&self.structure]);
        gpu.queue.submit([encoder.finish()]);
        let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    }
}

impl AccelerationStructure {
    /// In the memory of one of before, where there is one: a scene's triangles keep their number.
    fn new(gpu: &Gpu, scene: &Scene, eye: DVec3, before: Option<&Self>) -> Result<Self> {
        let memory = match before {
            Some(before) => before.memory.clone(),
            None => Arc::new(Memory::new(gpu, scene.triangles().len() as u32)?),
        };
        let boxes = TriangleBoxes::new(scene);
        let reach = reach_of_eye(boxes.space.place_of(eye));
        let margin = WALK_MARGIN * reach as f32;
        write_items(gpu, &memory.triangles, scene, &boxes.triangles);
        let mut grown = boxes.grown(margin);
        if grown.is_empty() {
            // No receiver will ask.
            grown.push([[0.0; 3]; 2]);
        }
        memory.build(gpu, &grown);
        Ok(Self {
            memory,
            space: boxes.space,
            margin,
            reach,
            generation: scene.generation(),
        })
    }

    /// Whether it holds for the scene as it is, seen from there.
    fn holds(&self, scene: &Scene, eye: DVec3) -> bool {
        let eye_in_boxes = self.space.place_of(eye);
        self.generation == scene.generation() && reach_of_eye(eye_in_boxes) <= self.reach
    }

    pub fn boxes(&self) -> Resource {
        Resource::Bound(Bound::Boxes(self.memory.structure.clone()))
    }

    /// (vertex, vertex, vertex, triangle) of each box.
    pub fn triangles(&self) -> &wgpu::TextureView {
        &self.memory.triangles
    }
}

impl Kept<AccelerationStructure> {
    /// Built at first use, after the vertices moved, and for an eye too far away; also says whether it was
    /// built now. Fails where the device does, without harm to it.
    pub fn for_eye(
        &self,
        frame: &Recording,
        scene: &Scene,
        eye: DVec3,
    ) -> Result<(Arc<AccelerationStructure>, bool)> {
        let gpu = &frame.gpu;
        gpu.check_ray_queries()?;
        let build = |before: Option<Arc<AccelerationStructure>>| {
            gpu.catch_errors(|| AccelerationStructure::new(gpu, scene, eye, before.as_deref()))
        };
        self.get(|known| frame.culls && known.holds(scene, eye), build)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reach_covers_the_eye_in_a_few_steps() {
        assert_eq!(reach_of_eye(DVec3::ZERO), LEAST_REACH);
        assert_eq!(reach_of_eye(DVec3::X * 6.0), 8.0);
        assert_eq!(reach_of_eye(DVec3::X * 6.1), 16.0);
        assert_eq!(reach_of_eye(DVec3::X * 1e300), MAX_REACH);
        for distance in [1.0, 13.9, 14.1, 1e3, 1e6] {
            assert!(reach_of_eye(DVec3::Y * distance) >= distance + 2.0);
        }
    }

    #[test]
    fn more_boxes_than_a_structure_holds_are_refused() {
        let limits = wgpu::Limits {
            max_blas_primitive_count: 1000,
            max_buffer_size: 24 * 900,
            ..Default::default()
        };
        assert_eq!(check_count(900, "d", &limits), Ok(()));
        let error = check_count(901, "d", &limits).unwrap_err().to_string();
        assert!(error.contains("901") && error.contains("900"), "{error}");
        let limits = wgpu::Limits {
            max_blas_primitive_count: 800,
            ..limits
        };
        assert!(check_count(801, "d", &limits).is_err());
    }
}
