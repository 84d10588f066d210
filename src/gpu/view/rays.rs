//! Shadows without a map: by rays, and by shadow volumes.

use super::{View, receivers_in};
use crate::error::Result;
use crate::gpu::acceleration::{self, AccelerationStructure};
use crate::gpu::passes::{ray_queries, shadow_rays, shadow_volumes};
use crate::gpu::pool::PooledBuffer;
use crate::region::Region;
use std::sync::Arc;
use std::time::Instant;

impl View<'_> {
    /// The visibility image by rays through the scene's hierarchy, which is built where it is missing.
    pub fn shadow_rays(&mut self) -> Result<PooledBuffer> {
        let start = Instant::now();
        let (hierarchy, is_new) = self.inputs.scene.hierarchy(&self.frame, self.scene)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame
                .add_time(shadow_rays::HIERARCHY_LABEL, milliseconds);
        } else {
            self.skip(shadow_rays::HIERARCHY_LABEL);
        }
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (visibility, facts) = shadow_rays::shadow_rays(&mut self.frame, seen, &hierarchy)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }

    /// What ray queries search; built where it is missing.
    pub fn acceleration_structure(&mut self) -> Result<Arc<AccelerationStructure>> {
        let start = Instant::now();
        let kept = &self.inputs.scene.acceleration;
        let (structure, is_new) = kept.get(&self.frame, self.scene, self.camera.eye)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame.add_time(acceleration::LABEL, milliseconds);
        } else {
            self.skip(acceleration::LABEL);
        }
        Ok(structure)
    }

    /// That, where ray queries are likely to be faster and the device can build it.
    pub fn preferred_structure(&mut self) -> Option<Arc<AccelerationStructure>> {
        let is_preferred = self.frame.gpu.prefers_ray_queries();
        is_preferred.then(|| self.acceleration_structure().ok())?
    }

    /// The visibility image by the device's ray queries.
    pub fn ray_queries(&mut self, structure: &AccelerationStructure) -> Result<PooledBuffer> {
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (visibility, facts) = ray_queries::ray_queries(&mut self.frame, seen, structure)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }

    /// The visibility image by shadow volumes; the scene's edges are found where they are not known.
    pub fn shadow_volumes(&mut self) -> Result<PooledBuffer> {
        let start = Instant::now();
        let (edges, is_new) = self.inputs.scene.edges(&self.frame, self.scene)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame
                .add_time(shadow_volumes::EDGES_LABEL, milliseconds);
        } else {
            self.skip(shadow_volumes::EDGES_LABEL);
        }
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (visibility, facts) = shadow_volumes::shadow_volumes(&mut self.frame, seen, &edges)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }
}
