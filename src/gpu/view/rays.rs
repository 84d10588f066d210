//! Shadows without a map: by rays, and by shadow volumes.

use super::View;
use crate::camera::Rays;
use crate::error::Result;
use crate::gpu::acceleration::{self, AccelerationStructure};
use crate::gpu::passes::shadow_volumes::{self, shadow_volumes};
use crate::gpu::passes::{ray_queries, shadow_rays};
use crate::gpu::pool::PooledBuffer;
use crate::occlusion::triangles_along;
use std::sync::Arc;
use std::time::Instant;

impl View<'_> {
    /// What is kept with the scene, and was perhaps built now: that has its own label among the timers.
    fn kept<T>(
        &mut self,
        label: &'static str,
        get: impl FnOnce(&Self) -> Result<(T, bool)>,
    ) -> Result<T> {
        let start = Instant::now();
        let (kept, is_new) = get(self)?;
        match is_new {
            true => self
                .frame
                .add_time(label, start.elapsed().as_secs_f64() * 1e3),
            false => self.skip(label),
        }
        Ok(kept)
    }

    /// The visibility image by rays through the scene's hierarchy, which is built where it is missing.
    pub(super) fn rays_of_compute(&mut self) -> Result<PooledBuffer> {
        let hierarchy = self.kept(shadow_rays::HIERARCHY_LABEL, |view| {
            view.seen.scene.hierarchy(&view.frame, view.scene)
        })?;
        let unsure = self.take_unsure()?;
        let image = shadow_rays::shadow_rays(&mut self.frame, self.seen, &hierarchy, &unsure)?;
        self.unsure = Some(unsure);
        self.leaves_open = true;
        Ok(image)
    }

    /// What ray queries search; built where it is missing.
    pub(super) fn acceleration_structure(&mut self) -> Result<Arc<AccelerationStructure>> {
        self.kept(acceleration::LABEL, |view| {
            let kept = &view.seen.scene.acceleration;
            kept.for_eye(&view.frame, view.scene, view.camera.eye)
        })
    }

    /// That, where ray queries are likely to be faster and the device can build it.
    pub(super) fn preferred_structure(&mut self) -> Option<Arc<AccelerationStructure>> {
        let is_preferred = self.frame.gpu.prefers_ray_queries();
        is_preferred.then(|| self.acceleration_structure().ok())?
    }

    /// The visibility image by the device's ray queries.
    pub(super) fn rays_of_hardware(
        &mut self,
        structure: &AccelerationStructure,
    ) -> Result<PooledBuffer> {
        let unsure = self.take_unsure()?;
        let image = ray_queries::ray_queries(&mut self.frame, self.seen, structure, &unsure)?;
        self.unsure = Some(unsure);
        self.leaves_open = true;
        Ok(image)
    }

    /// The visibility image by shadow volumes; the scene's edges are found where they are not known.
    pub(super) fn volumes(&mut self) -> Result<PooledBuffer> {
        let edges = self.kept(shadow_volumes::EDGES_LABEL, |view| {
            view.seen.scene.edges(&view.frame, view.scene)
        })?;
        let unsure = self.take_unsure()?;
        let count_at_infinity = match (self.camera.rays, self.light.position()) {
            (Rays::Orthographic, Some(position)) => {
                triangles_along(self.scene, position, self.camera.forward)
            }
            _ => 0,
        };
        let seen = self.seen;
        let frame = &mut self.frame;
        let image = shadow_volumes(frame, seen, &edges, count_at_infinity as i32, &unsure)?;
        self.unsure = Some(unsure);
        Ok(image)
    }
}
